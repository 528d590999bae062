"""EEVEE with the solved light field, rendered, against the solution without tables, per pixel."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.scene.water import frame_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tests.node_groups.test_realtime_groups import _column
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation import solved_cases

SQUARES = {
    "lit": ((-0.75, -0.9, -1.5), (1.5, 0.0, 0.0), (0.0, 0.75, -2.0)),
    "underside": ((-1.5, 0.2, -3.0), (3.0, 0.0, 0.0), (0.0, 1.0, -1.0)),
}
MEDIAN, MOST = 0.01, 0.05
SEAM = 3 * 2.0**-10  # second differences of half floats whose digits are cut


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("n", "surface", "sky", "floor", "turns", "square"),
    [
        (3, "flat", "clear", 9.0, (150.0, 88.0, 30.0), "lit"),
        (5, "flat", "overcast", 20.0, (88.0,), "lit"),
        (3, "none", "uniform", np.inf, (120.0, 60.0), "underside"),
        (3, "flat", "overcast", 9.0, (120.0, 88.0), "underside"),
    ],
)
def test_pixels_are_those_of_the_solution(tmp_path, n, surface, sky, floor, turns, square):
    wavelengths = Bands.uniform(n).centres
    a, b = 0.03 + 0.3 * ((wavelengths - 400) / 300) ** 2, 0.1 * 550 / wavelengths
    lobes = parse_phase("mixture").for_bands(b, 0.003 * (550 / wavelengths) ** 4)
    column = _column(n, a, b, surface=surface, sky=sky, floor_depth=floor)
    weights = 3.0 * _sensor(wavelengths)
    for turn in turns:
        view = probe.View(5.0, turn, square=SQUARES[square])
        for errors in probe.errors_of_solved(column, lobes, view, weights, tmp_path / "a.exr"):
            assert errors.size > 100
            assert np.median(errors) <= MEDIAN / 2
            assert np.quantile(errors, 0.95) <= MOST / 2
            assert errors.max() <= MOST


def _sensor(wavelengths):
    """Three channels as wide as those of cameras, shape (3, n)."""
    centres = np.array([[600.0], [540.0], [460.0]])
    seen = np.exp(-0.5 * ((wavelengths - centres) / 35.0) ** 2)
    return seen / seen.sum(axis=1, keepdims=True)


def _deeper(a, b, wavelengths, kind):
    """What lies below: six times as turbid, clear under turbid, many steps, another phase."""

    def layer(top, a, b, phase="mixture"):
        lobes = parse_phase(phase).for_bands(b, 0.003 * (550 / wavelengths) ** 4)
        return DeeperWater(float(top), a, b, lobes)

    if kind == "many":
        return tuple(layer(y, a * (1 + y / 8), b * (1 + y / 4)) for y in np.arange(0.8, 12, 0.8))
    return {
        "turbid": (layer(6.0, 2 * a, 6 * b),),
        "clear": (layer(2.0, 0.7 * a, 0.3 * b),),
        "other": (layer(3.0, a, 2 * b), layer(6.0, 2 * a, 6 * b, "hg:0.9")),
    }[kind]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "surface", "sky", "floor"),
    [
        ("turbid", "flat", "clear", 14.0),
        pytest.param("other", "flat", "overcast", np.inf, marks=pytest.mark.slow),
        pytest.param("turbid", "flat", "overcast", np.inf, marks=pytest.mark.slow),
        pytest.param("clear", "flat", "clear", 14.0, marks=pytest.mark.slow),
        pytest.param("clear", "none", "uniform", np.inf, marks=pytest.mark.slow),
        pytest.param("many", "flat", "clear", 14.0, marks=pytest.mark.slow),
        pytest.param("many", "none", "uniform", np.inf, marks=pytest.mark.slow),
    ],
)
def test_pixels_in_layers_are_those_of_the_solution(tmp_path, kind, surface, sky, floor):
    """A camera a metre above the turbid water, and objects above and below its top."""
    wavelengths = Bands.uniform(3).centres
    a, b = 0.03 + 0.3 * ((wavelengths - 400) / 300) ** 2, 0.1 * 550 / wavelengths
    lobes = parse_phase("mixture").for_bands(b, 0.003 * (550 / wavelengths) ** 4)
    below = _deeper(a, b, wavelengths, kind)
    column = _column(3, a, b, surface=surface, sky=sky, floor_depth=floor, below=below)
    weights = np.diag(np.pi / column.solved_field(lobes).Ed(5.0))
    for turn, drop in ((0.0, 0.7), (0.0, 3.0), (60.0, 2.0), (88.0, None), (150.0, None)):
        square = None if drop is None else probe.level_square(turn, drop)
        view = probe.View(5.0, turn, square=square)
        found = probe.errors_of_solved(column, lobes, view, weights, tmp_path / "a.exr")
        for errors in (part for part in found if part.size):
            assert np.median(errors) <= MEDIAN
            assert np.quantile(errors, 0.95) <= MOST / 2
            assert errors.max() <= MOST


@pytest.mark.slow
@pytest.mark.parametrize("part", [pytest.param("open water", marks=pytest.mark.slow), "square"])
def test_gradients_have_no_seams(tmp_path, part):
    """Slices and texels of the tables leave no lines; second differences show the smallest."""
    a, b = np.array([0.03, 0.08, 0.2]), np.array([0.4, 0.6, 1.0])
    lobes = parse_phase("hg:0.8").for_bands(b)
    column = _column(3, a, b, floor_depth=12.0, zenith=50.0)
    # An underside has its light from the tables alone, here of some ten slices.
    square = None if part == "open water" else ((-8.0, -1.6, -2.6), (16.0, 0, 0), (0, 4.0, 1.9))
    view = probe.View(2.5, 90.0, 120.0, square=square, size=(160, 90))
    solved = column.solved_field(lobes)
    weights = np.diag(np.pi / solved.Eu(view.depth))
    water = frame_water.realtime_water(column, lobes, view.depth, weights, solved=solved)
    seen = probe.render(water, view, tmp_path / "a.exr")
    wanted, where = probe.expected_of_solved(column, lobes, view, weights)
    inside = where == (square is not None)
    assert inside.mean() > 0.5
    for axis in (0, 1):
        middle = np.delete(inside, [0, -1], axis) & (np.diff(inside.astype(int), 2, axis=axis) == 0)
        bent = (np.diff(x, 2, axis=axis) / np.delete(wanted, [0, -1], axis) for x in (seen, wanted))
        assert np.abs(np.subtract(*bent))[middle].max() <= SEAM


# Within 40° of the sun in HG .95, Jerlov 5C, .3 m deep under a black sky: docs/limits.md.
_NEAR_SUN = pytest.mark.xfail(strict=True, reason="a square's 95 % is 5.4 %, its worst 28 %")


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=_NEAR_SUN if name == "hg:0.95" else [])
        for kind, (name, _, _) in enumerate(solved_cases.KINDS)
    ],
)
def test_random_waters_are_those_of_the_solution(tmp_path, kind):
    found = [probe.errors_of_case(case, tmp_path / "a.exr") for case in solved_cases.cases(kind, 5)]
    for errors in (np.concatenate(part) for part in zip(*found, strict=True)):
        assert np.median(errors) <= MEDIAN
        assert np.quantile(errors, 0.95) <= MOST
