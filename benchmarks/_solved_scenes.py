"""Sunlit water, which Cycles and EEVEE draw in the same bands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy

from ..settings.scene_settings import BOUNDED, EXACT
from ..settings.water_settings import DEFAULT_PHASE
from ._places import BANDS, Place
from ._scenery import camera_at, matt

SIZE = (60, 40)
_FIELD_OF_VIEW = 130.0
_FLOOR_BELOW, _FLOOR_REFLECTANCE = 3.0, 0.3
_EEVEE_SAMPLES = 4
_COLOUR = (0.6, 0.4, 0.2)


@dataclass(frozen=True)
class Scene:
    """A water, a sun and a sky, and a camera at a depth that looks level."""

    water: str
    depth: float
    sun: float = 30.0
    sky: str = "clear"
    objects: bool = False
    phase: str = DEFAULT_PHASE
    forward_peak: str = BOUNDED
    bands: int = BANDS
    share_passes: bool = False

    @property
    def title(self) -> str:
        """All of it in words."""
        objects = ", objects" if self.objects else ""
        peak = ", exact peak" if self.forward_peak == EXACT else ""
        where = f"{self.water} {self.depth:g} m, sun {self.sun:g}°, {self.sky}{objects}"
        return f"{where}, {self.phase}{peak}"

    def place(self, samples: int = 1) -> Place:
        """Where it is; under an overcast sky little of the light is direct sun."""
        settings = {
            "phase": self.phase, "bands": self.bands, "sky": self.sky,
            "sky_radiance": 0.05 if self.sky == "clear" else 3.0,
            "floor_depth": self.depth + _FLOOR_BELOW, "floor_reflectance": str(_FLOOR_REFLECTANCE),
            "forward_peak": self.forward_peak, "share_passes": self.share_passes,
        }  # fmt: skip
        return Place(
            self.title, self._build, self.water, self.sun, samples, settings, SIZE, _EEVEE_SAMPLES
        )

    def _build(self) -> bpy.types.Object:
        """Add the camera, and a sphere, a cube and a tilted square before it; return the first."""
        for add, (x, y, z), size in (
            (bpy.ops.mesh.primitive_uv_sphere_add, (-0.9, 1.6, 0.1), 0.3),
            (bpy.ops.mesh.primitive_cube_add, (0.9, 1.5, -0.5), 0.25),
            (bpy.ops.mesh.primitive_plane_add, (0.1, 1.4, 0.35), 0.35),
        )[: 3 * self.objects]:
            add(location=(x, y, z - self.depth), rotation=(0.4, 0.3, 0.2))
            bpy.context.object.scale = (size,) * 3
            bpy.context.object.data.materials.append(matt(_COLOUR))
        level = (math.radians(90.0), 0.0, 0.0)
        return camera_at((0.0, 0.0, -self.depth), level, math.radians(_FIELD_OF_VIEW))
