"""Ports and lenses against least time, formulas, boards and calibrations; writes its page.

``python3 dev.py run -m benchmarks housing`` writes docs/measured/housing.md.
"""

from __future__ import annotations

import dataclasses
import math
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.housing import (
    BrownConrady,
    DomePort,
    FlatPort,
    Housing,
    KannalaBrandt,
    LateralColour,
    LensCamera,
    PinholeView,
    SeaWater,
    field_needed,
    focus_distance,
    seen_places,
    viewpoint,
    warped,
)
from . import _housing_cases as cases

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parent.parent
NEAREST = 0.4
BANDS = (440.0, 540.0, 620.0)
_BROWN = LensCamera(
    1920, 1080, 1400.0, 1400.0, 950.0, 545.0, BrownConrady(-0.1, 0.02), LateralColour((2e-3,))
)
_FISHEYE = LensCamera(1920, 1080, 1080.0, 1080.0, 960.0, 540.0, KannalaBrandt(0.01))
WARPED = {
    "flat, Brown-Conrady, lateral colour": Housing(_BROWN, cases.PORTS["flat, 8 mm BK7"]),
    "flat, tilted 20°": Housing(cases.CAMERA, cases.PORTS["flat, 20 mm acrylic, tilted 20°"]),
    "dome decentred, fisheye": Housing(_FISHEYE, cases.PORTS["dome, decentred to all sides"]),
}


def traced() -> Array:
    """Largest errors against least time: pixels, metres that rays pass by, pixels and back."""
    rows = []
    for port in cases.PORTS.values():
        housing = Housing(cases.CAMERA, port, cases.WATER)
        found = [cases.errors(housing, way, nm) for way in cases.DISTANCES for nm in cases.NM]
        pixels, metres = np.max(found, axis=0)
        centres = cases.CAMERA.pixel_centres()[::30, ::30]
        back = 0.0
        for nm in cases.NM:
            origins, w = housing.ray_in_water(centres, nm)
            again = housing.project(origins + 2.0 * w, nm)
            back = max(back, float(np.abs(again - centres).max()))
        rows.append((pixels, metres, back))
    return np.max(rows, axis=0)


def polynomials() -> tuple[float, float]:
    """Largest errors, pixels, against the equations of fourth and of twelfth degree."""
    worst = []
    for thickness in (0.0, 0.02):
        housing = Housing(cases.CAMERA, FlatPort(0.03, thickness))
        port, errors = housing.port, []
        assert isinstance(port, FlatPort)
        for nm in cases.NM:
            indices = [float(x.refractive_index(nm)) for x in (port.glass, housing.water)]
            for z, r in ((0.5, 0.2), (2.0, 1.5), (10.0, 1.0)):
                x, _ = housing.project([r, 0.0, 0.03 + thickness + z], nm)
                q = cases.polynomial_tangent(port, z, r, *indices)
                errors.append(abs(float(x) - cases.CAMERA.cx - cases.CAMERA.fx * q))
        worst.append(max(errors))
    return worst[0], worst[1]


def effects() -> str:
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
        rows.append(
            f"| {name} | {larger:.3f} | {angle:.1f}° | {colour:.1f} | {behind:.1f} | {focus} "
            f"| {100 * passed[0]:.1f}/{100 * passed[1]:.1f} |"
        )
    return "\n".join(rows)


def pictures() -> str:
    """Rows of errors of warped pictures of boards, Full HD."""
    rows = []
    for name, housing in WARPED.items():
        view = field_needed(housing, NEAREST, BANDS)
        depth, _, points = cases.view_of_boards(view)
        centres, errors, hidden, seconds = housing.camera.pixel_centres(), [], [], []
        for nm in BANDS:
            start = time.perf_counter()
            seen = seen_places(housing, view, depth, nm)
            seconds.append(time.perf_counter() - start)
            origins, w = housing.ray_in_water(centres, nm)
            distance, board = cases.cast(origins, w)
            inner = ~cases.edges(board)
            missed = np.linalg.norm(housing.project(seen.points, nm) - centres, axis=-1)
            wrong = np.abs(seen.distances / distance - 1.0) > 1e-3
            errors.append((missed[inner].max(), wrong.mean()))
            hidden.append(seen.hidden.mean())
        shift = picture_shift(housing, view)
        del points
        pixel, wrong = np.max(errors, axis=0)
        grown = view.camera.width * view.camera.height / (1920 * 1080)
        rows.append(
            f"| {name} | {pixel:.0e} | {shift:.3f} | {100 * wrong:.3f} % | "
            f"{100 * max(hidden):.3f} % | {grown:.2f} | {np.mean(seconds):.1f} |"
        )
    return "\n".join(rows)


def picture_shift(housing: Housing, view: PinholeView) -> float:
    """Largest shift of what a warped picture shows of the near boards, pixels."""
    depth, _, points = cases.view_of_boards(view)
    picture = cases.painted(points)[..., None].repeat(len(BANDS), axis=-1)
    found = warped(picture, depth, housing, view, BANDS)
    worst = 0.0
    for band, nm in enumerate(BANDS):
        origins, w = housing.ray_in_water(housing.camera.pixel_centres(), nm)
        distance, board = cases.cast(origins, w)
        expected = cases.painted(origins + distance[..., None] * w)
        near = ~cases.edges(board) & (board > 0)
        shift = cases.shift(expected, found[..., band] - expected, near)
        worst = max(worst, float(np.abs(shift).max()))
    return worst


def calibrations() -> str:
    """Rows of calibrations by OpenCV and of the port's."""
    air = [cases.IN_AIR.project(cases.placed(pose)) for pose in cases.POSES]
    found, error, _ = cases.calibrated(cases.IN_AIR, air)
    rows = [
        f"| in air, OpenCV | f {found.fx:.2f} (1400), k1 {_k1(found):.4f} (-0.12) | {error:.1e} |"
    ]
    plain = dataclasses.replace(cases.IN_AIR, lens=BrownConrady())
    for label, port in (("1 mm", FlatPort(1e-3, 0.0)), ("50 mm", FlatPort(0.05, 0.008))):
        water = Housing(plain, port)
        n = float(water.water.refractive_index(cases.MIDDLE))
        corners = [water.project(cases.placed(pose), cases.MIDDLE) for pose in cases.POSES]
        found, error, _ = cases.calibrated(plain, corners)
        rows.append(
            f"| flat port {label} away, OpenCV | f × {found.fx / plain.fx:.4f} (n "
            f"{n:.4f}), k1 {_k1(found):+.3f} ({0.5 * (n * n - 1):.3f} far away) "
            f"| {error:.3f} |"
        )
    for noise in (0.0, 0.05, 0.2):
        port, error = port_from_corners(noise)
        turned = math.degrees(math.acos(min(float(port.axis @ cases.TILTED.axis), 1.0)))
        away = 1000.0 * abs(port.distance - cases.TILTED.distance)
        rows.append(
            f"| tilted port, noise {noise:g} pixels | off by "
            f"{away:.1e} of 35 mm, {turned:.1e} of 3° | {error:.1e} |"
        )
    return "\n".join(rows)


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


def _listed(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _k1(camera: LensCamera) -> float:
    assert isinstance(camera.lens, BrownConrady)
    return camera.lens.k1


def focus_error() -> float:
    """Largest relative error of the paraxial image against two traced rays."""
    worst = 0.0
    for port in cases.PORTS.values():
        if isinstance(port, DomePort) and not any(port.pupil[:2]):
            for distance in cases.DISTANCES:
                traced = cases.traced_focus(port, distance, 550.0)
                housing = Housing(cases.CAMERA, port)
                paraxial = float(focus_distance(housing, distance, 550.0))
                worst = max(worst, abs(paraxial / traced - 1.0))
    return worst


def main(_arguments: list[str]) -> None:
    """Measure everything and write the page."""
    worst, (quartic, twelfth) = traced(), polynomials()
    text = f"""# Through a housing

Written by `python3 dev.py run -m benchmarks housing`.

Flat and dome ports of `uw_spectral.housing`, without Blender: a Full HD camera of focal length
1400 pixels (72° in air), sea water, {_listed(cases.NM)} nm, points at {_listed(cases.DISTANCES)}
m. Target: .1 pixel.

## Rays against least time
Of eight ports, pixels of points are at most {worst[0]:.0e} pixels off those by the path of least
time (Fermat's principle), rays of these pixels pass the points by {worst[1]:.0e} m, and pixel →
ray → point → pixel changes {worst[2]:.0e} pixels. The quartic of Agrawal et al. (2012) is met
within {quartic:.0e} pixels, their equation of twelfth degree within {twelfth:.0e}, the paraxial
image behind domes within {focus_error():.0e} of its distance; Treibitz et al. (2012) and She et
al. (2022) are in `tests/uw_spectral/housing`.

## What ports do
Magnification; angle in water of the lower right corner; red against blue there in pixels at 2 m;
viewpoint behind the pupil; focus for .5 m and ∞; light let through, middle/corner in %.

| port | magnification | corner | colour | viewpoint, mm | .5 m, ∞ | light |
|---|---|---|---|---|---|---|
{effects()}

## Pictures
Boards at 3, 1 and .5 m, drawn by a pinhole (`field_needed`) and warped by depth, against rays:
place of points away from edges, shift of the pattern, pixels whose distance is off by more than
.1 %, not seen by the pinhole; pixels over Full HD; seconds for a band.

| housing | place, pixels | shift, pixels | wrong | hidden | pixels | s |
|---|---|---|---|---|---|---|
{pictures()}

## Calibration
Corners of a board of 9 × 6 in {len(cases.POSES)} poses, .5 to 1.6 m. In water a pinhole has n
times the focal length and pincushion distortion that depends on the distance.

| | result | error, pixels |
|---|---|---|
{calibrations()}

Pictures that reach farther than 80° from the axis in the water are refused; dirt, mirror images,
the softness of a dome's edges and frames are left out.
"""
    (ROOT / "docs" / "measured" / "housing.md").write_text(text, encoding="utf-8")
    print(text)
