"""EEVEE with the solved light field against the solution itself, and against Cycles."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..settings.scene_settings import EXACT
from ..settings.water_settings import DEFAULT_PHASE
from ..tests.node_groups import realtime_probe as probe
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..validation import solved_cases
from ..validation.solved_cases import KINDS
from . import grey_scene
from ._places import sheet
from ._solved_scenes import Scene
from .runner import Ask, Page, spread, table

_CASES = 5
_SEEDS = (1, 2, 3)
_BLOCK = 20
_SMOOTH = "hg:0.924"
_EACH = ("I", 5.0), ("IA", 9.0), ("IB", 5.0), ("II", 3.0), ("1C", 3.0), ("3C", 1.0)
_CLEAR, _TURBID_SAMPLES = ("I", "IA", "IB"), 4
SCENES = (
    *(Scene(*each, sun=sun) for sun in (30.0, 70.0) for each in _EACH),
    Scene("III", 1.0, sun=70.0),
    *(Scene(*each, sky="overcast") for each in (_EACH[3], _EACH[5])),
    *(Scene(*each, objects=True) for each in (_EACH[2], _EACH[3], _EACH[5])),
    *(Scene(*each, forward_peak=EXACT) for each in (_EACH[1], _EACH[2])),
    *(Scene(*each, phase=_SMOOTH) for each in (_EACH[3], _EACH[5])),
)
"""Some are scattered by the exact forward peak, some by a phase function that needs none."""

Errors = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Pictures of a scene in linear RGB: those of Cycles by seed, and by method."""

    scene: Scene
    reference: NDArray[np.float64]
    pictures: dict[str, NDArray[np.float64]]

    @property
    def noise(self) -> float:
        """Standard error of the mean of the reference, as a root mean square of ΔE2000."""
        each, mean = (_blocks(x) for x in (self.reference, self.reference.mean(axis=0)[None]))
        K = len(each)
        return float(np.sqrt((delta_e_CIE2000_images(each, mean) ** 2).mean() / (K - 1)))

    def delta_e(self, name: str) -> float:
        """Root mean square of ΔE2000 over blocks of pixels, the noise taken off."""
        seen, mean = (_blocks(x[None]) for x in (self.pictures[name], self.reference.mean(axis=0)))
        square = (delta_e_CIE2000_images(seen, mean) ** 2).mean() - self.noise**2
        return math.sqrt(max(square, 0.0))

    def luminance(self, name: str) -> tuple[float, float]:
        """Relative error of the mean of green, and its standard error."""
        means = self.reference[..., 1].mean(axis=(1, 2))
        error = means.std(ddof=1) / math.sqrt(len(means)) / means.mean()
        return float(self.pictures[name][..., 1].mean() / means.mean() - 1), float(error)


def _blocks(images: NDArray[np.float64]) -> NDArray[np.float64]:
    """Average over blocks; shape (k, h, w, 3) to (k, blocks, 3)."""
    means = [grey_scene.blocks(np.maximum(image, 0.0), _BLOCK) for image in images]
    return np.stack(means).reshape(len(images), -1, 3)


def _rendered(kinds: int) -> tuple[Errors, Errors]:
    """Errors of EEVEE in the random cases: of open water, and of a square in it."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for kind in range(kinds):
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            for case in solved_cases.cases(kind, _CASES):
                found.append(probe.errors_of_case(case, Path(folder) / "picture.exr"))
    water, square = (np.concatenate(part) for part in zip(*found, strict=True))
    return water, square


def _compared(ask: Ask) -> list[Comparison]:
    """Draw every scene by every method."""
    found = []
    for scene in SCENES[: ask.scenes]:
        count = ask.samples * (1 if scene.water in _CLEAR else _TURBID_SAMPLES)
        place = scene.place(count)
        camera = place.open()
        develop = place.develop(camera)
        traced = ask.kept(scene.title, lambda p=place, c=camera: p.by_cycles(c, _SEEDS))
        pictures = {"solved": develop(place.by_eevee(camera))}
        found.append(Comparison(scene, develop(traced), pictures))
    return found


def _summary(comparisons: list[Comparison]) -> list[list[str]]:
    rows = []
    for name, phase, objects in (
        (f"{DEFAULT_PHASE}, no objects", DEFAULT_PHASE, False),
        (f"{DEFAULT_PHASE}, objects", DEFAULT_PHASE, True),
        (f"{_SMOOTH}, all", _SMOOTH, None),
    ):
        some = [c for c in comparisons
                if c.scene.phase == phase and objects in (None, c.scene.objects)]  # fmt: skip
        if some:
            solved = [c.delta_e("solved") for c in some]
            green, error = max((c.luminance("solved") for c in some), key=lambda pair: abs(pair[0]))
            noise = np.mean([c.noise for c in some])
            numbers = (noise, np.mean(solved), max(solved))
            rows.append([name, *(f"{x:.2f}" for x in numbers),
                         f"{100 * green:+.1f}±{100 * error:.1f} %"])  # fmt: skip
    return rows


def measure(ask: Ask) -> Mapping[str, object]:
    """Render the cases, and the scenes."""
    found = {}
    if ask.scenes:
        found = _compared(ask)
        pictures = {
            c.scene.title: [srgb_encode(np.clip(x, 0.0, 1.0))
                            for x in (c.reference.mean(axis=0), *c.pictures.values())]
            for c in found
        }  # fmt: skip
        sheet(ask.shown("solved_accuracy.jpg"), pictures, ("Cycles", "solved"), across=2)
    errors = dict(zip(("open water", "square in it"), _rendered(ask.kinds), strict=True))
    rows = [[name, *spread(100 * x, ".2g").split("/")] for name, x in errors.items()]
    return {
        "pixels": table(("what", "median", "95 %", "worst"), rows),
        "against": table(("scenes", "noise", "solved", "worst", "green, worst"),
                        _summary(found)),
    }  # fmt: skip


PAGE = Page(
    "The solved light field in EEVEE",
    """
## Pixels against the solution
40 random cases: ten Jerlov types, sun at 0 to 80°, camera at 0.2 to 30 m, deep water and floors,
five phase functions, flat surface and none, three skies; a camera at any tilt looks past a square
of any tilt. Relative errors in % against the discrete ordinates without tables, beyond 10° from the
sun and 1° from the edge of Snell's window; half floats are part of them. The tables alone are in
`tests/uw_spectral/transfer/test_radiance_table.py`.

{pixels}

## Against Cycles
22 scenes: flat surface, floor 3 m below the camera, 3 bands on both sides. Cycles: 3 seeds of
{samples} samples in I, IA, IB and of four times as many in the others, bounded forward peak
([reference_cost.md](reference_cost.md)). Root mean square ΔE2000 of blocks of 20 × 20 of 60 × 40
pixels, the noise taken off; *green*: error of the picture's mean. Path guiding stays off: it makes
Cycles up to 20 % too bright.

{against}

![Cycles, EEVEE solved and, beside it, other forms](solved_accuracy.jpg)
""",
    settings={"samples": 96, "scenes": 99, "kinds": len(KINDS)},
)
