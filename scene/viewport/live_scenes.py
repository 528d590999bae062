"""Scenes with live water that share materials: one is dry or built anew with the others."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import bpy

from ...settings.render_plan import forget_files
from .. import contents
from ..engines import world_picture
from ..session import SESSION
from . import live


def take_out(scene: bpy.types.Scene) -> list[str]:
    """Take live water out for good: what the scene shares with others gets the water of these.

    Returns what could not be given back, or be treated there, one line each.
    """
    others = [other for other in _wet_with(scene) if other != scene]
    return live.remove(scene) + [note for other in others for note in rebuild(other)]


def _wet_with(scene: bpy.types.Scene) -> list[bpy.types.Scene]:
    """Scenes with live water that are the scene, or share materials with it."""
    own = set(contents.materials(scene))
    return [
        other
        for other in bpy.data.scenes
        if SESSION in other and (other == scene or not own.isdisjoint(contents.materials(other)))
    ]


def rebuild(scene: bpy.types.Scene) -> list[str]:
    """Build the water anew: new objects and materials get wet, files are read again."""
    forget_files()
    world_picture.forget(scene)
    return live.remove(scene) + live.add(scene)


@contextlib.contextmanager
def suspended(scene: bpy.types.Scene) -> Iterator[None]:
    """Take live water out while the block runs; a render brings its own.

    Other scenes that share materials with the scene are dry meanwhile too.
    """
    wet = _wet_with(scene)
    for other in wet:
        live.remove(other)
    try:
        yield
    finally:
        for other in wet:
            live.add(other)
