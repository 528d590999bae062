"""The mark of a scene that holds live water; nothing here is slow to import."""

from __future__ import annotations

import bpy

SESSION = "uw_session"
"""Custom property of a scene with live water: what to restore, and what the water shows."""


def is_live(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds live water."""
    return SESSION in scene
