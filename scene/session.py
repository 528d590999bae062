"""Marks of scenes with live water and of shown pictures; nothing here is slow to import."""

from __future__ import annotations

import bpy

SESSION = "uw_session"
"""Custom property of a scene with live water: what to restore, and what the water shows."""

PICTURE = "underwater_picture"
"""Mark of an image that shows a picture of ours: what it is of."""


def is_live(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds live water."""
    return SESSION in scene
