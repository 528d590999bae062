"""Pixels of objects in shaded water."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.transfer.radiance_table import tabulate
from underwater_spectral.validation import solved_cases
from underwater_spectral.validation.solved_ray import PathOcclusion, SolvedWater
from underwater_spectral.validation.sun_beam import SunBeam


@pytest.mark.parametrize("kind", [0, 5, 7])
@pytest.mark.parametrize("beyond", [0.0, 0.4, 1.0])
def test_what_shines_as_the_water_behind_it_is_not_seen(kind, beyond):
    """Whatever is behind an object: light scattered forward comes from there, or from itself."""
    case = next(solved_cases.cases(kind, 1))
    field, column = case.field, case.column
    beam = SunBeam(
        column.scattering, column.attenuation, field.extinction, column.sun_irradiance,
        column.sun_cosine, field.floor_depth, case.phase, column.sun_direction,
    )  # fmt: skip
    w, P = [np.array([x]) for x in (0.6, 0.0, 0.8)], 0.5 * case.depth
    y_o = np.array([case.depth])
    y_e = y_o - w[2] * P
    table = tabulate(field)
    near, far = (table.scattered(y, w, field.sun)[0] for y in (y_o, y_e))
    image = field.surface_radiance(w)[0]
    seen = SolvedWater(beam, near, far, image, occlusion=PathOcclusion(beyond=beyond))
    rest = beam.boundary(y_e, w)
    behind = far + beam.single_scattering(y_e, w, rest, without_peak=True)
    behind = behind + np.exp(-beam.cp * rest) * image
    there = beam.boundary(y_o, w)
    wanted = near + beam.single_scattering(y_o, w, there, without_peak=True)
    wanted = wanted + np.exp(-beam.cp * there) * image
    found = seen.surface(y_o, y_e, w, P, behind).total
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-9 * wanted.max())
