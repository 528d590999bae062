"""What ports do to pictures, and what calibrations make of them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.housing import (
    BrownConrady,
    FlatPort,
    Housing,
    LensCamera,
    SeaWater,
    focus_distance,
    viewpoint,
)
from ..validation import housing_cases as cases
from .runner import Ask, Page, table

Array = NDArray[np.float64]


def effects() -> list[list[str]]:
    """Rows of what ports do to a picture."""
    rows, camera = [], cases.CAMERA
    corner = np.array([[1919.5, 1079.5]])
    middle = np.array([[camera.cx, camera.cy], [camera.cx + 1.0, camera.cy]])
    for name, port in cases.PORTS.items():
        housing = Housing(camera, port)
        (_, ahead), (_, w) = (housing.ray_in_water(x, 550.0) for x in (middle, corner))
        larger = 1.0 / camera.fx / np.linalg.norm(np.cross(ahead[0], ahead[1]))
        origin, there = housing.ray_in_water(corner, 550.0)
        blue, red = (housing.project(origin + 2.0 * there, nm)[0] for nm in (450.0, 650.0))
        colour = np.linalg.norm(red - blue)
        behind = round(-1000.0 * viewpoint(housing)[2], 1) + 0.0
        passed = housing.transmittance(np.concatenate([middle[:1], corner]), 550.0)
        angle = math.degrees(math.acos(float(w[0, 2])))
        focus = ", ".join(
            "∞" if not math.isfinite(x) else f"{x:.2f}"
            for x in focus_distance(housing, [0.5, math.inf], 550.0).tolist()
        )
        light = "/".join(f"{100 * x:.1f}" for x in passed)
        cells = (f"{larger:.3f}", f"{angle:.1f}°", f"{colour:.1f}", f"{behind:.1f}", focus, light)
        rows.append([name, *cells])
    return rows


def calibrations() -> list[list[str]]:
    """Rows of calibrations by OpenCV and of the port's."""
    air = [cases.IN_AIR.project(cases.placed(pose)) for pose in cases.POSES]
    found, error, _ = cases.calibrated(cases.IN_AIR, air)
    said = f"f {found.fx:.2f} (1400), k1 {_k1(found):.4f} (-0.12)"
    rows = [["in air, OpenCV", said, f"{error:.1e}"]]
    plain = dataclasses.replace(cases.IN_AIR, lens=BrownConrady())
    for label, port in (("1 mm", FlatPort(1e-3, 0.0)), ("50 mm", FlatPort(0.05, 0.008))):
        water = Housing(plain, port)
        n = float(water.water.refractive_index(cases.MIDDLE))
        corners = [water.project(cases.placed(pose), cases.MIDDLE) for pose in cases.POSES]
        found, error, _ = cases.calibrated(plain, corners)
        said = f"f × {found.fx / plain.fx:.4f} (n {n:.4f}), k1 {_k1(found):+.3f} "
        said += f"({0.5 * (n * n - 1):.3f} far away)"
        rows.append([f"flat port {label} away, OpenCV", said, f"{error:.3f}"])
    for noise in (0.0, 0.05, 0.2):
        port, error = port_from_corners(noise)
        turned = math.degrees(math.acos(min(float(port.axis @ cases.TILTED.axis), 1.0)))
        away = 1000.0 * abs(port.distance - cases.TILTED.distance)
        said = f"off by {away:.1e} of 35 mm, {turned:.1e} of 3°"
        rows.append([f"tilted port, noise {noise:g} pixels", said, f"{error:.1e}"])
    return rows


def port_from_corners(noise: float) -> tuple[FlatPort, float]:
    """Calibrate the tilted port of noisy corners; also the root mean square error, pixels."""
    housing = Housing(cases.IN_AIR, cases.TILTED, SeaWater(20.0, 10.0))
    rng = np.random.default_rng(3)
    corners = [housing.project(cases.placed(pose), cases.MIDDLE) for pose in cases.POSES]
    corners = [picture + noise * rng.standard_normal(picture.shape) for picture in corners]
    # The start: poses of a pinhole calibration in water, and a port straight ahead.
    _, _, start = cases.calibrated(cases.IN_AIR, corners)
    guess = dataclasses.replace(housing, port=FlatPort(0.01, 0.008))
    return cases.calibrated_port(guess, corners, start, cases.MIDDLE)


def _k1(camera: LensCamera) -> float:
    assert isinstance(camera.lens, BrownConrady)
    return camera.lens.k1


def measure(_: Ask) -> Mapping[str, object]:
    """Trace and calibrate."""
    heads = ("port", "magnification", "corner", "colour", "viewpoint, mm", ".5 m, ∞", "light")
    return {"ports": table(heads, effects()),
            "calibrations": table(("", "result", "error, pixels"), calibrations())}  # fmt: skip


PAGE = Page(
    "Through a housing",
    """
Flat and dome ports of `uw_spectral.housing`, without Blender: a Full HD camera of focal length 1400
pixels (72° in air), sea water, 400, 550, 700 nm, points at 0.5, 2, 10 m.

Rays are held against the path of least time (Fermat's principle), the quartic of Agrawal et al.
(2012), their equation of twelfth degree, Treibitz et al. (2012) and She et al. (2022), warped
pictures of boards against rays, in `tests/uw_spectral/housing`: pixels agree to 1e-9, places of a
picture to 1e-10, with 0.03 % of pixels at edges wrong.

## What ports do
Magnification; angle in water of the lower right corner; red against blue there in pixels at 2 m;
viewpoint behind the pupil; focus for .5 m and ∞; light let through, middle/corner in %.

{ports}

## Calibration
Corners of a board of 9 × 6 in 14 poses, .5 to 1.6 m. In water a pinhole has n times the focal
length and pincushion distortion that depends on the distance.

{calibrations}

Pictures that reach farther than 80° from the axis in the water are refused; dirt, mirror images,
the softness of a dome's edges and frames are left out.
""",
)
