"""Marks of scenes with live water and of shown pictures; nothing here is slow to import."""

from __future__ import annotations

import bpy

from ..node_groups.node_mathematics import MARK

SESSION = "uw_session"
"""Custom property of a scene with live water: what to restore, and what the water shows."""
PROBLEM = "problem"
"""In it: what keeps the water from being drawn, for the panel."""

PICTURE = "underwater_picture"
"""Mark of an image that shows a picture of ours: what it is of."""


def is_live(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds live water."""
    return SESSION in scene


def has_strays() -> bool:
    """Whether the file holds the water of a scene that was deleted; asked at each edit."""
    waters = [c for c in bpy.data.collections if MARK in c and c.is_editable]
    if not waters:
        return False
    held = {c for scene in bpy.data.scenes for c in scene.collection.children_recursive}
    return any(collection not in held for collection in waters)
