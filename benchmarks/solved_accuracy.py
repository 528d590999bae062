"""EEVEE with the solved light field against the solution itself, and against Cycles.

    python3 dev.py run -m benchmarks solved_accuracy [--samples N] [--keep DIR]

writes docs/measured/solved_accuracy.md and its picture. Pictures of Cycles are kept as
files, so an interrupted run goes on where it stopped.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
import math
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..settings.scene_settings import DEFAULT_PHASE, EXACT
from ..tests.node_groups import realtime_probe as probe
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.transfer.radiance_table import RadianceTable, tabulate
from . import _solved_cases, _solved_scenes, grey_scene
from ._solved_cases import FROM_SUN, KINDS, LightAround
from ._solved_scenes import Scene

_CASES = 5
_ELEVATIONS, _AZIMUTHS, _PATCHES = 20, 15, 8
_SEEDS = (1, 2, 3)
_BLOCK = 20
_SMOOTH = "hg:0.924"
_EACH = ("I", 5.0), ("IA", 9.0), ("IB", 5.0), ("II", 3.0), ("1C", 3.0), ("3C", 1.0)
_CLEAR, _TURBID_SAMPLES = ("I", "IA", "IB"), 4
SCENES = (
    *(Scene(*each, sun=sun) for sun in (30.0, 70.0) for each in _EACH),
    Scene("III", 1.0, sun=70.0),
    *(Scene(*each, sky="overcast") for each in (_EACH[3], _EACH[5])),
    *(Scene(*each, things=True) for each in (_EACH[2], _EACH[3], _EACH[5])),
    *(Scene(*each, forward_peak=EXACT) for each in (_EACH[1], _EACH[2])),
    *(Scene(*each, phase=_SMOOTH) for each in (_EACH[3], _EACH[5])),
)
"""Some are scattered by the exact forward peak, some by a phase function that needs none."""

Errors = NDArray[np.float64]
_TABLES = ("radiance", "irradiance", "image")


def rendered() -> tuple[Errors, Errors]:
    """Errors of EEVEE in the random cases: of open water, and of a square in it."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for kind in range(len(KINDS)):
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            for case in _solved_cases.cases(kind, _CASES):
                found.append(probe.errors_of_case(case, Path(folder) / "picture.exr"))
    water, square = (np.concatenate(part) for part in zip(*found, strict=True))
    return water, square


def tabulated() -> Iterator[tuple[str, Errors]]:
    """Errors of the tables of the random cases, by what of them."""
    found: dict[str, list[Errors]] = {}
    random = np.random.default_rng(1)

    def note(name: str, errors: Errors) -> None:
        found.setdefault(name, []).append(np.ravel(np.abs(errors)))

    for kind in range(len(KINDS)):
        for case in _solved_cases.cases(kind, _CASES):
            column, field, y = case.column, case.field, np.array([case.depth])
            lit = case.lit
            table, sun, mu_s = tabulate(field), column.sun_direction, column.sun_cosine
            short = _half(table)
            mu, turns = random.uniform(-1, 1, _ELEVATIONS), random.uniform(0, math.pi, _AZIMUTHS)
            azimuth = turns + math.atan2(sun[1], sun[0])
            across = np.sqrt(1.0 - mu**2)[:, None]
            w = -across * np.cos(azimuth), -across * np.sin(azimuth), mu[:, None]
            far = -sum(s * part for s, part in zip(sun, w, strict=True))
            far = far < math.cos(math.radians(FROM_SUN))
            L = field.radiance(y, w)[far]
            M = np.moveaxis(field.scattered_on_grid(y, mu, turns)[:, 0], 0, -1)[far]
            looked_up = table.scattered(y, w, sun)[far]
            note("radiance, share of all", ((looked_up - M) / L)[:, lit])
            halved = short.scattered(y, w, sun)[far]
            note("radiance, by half floats", ((halved - looked_up) / L)[:, lit])
            around = LightAround.at(column, case.phase, y)
            beam = column.sun_irradiance / mu_s * np.exp(-field.extinction * y / mu_s)
            normals = random.normal(size=(_PATCHES, 3))
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            for name, several in (("tilted patch", normals), ("underside", [(0.0, 0.0, -1.0)])):
                for n in several:
                    E = table.patch_irradiance(y, n, sun) - around.on_patch(n)
                    note(name, (E / (around.on_patch(n) + max(-(n @ sun), 0.0) * beam))[:, lit])
    for name, errors in found.items():
        yield name, np.concatenate(errors)


def _half(table: RadianceTable) -> RadianceTable:
    """Return a table whose values have been stored as half floats."""
    short = {name: getattr(table, name).astype(np.float16).astype(float) for name in _TABLES}
    return dataclasses.replace(table, **short)


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


def compared(samples: int, keep: Path) -> list[Comparison]:
    """Draw every scene by every method."""
    camera = _solved_scenes.build()
    keep.mkdir(parents=True, exist_ok=True)
    references, drawn = {}, {scene: {} for scene in SCENES}
    for scene in SCENES:
        count = samples * (1 if scene.water in _CLEAR else _TURBID_SAMPLES)
        kept = keep / f"{scene.title.replace(' ', '_')}_{count}.npy"
        if not kept.exists():
            found = _solved_scenes.by_cycles(scene, camera, count, _SEEDS)
            with replacing(kept) as temporary, temporary.open("wb") as file:
                np.save(file, found)
        references[scene] = np.load(kept)
        print(scene.title, flush=True)
    groups = itertools.groupby(
        sorted(SCENES, key=lambda s: (s.phase, s.sky)), lambda s: (s.phase, s.sky)
    )
    for _, group in groups:
        scenes = list(group)
        for scene, image in zip(scenes, _solved_scenes.by_eevee(scenes, camera), strict=True):
            drawn[scene]["solved"] = image
    for scene in SCENES:
        drawn[scene]["papers"] = _solved_scenes.by_papers(scene, camera)
    comparisons = []
    for scene in SCENES:
        develop = scene.plan(1).reduction(scene.depth).apply
        pictures = {name: develop(image) for name, image in drawn[scene].items()}
        comparisons.append(Comparison(scene, develop(references[scene]), pictures))
    return comparisons


def _row(name: str, errors: Errors) -> str:
    cells = " | ".join(f"{100 * np.quantile(errors, q):.2g}" for q in (0.5, 0.95, 1.0))
    return f"| {name} | {cells} |"


def _summary(comparisons: Sequence[Comparison]) -> str:
    lines = ["| scenes | noise | solved | worst | papers | green, worst |", "|---" * 6 + "|"]
    for name, phase, things in (
        (f"{DEFAULT_PHASE}, no things", DEFAULT_PHASE, False),
        (f"{DEFAULT_PHASE}, things", DEFAULT_PHASE, True),
        (f"{_SMOOTH}, all", _SMOOTH, None),
    ):  # fmt: skip
        some = [c for c in comparisons
                if c.scene.phase == phase and things in (None, c.scene.things)]  # fmt: skip
        noise = np.mean([c.noise for c in some])
        solved, papers = ([c.delta_e(name) for c in some] for name in ("solved", "papers"))
        green, error = max((c.luminance("solved") for c in some), key=lambda pair: abs(pair[0]))
        lines.append(
            f"| {name} | {noise:.2f} | {np.mean(solved):.2f} | {max(solved):.2f} "
            f"| {np.mean(papers):.2f} | {100 * green:+.1f}±{100 * error:.1f} % |"
        )
    return "\n".join(lines)


def picture_sheet(comparisons: Sequence[Comparison], path: Path) -> None:
    """Draw the reference and every method, a row per scene."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    titles = ["Cycles", *comparisons[0].pictures]
    figure, axes = plt.subplots(
        len(comparisons), len(titles), figsize=(2 * len(titles), 1.35 * len(comparisons))
    )
    for row, item in zip(axes, comparisons, strict=True):
        row[0].set_ylabel(item.scene.title.replace(", ", "\n"), fontsize=5)
        for axis, image in zip(
            row, (item.reference.mean(axis=0), *item.pictures.values()), strict=True
        ):
            axis.imshow(srgb_encode(np.clip(image, 0.0, 1.0)))
            axis.set(xticks=[], yticks=[])
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title, fontsize=7)
    figure.tight_layout(pad=0.3)
    figure.savefig(path, dpi=60, pil_kwargs={"quality": 90})


def main(arguments: Sequence[str]) -> None:
    """Measure everything and write the report."""
    parser = argparse.ArgumentParser(prog="solved_accuracy")
    parser.add_argument("--samples", type=int, default=96)
    parser.add_argument("--keep", type=Path, default=Path("out/solved_accuracy"))
    options = parser.parse_args(arguments)
    docs = Path(__file__).resolve().parent.parent / "docs" / "measured"
    comparisons = compared(options.samples, options.keep)
    picture_sheet(comparisons, docs / "solved_accuracy.jpg")
    water, square = rendered()
    heads = "| what | median | 95 % | worst |\n|---|---|---|---|"
    pixels = "\n".join([heads, _row("open water", water), _row("square in it", square)])
    tables = "\n".join([heads, *(_row(*each) for each in tabulated())])
    text = f"""# The solved light field in EEVEE

Written by `python3 dev.py run -m benchmarks solved_accuracy`.

## Pixels against the solution
{len(KINDS) * _CASES} random cases: ten Jerlov types, sun at 0 to 80°, camera at 0.2 to 30 m, deep
water and floors, five phase functions, flat surface and none, three skies; a camera at any tilt
looks past a square of any tilt. Relative errors in % against the discrete ordinates without tables,
beyond {FROM_SUN:g}° from the sun and 1° from the edge of Snell's window; half floats are part of
them.

{pixels}

## Tables alone
The same cases in numpy, in %; patches against the radiances from all sides added up.

{tables}

## Against Cycles
{len(SCENES)} scenes: flat surface, floor {_solved_scenes.FLOOR_BELOW:g} m below the camera,
{_solved_scenes.BANDS} bands on both sides. Cycles: {len(_SEEDS)} seeds of {options.samples} samples
in {", ".join(_CLEAR)} and of {_TURBID_SAMPLES * options.samples} in the others, bounded forward
peak ([forward_peak.md](forward_peak.md)). Root mean square ΔE2000 of blocks of {_BLOCK} × {_BLOCK}
of {_solved_scenes.WIDTH} × {_solved_scenes.HEIGHT} pixels, the noise taken off; *green*: error of
the picture's mean. Path guiding stays off: it makes Cycles up to 20 % too bright.

{_summary(comparisons)}

![Cycles, EEVEE solved, the papers' form](solved_accuracy.jpg)
"""
    (docs / "solved_accuracy.md").write_text(text, encoding="utf-8")
    print(text)
