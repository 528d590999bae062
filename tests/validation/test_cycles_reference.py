"""Cycles with our water against Monte Carlo, published canonical problems, and the furnace."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.node_groups.water_volume import ScatteringLobe
from underwater_spectral.tests.scene import columns
from underwater_spectral.tests.validation import cycles_probe
from underwater_spectral.validation.canonical_problems import canonical_values

HG = columns.henyey_greenstein(0.8)
# a = 0.05, b = 0.1, HG 0.8, vertical sun, no interface: discrete ordinates of this project and
# PythonicDISORT, 64 streams each, to four digits.
REFERENCE_ED = {0.5: 0.9730, 2.0: 0.8935, 5.0: 0.7463, 10.0: 0.5421, 20.0: 0.2725}
ROUNDING = 0.5e-4


@pytest.mark.slow_but_first
@pytest.mark.parametrize("depth", REFERENCE_ED)
def test_downwelling_irradiance_against_discrete_ordinates(empty_blender, tmp_path, depth):
    column = columns.grey_column(0.05, 0.1)
    found = cycles_probe.downwelling_irradiance(
        empty_blender, column, HG, depth, samples=2048, path=tmp_path / "ed.exr"
    )
    assert found.error < 0.002
    assert abs(found.mean - REFERENCE_ED[depth]) <= 3 * found.error + ROUNDING


@pytest.mark.slow_but_first
@pytest.mark.parametrize("surface", ["none", "flat"])
@pytest.mark.parametrize("rotation", [0.0, 1.3, 2.3])
def test_white_furnace(empty_blender, tmp_path, surface, rotation):
    index = 1.34 if surface == "flat" else 1.0
    column = columns.grey_column(
        0.0,
        0.1,
        sun_irradiance=0.0,
        sky_radiance=1.0,
        floor_depth=3.0,
        floor_reflectance=1.0,
        surface=surface,
        refractive_index=index,
    )
    found = cycles_probe.radiance(
        empty_blender,
        column,
        HG,
        1.0,
        (rotation, 0.0, 0.0),
        samples=512,
        path=tmp_path / "furnace.exr",
    )
    assert found.error < 0.003
    assert abs(found.mean / index**2 - 1.0) <= 3 * found.error + 1e-3


MOLECULAR = (ScatteringLobe("DRAINE", alpha=1.0),)  # Rayleigh, as the problem is posed


@pytest.mark.parametrize(
    ("case", "a", "b"),
    [
        pytest.param(1, 1.0, 0.25, marks=pytest.mark.slow),
        pytest.param(2, 1.0, 9.0, marks=pytest.mark.slow),
    ],
)
def test_mobley1993_problem_1(empty_blender, tmp_path, record_property, case, a, b):
    index, zenith = 1.34, math.radians(60.0)
    sine = math.sin(zenith) / index
    cosine = math.sqrt(1 - sine**2)
    rs = ((math.cos(zenith) - index * cosine) / (math.cos(zenith) + index * cosine)) ** 2
    rp = ((index * math.cos(zenith) - cosine) / (index * math.cos(zenith) + cosine)) ** 2
    column = columns.grey_column(
        a,
        b,
        sun_irradiance=0.5 * (1 - (rs + rp) / 2),
        sun_cosine=cosine,
        sun_direction=np.array([sine, 0.0, -cosine]),
        surface="flat",
        refractive_index=index,
    )
    depth = 1.0 / (a + b)
    common = {"path": tmp_path / "probe.exr"}
    meters = {
        "Ed": lambda: cycles_probe.downwelling_irradiance(
            empty_blender, column, MOLECULAR, depth, samples=4096, **common
        ),
        "Eou": lambda: cycles_probe.upwelling_scalar_irradiance(
            empty_blender, column, MOLECULAR, depth, samples=1024, **common
        ),
        "Lu": lambda: cycles_probe.radiance(
            empty_blender, column, MOLECULAR, depth, (0.0, 0.0, 0.0), samples=4096, **common
        ),
    }
    for row in canonical_values(1, case):
        if row.depth != pytest.approx(depth):
            continue
        mean, variation, quantity = row.mean, row.scatter, row.quantity
        found = meters[quantity]()
        tolerance = max(3 * variation, 0.05 if quantity == "Lu" else 0.01) * mean
        record_property(f"{quantity} {mean:g}", f"{found.mean:.5g} ± {found.error:.2g}")
        assert found.error < tolerance / 2
        assert abs(found.mean - mean) <= tolerance
