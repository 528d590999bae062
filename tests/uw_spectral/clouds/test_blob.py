"""Puffs: their density along rays, against sums."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.gaussian_blob import GaussianBlob
from underwater_spectral.uw_spectral.errors import InputError

TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
AXES = TURN * [0.6, 1.5, 3.0]
MIDDLE = (1.0, 4.0, -6.0)


def _summed(blob, origin, w, P):
    s = (np.arange(40_000) + 0.5) / 40_000 * P
    points = [o + along * s for o, along in zip(origin, w, strict=True)]
    return float(blob.density(points).mean() * P)


@pytest.mark.parametrize("P", [2.0, 4.0, 5.5, 40.0])
@pytest.mark.parametrize("aim", [(0.0, 0.0, 0.0), (0.7, 0.2, -0.4), (-1.0, 0.5, 1.2)])
def test_the_density_along_a_ray_is_that_of_a_sum(P, aim):
    blob, origin = GaussianBlob.of_axes(MIDDLE, AXES), np.array([0.5, -0.5, -5.0])
    w = np.array(MIDDLE) + aim - origin
    w /= np.linalg.norm(w)
    found = float(blob.along(origin, w).column(P))
    wanted = _summed(blob, origin, w, P)
    # 2 % of the transmittance was asked for.
    assert found == pytest.approx(wanted, rel=1e-4, abs=2e-6)


def test_single_precision_is_enough_for_nodes():
    blob, origin = GaussianBlob.of_axes((0, 60, -6), 0.5 * np.eye(3)), np.float32([0, 0, -6.2])
    w = np.float32([0.001, 1.0, 0.003])
    w /= np.linalg.norm(w)
    single = blob.along(list(origin), list(w)).column(np.float32(80.0))
    double = blob.along(list(map(float, origin)), list(map(float, w))).column(80.0)
    assert float(single) == pytest.approx(float(double), rel=1e-3)


def test_what_lies_outwards_adds_up_to_paths_along_the_axes():
    blob, point = GaussianBlob.of_axes(MIDDLE, AXES), (1.2, 4.3, -6.5)
    found = blob.outwards(point)
    for axis in range(3):
        for side, sign in ((0, -1.0), (1, 1.0)):
            w = sign * TURN[:, axis]
            assert float(found[2 * axis + side]) == pytest.approx(
                _summed(blob, point, w, 30.0), rel=1e-3
            )


def test_the_outline_is_where_the_density_is_a_seventh():
    blob = GaussianBlob.of_axes(MIDDLE, AXES)
    for axis in AXES.T:
        assert float(blob.density(np.array(MIDDLE) + axis)) == pytest.approx(np.exp(-2.0))
    assert blob.size == pytest.approx(0.5 * (0.6 * 1.5 * 3.0) ** (1 / 3))


def test_a_flat_blob_is_refused():
    with pytest.raises(InputError, match="flat"):
        GaussianBlob.of_axes(MIDDLE, np.diag([1.0, 0.0, 1.0]))
