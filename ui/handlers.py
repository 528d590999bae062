"""What Blender calls: on edits, frames, files and undo, and as its command ``underwater``."""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..scene.session import has_strays, is_live
from . import live_updates

COMMAND = "underwater"
_commands: list[object] = []  # what Blender gives to unregister one with


@persistent
def _edited(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Follow an edit, an undo or a redo: once objects are where they belong."""
    if is_live(scene):
        with live_updates.guarded(scene):
            _follow_edit(scene, depsgraph)
    if has_strays():
        live_updates.tidy()


def _follow_edit(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    from ..scene.materials import wet_trees
    from ..scene.viewport import changes, live

    changes.note_moves(scene, depsgraph)
    shaders = bpy.types.Material, bpy.types.NodeTree
    painted = any(isinstance(update.id, shaders) for update in depsgraph.updates)
    if painted:
        wet_trees.refresh()
    hasty = not bpy.app.background
    if (
        not live_updates.is_waiting()
        and (
            changes.has_come(scene, depsgraph)
            or not live.update(scene, depsgraph, may_rebuild=False, hasty=hasty)
        )
    ) or (painted and changes.has_new_kinds(scene)):
        # Last: it adds and removes data, after which what the graph lists may be gone.
        live_updates.follow(scene)
    if changes.is_stale(scene):
        live_updates.settle()


@persistent
def _frame_changed(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if not is_live(scene):
        return
    from ..scene.materials import wet_trees
    from ..scene.viewport import changes, live

    # A picture that is rendered is worth the wait; one that is played is not.
    hasty = not (bpy.app.background or bpy.app.is_job_running("RENDER"))
    with live_updates.guarded(scene):
        wet_trees.refresh()
        live.update(scene, depsgraph, may_rebuild=False, hasty=hasty)
        if changes.is_stale(scene):
            live_updates.settle()


@persistent
def _render_begins(scene: bpy.types.Scene, _: object = None) -> None:
    """Take in what a script has set just before it renders."""
    if is_live(scene):
        from ..scene.viewport import live

        with live_updates.guarded(scene):
            live.update(scene)


@persistent
def _loaded(*_: object) -> None:
    """Bring a file that was opened, or data that was appended, to this version."""
    from . import migration

    with live_updates.transaction():
        for scene in bpy.data.scenes:
            migration.migrate(scene)
    if has_strays():
        live_updates.tidy()


def run_batch(arguments: list[str]) -> int:
    """Run the batch with the options of ``render_bands.py``; return the exit status."""
    from ..jobs import batch

    # blender scene.blend --command underwater OPTIONS
    return batch.main(arguments, program=COMMAND, inside_blender=bool(bpy.data.filepath))


_HANDLERS = {
    "depsgraph_update_post": _edited,
    "frame_change_post": _frame_changed,
    "render_init": _render_begins,
    "load_post": _loaded,
    "blend_import_post": _loaded,
}


def register() -> None:
    """Add the handlers and the command."""
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)
    _commands.append(bpy.utils.register_cli_command(COMMAND, run_batch))


def unregister() -> None:
    """Take them away."""
    bpy.utils.unregister_cli_command(_commands.pop())
    for name, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(handler)
    live_updates.cancel()
