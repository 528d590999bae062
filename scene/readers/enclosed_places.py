"""Closed rooms that a camera is in or sees into: EEVEE's grid of light is too coarse for them.

Light is looked up among eight cells; where walls are thinner than these and the water behind them
is much brighter, as behind those of a house, it comes through.
"""

from __future__ import annotations

import bpy
import numpy as np

from ...uw_spectral.occlusion.grid import Array
from ...uw_spectral.occlusion.occlusion_table import IRRADIANCE, OcclusionTable
from ...uw_spectral.occlusion.probes import spiral
from ...uw_spectral.occlusion.view_directions import AXES, NORMALS
from ...uw_spectral.occlusion.voxels import SurfaceVoxels, grown
from .cameras import ray_arrays
from .surroundings import Surroundings

# Of what surrounds a camera, .28 to .84 are walls with eight times the light next to them in houses
# of doors and windows, at most .11 in caves, tunnels, canyons and cars; of what it sees, .74 before
# a window, .51 before a tunnel.
_BRIGHTER = 8.0
_AROUND, _SEEN = 0.2, 0.6
_EVERYWHERE, _PICTURE = 512, (24, 14)  # rays
_OFF_WALL = 0.7  # cells
_LEAST = 1e-3  # of the light of open water
_SIDES = 5  # patches: all but that which faces down


def notes(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    occlusion: OcclusionTable | None,
    around: Surroundings | None,
) -> list[str]:
    """Say where EEVEE is not accurate because a camera is in a closed room, or sees into one.

    The table is of the water, and of these surroundings.
    """
    found = None if camera is None or around is None else around.under_objects()
    if camera is None or occlusion is None or around is None or found is None:
        return []
    ways = spiral(_EVERYWHERE)
    room = _Room(occlusion, found[0])
    if any(room.fraction(np.tile(eye, (len(ways), 1)), ways) > _AROUND for eye in around.eyes):
        where = "is in"
    elif room.fraction(*ray_arrays(scene, camera, *_PICTURE)) > _SEEN:
        where = "sees into"
    else:
        return []
    return [
        f"camera {camera.name!r} {where} a closed room, where EEVEE draws walls up to twice too "
        "bright or too dark: use --engine cycles"
    ]


class _Room:
    """How much brighter it is beside walls than before them."""

    def __init__(self, occlusion: OcclusionTable, voxels: SurfaceVoxels) -> None:
        self._grid, self._voxels = occlusion.grid, voxels
        some = AXES[:_SIDES]
        weight = occlusion.box.light([*NORMALS[some].T[..., None, None, None]])
        light = (occlusion.atlas[IRRADIANCE, some, 1:-1, 1:-1, 1:-1, 0] / weight).mean(axis=0)
        self._light = np.ascontiguousarray(light.transpose(2, 1, 0))
        self._beside = grown(self._light)

    def fraction(self, origin: Array, ways: Array) -> float:
        """Fraction of rays that meet walls which are much darker than what is next to them."""
        inside = self._voxels.grid.inside(origin)
        distance, number = self._voxels.trace(origin[inside], ways[inside])
        origin, ways, distance = (x[number >= 0] for x in (origin[inside], ways[inside], distance))
        places = origin + ways * distance[:, None]
        before = places - ways * np.minimum(distance, _OFF_WALL * self._grid.cell)[:, None]
        known = self._grid.inside(places)
        here = self._light.ravel()[self._grid.index(before[known])]
        most = self._beside.ravel()[self._grid.index(places[known])]
        return float((most > _BRIGHTER * np.maximum(here, _LEAST)).sum()) / max(len(inside), 1)
