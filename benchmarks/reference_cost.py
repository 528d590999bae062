"""What a reference without visible noise costs in Cycles, by its settings, in ten waters.

Beside the page data/cycles_noise.csv is written, which Auto reads: noise and time of whole pictures
with the default settings.
"""

from __future__ import annotations

import dataclasses
import json
import math
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..jobs import band_passes
from ..quality.light_reach import lost_beyond
from ..scene.engines import engines
from ..scene.water import water_body
from ..settings.scene_settings import EXACT
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, luminance
from ..validation.solved_cases import FROM_SUN
from . import grey_scene
from ._scenery import view_rays
from ._solved_scenes import SIZE, Scene
from .runner import ROOT, Ask, Page, ranged, table

Array = NDArray[np.float64]

WATERS = {
    "I": 20.0, "IA": 15.0, "IB": 8.0, "II": 5.0, "III": 3.0,
    "1C": 4.0, "3C": 2.0, "5C": 1.5, "7C": 1.0, "9C": 0.5,
}  # fmt: skip
"""Depth of the camera in m, some optical depths."""

_BANDS, _BAND = 8, 3
"""Of them one is compared, 512.5 to 550 nm; in turbid waters it shares a pass with two more."""
_SEEDS = (1, 2)
_SAMPLES = 128
_SUN = 30.0
_NOISE = 0.02
_STREAMS, _RAYS = 32, 2
_GUIDING = {"use_guiding": True, "guiding_training_samples": _SAMPLES // 2}
_SUNS = (30.0, 70.0)
_TABLE_SAMPLES = 48
_BLOCK = 5


@dataclass(frozen=True)
class _Setting:
    """What is changed; ``cycles`` are properties of Cycles."""

    name: str
    cycles: dict[str, Any] = dataclasses.field(default_factory=dict)
    scene: dict[str, Any] = dataclasses.field(default_factory=dict)
    same_paths: bool = False


_PLAIN = _Setting("bounded peak, a band a pass")
_SHARED = _Setting("shared passes", scene={"share_passes": True})
_GUIDED = _Setting(
    "guided surfaces, short training",
    {**_GUIDING, "use_volume_guiding": False, "guiding_training_samples": 16},
)
_SETTINGS = (
    _PLAIN,
    _SHARED,
    _Setting("exact peak", scene={"forward_peak": EXACT}),
    _Setting("HG 0.9", scene={"phase": "hg:0.9"}),
    _Setting("path guiding", _GUIDING),
    _Setting("path guiding, surfaces only", {**_GUIDING, "use_volume_guiding": False}),
    _GUIDED,
    _Setting("light tree off", {"use_light_tree": False}, same_paths=True),
    _Setting("roulette after 4 bounces", {"min_light_bounces": 4}),
    _Setting("32 bounces", {"volume_bounces": 32, "max_bounces": 32}, same_paths=True),
    _Setting("16 bounces", {"volume_bounces": 16, "max_bounces": 16}, same_paths=True),
    _Setting("indirect clamp 10", {"sample_clamp_indirect": 10.0}, same_paths=True),
    _Setting("indirect clamp 1", {"sample_clamp_indirect": 1.0}, same_paths=True),
    _Setting("denoised", {"use_denoising": True}, same_paths=True),
)


def _scene(water: str, setting: _Setting = _PLAIN, sun: float = _SUN) -> Scene:
    return Scene(water, WATERS[water], sun=sun, bands=_BANDS, **setting.scene)


def _render(
    scene: Scene, setting: _Setting, samples: int, *, all_bands: bool
) -> tuple[Array, float, int]:
    """Render seeds of a scene; return images, seconds and passes.

    Images, shape (seeds, h, w, n), are of all bands, or of those that share a pass with the one
    that is compared. Seconds are CPU time of a sample of a megapixel, all of these passes; what a
    render takes before its first sample is left out.
    """
    place = scene.place(samples)
    camera, plan, blender = place.open(), place.plan(samples), bpy.context.scene
    blender.render.threads_mode, blender.render.threads = "FIXED", 1
    extent = water_body.water_extent(blender, plan.column, scene.depth)
    images, seconds = [], 0.0
    passes = [shared for shared in plan.passes if all_bands or _BAND in shared]
    for seed in _SEEDS:
        with (
            engines.cycles_bands(blender, camera, plan, extent, seed=seed) as engine,
            tempfile.TemporaryDirectory() as folder,
        ):
            for name, value in {"use_light_tree": True, **setting.cycles}.items():
                setattr(blender.cycles, name, value)
            render, parts = engine.frame(plan, scene.depth), []
            for number, bands in enumerate(passes):
                for count, sign in ((1, -1), (samples, 1)):
                    engine.draw(seed, count)
                    path = Path(folder, f"{number}_{count}.exr")
                    start = time.process_time()
                    band_passes.render_pass(render, bands, path)
                    seconds += sign * (time.process_time() - start)
                parts.append(band_passes.RenderedPass(path, bands, None))
            images.append(band_passes.gather(parts).astype(np.float64))
    pixels = SIZE[0] * SIZE[1] / 1e6
    return np.stack(images), seconds / ((samples - 1) * pixels * len(_SEEDS)), len(passes)


def _measured(
    water: str, setting: _Setting, truth: tuple[Array, NDArray[np.bool_]], plain: Array | None
) -> tuple[dict[str, float], Array]:
    """Measure one setting; ``plain`` are the images without it, of the same seeds."""
    scene = _scene(water, setting)
    images, seconds, _ = _render(scene, setting, _SAMPLES, all_bands=False)
    wanted, far = truth
    shared = images.shape[-1]
    where = next(group.index(_BAND) for group in scene.place().plan(1).passes if _BAND in group)
    chosen = images[..., where][:, far]
    mean, count = chosen.mean(), far.sum() * len(_SEEDS)
    variance = ((chosen[0] - chosen[1]) ** 2).mean() / 2.0
    bias, error = mean / wanted[far].mean() - 1.0, math.sqrt(variance / count) / mean
    if setting.same_paths and plain is not None:
        # Of the same random numbers: most of the noise is in both.
        difference = (chosen - plain) / plain.mean()
        bias, error = difference.mean(), difference.std() / math.sqrt(count)
    found = {
        "noise": math.sqrt(variance * _SAMPLES) / mean,
        "rms": math.sqrt(((chosen - wanted[far]) ** 2).mean()) / wanted[far].mean(),
        "seconds": seconds / shared, "bands": shared, "bias": bias, "error": error,
    }  # fmt: skip
    return {name: float(value) for name, value in found.items()}, chosen


def picture_noise(water: str, sun: float) -> dict[str, float]:
    """Noise in ΔE2000 and time of a whole picture with the default settings."""
    scene = _scene(water, _SHARED, sun=sun)
    images, seconds, passes = _render(scene, _SHARED, _TABLE_SAMPLES, all_bands=True)
    plan = scene.place().plan(1)
    reduction = plan.reduction(scene.depth)
    weights = np.maximum(luminance(reduction.weights.T), 0.0) * plan.column.sun_irradiance
    b = float(plan.column.scattering @ weights / weights.sum())
    developed = [np.maximum(reduction.apply(image), 0.0) for image in images]
    blocks = [grey_scene.blocks(image, _BLOCK) for image in developed]
    delta_e = float(delta_e_CIE2000_images(*(x[None] for x in blocks)).mean())
    return {
        "scatterings": b * scene.depth / plan.column.sun_cosine,
        # Of the difference of two means back to a pixel and a sample.
        "delta_e": delta_e / math.sqrt(2.0) * _BLOCK * math.sqrt(_TABLE_SAMPLES),
        "seconds": seconds / passes,
        "passes": passes,
    }


def _cost(found: dict[str, float]) -> float:
    """CPU seconds of a megapixel and band at the noise that is compared at."""
    return found["seconds"] * (found["noise"] / _NOISE) ** 2


def _table(found: Mapping[str, Mapping[str, dict[str, float]]]) -> str:
    """Return data/cycles_noise.csv."""
    rows = sorted(
        (x["scatterings"], x["delta_e"], x["seconds"])
        for by in found.values()
        for x in (by[f"{sun:g}°"] for sun in _SUNS)
    )
    return _HEADER + "".join(f"{x:.3g},{y:.3g},{z:.3g}\n" for x, y, z in rows)


_HEADER = f"""\
# Noise and time of a Cycles pixel at one sample, by the scatterings on the sun's path
# source: `python3 dev.py measure reference_cost`, default phase function, bounded peak,
# {_BANDS} bands, those alike in shared passes
# delta_e: ΔE2000 on the display; divide by the root of the samples. Of two pictures over blocks of
# {_BLOCK} x {_BLOCK} pixels, back to a pixel and a sample
# seconds: CPU time of a pass of a megapixel, s, on one of two cores that other work kept busy
# scatterings: b y/mu_s on the sun's slant path to the camera, weighted with luminance
# licence: GPL-3.0-or-later. status: derived from measurements, within a factor of two
# SPDX-License-Identifier: GPL-3.0-or-later
scatterings,delta_e,seconds
"""


def _solved(scene: Scene) -> tuple[Array, NDArray[np.bool_]]:
    """Radiance by pixel of the compared band, exact peak, and which pixels are off the sun."""
    place = scene.place()
    w, plan = view_rays(place.open(), _RAYS), place.plan(1)
    far = w @ -np.asarray(plan.column.sun_direction) < math.cos(math.radians(FROM_SUN))
    shape = (SIZE[1], _RAYS, SIZE[0], _RAYS)
    image = plan.solved_field(_STREAMS).radiance(scene.depth, tuple(w.reshape(-1, 3).T))[:, _BAND]
    return image.reshape(shape).mean(axis=(1, 3)), far.reshape(shape).all(axis=(1, 3))


def _water(water: str) -> dict[str, dict[str, float]]:
    """Measure all settings in a water; what uses the same random numbers against the plain one."""
    truth, plain, found = _solved(_scene(water)), None, {}
    for setting in _SETTINGS:
        found[setting.name], chosen = _measured(water, setting, truth, plain)
        plain = chosen if plain is None else plain
    return found | {f"{sun:g}°": picture_noise(water, sun) for sun in _SUNS}


def measure(ask: Ask) -> Mapping[str, object]:
    """Measure each setting in each water, and write the table that Auto reads."""
    found = {}
    for water in list(WATERS)[: ask.waters]:
        kept = ask.kept(water, lambda water=water: json.dumps(_water(water)))
        found[water] = json.loads(str(kept))
    if not ask.trial:
        (ROOT / "data" / "cycles_noise.csv").write_text(_table(found), encoding="utf-8")
    return _values(found)


def _values(found: Mapping[str, Mapping[str, dict[str, float]]]) -> Mapping[str, object]:
    shown = (_SHARED.name, _PLAIN.name, "exact peak", "HG 0.9")
    plain = [_cost(by[_PLAIN.name]) for by in found.values()]
    settings = []
    for setting in _SETTINGS[:-1]:
        every = [by[setting.name] for by in found.values()]
        gains = [_cost(x) / before for x, before in zip(every, plain, strict=True)]
        bias = ranged([100 * x["bias"] for x in every], "+.1f")
        error = f"{bias} ± {100 * max(x['error'] for x in every):.1f}"
        hg = setting.name == "HG 0.9"
        settings.append([setting.name, ranged(gains, ".2g"), "–" if hg else error])
    views = [_scene(water).place().plan(1).viewpoint(WATERS[water]) for water in found]
    bounds = 100 * np.max([lost_beyond(view, (32, 16)) for view in views], axis=0)
    lost = [max(-100 * by[f"{n} bounces"]["bias"] for by in found.values()) for n in (32, 16)]
    last, before = ([by[x] for by in found.values()] for x in ("denoised", _PLAIN.name))
    worth = [(x["rms"] / y["rms"]) ** 2 for x, y in zip(before, last, strict=True)]
    shared = [
        cost / _cost(by[_SHARED.name])
        for cost, by in zip(plain, found.values(), strict=True)
        if by[_SHARED.name]["bands"] > 1
    ]
    return {
        "costs": table(("water", *shown), [
            [f"{water} {WATERS[water]:g} m", *(f"{_cost(by[name]):.2g}" for name in shown)]
            for water, by in found.items()
        ]),
        "count": f"{len(shared)} of {len(found)}",
        "cheaper": f"{min(shared, default=1):.1f} to {max(shared, default=1):.1f}",
        "middle": float(np.median(shared or [1.0])),
        "settings": table(("setting", "cost", "bias, %, ± largest error"), settings),
        "lost32": lost[0], "lost16": lost[1], "bound32": bounds[0], "bound16": bounds[1],
        "noisy": ranged([100 * x["rms"] for x in before], ".0f", " … "),
        "denoised": ranged([100 * x["rms"] for x in last], ".0f", " … "),
        "worth": ranged(worth, ".0f", " … "),
        "bias": ranged([100 * x["bias"] for x in last], "+.1f", " … "),
    }  # fmt: skip


PAGE = Page(
    "What a reference without visible noise costs",
    """
**CPU seconds of one core for a megapixel and a band at 2 % noise**; the default is *shared passes*:

{costs}

Camera at the depth given, 60 × 40 pixels, level, 130° wide, those within 10° of the sun left out;
flat surface, clear sky, sun at 30°, the band at 531 nm of 8. Noise is that between 2 seeds of 128
samples, extrapolated as 1/√N, too low where there are rare bright paths (the exact peak).
**Differences below 20 % are none.**

- **Shared passes** ({count} waters here): {cheaper} times cheaper, median {middle:.1f}. Bands share
  where bb/b and 1 - g differ by less than 8 %; the mean radiance of a band and Eu stay within 0.5 %
  and 1 % (`uw_spectral.water.shared_phase`).
- **Bounded peak**: sea particles' phase function rises without end towards 0°. Cycles draws two
  lobes that keep backscatter and moments; the rest goes straight on
  (`uw_spectral.water.bounded_peak`). By the solver radiance beyond 3° from the sun changes by 0.5 %
  (median) and 3 % (95 %), its mean by 0.1 %, E0 and Ed by 0.15 %, Eu by 1.3 % at most
  (`tests/uw_spectral/water/test_bounded_peak.py`).
- **Path guiding** stays off: it gains in the clearest waters, which are the cheapest anyway, loses
  in the turbid ones, and took 300 MB more for 480 × 270 pixels of 3C.
- The **light tree** changes no bit of the picture and is off where nothing but the sun is sampled.

## Bias
Range over the waters of the cost, over the bounded peak with a band a pass, and of the bias of the
mean: light tree, bounces and clamps against the same random numbers, the others against the
solution with 32 streams. Guiding trains on 64 samples, short training on 16.

{settings}

By 32 bounces at most {lost32:.2f} % are lost, by 16 {lost16:.2f} %; the bounds by which Auto
chooses (`quality.light_reach.lost_beyond`) are {bound32:.2f} and {bound16:.2f} % there.

## Denoiser
OpenImageDenoise after 128 samples against the solved picture: error {noisy} % before, {denoised} %
after, worth {worth} times the samples in this smooth picture; bias of the mean {bias} %. See
[denoising](denoising.md).
""",
    settings={"waters": len(WATERS)},
)
