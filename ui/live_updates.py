"""When live water follows its settings: at each change, or once for many."""

from __future__ import annotations

import contextlib
import traceback
from collections.abc import Iterator
from contextvars import ContextVar

import bpy

from ..scene.session import PROBLEM, SESSION, is_live

_MOMENT = 0.4  # s

_held: ContextVar[bool] = ContextVar("updates of live water wait", default=False)


@contextlib.contextmanager
def transaction() -> Iterator[None]:
    """Let live water follow once, when the block ends, however many settings change in it.

    A block inside another ends with the outer one. The water also follows
    what was changed before an error.
    """
    if _held.get():
        yield
        return
    token = _held.set(True)
    try:
        yield
    finally:
        _held.reset(token)
        _update_all()


def is_waiting() -> bool:
    """Whether an update is still to come, which will take in every change until then."""
    return _held.get() or bpy.app.timers.is_registered(_update_all)


def follow(scene: bpy.types.Scene) -> None:
    """Bring live water to its settings, with new nodes where it needs them.

    In a window this happens once Blender is idle, so that many changes are
    one update; in background at once, since nothing is idle there.
    """
    if _held.get() or not is_live(scene):
        return
    if bpy.app.background:
        _update(scene)
    elif not bpy.app.timers.is_registered(_update_all):
        bpy.app.timers.register(_update_all, first_interval=0.0)


def refresh(scene: bpy.types.Scene) -> None:
    """Bring live water at once to what was just added to its scene."""
    if is_live(scene):
        from ..scene.viewport import live

        live.update(scene)


def follow_property(group: bpy.types.PropertyGroup, _: bpy.types.Context) -> None:
    """Follow a change of one setting; the update callback of them all."""
    follow(group.id_data)


def follow_material(group: bpy.types.PropertyGroup, _: bpy.types.Context) -> None:
    """Follow a change of what a material stores."""
    from ..scene.materials import refractive_indices  # enabling loads little

    refractive_indices.follow(group.id_data)
    for scene in bpy.data.scenes:
        if is_live(scene):
            follow(scene)


@contextlib.contextmanager
def guarded(scene: bpy.types.Scene) -> Iterator[None]:
    """Let an error within the block be the water's problem, which the panel shows.

    Blender calls handlers and timers by itself: an error there would keep other scenes, and what
    comes after it, from being followed.
    """
    try:
        yield
    except Exception as error:  # noqa: BLE001 - it is printed, and said in the panel
        traceback.print_exc()
        if is_live(scene):
            scene[SESSION][PROBLEM] = (
                f"The water could not follow ({type(error).__name__}: {error}). Press Refresh "
                "Water; if that does not help, Remove Water, and please report it."
            )


def tidy() -> None:
    """Give back, once Blender is idle, what water has changed for scenes that are deleted."""
    if bpy.app.background:
        _tidy()
    elif not bpy.app.timers.is_registered(_tidy):
        bpy.app.timers.register(_tidy, first_interval=0.0)


def _tidy() -> None:
    from ..scene.water import giving_back

    giving_back.tidy()


def settle() -> None:
    """Compute what a hasty update left out, once nothing has changed for a moment.

    In background nothing is hasty.
    """
    if bpy.app.background:
        return
    if bpy.app.timers.is_registered(_settle_all):
        bpy.app.timers.unregister(_settle_all)
    bpy.app.timers.register(_settle_all, first_interval=_MOMENT)


def cancel() -> None:
    """Forget updates that wait for Blender to be idle."""
    for update in (_update_all, _settle_all, _tidy):
        if bpy.app.timers.is_registered(update):
            bpy.app.timers.unregister(update)


def _settle_all() -> None:
    from ..scene.viewport import changes, live

    for scene in bpy.data.scenes:
        if is_live(scene) and changes.is_stale(scene):
            with guarded(scene):
                live.update(scene)


def _update_all() -> None:
    for scene in bpy.data.scenes:
        if is_live(scene):
            _update(scene)


def _update(scene: bpy.types.Scene) -> None:
    from ..scene.viewport import changes, live

    with guarded(scene):
        live.update(scene, hasty=not bpy.app.background)
    if changes.is_stale(scene):
        settle()
