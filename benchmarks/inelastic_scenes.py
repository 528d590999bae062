"""Light that lamps excite by night, EEVEE against Cycles, alone and in the whole picture."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import bpy
import numpy as np
from numpy.typing import NDArray

from ._lamp_scenes import (
    FISH,
    FISH_AXES,
    LitPlace,
    add_lamp,
    behind,
    sand_room,
    strobes,
    torch,
    vehicle,
)
from ._places import Compared
from .runner import Ask, Page, Target, spread, table

_BLOCK = 3  # pixels


def _point() -> bpy.types.Object:
    camera = sand_room()
    add_lamp((-0.8, 1.0, 0.4), (0.0, 0.0, 0.0))
    bpy.data.lights["Lamp"].type = "POINT"
    return camera


_SCENES: tuple[tuple[str, Callable[[], bpy.types.Object], str, str], ...] = (
    ("point lamp", _point, "bio:chl=5,cdom=0.3", "all"),
    ("torch across", partial(torch, (0.9, 5.0, 0.5), 0.75 * math.pi), "jerlov:IB", "raman"),
    ("torch along", partial(torch, (0.25, 0.0, -0.1), 0.0, 8000.0), "bio:chl=5", "chlorophyll"),
    ("strobe pair", strobes, "bio:chl=2,cdom=0.4", "cdom"),
    ("vehicle with four lamps", vehicle, "bio:chl=0.3", "all"),
    ("behind a fish", partial(behind, (0.0, 5.2, 0.1), [(FISH, FISH_AXES)]), "bio:chl=1", "all"),
)


def _pictures(ask: Ask, place: LitPlace) -> tuple[Compared, NDArray[np.float64]]:
    """Return developed pictures, and band radiances: two of Cycles, then EEVEE's."""
    camera = place.open()
    halves = ask.kept(f"{place.name} {place.samples}", lambda: place.by_cycles(camera))
    eevee, develop = place.by_eevee(camera), place.develop(camera)
    return Compared(develop(halves), {"EEVEE": develop(eevee)}, _BLOCK), np.stack([*halves, eevee])


def measure(ask: Ask) -> Mapping[str, object]:
    """Measure every scene, with what lamps excite and without."""
    rows, means = [], []
    for name, build, water, inelastic in _SCENES[: ask.scenes]:
        settings = {"sunlight": 0.0, "water": water}
        plain = LitPlace(f"{name}, elastic", build, samples=ask.samples, settings=settings)
        place = replace(plain, name=name, settings={**settings, "inelastic": inelastic})
        (found, whole), (_, elastic) = (_pictures(ask, each) for each in (place, plain))
        one, other, eevee = (whole - elastic).mean(axis=(1, 2))
        cycles = (one + other) / 2.0
        fraction = cycles / whole[:2].mean(axis=(0, 1, 2))
        off = found.delta_e("EEVEE")
        means.append(float(off.mean()))
        rows.append([
            name, f"{water}, {inelastic}", spread(off), f"{off.mean():.2f}",
            f"{found.noise.mean():.2f}", " ".join(f"{100.0 * x:.2g}" for x in fraction),
            " ".join(f"{x:.2f} ± {y:.2f}" for x, y in
                     zip(eevee / cycles, np.abs(one - other) / 2.0 / np.abs(cycles), strict=True)),
        ])  # fmt: skip
        print(*rows[-1], sep=" | ", flush=True)
    heads = ("scene", "water, light", "ΔE", "mean", "noise", "% of light", "EEVEE / Cycles")
    return {"rows": table(heads, rows), "worst": max(means)}


PAGE = Page(
    "What lamps excite, by night",
    """
Sand, a ball, a box and open water 15 m deep, lamps alone, 48 × 27 pixels, 3 bands, by EEVEE and by
Cycles (two images of {samples} samples, a quarter of them for what is emitted). ΔE2000 of blocks of
3 × 3 pixels, median/95 %/worst, mean, and Cycles' noise in it; then, by band, the fraction of the
picture's light that has changed its wavelength, and EEVEE's over Cycles', each with half the
difference of its two images.

{rows}
""",
    (Target("mean ΔE2000, worst scene", "worst", 2.0),),
    {"scenes": 99, "samples": 128},
)
