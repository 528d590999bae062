"""Mitsuba 3 against the photons of lamps: two rooms in one band, so that a miss is a miss.

    python3 dev.py run -m benchmarks mitsuba_lamps [--samples N] [--seeds N] [--photons N]

Both get the same coefficients and the same phase function, its peak cut off, and spots with a sharp
edge. Writes docs/measured/mitsuba_lamps.md. Takes about ten minutes.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..settings.render_plan import make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.profile import SpotProfile
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.water.phase import BandPhase
from . import _lamp_photons, _lamp_room, grey_scene
from ._lamp_page import BLOCK, BLUR, COARSER, CUT
from ._lamp_scenes import FIELD_OF_VIEW
from ._shade_scenes import HEIGHT, WIDTH
from .mitsuba_reference import load_mitsuba, mean_and_error

Array = NDArray[np.float64]
_WATER, _BAND = "II", 1
_FLOOR = -1.2  # m, from the camera
_REFLECTANCE = np.array([0.4, 0.3])  # of floor and ball
_SHARP = 1e-3  # blend of a spot
_FAR = 60.0  # m; half the width of Mitsuba's water
_COSINES = 2**16 + 1
_MEDIAN_OF_NORMAL = 0.674  # of its size, standard deviations
_RAYS = 400  # of a block, for what is scattered or thrown back once
_ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Case:
    """A spot of intensity 1 and a ball over a floor, as the camera at the origin sees them.

    Attributes
    ----------
    title : str
    lamp, axis : tuple of float
        Place, m; unit vector.
    cone : float
        Full angle, degrees.
    ball : tuple of float
        Middle and radius, m.
    """

    title: str
    lamp: tuple[float, float, float]
    axis: tuple[float, float, float]
    cone: float
    ball: tuple[float, float, float, float]

    def as_lamp(self) -> Lamp:
        """The lamp of the photons."""
        profile = SpotProfile(math.radians(self.cone), _SHARP)
        return Lamp(self.lamp, self.axis, np.ones(1), profile, 1e-3)

    def as_room(self) -> _lamp_room.Room:
        """The room of the photons."""
        *middle, radius = self.ball
        ball = np.array([[*middle, radius, radius, radius]])
        return _lamp_room.Room(_FLOOR, ball, np.zeros((0, 6)), np.zeros((2, 3)))


_DIAGONAL = math.sqrt(0.5)
CASES = (
    Case(
        "torch across", (0.9, 5.0, 0.5), (-_DIAGONAL, -_DIAGONAL, 0.0), 50.0, (0.6, 3.2, -0.5, 0.6)
    ),
    Case("lamp behind a ball", (0.1, 5.2, 0.1), (0.0, -1.0, 0.0), 90.0, (0.1, 4.0, 0.0, 0.35)),
)


@dataclass(frozen=True, eq=False)
class Water:
    """The water of both: absorption and scattering, 1/m, and its phase function."""

    a: float
    b: float
    phase: _lamp_photons.PhaseTables


@dataclass(frozen=True, eq=False)
class Comparison:
    """Independent pictures of a case in blocks, (k, h, w), and seconds: photons, Mitsuba."""

    title: str
    photons: Array
    mitsuba: Array
    seconds: tuple[float, float]

    def row(self) -> str:
        """Write it as cells of a table."""
        both = self.photons, self.mitsuba
        (one, doubt), (other, others) = (mean_and_error(x.mean(axis=(1, 2))) for x in both)
        ratio, error = one / other, one / other * math.hypot(doubt / one, others / other)
        cells = [f"{100 * (ratio - 1):+.1f}±{100 * error:.1f} %"]
        for sizes in ((1, 1), COARSER):
            cells += [*_differences(*(_together(x, sizes) for x in both))]
        photons, mitsuba = self.seconds
        return f"| {self.title} | {' | '.join(cells)} | {photons:.0f}/{mitsuba:.0f} |"


def _together(pictures: Array, sizes: Sequence[int]) -> Array:
    count, rows, columns = pictures.shape
    down, across = sizes
    shape = (count, rows // down, down, columns // across, across)
    return pictures.reshape(shape).mean(axis=(2, 4))


def _differences(photons: Array, mitsuba: Array) -> tuple[str, str]:
    """Median and 95 % of relative differences, and what of the median noise alone would make."""
    (one, doubt), (other, others) = (mean_and_error(x) for x in (photons, mitsuba))
    off = np.abs(one / other - 1.0)
    noise = _MEDIAN_OF_NORMAL * np.hypot(doubt, others) / other
    size = f"{100 * np.median(off):.1f}/{100 * np.quantile(off, 0.95):.1f} %"
    return size, f"{100 * np.median(noise):.1f} %"


def water() -> Water:
    """Return the water in its band."""
    plan = make_plan(SceneSettings(water=f"jerlov:{_WATER}", bands=3, surface="flat"))
    one = BandPhase(plan.phase.components, plan.phase.weights[:, _BAND : _BAND + 1])
    phase, kept = _lamp_room.cut(_lamp_photons.tables_of(one), CUT)
    column = plan.column
    return Water(float(column.absorption[_BAND]), kept * float(column.scattering[_BAND]), phase)


def by_photons(case: Case, water: Water, photons: int, seed: int) -> Array:
    """Radiance of blocks by batch, shape (k, h, w)."""
    scale = 2.0 * math.tan(FIELD_OF_VIEW / 2.0) / WIDTH
    view = _lamp_room.View(HEIGHT // BLOCK, WIDTH // BLOCK, BLOCK * scale, BLUR)
    lamps, room, scattered = [case.as_lamp()], case.as_room(), (water.a, water.b)
    counts = photons, _RAYS
    found = _lamp_room.traced(view, lamps, scattered, water.phase, room, _REFLECTANCE, seed, counts)
    return np.moveaxis(found.sum(axis=2), -1, 0)


def _scene(mitsuba: ModuleType, case: Case, water: Water) -> dict:
    transform = mitsuba.ScalarTransform4f
    s2 = (1.0 - np.linspace(-1.0, 1.0, _COSINES)) / 2.0
    values = ",".join(f"{v:.8g}" for v in water.phase.per_steradian(s2))
    c = water.a + water.b
    *middle, radius = case.ball
    target = [x + w for x, w in zip(case.lamp, case.axis, strict=True)]
    floor, ball = (
        {"type": "diffuse", "reflectance": {"type": "uniform", "value": float(r)}}
        for r in _REFLECTANCE
    )
    return {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1},
        "water": {
            "type": "cube",
            "to_world": transform().translate([0.0, 0.0, _FLOOR - 1.0 + _FAR]).scale(_FAR),
            "bsdf": {"type": "null"},
            "interior": {
                "type": "homogeneous", "id": "medium", "sigma_t": c, "albedo": water.b / c,
                "phase": {"type": "tabphase", "values": values},
            },
        },
        "floor": {
            "type": "rectangle",
            "to_world": transform().translate([0.0, 0.0, _FLOOR]).scale(2.0 * _FAR),
            "bsdf": floor,
        },
        "ball": {"type": "sphere", "center": middle, "radius": radius, "bsdf": ball},
        "lamp": {
            "type": "spot",
            "to_world": transform().look_at(
                origin=list(case.lamp), target=target, up=[0.0, 0.0, 1.0]
            ),
            "intensity": 1.0,
            "cutoff_angle": case.cone / 2.0,
            "beam_width": case.cone / 2.0 * (1.0 - _SHARP),
        },
        "camera": {
            "type": "perspective",
            "fov": math.degrees(FIELD_OF_VIEW),
            "fov_axis": "x",
            "near_clip": 1e-5,
            "to_world": transform().look_at(
                origin=[0.0, 0.0, 0.0], target=[0.0, 1.0, 0.0], up=[0.0, 0.0, 1.0]
            ),
            "medium": {"type": "ref", "id": "medium"},
            "film": {
                "type": "hdrfilm", "width": WIDTH, "height": HEIGHT,
                "pixel_format": "luminance", "component_format": "float32",
                "rfilter": {"type": "box"},
            },
        },
    }  # fmt: skip


def by_mitsuba(case: Case, water: Water, samples: int, seeds: int, variant: str) -> Array:
    """Radiance of blocks by seed, shape (k, h, w)."""
    mitsuba = load_mitsuba(variant)
    scene = mitsuba.load_dict(_scene(mitsuba, case, water))
    images = [np.array(mitsuba.render(scene, spp=samples, seed=seed)) for seed in range(seeds)]
    return np.stack([grey_scene.blocks(image, BLOCK)[..., 0] for image in images])


def report(rows: Sequence[str], options: argparse.Namespace) -> str:
    """Return the page."""
    down, across = (BLOCK * n for n in COARSER)
    table = "\n".join(rows)
    return f"""# Mitsuba 3 against the photons of lamps

Written by `python3 dev.py run -m benchmarks mitsuba_lamps`.

The photons that judge [lamps](lamps.md) (`benchmarks/_lamp_room.py`) against Mitsuba's `volpath`
(`{options.variant}`): one band of Jerlov {_WATER}, a sharp spot, a floor, a ball; {WIDTH} ×
{HEIGHT} pixels in blocks of {BLOCK} × {BLOCK} and of {across} × {down}.
{options.photons * 10 / 1e6:g} million photons, blurred by {BLUR[0]:g} m and more; {options.seeds}
seeds of {options.samples} samples. Photons over Mitsuba less 1 of the picture, then its size in
blocks, median/95 %, and that of noise alone.

| case | picture | blocks | noise | coarse blocks | noise | CPU s |
|---|---|---|---|---|---|---|
{table}

CPU s: photons/Mitsuba. Mitsuba seldom meets places near the lamp, so that its scatter tells too
little there; the photons' blur is in the differences too.
"""


def main(arguments: Sequence[str]) -> None:
    """Compare the cases and write the page."""
    parser = argparse.ArgumentParser(prog="mitsuba_lamps")
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    parser.add_argument("--photons", type=int, default=100_000, help="in each of ten batches")
    parser.add_argument("--samples", type=int, default=512, help="of Mitsuba, per seed")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--variant", default="scalar_rgb")
    options = parser.parse_args(arguments)
    found, rows = water(), []
    for number, case in enumerate(CASES):
        start = time.process_time()
        photons = by_photons(case, found, options.photons, number)
        middle = time.process_time()
        mitsuba = by_mitsuba(case, found, options.samples, options.seeds, options.variant)
        seconds = middle - start, time.process_time() - middle
        rows.append(Comparison(case.title, photons, mitsuba, seconds).row())
        print(rows[-1], flush=True)
    with replacing(options.docs / "mitsuba_lamps.md") as temporary:
        temporary.write_text(report(rows, options), encoding="utf-8")
