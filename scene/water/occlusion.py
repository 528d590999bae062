"""The light among the objects of a scene, as a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.occlusion.grid import Grid
from ...uw_spectral.occlusion.occlusion_table import (
    OcclusionTable,
    occlusion_table,
    without_occlusion,
)
from ...uw_spectral.occlusion.probe_irradiance import ProbeIrradiance
from ...uw_spectral.occlusion.probe_solution import WaterCache, probe_irradiance
from ...uw_spectral.occlusion.probes import Rays, cast
from ...uw_spectral.occlusion.visibility_buffer import VisibilityCache
from ...uw_spectral.occlusion.voxels import SurfaceVoxels
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.reflectance import projected, uplift_basis
from ...uw_spectral.transfer.solved_field import SolvedField
from ...uw_spectral.transfer.water_column import WaterColumn
from ..readers.lamp_shadows import LampShadowCache
from ..readers.surface_samples import SampleCache
from ..readers.surroundings import Ground, Surroundings, look_around
from ..readers.volume_grids import GridCache

Array = NDArray[np.float64]

_NEXT_TO_NONE, _ENDLESS = 0.01, 1e9  # cells, and m
MOST_BANDS = 8
"""That the light among objects is computed in; between them it is linear."""


@dataclass(frozen=True, eq=False)
class _Inputs:
    """What decides the light among objects."""

    voxels: SurfaceVoxels
    coarse: SurfaceVoxels
    grid: Grid
    eyes: Array
    bands: Bands
    field: SolvedField

    def are(self, other: _Inputs) -> bool:
        """Whether others are the same, to the bit."""
        return (
            self.of_same_water(other)
            and np.array_equal(self.eyes, other.eyes)
            and self.coarse.equals(other.coarse)
            and self.voxels.equals(other.voxels)
        )

    def of_same_water(self, other: _Inputs) -> bool:
        """Whether only objects or eyes may be others."""
        grids = self.grid == other.grid and self.coarse.grid == other.coarse.grid
        return self.field is other.field and self.bands == other.bands and grids


class Cache:
    """What was computed for a frame and may serve for the next, which is the same without it.

    In a job nothing moves within a frame.
    """

    def __init__(self, *, of_job: bool = False) -> None:
        self._of_job = of_job
        self._looked: tuple[tuple[object, ...], Surroundings] | None = None
        self.samples = SampleCache()
        self.lamp_shadows = LampShadowCache()
        self.grids = GridCache(of_job=of_job)
        self.picture = VisibilityCache()
        self.ground: Ground | None = None
        """That of the last look around."""
        self._waters = WaterCache()
        self._table: tuple[ProbeIrradiance, bytes, OcclusionTable] | None = None
        self._last: tuple[_Inputs, ProbeIrradiance] | None = None
        self._first: tuple[_Inputs, Rays, ProbeIrradiance] | None = None
        """A frame that was solved for itself, from which others start."""
        self.has_begun = False
        """Whether there was a frame already, be it without occlusion."""

    def look(
        self,
        scene: bpy.types.Scene,
        camera: bpy.types.Object | None,
        column: WaterColumn,
        path: Sequence[tuple[float, ...]] = (),
    ) -> Surroundings:
        """Look around in a water, see :func:`.look_around`; in a job once a frame."""
        extinction = float(column.attenuation.min())
        name = "" if camera is None else camera.name
        floor = _floor_of(column)
        asked = (scene.frame_current_final, name, extinction, tuple(path), floor)
        if not self._of_job or self._looked is None or self._looked[0] != asked:
            around = look_around(scene, camera, extinction, path, self.samples, floor)
            self._looked = asked, around
            self.ground = around.ground
        return self._looked[1]

    @property
    def looked(self) -> Surroundings | None:
        """What :meth:`look` saw last."""
        return None if self._looked is None else self._looked[1]

    def light(self, inputs: _Inputs) -> ProbeIrradiance:
        """Return the light of before, if nothing that decides it has changed.

        Else that of a frame is corrected which was solved for itself, until it has settled: what
        comes out does not depend on the frames between. In a job that is always its first frame,
        with which every process begins, so that all make the same pictures of a frame.
        """
        if self._last is None or not self._last[0].are(inputs):
            self._last = inputs, self._solved(inputs)
        return self._last[1]

    def table(
        self,
        light: ProbeIrradiance,
        extinction: Array,
        seen: Array,
        *,
        beyond: float,
        enclosed: bool,
    ) -> OcclusionTable:
        """Return the table of a light; that of before, if it is the same."""
        given = extinction.tobytes() + seen.tobytes() + repr((beyond, enclosed)).encode()
        last = self._table
        if last is None or last[0] is not light or last[1] != given:
            table = occlusion_table(light, extinction, seen, beyond=beyond, enclosed=enclosed)
            self._table = last = light, given, table
        return last[2]

    def _solved(self, inputs: _Inputs) -> ProbeIrradiance:
        first, field, voxels = self._first, inputs.field, inputs.voxels
        to_sun = -np.asarray(field.sun)
        rays = cast(voxels, inputs.grid, to_sun, inputs.eyes, inputs.coarse, first and first[1])
        before = first[2] if first is not None and first[0].of_same_water(inputs) else None
        same_rays = first is not None and rays.hit is first[1].hit
        if first and before and same_rays and voxels.equals(first[0].voxels):
            # Nothing but eyes has moved.
            return before
        near = None if self._of_job or self._last is None else self._last[1]
        reflectance = np.clip(voxels.colour @ uplift_basis(inputs.bands).T, 0.0, 1.0)
        light = probe_irradiance(field, rays, reflectance, self._waters, before, near)
        if light.serves and not (self._of_job and self.has_begun):
            self._first = inputs, rays, light
        return light


def _floor_of(column: WaterColumn) -> Ground | None:
    depth = column.floor_depth
    if not math.isfinite(depth):
        return None
    red, green, blue = projected(column.floor_reflectance, column.bands).tolist()
    return Ground(depth, (red, green, blue), depth)


def table_of(
    around: Surroundings,
    bands: Bands,
    field: SolvedField,
    weights: NDArray[np.float64],
    depth: float,
    cache: Cache | None = None,
) -> OcclusionTable:
    """Return the occlusion in a scene's water, around its cameras.

    The field is that of the water without objects; the weights, shape (3, n), are linear RGB per
    unit radiance of each band; the camera's depth is in m.
    """
    cache, found = cache or Cache(), around.under_objects()
    if found is None:
        cache.has_begun = True
        return without_occlusion(len(bands))
    voxels, grid = found
    # In one order, whichever frame it is.
    eyes = np.unique(around.eyes, axis=0)
    light = cache.light(_Inputs(voxels, around.coarse, grid, eyes, bands, field))
    cache.has_begun = True
    seen = field.scalar_irradiance(depth) * np.abs(weights).sum(axis=0)
    enclosed = light.solution is None or light.solution.known.rays.enclosed(eyes)
    beyond = around.beyond(grid)
    if enclosed and beyond > _NEXT_TO_NONE * grid.cell:
        # Walls there are lit as those at its sides.
        beyond = _ENDLESS
    return cache.table(light, field.extinction, seen, beyond=beyond, enclosed=enclosed)
