"""Depths that live water is computed for."""

from __future__ import annotations

import math

import bpy

from ...settings.scene_settings import SceneSettings
from ..readers import cameras

NOMINAL_DEPTH = 1.0
"""Depth in m that the preview assumes while no camera is under water."""


def camera_depth(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph | None = None
) -> float | None:
    """Depth of the scene's camera in m, negative above the water; None without a camera."""
    camera = cameras.camera_of(scene)
    if camera is None:
        return None
    if depsgraph is not None:
        camera = camera.evaluated_get(depsgraph)
    return -camera.matrix_world.translation.z


def preview_depth(
    scene: bpy.types.Scene, chosen: SceneSettings, depsgraph: bpy.types.Depsgraph | None = None
) -> float:
    """Depth in m that the water is computed for: the camera's, or a nominal one."""
    if scene.camera is not None:
        cameras.require_usable(scene.camera, scene.camera.matrix_world)
    depth = camera_depth(scene, depsgraph)
    depth = NOMINAL_DEPTH if depth is None else max(depth, 0.0)
    floor = chosen.floor_depth or math.inf
    # Above the floor, whatever the camera does.
    return float(f"{min(depth, 0.999 * floor):.6g}")
