"""Lenses against OpenCV, their inverses, and lateral colour."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.housing import (
    BrownConrady,
    KannalaBrandt,
    LateralColour,
    LensCamera,
)

K = np.array([[1400.0, 0.0, 949.5], [0.0, 1390.0, 544.5], [0.0, 0.0, 1.0]])
WIDE = np.array([[600.0, 0.0, 949.5], [0.0, 595.0, 544.5], [0.0, 0.0, 1.0]])
BROWNS = (
    (0.0, 0.0, 0.0, 0.0, 0.0),
    (-0.2, 0.05, 0.001, -0.002, -0.003),
    (0.15, -0.02, -0.003, 0.001, 0.01),
)
FISHEYES = ((0.0, 0.0, 0.0, 0.0), (-0.03, 0.004, -0.002, 0.0005), (0.05, 0.01, -0.004, 0.001))


def _camera(matrix, lens, lateral=None):
    return LensCamera(
        1920, 1080, matrix[0, 0], matrix[1, 1], matrix[0, 2] + 0.5, matrix[1, 2] + 0.5, lens,
        lateral or LateralColour(),
    )  # fmt: skip


def _pixels():
    return np.stack(np.meshgrid(np.linspace(0, 1920, 25), np.linspace(0, 1080, 19)), axis=-1)


@pytest.mark.parametrize("k", BROWNS, ids=str)
def test_distortion_is_that_of_opencv(k):
    camera = _camera(K, BrownConrady(*k))
    directions = camera.directions(_pixels()) * 3.0
    seen = cv2.projectPoints(directions.reshape(-1, 3), np.zeros(3), np.zeros(3), K, np.array(k))
    np.testing.assert_allclose(
        seen[0].reshape(*_pixels().shape) + 0.5, camera.project(directions), atol=1e-6
    )


@pytest.mark.parametrize("k", FISHEYES, ids=str)
def test_fisheyes_are_those_of_opencv(k):
    camera = _camera(WIDE, KannalaBrandt(*k))
    directions = camera.directions(_pixels())
    directions = directions[directions[..., 2] > 0.05].reshape(1, -1, 3)
    assert directions.shape[1] > 300
    seen, _ = cv2.fisheye.projectPoints(directions, np.zeros(3), np.zeros(3), WIDE, np.array(k))
    np.testing.assert_allclose(seen + 0.5, camera.project(directions), atol=1e-6)


@pytest.mark.parametrize("lateral", [LateralColour(), LateralColour((1e-3, -3e-4), (5e-4,))])
@pytest.mark.parametrize(
    "lens", [*(BrownConrady(*k) for k in BROWNS), *(KannalaBrandt(*k) for k in FISHEYES)], ids=str
)
def test_directions_undo_what_lens_and_colour_do(lens, lateral):
    camera = _camera(K, lens, lateral)
    for nm in (400.0, 550.0, 700.0):
        back = camera.project(camera.directions(_pixels(), nm), nm)
        np.testing.assert_allclose(back, _pixels(), atol=1e-9, rtol=0)


def test_lateral_colour_magnifies():
    camera = _camera(K, BrownConrady(), LateralColour((2e-3,), (1e-3,), 500.0))
    x = camera.project([[0.5, 0.0, 1.0]] * 3, [400.0, 500.0, 600.0])[:, 0] - 950.0
    by_hand = 700.0 * (1.0 + np.array([-1, 0, 1]) * (2e-3 + 1e-3 * 0.25))
    np.testing.assert_allclose(x, by_hand, atol=1e-9)


def test_what_a_lens_does_not_see_is_nan():
    """A polynomial that folds back would show the far side inside the picture."""
    projecting = BrownConrady(-0.3)
    assert np.isnan(projecting.image([[2.0, 0.0, 1.0], [0.1, 0.0, -1.0]])).all()
    assert np.isnan(projecting.directions([5.0, 0.0])).all()
    for lens, project in (
        (BrownConrady(k2=-0.1), 2**0.25),
        (BrownConrady(k3=-0.1), 0.7 ** (-1 / 6)),
    ):
        seen = np.isfinite(lens.image([[0.99 * project, 0.0, 1.0], [0.0, 1.01 * project, 1.0]]))
        assert seen.all(axis=-1).tolist() == [True, False]
    fisheye = KannalaBrandt(-0.2)
    limit = np.sqrt(1 / 0.6)
    for angle, seen in ((limit - 0.01, True), (limit + 0.01, False)):
        image = fisheye.image([np.sin(angle), 0.0, np.cos(angle)])
        assert np.isfinite(image).all() == seen
    assert np.isnan(fisheye.directions([3.0, 0.0])).all()


@pytest.mark.parametrize(
    "make",
    [
        lambda: BrownConrady(np.nan),
        lambda: KannalaBrandt(k3=np.inf),
        lambda: LateralColour((np.nan,)),
        lambda: LateralColour(reference=0.0),
        lambda: LensCamera(0, 2, 1.0, 1.0, 0.0, 0.0),
        lambda: LensCamera(2, 2, -1.0, 1.0, 0.0, 0.0),
        lambda: LensCamera(2, 2, 1.0, 1.0, np.nan, 0.0),
    ],
)
def test_lenses_that_cannot_be(make):
    with pytest.raises(InputError):
        make()
