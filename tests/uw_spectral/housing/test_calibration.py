"""Calibration as a user does it: OpenCV in air and in water, and a port of corners."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from underwater_spectral.benchmarks import housing as benchmark
from underwater_spectral.uw_spectral.housing import (
    BrownConrady,
    FlatPort,
    Housing,
)
from underwater_spectral.validation import housing_cases as cases

NM, CAMERA, POSES = cases.MIDDLE, cases.IN_AIR, cases.POSES
PORT = cases.TILTED


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
    found, error = benchmark.port_from_corners(noise)
    assert error < 1e-6 if noise == 0 else error == pytest.approx(noise * np.sqrt(2), rel=0.1)
    assert found.distance == pytest.approx(PORT.distance, abs=distance)
    turned = np.degrees(np.arccos(min(float(found.axis @ PORT.axis), 1.0)))
    assert turned < degrees
