"""The light among the things of a scene, as a table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.shade.disturbed_light import DisturbedLight, disturbed_light
from ..uw_spectral.shade.grid import Grid
from ..uw_spectral.shade.probes import cast
from ..uw_spectral.shade.shade_table import ShadeTable, shade_table, without_shade
from ..uw_spectral.shade.voxels import SurfaceVoxels
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.transfer.solved_field import SolvedField
from .lamp_shadows import KeptLampShadows
from .surface_samples import KeptSamples
from .surroundings import Ground, Surroundings


@dataclass(frozen=True, eq=False)
class _Inputs:
    """What decides the light among things."""

    voxels: SurfaceVoxels
    coarse: SurfaceVoxels
    grid: Grid
    eyes: NDArray[np.float64]
    bands: Bands
    field: SolvedField

    def are(self, other: _Inputs) -> bool:
        """Whether others are the same, to the bit."""
        return (
            self.field is other.field
            and self.grid == other.grid
            and self.bands == other.bands
            and np.array_equal(self.eyes, other.eyes)
            and self.coarse.equals(other.coarse)
            and self.voxels.equals(other.voxels)
        )

    def light(self) -> DisturbedLight:
        """Compute it."""
        to_sun = -np.asarray(self.field.sun)
        rays = cast(self.voxels, self.grid, to_sun, self.eyes, self.coarse)
        reflectance = np.clip(self.voxels.colour @ uplift_basis(self.bands).T, 0.0, 1.0)
        return disturbed_light(self.field, rays, reflectance)


class Kept:
    """What was computed for a frame and may serve for the next, which is the same without it."""

    def __init__(self) -> None:
        self.samples = KeptSamples()
        self.lamp_shadows = KeptLampShadows()
        self.ground: Ground | None = None
        """That of the last look around."""
        self._last: tuple[_Inputs, DisturbedLight] | None = None

    def light(self, inputs: _Inputs) -> DisturbedLight:
        """Return the light of before, if nothing that decides it has changed."""
        if self._last is None or not self._last[0].are(inputs):
            self._last = inputs, inputs.light()
        return self._last[1]


def table_of(
    around: Surroundings,
    bands: Bands,
    field: SolvedField,
    weights: NDArray[np.float64],
    depth: float,
    kept: Kept | None = None,
) -> ShadeTable:
    """Return the shade in a scene's water, around its cameras.

    Parameters
    ----------
    around : Surroundings
        Of the scene.
    bands : Bands
    field : SolvedField
        Of the water without things.
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    depth : float
        Of the camera, m.
    kept : Kept, optional
        What may be used again.
    """
    found = around.under_things()
    if found is None:
        return without_shade(len(bands))
    voxels, grid = found
    # In one order, whichever frame it is.
    eyes = np.unique(around.eyes, axis=0)
    light = (kept or Kept()).light(_Inputs(voxels, around.coarse, grid, eyes, bands, field))
    seen = field.scalar_irradiance(depth) * np.abs(weights).sum(axis=0)
    return shade_table(light, field.extinction, seen, alone=around.is_whole(grid))
