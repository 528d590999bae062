"""Calibration as a user does it: OpenCV in air and in water, and a port of corners."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.benchmarks import _housing_cases as cases
from underwater_spectral.uw_spectral.housing import (
    GLASSES,
    BrownConrady,
    FlatPort,
    Housing,
    LensCamera,
    SeaWater,
)

NM = 550.0
CAMERA = LensCamera(
    1920, 1080, 1400.0, 1395.0, 955.0, 548.0, BrownConrady(-0.12, 0.05, 1e-3, -5e-4)
)
PORT = FlatPort.tilted(0.035, 0.008, GLASSES["BK7"], degrees=3.0, towards=120.0)
POSES = cases.poses(14, 0.5, 1.6)


def test_in_air_opencv_returns_the_camera():
    pictures = [CAMERA.project(cases.placed(pose)) for pose in POSES]
    found, error, _ = cases.calibrated(CAMERA, pictures)
    assert error < 1e-3
    for name in ("fx", "fy", "cx", "cy"):
        assert getattr(found, name) == pytest.approx(getattr(CAMERA, name), abs=0.05)
    assert isinstance(found.lens, BrownConrady)
    for name, within in (("k1", 1e-3), ("k2", 1e-2), ("p1", 1e-4), ("p2", 1e-4)):
        assert getattr(found.lens, name) == pytest.approx(getattr(CAMERA.lens, name), abs=within)


def test_in_water_opencv_returns_the_known_bias():
    """Focal length times n, and pincushion: x = f n tan θ (1 + (n² - 1)/2 tan² θ) far away.

    A pinhole does not fit it: P. Agrafiotis & A. Georgopoulos, ISPRS Archives XL-5/W5 (2015).
    """
    plain = dataclasses.replace(CAMERA, lens=BrownConrady())
    housing = Housing(plain, FlatPort(1e-4, 0.0))
    n = float(housing.water.refractive_index(NM))
    pictures = [housing.project(cases.placed(pose), NM) for pose in POSES]
    found, error, _ = cases.calibrated(plain, pictures)
    assert error < 0.1
    assert found.fx == pytest.approx(1400.0 * n, rel=2e-3)
    assert isinstance(found.lens, BrownConrady)
    assert found.lens.k1 == pytest.approx(0.5 * (n**2 - 1.0), rel=0.1)


@pytest.mark.parametrize(("noise", "distance", "degrees"), [(0.0, 1e-7, 1e-5), (0.05, 1e-3, 0.1)])
def test_a_refractive_calibration_recovers_the_port(noise, distance, degrees):
    housing = Housing(CAMERA, PORT, SeaWater(20.0, 10.0))
    rng = np.random.default_rng(3)
    pictures = [housing.project(cases.placed(pose), NM) for pose in POSES]
    pictures = [picture + noise * rng.standard_normal(picture.shape) for picture in pictures]
    # The start: poses of a pinhole calibration in water, and a port straight ahead.
    _, _, start = cases.calibrated(CAMERA, pictures)
    guess = dataclasses.replace(housing, port=FlatPort(0.01, 0.008))
    found, error = cases.calibrated_port(guess, pictures, start, NM)
    assert error < 1e-6 if noise == 0 else error == pytest.approx(noise * np.sqrt(2), rel=0.1)
    assert found.distance == pytest.approx(PORT.distance, abs=distance)
    turned = np.degrees(np.arccos(min(float(found.axis @ PORT.axis), 1.0)))
    assert turned < degrees
