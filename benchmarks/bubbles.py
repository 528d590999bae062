"""Clouds of bubbles: their optics against the literature, EEVEE against Cycles, photons, costs.

``python3 dev.py run -m benchmarks bubbles`` writes docs/measured/bubbles.md and bubbles.png. Takes
about twenty minutes.
"""

from __future__ import annotations

import argparse
import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from ..scene import stored_settings
from ..scene.engines import engines
from ..scene.water import new_clouds, water_body
from ..settings.render_plan import make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.clouds.matter import BUBBLES, suspended_matter
from ..uw_spectral.spectra.spectral_image import replacing, write_png
from ..uw_spectral.surface.plumes import AIR_COLUMN, plume_depth
from ..uw_spectral.surface.whitecaps import whitecap_cover_Monahan1980
from ..uw_spectral.water.bubbles import BubblePhase
from ..uw_spectral.water.phase import HenyeyGreenstein, PhaseFunction
from ..validation.bubbles import Population, bubbles
from ..validation.cloud_photons import GreyPuff, radiance
from . import clouds, grey_scene
from .clouds import Case

_ROOT = Path(__file__).resolve().parent.parent
_SIGMA = 0.5  # m
_SUN = (0.373, 0.0, -0.928)
_VIEWS = {
    "level": (0.0, 1.0, 0.0), "down": (0.0, 0.766, -0.643), "up": (0.0, 0.866, 0.5),
    "towards": (-0.5, 0.0, 0.866),
}  # fmt: skip
_CASES = (
    Case("jerlov:II", 1.0, constituent=BUBBLES),
    Case("jerlov:II", 3.0, constituent=BUBBLES),
    Case("jerlov:IB", 3.0, constituent=BUBBLES),
    Case("jerlov:IB", 10.0, constituent=BUBBLES),
    Case("jerlov:IB", 3.0, watts=400.0, sunlight=0.0, constituent=BUBBLES),
)
_SHOWN = 2
_AMOUNTS = (0.5, 2.0, 5.0, 10.0)
_COUNTS = (0, 1, 3, 10)
_PLUME_SIZE = (96, 54)


class _Whole(PhaseFunction):
    """A phase function of which nothing counts as unscattered."""

    def __init__(self, of: PhaseFunction) -> None:
        self._of = of

    def per_steradian(self, s2, m=None):  # noqa: ANN001, ANN202, ARG002
        return self._of.per_steradian(s2)

    def moments(self, count: int):  # noqa: ANN202
        return np.zeros(count) if count > 1 else self._of.moments(1)


def optics_row(name: str, found: Population) -> str:
    """Write what a population scatters as cells of a table."""
    return (
        f"| {name} | {1e-3 * found.per_void:.2f} | {found.asymmetry:.3f} | "
        f"{found.backscatter_ratio:.4f} | {found.diffracted:.3f} |"
    )


def lobe_row(tau: float) -> str:
    """Compare the lobe that Cycles draws with the phase function, photon by photon."""
    b, own = tau / (_SIGMA * math.sqrt(2.0 * math.pi)), BubblePhase()
    lights = [
        radiance(GreyPuff(_SIGMA, 0.0, b, _Whole(phase)), _SUN, _VIEWS, count=300_000)
        for phase in (own, HenyeyGreenstein(own.g))
    ]
    ratios = [f"{lights[1][name] / lights[0][name]:.2f}" for name in _VIEWS]
    return f"| {tau:g} | {'/'.join(ratios)} |"


def plume_row(concentration: float, samples: int) -> str:
    """Compare a plume right below a flat surface, seen from 5 m below it, with Cycles."""
    camera = clouds.build(Case("jerlov:IB", 0.0, look=120.0, floor=False), _PLUME_SIZE)
    camera.data.angle = math.radians(75.0)
    scene, depth = bpy.context.scene, -camera.location.z
    item = new_clouds.add_puff(scene, BUBBLES)
    item.location, item.scale = (0.0, 6.5, -0.2), (1.2, 1.2, 0.4)
    item.underwater.concentration = concentration
    bpy.context.view_layer.update()
    chosen = SceneSettings(water="jerlov:IB", bands=3, samples=16, surface="flat", sun_zenith=40.0)
    plan = make_plan(chosen)
    extent = water_body.water_extent(scene, plan.column, depth)
    with engines.eevee_bands(scene, camera, plan, extent, depth) as engine:
        eevee = grey_scene.band_image(engine, plan, depth)
    traced = replace(plan, settings=replace(plan.settings, samples=samples))
    with engines.cycles_bands(scene, camera, traced, extent, seed=1) as engine:
        cycles = grey_scene.band_image(engine, traced, depth)
    green = cycles[..., 1]
    open_water = float(np.median(green[-12:]))
    bright = green > 0.5 * float(np.quantile(green, 0.99))
    rows, columns = np.nonzero(bright)
    away = np.hypot(
        (rows - rows.mean()) / max(float(np.ptp(rows)), 1.0),
        (columns - columns.mean()) / max(float(np.ptp(columns)), 1.0),
    )
    middle = tuple(x[away < 0.25] for x in (rows, columns))
    ratios = [
        f"{eevee[..., 1][where].mean() / green[where].mean():.2f}" for where in (bright, middle)
    ]
    return f"| {concentration:g} | {green[bright].mean() / open_water:.0f} | {' | '.join(ratios)} |"


def wind_text(winds: Sequence[float]) -> str:
    """Say what the literature has of bubbles at winds."""
    cover = [whitecap_cover_Monahan1980(wind) for wind in winds]
    depth = [plume_depth(0.0246 * wind**2) for wind in winds]
    below = float(suspended_matter(BUBBLES, 1e3 * AIR_COLUMN, [550.0]).scattering[0])
    # 0.11 m of air below whitecaps, of all sizes up to 10 mm.
    return (
        f"At {'/'.join(f'{x:g}' for x in winds)} m/s whitecaps cover "
        f"{'/'.join(f'{100 * x:.2f}' for x in cover)} % (Monahan & O'Muircheartaigh 1980), the top "
        f"metre has {'/'.join(f'{110.0 * x:.2g}' for x in cover)} l/m³ (arXiv:1906.11202, 2019), "
        f"half axes of plumes are {'/'.join(f'{x:.2f}' for x in depth)} m (Kalvoda et al. 2003), "
        f"the optical depth below a m² of foam seconds later is {below:.1f}."
    )


def report(
    optics: Sequence[str], lobes: Sequence[str], photons: Sequence[str], lamps: Sequence[str],
    compared: Sequence[str], costs: Sequence[str], winds: str, plumes: Sequence[str],
) -> str:  # fmt: skip
    """Return the page."""
    rows, shipped = "\n".join, BubblePhase()
    b = suspended_matter(BUBBLES, 1.0, [550.0]).scattering[0]
    return f"""# Bubbles

Written by `python3 dev.py run -m benchmarks bubbles`. How they are drawn:
[physics](../physics.md#bubbles).

## Optics
The Lorenz-Mie series: b of a litre of air in a m³, mean cosine, bb/b and the share that is only
diffracted.

| sizes | b, 1/m | g | bb/b | diffracted |
|---|---|---|---|---|
{rows(optics)}

Published: bb/b about .01, up to five times as much with an organic film (Zhang et al. 1998), g
about .85, and the end of total reflection at 83° (Marston 1979). Drawn is the first row spread by
6°: {b:.2f} 1/m without diffraction, g {shipped.g:.3f}, bb/b {shipped.backscatter_ratio:.4f}.

## The lobe that Cycles draws
Henyey-Greenstein's phase function of the same mean cosine: radiance of a puff in a beam 22° from
the vertical, by photons, over that with the phase function of bubbles.

| optical depth | level / down / up / towards the sun |
|---|---|
{rows(lobes)}

No sum of such lobes has the moments of bubbles.

## The closed form of EEVEE against photons
As for [silt](clouds.md#the-light-of-a-puff-against-photons), in a beam and in light from all sides:

| l/m³ | optical depth | beam: level / down / up | all sides: level / down / up |
|---|---|---|---|
{rows(photons)}

By a lamp 3 m away:

| l/m³ | optical depth | along / down / up / side / towards |
|---|---|---|
{rows(lamps)}

Along its light it is **too bright**: bubbles throw little straight back.

## EEVEE against Cycles
As for [silt](clouds.md#eevee-against-cycles): ΔE2000 of blocks, wanted a mean of 3 by day.

| water | light of | l/m³ | ΔE mean | 95 % | noise | light |
|---|---|---|---|---|---|---|
{rows(compared)}

![EEVEE, Cycles](bubbles.png)

*By day, type IB, 3 l/m³: EEVEE, and Cycles with its noise.*

## What they cost
CPU seconds as for [silt](clouds.md#what-they-cost), by clouds, later pictures: {", ".join(costs)}.

## Below breakers
{winds}

Elsewhere hardly any are seen: 2 m down the void fraction stays below 10^−4.5 up to 27 m/s (Czerski
et al. 2022), b .4 1/m. A plume right below a flat surface, IB, sun at 40°, seen from 5 m below: its
light at 550 nm over open water, and EEVEE over Cycles, all of it and its middle.

| l/m³ | over open water | EEVEE / Cycles | middle |
|---|---|---|---|
{rows(plumes)}

They are not put there by themselves: six puffs below the largest whitecaps hold two thirds to three
quarters of the foam within 15 m, but cost more than four times the picture, hang half a metre below
the crests, and stay where foam runs on. *Add Bubble Plumes* puts a few at a frame, with 8 l/m³ at
most: more is hardly brighter, and EEVEE draws it with **a dark middle**.
"""


def main(arguments: Sequence[str]) -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="bubbles")
    parser.add_argument("--samples", type=int, default=384)
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    options = parser.parse_args(arguments)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    populations = {
        "a plume, 20 µm to 1 mm, r^−3/2, 550 nm": bubbles(),
        "far below breakers, 10 to 80 µm, r^−0.3": bubbles(1e-5, 8e-5, -0.3, count=400),
    }
    optics = [optics_row(name, found) for name, found in populations.items()]
    lobes = [lobe_row(tau) for tau in (0.3, 2.0, 8.0, 25.0)]
    photons = [clouds.photons_row(x, BUBBLES) for x in _AMOUNTS]
    lamps = [clouds.lamp_row(x, BUBBLES) for x in _AMOUNTS]
    print(*optics, *lobes, *photons, *lamps, sep="\n", flush=True)
    compared = []
    for number, case in enumerate(_CASES):
        found = clouds.compare(case, options.samples)
        compared.append(found.row())
        print(compared[-1], flush=True)
        if number == _SHOWN:
            both = np.concatenate([found.eevee, found.cycles], axis=1)
            larger = np.repeat(np.repeat(both, 6, axis=0), 6, axis=1)
            write_png(options.docs / "bubbles.png", np.clip(larger, 0.0, 1.0))
    winds = textwrap.fill(wind_text((5.0, 10.0, 15.0)), 98)
    plumes = [plume_row(amount, options.samples) for amount in (1.0, 3.0, 10.0, 30.0)]
    print(winds, *plumes, sep="\n", flush=True)
    costs = []
    for count in _COUNTS:
        later = clouds.cost_row(count, constituent=BUBBLES).split(" | ")[-1].strip(" |")
        costs.append(f"{count}: {later}")
        print(costs[-1], flush=True)
    with replacing(options.docs / "bubbles.md") as temporary:
        temporary.write_text(report(optics, lobes, photons, lamps, compared, costs, winds, plumes))
