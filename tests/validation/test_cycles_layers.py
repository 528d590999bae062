"""Cycles in layered water against the light field solved by discrete ordinates."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.tests.scene import columns
from underwater_spectral.tests.validation import cycles_probe
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

INDEX, ZENITH = 1.34, 40.0
FLAT = {
    "surface": "flat",
    "refractive_index": INDEX,
    "sun_cosine": float(in_water_cosine(ZENITH, INDEX)),
    "sun_direction": sun_travel_direction(ZENITH, 0.0, INDEX),
}
FLOOR = {"floor_depth": 9.0, "floor_reflectance": 0.3}


def _phase(g=0.8):
    return parse_phase(f"hg:{g}").for_bands(np.ones(3))


def _layered(a, b, *below, **changes):
    deeper = tuple(DeeperWater(top, a, b, _phase(g)) for top, a, b, g in below)
    return columns.grey_column(a, b, below=deeper, **FLOOR, **changes)


CLEAR_OVER_TURBID = _layered(0.05, 0.1, (4.0, 0.2, 0.6, 0.8))
THREE = _layered(0.1, 0.3, (3.0, 0.05, 0.05, 0.8), (6.0, 0.2, 0.8, 0.5))
# Angle of the camera from straight down, rad.
DOWN, LEVEL, UP = 0.0, math.pi / 2, 2.3


def _measured(column, quantity, depth, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    meter = bpy.context.scene, column, columns.henyey_greenstein(0.8), depth
    path = tmp_path / "probe.exr"
    if quantity == "Ed":
        return cycles_probe.downwelling_irradiance(*meter, samples=512, path=path)
    rotation = (quantity, 0.0, 0.0)
    return cycles_probe.radiance(*meter, rotation, samples=512, path=path)


def _solved(column, quantity, depth):
    field = column.solved_field(_phase())
    if quantity == "Ed":
        return float(field.Ed(depth)[0])
    w = (0.0, math.sin(quantity), -math.cos(quantity))
    return float(field.radiance(depth, w)[0])


def _deviations(column, wanted, tmp_path):
    """How far Cycles is from a value, in standard errors; they are below 1.5 % of it."""
    found = []
    for (quantity, depth), value in wanted.items():
        measured = _measured(column, quantity, depth, tmp_path)
        assert measured.error < 0.015 * value
        found.append((measured.mean - value) / math.hypot(measured.error, 0.002 * value))
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("column", "meters"),
    [
        pytest.param(
            CLEAR_OVER_TURBID,
            [("Ed", 2.0), ("Ed", 4.0), ("Ed", 7.0), (UP, 7.0), (DOWN, 2.0)],
            marks=pytest.mark.slow,
        ),
        (THREE, [("Ed", 5.0), ("Ed", 8.0), (UP, 8.0), (LEVEL, 2.0), (LEVEL, 5.0), (DOWN, 5.0)]),
        pytest.param(
            replace(CLEAR_OVER_TURBID, **FLAT),
            [("Ed", 2.0), ("Ed", 7.0), (UP, 7.0), (LEVEL, 6.0)],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_layers_against_the_solved_field(column, meters, tmp_path, record_property):
    wanted = {meter: _solved(column, *meter) for meter in meters}
    found = _deviations(column, wanted, tmp_path)
    record_property("standard errors", found.round(1).tolist())
    assert np.all(np.abs(found) < 3.0)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("error", [0.9, 1.1])
def test_another_scattering_of_one_layer_is_seen(error, tmp_path):
    """The light of the layer below is 10 % of b away from that of the column that is drawn."""
    (deeper,) = CLEAR_OVER_TURBID.below
    other = replace(deeper, scattering=error * deeper.scattering)
    planted = replace(CLEAR_OVER_TURBID, below=(other,))
    wanted = {("Ed", 7.0): _solved(planted, "Ed", 7.0)}
    assert np.abs(_deviations(CLEAR_OVER_TURBID, wanted, tmp_path)) > 3.0


@pytest.mark.slow
def test_one_water_cut_into_layers_is_the_same_picture(tmp_path):
    """In a camera at the depth where layers meet, too."""
    whole = columns.grey_column(0.1, 0.3, **FLOOR)
    cut = _layered(0.1, 0.3, (1.0, 0.1, 0.3, 0.8), (4.0, 0.1, 0.3, 0.8), (20.0, 0.1, 0.3, 0.8))
    for quantity in ("Ed", LEVEL, DOWN):
        one, other = (_measured(column, quantity, 4.0, tmp_path) for column in (whole, cut))
        assert other.error < 0.015 * one.mean
        assert abs(one.mean - other.mean) < 3 * math.hypot(one.error, other.error)
