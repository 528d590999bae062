"""Tables against arithmetic by hand, and where coordinates lie on their axes."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.cloud_numbers import ESCAPES
from underwater_spectral.uw_spectral.lamps.angular_spread import path_lengths
from underwater_spectral.uw_spectral.lamps.lamp_harmonics import lamp_distances
from underwater_spectral.uw_spectral.lamps.lamp_shadow import SOFT_DISTANCES
from underwater_spectral.uw_spectral.lamps.scattered_source import BENT, TURNED
from underwater_spectral.uw_spectral.table import (
    LOGARITHMIC,
    Axis,
    Scale,
    Table,
    angular,
    discrete_axis,
    root,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import SUN_ANGLE, TILT, TURN, UP

SCALES = {
    "escapes": ESCAPES, "lengths": path_lengths(7), "lamps": lamp_distances(0.3, 5.0),
    "shadows": SOFT_DISTANCES, "sun": SUN_ANGLE, "up": UP, "tilt": TILT,
    "root": Scale(9, 0.0, 2.0, root(3.0)),
}  # fmt: skip


def test_tables_are_linear_between_their_entries_along_each_axis():
    rng = np.random.default_rng(1)
    values = rng.random((4, 5, 3, 2))
    table = Table(values, (Axis("a", 4), Axis("b", 5), Axis("c", 3)))
    places = rng.uniform(-0.4, 1.4, (3, 6)) * np.array([[3], [4], [2]])
    for a, b, c in places.T:
        total = np.zeros(2)
        for i, j, k in itertools.product((0, 1), repeat=3):
            low = [min(max(math.floor(x), 0), n - 2) for x, n in ((a, 4), (b, 5), (c, 3))]
            parts = [x - at for x, at in zip((a, b, c), low, strict=True)]
            weight = math.prod(x if up else 1 - x for x, up in zip(parts, (i, j, k), strict=True))
            total += weight * values[low[0] + i, low[1] + j, low[2] + k]
        np.testing.assert_allclose(table.at(a=a, b=b, c=c), total, rtol=1e-12)
    found = table.at(a=places[0, :, None], c=places[2, :, None], b=places[1, :, None])
    one = [table.at(a=a, b=b, c=c) for a, b, c in places.T]
    np.testing.assert_allclose(found, one, rtol=1e-12)


def test_numbered_entries_are_taken_as_they_are_and_all_of_them_where_none_is_named():
    values = np.random.default_rng(2).random((3, 4, 2))
    table = Table(values, (discrete_axis("which", 3), Axis("x", 4)))
    x = np.array([[0.5], [2.25]])
    wanted = [values[:, [0, 2]], values[:, [1, 3]]]
    wanted = wanted[0] + np.array([0.5, 0.25])[:, None] * (wanted[1] - wanted[0])
    np.testing.assert_allclose(table.at(x=x), wanted)
    at = table.at(which=np.array([[2], [0]]), x=x)
    np.testing.assert_allclose(at, [wanted[2][0], wanted[0][1]])


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES)
def test_entries_lie_at_their_places_and_what_is_beyond_is_held(scale):
    values = scale.values()
    assert values[[0, -1]] * scale.unit == pytest.approx([scale.first, scale.last], abs=1e-12)
    # An entry at an end may be held within it, by its last digit.
    assert scale.place(values) == pytest.approx(np.arange(scale.count), abs=1e-6)
    ends = np.array([-1e9 if scale.first < 0 else 0.0, 1e9])
    last = scale.place(scale.beyond * scale.last / scale.unit)
    assert scale.place(ends) == pytest.approx([0.0, last], abs=1e-6)
    assert last == pytest.approx(scale.count - 1.0) or scale.beyond > 1.0


@pytest.mark.parametrize(("scale", "sign"), [(TURNED, 1.0), (BENT, 1.0), (TURN, -1.0)])
def test_angles_are_looked_up_by_their_cosines(scale, sign):
    angles = scale.values()
    assert angles[[0, -1]] == pytest.approx([0.0, math.pi])
    assert scale.place(sign * np.cos(angles)) == pytest.approx(np.arange(scale.count), abs=1e-6)


def test_scales_are_even_in_what_they_say():
    assert Scale(3, 1.0, 100.0, LOGARITHMIC).values() == pytest.approx([1.0, 10.0, 100.0])
    assert Scale(3, 0.0, 8.0, root(3.0)).values() == pytest.approx([0.0, 1.0, 8.0])
    assert Scale(3, 1.0, -1.0, angular(2.0)).values() == pytest.approx([0.0, math.pi / 4, math.pi])
    assert Scale(3, 1.0, 100.0, LOGARITHMIC, unit=2.0).place(5.0) == pytest.approx(1.0)
    assert Scale(3, 1.0, 100.0, LOGARITHMIC, beyond=10.0).place(1e9) == pytest.approx(3.0)
