# ruff: noqa: E501 - tables
"""Layers of a picture: whether they add up, and what the truth beside them is worth.

    python3 dev.py run -m benchmarks layers [--folder DIR]

writes docs/measured/layers.md.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers, bands_name, read_layers
from ..datasets.truth import read_formation
from ..uw_spectral.imaging.formation_fit import BLACK, FormationFit, fit_formation
from ..uw_spectral.imaging.image_formation import FormationCurves
from ._jobs import rendered_seconds
from ._layer_scenes import BEFORE, FAR, NEAR, targets

PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured" / "layers.md"
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


def render(blend: Path, out: Path, *options: str, layers: str = "all") -> float:
    """Render a job and return its CPU time, s.

    Raises
    ------
    InputError
        If it fails.
    """
    return rendered_seconds(blend, out, *_SHARED, *_asked(layers), *options)


def _asked(layers: str) -> list[str]:
    return ["--layers", layers] if layers else []


def frame_seconds(blend: Path, out: Path, *options: str, layers: str) -> float:
    """Return the CPU time of a frame after the first, s."""
    first, all_of_them = (
        render(blend, out / f"{last}", *options, "--frames", f"1-{last}", layers=layers)
        for last in (1, 1 + _FRAMES)
    )
    return (all_of_them - first) / _FRAMES


def cost(blend: Path, out: Path, *options: str) -> str:
    """Return a row of the table of costs: a frame without layers, and with all over that."""
    size = ("--resolution", *_FRAME.split("x"))
    plain, whole = (
        frame_seconds(blend, out / (layers or "none"), *options, *size, layers=layers)
        for layers in ("", "all")
    )
    return f"{plain:.2g} s | {whole / plain:.2f} |"


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
    return (
        float(np.abs(D / truth.beta_direct[there] - 1.0).max()),
        float(np.abs(B / truth.beta_backscatter[there] - 1.0).max()),
        float(np.abs(np.array(fit.B_inf) / truth.B_inf - 1.0).max()),
    )


def band_curves(truth: dict[str, Any]) -> FormationCurves:
    """Return the coefficients of the bands of a truth."""
    of_bands = truth["formation"]["level"]["bands"]
    return FormationCurves(*(np.array(of_bands[n]) for n in ("z", "beta_D", "beta_B", "B_inf")))


def _share(x: float) -> str:
    return f"{100 * x:.2g} %"


def _sums(name: str, error: NDArray[np.float64]) -> str:
    return f"| {name} | {np.median(error):.1e} | {np.percentile(error, 95):.1e} |"


def _left(frame: Rendered) -> tuple[float, float]:
    """Errors of T against exp(-c z), and of D / J against T where more than e^-3 is left."""
    layers = frame.layers
    mask = np.logical_or.reduce([m for n, m in squares(layers).items() if n.startswith("grey")])
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
    greys = [mask for name, mask in squares(frame).items() if name.startswith("grey")]
    z = np.array([frame["range"][mask].mean() for mask in greys], np.float64)
    T = np.array([frame["T"][mask].mean(axis=0) for mask in greys], np.float64)
    found = np.stack([beta.at(z) for beta in fit.beta_direct], axis=-1)
    return float(np.abs(found * z[:, None] / -np.log(T) - 1.0).max())


def measure(folder: Path) -> str:
    """Render everything into a folder and return the page."""
    blend = folder / "targets.blend"
    middle = targets(blend, RANGES)
    eevee = ("--engine", "eevee", "--samples", "16")
    render(blend, folder / "bands", *eevee, "--mode", "bands", "--cameras", f"{FAR},{NEAR}")
    far, near = found(folder / "bands" / FAR), found(folder / "bands" / NEAR)
    render(blend, folder / "realtime", *eevee, "--mode", "realtime", "--camera", FAR)
    realtime = found(folder / "realtime")
    render(blend, folder / "cycles", "--samples", "64", "--camera", FAR)
    cycles = found(folder / "cycles")
    sums = [
        _sums("bands, each band", sum_error(far.layers, bands=True)),
        _sums("bands, the sensor's channels", sum_error(far.layers, bands=False)),
        _sums("real-time, the sensor's channels", sum_error(realtime.layers, bands=False)),
    ]
    exact, left = _left(far)
    same, taken = _against_no_water(far, near, middle)
    in_bands = fit_errors(fitted(far.layers, bands=True), band_curves(far.truth))
    of_sensor = fitted(far.layers, bands=False)
    in_channels = fit_errors(of_sensor, read_formation(far.path))
    greys = [mask for name, mask in squares(far.layers).items() if name.startswith("grey")]
    traced = [
        cycles.layers.bands("J")[m].mean(axis=0) / far.layers.bands("J")[m].mean(axis=0)
        for m in greys
    ]
    ratio = np.array(traced)[np.exp(-far.c.max() * np.array(RANGES[: len(traced)])) > 0.1]
    costs = [
        f"| {name} | {cost(blend, folder / 'cost' / name.split()[0], *options)}"
        for name, options in {
            "real-time, EEVEE, 16 samples": (*eevee, "--mode", "realtime", "--camera", FAR),
            "bands, EEVEE, 16 samples": (*eevee, "--mode", "bands", "--camera", FAR),
            "cycles, 16 samples": ("--samples", "16", "--camera", FAR),
        }.items()
    ]
    return _PAGE.format(
        costs="\n".join(costs),
        size=_FRAME.replace("x", " × "),
        frames=_FRAMES,
        water=WATER,
        farthest=FARTHEST,
        sums="\n".join(sums),
        exact=f"{exact:.0e}",
        left=_share(left),
        same=_share(same),
        taken=_share(taken),
        before=f"{100 * BEFORE:g} cm",
        bands="|".join(f" {_share(x)} " for x in in_bands),
        channels="|".join(f" {_share(x)} " for x in in_channels),
        traced=f"{ratio.mean():.3f}±{ratio.std() / np.sqrt(ratio.size):.3f}",
        own=_share(_against_own_light(far.layers, of_sensor)),
    )


def main(arguments: Sequence[str]) -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="layers", description=__doc__)
    parser.add_argument("--folder", type=Path, help="where to keep what is rendered")
    folder = parser.parse_args(arguments).folder
    with tempfile.TemporaryDirectory() as temporary:
        where = folder or Path(temporary)
        where.mkdir(parents=True, exist_ok=True)
        PAGE.write_text(measure(where), encoding="utf-8")


_PAGE = """\
# Layers of a picture

Written by `python3 dev.py run -m benchmarks layers`; the layers:
[researcher.md](../researcher.md#layers). Black and grey squares at 24 ranges of 0.4 to {farthest}
m, camera at 5 m depth, Jerlov II (`{water}`), 6 bands, Nikon D7000.

## They add up
|D + B + F - I| / I of all pixels; wanted are 10⁻³ for the median, 10⁻² for 95 %. EEVEE keeps 11 bits of each layer.

| EEVEE | median | 95 % |
|---|---|---|
{sums}

In Cycles they add up by construction.

## They are what they are called
- T of a band is e^(-cz) within {exact}, D / J as drawn within {left} where more than e⁻³ is left.
- J of a grey square against the image from {before} before it: {same} apart, of which those
  {before} take {taken}.
- J by Cycles over J by EEVEE: {traced}.

## The image alone gives the truth's coefficients
`fit_formation` on the image and the range layer; largest error at any range against the JSON beside it. Wanted are 2 %.

| | β_D | β_B | B∞ |
|---|---|---|---|
| each band |{bands}|
| the sensor's channels |{channels}|

The truth's β_D is of grey on a level surface; against the layer T of the same upright squares β_D
of the channels is within {own}.

## What they cost
CPU time of a frame of {size} pixels, mean of {frames} after the first, and that with all layers over that without any, in
one run.

| | without | all layers |
|---|---|---|
{costs}
"""
