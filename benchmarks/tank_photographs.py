"""Photographs of a chart in a tank of known visibility, and ours of the same water.

Reads the folder that the environment variable UW_PHOTOGRAPHS names, a copy of the repository
JOU-UIP/TankImage-I: its terms are for education and research, nothing of it is part of this.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from ..datasets.applied_pictures import AppliedSettings, PictureFilter
from ..datasets.camera import PinholeCamera
from ..datasets.picture_codes import read_rgb
from ..uw_spectral.imaging import (
    Description,
    FloorDescription,
    SurfaceDescription,
    WaterDescription,
)
from ..uw_spectral.spectra.reflectance import colorchecker_patches, colorchecker_reflectance
from ..uw_spectral.water.named import parse_uniform_water
from .runner import Ask, Page, Target, table

Array = NDArray[np.float64]
# Middles of the black and of the white patch, pixels, by distance in cm.
_PLACES = {
    ("Clear", 325): {
        50: (192, 140, 740, 129), 60: (301, 192, 693, 184), 70: (342, 217, 656, 209),
        80: (372, 235, 631, 227), 90: (402, 245, 619, 239), 100: (409, 250, 606, 245),
        110: (424, 259, 601, 254), 120: (439, 262, 603, 257),
    },
    ("Mid", 182): {
        50: (187, 162, 750, 144), 60: (275, 204, 700, 190), 70: (307, 227, 654, 217),
        80: (372, 247, 656, 239), 90: (401, 259, 641, 254), 100: (419, 267, 624, 262),
        110: (431, 277, 618, 272), 120: (447, 282, 614, 277),
    },
    ("Turbid", 85): {
        50: (275, 147, 731, 170), 60: (339, 182, 701, 199), 70: (362, 215, 659, 225),
        80: (377, 232, 633, 242),
    },
}  # fmt: skip
_GREYS = colorchecker_patches()[:-7:-1]  # from black to white
_GREEN, _CLIPPED, _MIDDLE = 1, 0.985, 0.17
_GAMMAS = (1.8, 2.2, 2.4)
_PITCH, _HEIGHT, _FRAME = 0.0406, 0.02, 0.03  # m, of patches; half of one; its black frame
_DEPTH, _FLOOR, _SAND = 0.45, 0.9, "0.3"
_BLACK_DISK = 4.8  # c y, Davies-Colley (1988)
_NM = 530.0
_WATERS = {"minerals": "bio:minerals={:.5f}", "phytoplankton": "bio:chl={:.5f},cdom=0.1"}
_CAMERA = PinholeCamera(480, 288, 387.0, 387.0, 240.0, 144.0)


def _reflectances() -> Array:
    return np.array([float(colorchecker_reflectance(name).at([_NM])[0]) for name in _GREYS])


def _codes(folder: Path, kind: str, visibility: int) -> tuple[Array, Array]:
    """Greys of a set, (pictures, 6), and how many pixels patches are apart, (pictures,)."""
    codes, apart = [], []
    for distance, (x0, y0, x5, y5) in _PLACES[kind, visibility].items():
        name = f"ColorChart_{visibility}_{distance}_natural.bmp"
        picture = read_rgb(folder / kind / "ColorChart_natural" / name)[..., _GREEN] / 255.0
        step = np.hypot(x5 - x0, y5 - y0) / 5
        half, row = max(2, round(_MIDDLE * step)), []
        for x, y in zip(np.linspace(x0, x5, 6), np.linspace(y0, y5, 6), strict=True):
            cut = picture[round(y) - half : round(y) + half + 1,
                          round(x) - half : round(x) + half + 1]  # fmt: skip
            row.append(np.median(cut))
        codes.append(row)
        apart.append(step)
    return np.array(codes), np.array(apart)


def _veil(values: Array, reflectances: Array) -> float:
    """What is seen of black over what is seen of white: the exposure is not in it."""
    there = values < _CLIPPED
    slope, black = np.polyfit(reflectances[there], values[there], 1)
    return float(black / slope)


def _attenuation(veils: Sequence[float], P: Array) -> float:
    """C of the veil k (e^(cP) - 1), 1/m: the light that is left falls as e^(-cP)."""
    found = np.linspace(0.05, 12.0, 2400)
    shape = np.log(np.expm1(found[:, None] * P))
    off = np.log(veils) - shape
    return float(found[off.var(axis=1).argmin()])


def _ours(c: float, kind: str, P: Array, *, blur: bool) -> float:
    """The same of pictures of a filter, in a water that attenuates so much."""

    def attenuation(amount: float) -> float:
        water = parse_uniform_water(_WATERS[kind].format(amount))
        return float((water.a([_NM]) + water.b([_NM]))[0])

    amount = brentq(lambda x: attenuation(x) - c, 1e-3, 100.0)
    sea = Description(
        WaterDescription(_WATERS[kind].format(amount)), surface=SurfaceDescription("flat"),
        floor=FloorDescription(_FLOOR, _SAND),
    )  # fmt: skip
    water = PictureFilter(AppliedSettings(sea, depth=_DEPTH, blur=blur))
    reflectances, veils = _reflectances(), []
    y, x = np.mgrid[: _CAMERA.height, : _CAMERA.width]
    for z in P:
        X, Y = (x - _CAMERA.cx) / _CAMERA.fx * z, (y - _CAMERA.cy) / _CAMERA.fy * z
        place = np.floor(X / _PITCH + 3).astype(int)
        inside = (place >= 0) & (place < 6) & (abs(Y) < _HEIGHT)
        dry = np.where(inside, reflectances[place.clip(0, 5)], _FRAME)
        wet = water.picture(np.repeat(dry[..., None], 3, axis=2), np.full(dry.shape, z), _CAMERA)
        along = X / _PITCH + 2.5
        near = (abs(Y) < 0.3 * _HEIGHT) & (abs(along - np.round(along)) < 0.15)
        seen = [wet[near & (place == k), _GREEN].mean() for k in range(6)]
        veils.append(_veil(np.array(seen) * (0.5 / max(seen)), reflectances))
    return _attenuation(veils, P)


def measure(_: Ask) -> Mapping[str, object]:
    """Read the photographs, and make ours."""
    folder = Path(os.environ.get("UW_PHOTOGRAPHS", ""))
    if not (folder / "Clear").is_dir():
        raise SystemExit("set UW_PHOTOGRAPHS to a copy of github.com/JOU-UIP/TankImage-I")
    sets = {key: _codes(folder, *key) for key in _PLACES}
    distances = {key: np.array(list(places)) / 100.0 for key, places in _PLACES.items()}
    # The chart's size tells where distances begin: behind the port.
    apart = np.concatenate([each for _, each in sets.values()])
    slope, begin = np.polyfit(np.concatenate(list(distances.values())), 1.0 / apart, 1)
    before = -begin / slope
    reflectances, rows, off = _reflectances(), [], []
    for key, (codes, _) in sets.items():
        P, c = distances[key] - before, _BLACK_DISK / (key[1] / 100.0)
        linear = [np.where(codes < _CLIPPED, codes**g, 1.0) for g in _GAMMAS]
        seen = [_attenuation([_veil(row, reflectances) for row in x], P) for x in linear]
        ours = {
            (kind, blur): _ours(c, kind, P, blur=blur) for kind in _WATERS for blur in (False, True)
        }
        rows.append([key[0].lower(), f"{key[1]} cm", f"{c:.2f}", *(f"{x:.2f}" for x in seen),
                     *(f"{x:.2f}" for x in ours.values())])  # fmt: skip
        off.append(abs(ours["minerals", True] / seen[1] - 1.0))
    heads = [f"{kind}{', F' * blur}" for kind in _WATERS for blur in (False, True)]
    return {
        "rows": table(("", "visibility", "c", *(f"γ {g:g}" for g in _GAMMAS), *heads), rows),
        "before": 100.0 * before, "middle": float(np.median(off)), "worst": max(off),
    }  # fmt: skip


PAGE = Page(
    "Photographs of a chart in a tank",
    """
JOU-UIP/TankImage-I (Underwater Vision Laboratory, Jiangsu Ocean University): a ColorChecker at .5
to 1.2 m in a tank of 2.5 × 1 m, .45 m deep, by daylight, in three waters whose visibility a black
disk told: c = 4.8/V (Davies-Colley 1988). Nothing of it is part of this project; the command reads
a copy that the environment variable UW_PHOTOGRAPHS names.

From each photograph the six greys give what is seen of black over what is seen of white, in which
no exposure is; over distance it grows as k (e^(cP) - 1). This c, 1/m, green, by the γ that the
camera's codes are taken to have (its curve is not published), and of our own pictures
(`PictureFilter`) of the chart in water of that c at {nm:g} nm, without and with light scattered
forward (*F*):

{rows}

- The disk's c is met in no column of turbid water: patches of 4 cm at .5 m and more still get the
  light that was scattered by a few degrees. Pictures with it do as photographs do, those without
  do not; how much depends on what floats in the tank, which nobody tells.
- Clear water: its veil comes from the bright bottom and walls, which are not in our water.
- Distances begin {before:.0f} cm behind the camera's pupil, as the size of the chart has it.
- Not compared: colours (sensitivities are not published), the pictures by LED (burnt out).
""",
    (
        Target("c of pictures (minerals, F) off photographs' at γ 2.2, median", "middle", 0.2),
        Target("the same, worst of three waters", "worst", 0.3),
    ),
    {"nm": _NM},
)
