"""The light among the things of a scene, as a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.shade.disturbed_light import disturbed_light
from ..uw_spectral.shade.probes import cast
from ..uw_spectral.shade.shade_table import ShadeTable, shade_table, without_shade
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.transfer.solved_field import SolvedField
from .surroundings import Surroundings


def table_of(
    around: Surroundings,
    bands: Bands,
    field: SolvedField,
    weights: NDArray[np.float64],
    depth: float,
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
    """
    found = around.under_things()
    if found is None:
        return without_shade(len(bands))
    voxels, grid = found
    rays = cast(voxels, grid, -np.asarray(field.sun), around.eyes, around.coarse)
    reflectance = np.clip(voxels.colour @ uplift_basis(bands).T, 0.0, 1.0)
    light = disturbed_light(field, rays, reflectance)
    seen = field.scalar_irradiance(depth) * np.abs(weights).sum(axis=0)
    return shade_table(light, field.extinction, seen)
