"""The tables of the solved field, against the field itself and light added up without them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.transfer.radiance_table import AZIMUTHS, tabulate
from underwater_spectral.validation import solved_cases

CASES = [next(solved_cases.cases(kind, 1)) for kind in (0, 5, 7)]


@pytest.fixture(params=CASES, ids=lambda case: case.name)
def case(request):
    return request.param


def _directions(count: int) -> np.ndarray:
    w = np.random.default_rng(0).normal(size=(3, count))
    return w / np.linalg.norm(w, axis=0)


def test_scattered_light_is_that_of_the_field(case):
    field, table = case.field, tabulate(case.field)
    mu, turns = np.linspace(-0.97, 0.98, 14), np.linspace(0.1, 3.1, 9)
    azimuth = turns + math.atan2(field.sun[1], field.sun[0])
    across = np.sqrt(1.0 - mu**2)[:, None]
    w = -across * np.cos(azimuth), -across * np.sin(azimuth), mu[:, None]
    y = np.array([case.depth])
    wanted = np.moveaxis(field.scattered_on_grid(y, mu, turns)[:, 0], 0, -1)
    far = -sum(s * x for s, x in zip(field.sun, w, strict=True)) < math.cos(math.radians(10.0))
    error = np.abs(table.scattered(y, w, field.sun) - wanted)[far] / field.radiance(y, w)[far]
    assert np.median(error) <= 0.003
    assert np.quantile(error, 0.95) <= 0.02
    assert table.radiance.shape[-1] == AZIMUTHS


@pytest.mark.slow_but_first
def test_light_on_patches_is_what_comes_from_all_sides(case):
    column, field, table = case.column, case.field, tabulate(case.field)
    y, errors = np.array([case.depth]), []
    around = solved_cases.LightAround.at(column, case.phase, y)
    np.testing.assert_allclose(around.on_patch((0.0, 0.0, -1.0)), field.Eu(y), rtol=0.005)
    beam = column.sun_irradiance / column.sun_cosine
    beam = beam * np.exp(-field.extinction * y / column.sun_cosine)
    for n in _directions(40).T:
        wanted = around.on_patch(n)
        direct = max(-(n @ column.sun_direction), 0.0) * beam
        errors.append((table.patch_irradiance(y, n, field.sun) - wanted) / (wanted + direct))
    assert np.median(np.abs(errors)) <= 0.003
    assert np.quantile(np.abs(errors), 0.95) <= 0.015
