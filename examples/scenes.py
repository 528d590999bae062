"""The example scenes: geometry in numpy, materials in nodes, no light, no water."""

from __future__ import annotations

import bpy

from .cave.layout import Cave
from .parts.detail import DETAILS
from .pool.layout import Pool
from .reef.layout import Reef
from .wreck.layout import Wreck

__all__ = ["DETAILS", "SCENES", "build_scene", "count_triangles"]

SCENES = {"reef": Reef, "wreck": Wreck, "cave": Cave, "pool": Pool}


def build_scene(name: str, seed: int = 1, detail: str = "full") -> None:
    """Build an example in the open, empty file: reef, wreck, cave or pool.

    Metres; z = 0 is the mean water surface. Equal seeds, not negative, give equal vertices;
    ``detail``, draft, panel or full, is how finely to mesh. Raises ValueError for what is unknown.
    """
    if name not in SCENES:
        raise ValueError(f"unknown scene {name!r}; known: {', '.join(SCENES)}")
    if detail not in DETAILS:
        raise ValueError(f"unknown detail {detail!r}; known: {', '.join(DETAILS)}")
    if seed < 0:
        raise ValueError(f"the seed must not be negative, got {seed}")
    scene = bpy.context.scene
    scene.unit_settings.system = "METRIC"
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    SCENES[name](seed, DETAILS[detail]).build()


def count_triangles() -> tuple[int, int]:
    """Count the triangles that are rendered, and those that are stored.

    Objects that share a mesh count each time in the first number, once in the second.
    """
    meshes = [item.data for item in bpy.context.scene.objects if item.type == "MESH"]
    stored = {mesh.name: len(mesh.polygons) for mesh in meshes}
    return sum(len(mesh.polygons) for mesh in meshes), sum(stored.values())
