"""Layers of a picture: whether they add up, and what the truth beside them is worth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers, bands_name, read_layers
from ..datasets.truth import read_formation
from ..uw_spectral.imaging.formation_fit import BLACK, FormationFit, fit_formation
from ..uw_spectral.imaging.image_formation import FormationCurves
from ._jobs import frame_seconds, rendered_seconds
from ._layer_scenes import BEFORE, FAR, NEAR, targets
from .runner import Ask, Page, Target, table

WATER, FARTHEST = "jerlov:II", 6.5
RANGES = tuple(np.geomspace(0.4, FARTHEST, 24).tolist())
_SHARED = [
    "--water", WATER, "--bands", "6", "--sensor", "Nikon D7000", "--no-diffuse-shadows",
    "--no-scene-floor",
]  # fmt: skip
_FRAMES = 7  # more than one: what is left is without start, plan and compilation
_FRAME = "320x180"


@dataclass(frozen=True)
class Rendered:
    """A picture's layers and truth."""

    layers: FrameLayers
    truth: dict[str, Any]
    path: Path

    @property
    def c(self) -> NDArray[np.float64]:
        """Extinction of the bands, 1/m."""
        return np.array(self.truth["bands"]["c"])


def render(blend: Path, out: Path, *options: str) -> None:
    """Render a job with all layers."""
    rendered_seconds(blend, out, *_SHARED, "--layers", "all", *options)


def found(out: Path) -> Rendered:
    """Read what a job wrote for frame 1."""
    path = out / "0001_truth.json"
    truth = json.loads(path.read_text(encoding="utf-8"))
    return Rendered(read_layers(out / "0001_layers.exr"), truth, path)


def sum_error(frame: FrameLayers, *, bands: bool) -> NDArray[np.float64]:
    """Return |D + B + F - I| / I of every pixel and channel."""
    names = [bands_name(name) if bands else name for name in "DBFI"]
    D, B, F, I = (frame[name].astype(np.float64) for name in names)  # noqa: E741
    return np.abs(D + B + F - I) / np.abs(I)


def inside(here: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask without the pixels at its edge."""
    inner = here.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= np.roll(here, step, axis)
    return inner


def squares(frame: FrameLayers) -> dict[str, NDArray[np.bool_]]:
    """Return the pixels of each square, without its edge."""
    masks = {
        name: inside(frame["instance"] == number)
        for number, name in frame.instances.items()
        if name.startswith(("black", "grey"))
    }
    return {name: mask for name, mask in masks.items() if mask.any()}


def fitted(frame: FrameLayers, *, bands: bool) -> FormationFit:
    """Fit the image formation to the image and the range alone."""
    image = frame.bands("I") if bands else frame["I"]
    masks = squares(frame)
    values = [image[mask].astype(np.float64).mean(axis=0) for mask in masks.values()]
    z = [float(frame["range"][mask].mean()) for mask in masks.values()]
    labels = [BLACK if name.startswith("black") else BLACK + 1 for name in masks]
    water = inside(~np.isfinite(frame["range"]))
    values.append(image[water].astype(np.float64).mean(axis=0))
    return fit_formation(np.array(values), np.array([*z, np.inf]), np.array([*labels, BLACK]))


def fit_errors(fit: FormationFit, truth: FormationCurves) -> tuple[float, float, float]:
    """Return the largest relative errors of β_D, β_B and B∞ between the nearest and farthest."""
    there = (truth.z >= RANGES[0]) & (truth.z <= FARTHEST)
    z = truth.z[there]
    D, B = (
        np.stack([beta.at(z) for beta in curves], axis=-1)
        for curves in (fit.beta_direct, fit.beta_backscatter)
    )
    pairs = ((D, truth.beta_direct[there]), (B, truth.beta_backscatter[there]),
             (np.array(fit.B_inf), truth.B_inf))  # fmt: skip
    D_off, B_off, B_inf_off = (float(np.abs(x / y - 1.0).max()) for x, y in pairs)
    return D_off, B_off, B_inf_off


def band_curves(truth: dict[str, Any]) -> FormationCurves:
    """Return the coefficients of the bands of a truth."""
    of_bands = truth["formation"]["level"]["bands"]
    return FormationCurves(*(np.array(of_bands[n]) for n in ("z", "beta_D", "beta_B", "B_inf")))


def _greys(frame: FrameLayers) -> list[NDArray[np.bool_]]:
    return [mask for name, mask in squares(frame).items() if name.startswith("grey")]


def _fraction(x: float) -> str:
    return f"{100 * x:.2g} %"


def _left(frame: Rendered) -> tuple[float, float]:
    """Errors of T against exp(-c z), and of D / J against T where more than e^-3 is left."""
    layers = frame.layers
    mask = np.logical_or.reduce(_greys(layers))
    T = layers.bands("T")[mask].astype(np.float64)
    exact = np.exp(-frame.c * layers["range"][mask][:, None].astype(np.float64))
    D, J = (layers.bands(name)[mask].astype(np.float64) for name in "DJ")
    near = exact > np.exp(-3.0)
    return float(np.abs(T / exact - 1.0).max()), float(np.abs(D / J / exact - 1.0)[near].max())


def _against_no_water(far: Rendered, near: Rendered, name: str) -> tuple[float, float]:
    """J of a square against the image from close before it, and what that water takes."""
    J = far.layers.bands("J")[squares(far.layers)[name]].astype(np.float64).mean(axis=0)
    image = near.layers.bands("I").astype(np.float64).mean(axis=(0, 1))
    return float(np.abs(J / image - 1.0).max()), float(1.0 - np.exp(-near.c * BEFORE).min())


def _against_own_light(frame: FrameLayers, fit: FormationFit) -> float:
    """Largest relative error of the channels' β_D against the layer T of the grey squares."""
    greys = _greys(frame)
    z = np.array([frame["range"][mask].mean() for mask in greys], np.float64)
    T = np.array([frame["T"][mask].mean(axis=0) for mask in greys], np.float64)
    found = np.stack([beta.at(z) for beta in fit.beta_direct], axis=-1)
    return float(np.abs(found * z[:, None] / -np.log(T) - 1.0).max())


def measure(ask: Ask) -> Mapping[str, object]:
    """Render everything."""
    folder = ask.folder
    folder.mkdir(parents=True, exist_ok=True)
    blend = folder / "targets.blend"
    middle = targets(blend, RANGES)
    eevee = ("--engine", "eevee", "--samples", "16")
    render(blend, folder / "bands", *eevee, "--mode", "bands", "--cameras", f"{FAR},{NEAR}")
    far, near = found(folder / "bands" / FAR), found(folder / "bands" / NEAR)
    render(blend, folder / "realtime", *eevee, "--mode", "realtime", "--camera", FAR)
    realtime = found(folder / "realtime")
    render(blend, folder / "cycles", "--samples", str(ask.samples), "--camera", FAR)
    cycles = found(folder / "cycles")
    sums = {
        "bands, each band": sum_error(far.layers, bands=True),
        "bands, the sensor's channels": sum_error(far.layers, bands=False),
        "real-time, the sensor's channels": sum_error(realtime.layers, bands=False),
    }
    exact, left = _left(far)
    same, taken = _against_no_water(far, near, middle)
    of_sensor = fitted(far.layers, bands=False)
    fits = {
        "each band": fit_errors(fitted(far.layers, bands=True), band_curves(far.truth)),
        "the sensor's channels": fit_errors(of_sensor, read_formation(far.path)),
    }
    greys = _greys(far.layers)
    ratio = np.array([
        np.divide(*(x.layers.bands("J")[mask].mean(axis=0) for x in (cycles, far)))
        for mask in greys
    ])[np.exp(-far.c.max() * np.array(RANGES[: len(greys)])) > 0.1]  # fmt: skip
    costs = []
    for name, options in {
        "real-time, EEVEE": (*eevee, "--mode", "realtime"),
        "bands, EEVEE": (*eevee, "--mode", "bands"),
        "cycles": ("--samples", "16"),
    }.items():
        out, size = folder / "cost" / name.split(",")[0], ("--resolution", *_FRAME.split("x"))
        plain, whole = (
            frame_seconds(blend, out / (x or "none"), _FRAMES, *_SHARED, *options, "--camera", FAR,
                          *size, *(("--layers", x) if x else ()))
            for x in ("", "all")
        )  # fmt: skip
        costs.append([f"{name}, 16 samples", f"{plain:.2g} s", f"{whole / plain:.2f}"])
    errors = list(sums.values())
    return {
        "sums": table(("EEVEE", "median", "95 %"), [
            [name, f"{np.median(x):.1e}", f"{np.percentile(x, 95):.1e}"] for name, x in sums.items()
        ]),
        "median": max(float(np.median(x)) for x in errors),
        "most": max(float(np.percentile(x, 95)) for x in errors),
        "exact": f"{exact:.0e}", "left": _fraction(left), "same": _fraction(same),
        "taken": _fraction(taken),
        "traced": f"{ratio.mean():.3f} ± {ratio.std() / np.sqrt(ratio.size):.3f}",
        "fits": table(("", "β_D", "β_B", "B∞"),
                      [[name, *map(_fraction, x)] for name, x in fits.items()]),
        "fitted": 100 * max(fits["each band"]),
        "own": _fraction(_against_own_light(far.layers, of_sensor)),
        "costs": table(("", "without", "all layers"), costs),
    }  # fmt: skip


PAGE = Page(
    "Layers of a picture",
    """
The layers: [researcher.md](../researcher.md#layers). Black and grey squares at 24 ranges of 0.4 to
6.5 m, camera at 5 m depth, Jerlov II (`jerlov:II`), 6 bands, Nikon D7000.

## They add up
Of all pixels: |D + B + F - I| / I. EEVEE keeps 11 bits of each layer.

{sums}

In Cycles they add up by construction.

## They are what they are called
- T of a band is e^(-cz) within {exact}, D / J as drawn within {left} where more than e⁻³ is left.
- J of a grey square against the image from 2 cm before it: {same} apart, of which those 2 cm take
  {taken}.
- J by Cycles over J by EEVEE: {traced}.

## The image alone gives the truth's coefficients
`fit_formation` on the image and the range layer; largest error at any range against the JSON beside
it. Wanted are 2 %.

{fits}

The truth's β_D is of grey on a level surface; against the layer T of the same upright squares β_D
of the channels is within {own}.

## What they cost
CPU time of a frame of 320 × 180 pixels, mean of 7 after the first, and that with all layers over
that without any, in one run.

{costs}
""",
    (
        Target("|D + B + F - I| / I, median", "median", 1e-3),
        Target("the same, 95 %", "most", 1e-2),
        Target("coefficients of each band, worst, %", "fitted", 2.0),
    ),
    {"samples": 64},
)
