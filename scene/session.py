"""Marks of scenes with live water and of shown pictures; nothing here is slow to import."""

from __future__ import annotations

import bpy

from ..uw_spectral.errors import unknown_name

SESSION = "uw_session"
"""Custom property of a scene with live water: what to restore, and what the water shows."""
PROBLEM = "problem"
"""In it: what keeps the water from being drawn, for the panel."""
STALE, KINDS, BUILD = "stale", "kinds", "build"
"""Whether it was drawn in haste, what of materials it was built for, and by which code."""

PICTURE = "underwater_picture"
"""Mark of an image that shows a picture of ours: what it is of."""


def select_scene(name: str) -> None:
    """Make a scene of the open file the active one; InputError if there is no such scene."""
    scene = bpy.data.scenes.get(name)
    if scene is None:
        raise unknown_name("scene", name, [scene.name for scene in bpy.data.scenes])
    if bpy.context.scene != scene:
        bpy.context.window.scene = scene


def other_scenes(scene: bpy.types.Scene) -> str:
    """Say which scenes of the file a job leaves out; empty if there are none."""
    others = [x for x in bpy.data.scenes if x not in (scene, scene.background_set)]
    names = [repr(other.name) for other in others if other.objects]
    if not names:
        return ""
    return (
        f"only scene {scene.name!r} of the file is rendered, not {', '.join(names)}; name the one "
        "you want with --scene"
    )


def is_live(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds live water."""
    return SESSION in scene


def has_strays() -> bool:
    """Whether the file holds the water of a scene that was deleted; asked at each edit."""
    from ..node_groups.node_mathematics import MARK

    waters = [c for c in bpy.data.collections if MARK in c and c.is_editable]
    if not waters:
        return False
    held = {c for scene in bpy.data.scenes for c in scene.collection.children_recursive}
    return any(collection not in held for collection in waters)
