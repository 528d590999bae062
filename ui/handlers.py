"""What Blender calls by itself: on edits, frames, files and undo."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..scene import stored_settings as optics
from ..scene.session import is_live


def _update(
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph | None = None,
    *,
    may_rebuild: bool = False,
) -> None:
    if not is_live(scene):
        return
    from ..scene import live

    if not live.update(scene, depsgraph, may_rebuild=may_rebuild):
        _rebuild_later(scene)


def _rebuild_later(scene: bpy.types.Scene) -> None:
    """Build nodes outside of the handler, where data may be added and removed."""
    if bpy.app.background:
        _update(scene, may_rebuild=True)
    elif not bpy.app.timers.is_registered(_rebuild):
        bpy.app.timers.register(_rebuild, first_interval=0.0)


def _rebuild() -> None:
    for scene in bpy.data.scenes:
        _update(scene, may_rebuild=True)


@persistent
def _edited(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not is_live(scene):
        return
    _update(scene, depsgraph)
    if any(isinstance(u.id, bpy.types.Material | bpy.types.NodeTree) for u in depsgraph.updates):
        from ..scene import live

        live.refresh_materials()


@persistent
def _frame_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not is_live(scene):
        return
    from ..scene import live

    live.update(scene, depsgraph, may_rebuild=False)
    live.refresh_materials()


@persistent
def _render_begins(scene: bpy.types.Scene, _: object = None) -> None:
    """Take in what a script has set just before it renders."""
    _update(scene, may_rebuild=True)


@persistent
def _undone(scene: bpy.types.Scene, _: object = None) -> None:
    _update(scene)


@persistent
def _loaded(*_: object) -> None:
    """Bring a file that was opened, or data that was appended, to this version."""
    from . import migration

    for scene in bpy.data.scenes:
        migration.migrate(scene)
        if scene.is_editable:
            _update(scene, may_rebuild=True)


def _property_changed(group: bpy.types.PropertyGroup, _: bpy.types.Context) -> None:
    _update(group.id_data, may_rebuild=True)


_HANDLERS = {
    "depsgraph_update_post": _edited,
    "frame_change_post": _frame_changed,
    "render_init": _render_begins,
    "undo_post": _undone,
    "redo_post": _undone,
    "load_post": _loaded,
    "blend_import_post": _loaded,
}


def follow_properties() -> None:
    """Let every setting of the water call the live water; before the properties register."""
    for deferred in optics.UnderwaterProperties.__annotations__.values():
        deferred.keywords["update"] = _property_changed


def register() -> None:
    """Add the handlers."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    """Take the handlers away."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    if bpy.app.timers.is_registered(_rebuild):
        bpy.app.timers.unregister(_rebuild)
