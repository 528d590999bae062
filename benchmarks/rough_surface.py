"""Light under waves on average, against traced waves, and what it changes.

    python3 dev.py run -m benchmarks rough_surface

writes docs/measured/rough_surface.md.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.refraction import sun_travel_direction
from ..uw_spectral.surface.waves import WaveSpectrum
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.radiance_table import TABLE_STREAMS, tabulate
from ..uw_spectral.transfer.rough_surface import (
    beam_below,
    beam_reflectance,
    exchange,
    internal_reflectance,
)
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from . import path_radiance_table
from ._traced_sea import Below, TracedSea, photons

WINDS = (2, 5, 10)
ZENITHS = (0, 30, 60, 80)

_INDEX = 1.34
_RAYS, _PHOTONS, _SEED = 200_000, 200_000, 3
_WATER = {"a": 0.1, "b": 0.4, "g": 0.8, "floor": 3.0, "reflectance": 0.6, "y": 1.0}
_DEPTHS = (0.0, 5.0)
_DIFFUSE = 0.3  # irradiance of the sky over that of the sun, both horizontal, in air
_BELOW = "from below, from all sides"
_VIEWS = {"up": (0.0, 0.0, 1.0), "level": (0.0, 1.0, 0.0), "down": (0.0, 0.0, -1.0)}


def variance(wind: float) -> float:
    """Mean square slope of the open sea at a wind in m/s."""
    return WaveSpectrum(wind).mean_square_slope


def _table(head: str, rows: list[str]) -> str:
    return "\n".join([head, "|---" * (head.count("|") - 1) + "|", *rows])


def _reflectances() -> str:
    rows = []
    any_way = np.sqrt((np.arange(_RAYS) + 0.5) / _RAYS)
    beams = {f"sun at {zenith}°": math.cos(math.radians(zenith)) for zenith in ZENITHS}
    for wind in WINDS:
        slopes = 0.0, variance(wind)
        sea = TracedSea(slopes[1], np.random.default_rng(_SEED), _INDEX)
        cases = [
            (name, np.full(_RAYS, cosine), [beam_reflectance(cosine, _INDEX, s) for s in slopes])
            for name, cosine in beams.items()
        ]
        sky = [1.0 - Sky().transmittance(_INDEX, s) for s in slopes]
        below = [internal_reflectance(_INDEX, s) for s in slopes]
        cases += [("uniform sky", any_way, sky), (_BELOW, any_way, below)]
        for name, cosines, (flat, waves) in cases:
            traced, error = sea.reflectance(cosines, above=name != _BELOW)
            rows.append(f"| {wind} m/s | {name} | {flat:.4f} | {waves:.4f} | {traced:.4f} "
                        f"| {error:.4f} |")  # fmt: skip
    return _table("| wind | light | flat | waves | traced | ± |", rows)


def _field(s: float, sun: NDArray[np.float64], E: float, sky: float) -> SolvedField:
    b = np.array([_WATER["b"]])
    phase = parse_phase(f"hg:{_WATER['g']}").for_bands(b)
    return solve_discrete_ordinates(
        [OpticalLayer(_WATER["floor"], np.array([_WATER["a"]]), b, phase)], [E], sun.tolist(),
        sky=Sky.standard("uniform", [sky]), refractive_index=_INDEX, slope_variance=s,
        floor_reflectance=_WATER["reflectance"],
    )  # fmt: skip


def _at(field: SolvedField, y: float) -> Below:
    found = field.Ed(y), field.Eu(y), field.scalar_irradiance(y)
    return Below(*(float(each[0]) for each in found))


def _photons() -> str:
    s, rows = variance(10), []
    sea = TracedSea(s, np.random.default_rng(_SEED), _INDEX)
    for zenith in (*ZENITHS, None):
        cosine = np.full(_PHOTONS, math.cos(math.radians(zenith or 0)))
        if zenith is None:
            cosine = np.sqrt(sea.random.random(_PHOTONS))
        across, turn = np.sqrt(1.0 - cosine**2), np.zeros(_PHOTONS)
        if zenith is None:
            turn = sea.random.uniform(0.0, 2.0 * math.pi, _PHOTONS)
        w = np.array([across * np.cos(turn), across * np.sin(turn), -cosine])
        entered = sea.trace(w, above=True)
        entered = entered[:, entered[2] < 0]
        spread, share = photons(sea, entered, **_WATER), entered.shape[1] / _PHOTONS
        if zenith is None:
            sun = np.array([0.0, 0.0, -1.0])
            flat, waves = (_at(_field(each, sun, 0.0, 1.0 / share), 1.0) for each in (0.0, s))
            straight = spread
        else:
            above = sun_travel_direction(zenith, 0, 1.0)
            suns = [beam_below(above, _INDEX, each) for each in (0.0, s)]
            flat, waves = (
                _at(_field(each, sun, 1.0, 0.0), 1.0)
                for each, sun in zip((0.0, s), suns, strict=True)
            )
            straight = photons(sea, np.repeat(suns[1][:, None], _PHOTONS, axis=1), **_WATER)
        name = "uniform sky" if zenith is None else f"sun at {zenith}°"
        for quantity in ("Ed", "Eu", "E0"):
            values = (getattr(each, quantity) for each in (flat, waves, straight, spread))
            rows.append(f"| {name} | {quantity} | " + " | ".join(f"{x:.4f}" for x in values) + " |")
    return _table("| light | quantity | flat | waves | photons | with the sun spread |", rows)


def _scene(wind: float, zenith: float) -> SolvedField:
    """Deep Jerlov II water at 480 nm; 0 wind is a flat surface."""
    s, nm = variance(wind), np.array([480.0])
    b = Water.jerlov("II").b(nm)
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    T = 1.0 - float(beam_reflectance(math.cos(math.radians(zenith)), _INDEX, s))
    return solve_discrete_ordinates(
        [OpticalLayer(math.inf, Water.jerlov("II").a(nm), b, phase)], [T],
        beam_below(sun_travel_direction(zenith, 0, 1.0), _INDEX, s).tolist(),
        sky=Sky.standard("uniform", [_DIFFUSE]), refractive_index=_INDEX, slope_variance=s,
    )  # fmt: skip


def _changes() -> Iterator[str]:
    for wind, zenith in itertools.product(WINDS, ZENITHS):
        flat, waves = _scene(0, zenith), _scene(wind, zenith)
        cells = [f"{100 * (waves.light.E[0] / flat.light.E[0] - 1):+.1f}"]
        for y in _DEPTHS:
            pairs = [(waves.Ed(y), flat.Ed(y)), (waves.Eu(y), flat.Eu(y))]
            pairs.append((waves.scalar_irradiance(y), flat.scalar_irradiance(y)))
            cells += [f"{100 * float((a / b)[0] - 1):+.1f}" for a, b in pairs]
        for w in _VIEWS.values():
            ratio = waves.radiance(_DEPTHS[1], w) / flat.radiance(_DEPTHS[1], w)
            cells.append(f"{100 * float(ratio[0] - 1):+.1f}")
        yield f"| {wind} m/s | {zenith}° | " + " | ".join(cells) + " |"


def _cost() -> str:
    nm = np.linspace(410.0, 690.0, 8)
    water, rows = Water.jerlov("II"), []
    b = water.b(nm)
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(nm))
    for name, s in (("flat", 0.0), ("waves", variance(5))):
        times = []
        for _ in range(3):
            exchange.cache_clear()
            tabulate.cache_clear()
            marks = [time.process_time()]
            for _ in range(2):
                field = solve_discrete_ordinates(
                    [OpticalLayer(9.0, water.a(nm), b, phase)], np.ones(8),
                    sun_travel_direction(30, 0, _INDEX).tolist(), refractive_index=_INDEX,
                    sky=Sky.standard("clear", np.ones(8), sun_travel_direction(30, 0, 1.0)),
                    slope_variance=s, floor_reflectance=0.2, streams=TABLE_STREAMS,
                )  # fmt: skip
                marks.append(time.process_time())
            tabulate(field)
            times.append(np.diff([*marks, time.process_time()]))
        cells = " | ".join(f"{1e3 * each:.0f}" for each in np.min(times, axis=0))
        rows.append(f"| {name} | {cells} |")
    return _table("| surface | first, ms | again, ms | tables, ms |", rows)


def main(_: list[str]) -> None:
    """Measure everything and write docs/measured/rough_surface.md."""
    columns = [f"{q}({y:g} m)" for y in _DEPTHS for q in ("Ed", "Eu", "E0")]
    columns += [f"L {name}" for name in _VIEWS]
    changes = _table("| wind | sun | sun below | " + " | ".join(columns) + " |", list(_changes()))
    water = (
        "a = {a}, b = {b} 1/m, Henyey-Greenstein {g}, a floor of reflectance {reflectance} "
        "at {floor:g} m"
    )
    text = f"""# Waves, on average

With `--surface waves` the light field is solved under the average of all waves: facets of
isotropic normal slopes, with the mean square slope of the scene's own spectrum (Cox & Munk's for a
long fetch), Fresnel and Snell at each (`uw_spectral/transfer/rough_surface.py`). Written by
`python3 dev.py run -m benchmarks rough_surface`.

- A ray meets facets by the area they turn to it; fractions add up to 1, which is Smith's masking.
  In air, what a facet sends down meets the waves once more. In water, what leaves towards another
  wave comes back but for what that wave mirrors to the sky; a ray mirrored up becomes a level one.
- Streams in the water exchange light by a matrix per azimuth mode. It is made reciprocal, and
  scaled (Sinkhorn, symmetrically) until as much comes along each stream as goes, and a uniform
  sky brings what beams from all over it bring. So R + T = 1 for every stream to 1e-6, and a
  furnace stays at n² to 5e-6 (32 streams), as under a flat surface.
- The direct sun below the surface is what waves let in, in one direction: facets that face a low
  sun take in most of it and send it on flatter than a level surface, at 80° and 7 m/s by 5°.
  Mobley's fifth problem needs that ([problems](outside.md#canonical-problems)). Its spread by some
  degrees is in the caustics that are drawn, not in the field.
- The closed form takes the mean transmittances and the mean internal reflectance. The Monte Carlo
  solver (`validation.monte_carlo`) keeps a flat surface.

## Against traced waves
Rays through a random surface with heights, of Gaussian correlation, that meet it as often as they
do (`benchmarks/_traced_sea.py`). One sea, {_RAYS} rays each, ± one standard error of these.
n = {_INDEX}. The tests hold the fit of Jin et al. (2011) as well.

{_reflectances()}

Photons through the waves of 10 m/s, {_PHOTONS} each (± 0.3 %): {water.format(**_WATER)};
at {_WATER["y"]:g} m, per irradiance that entered. *Flat* and *waves* have the sun's one direction
below each, *photons* that below waves; in the last column sunlight sets out in the directions in
which the waves refract it: what the one direction leaves out.

{_photons()}

## What it changes
Deep water II at 480 nm under a uniform sky of {_DIFFUSE} of the sun's irradiance; change in %
against a flat surface, for the same light in air. Radiances at {_DEPTHS[1]:g} m, *level* across
the sun's azimuth.

{changes}

## Cost
Eight bands, {TABLE_STREAMS} streams, clear sky, a floor; CPU time of one process, minimum of three.
*First* includes the exchange, which is kept for the same waves.

{_cost()}

## Limits
- Slopes are the same to all sides; at 10 m/s the sea has 1.4 times the slope variance along the
  wind as across it.
- No whitecaps, no skewness, and slopes do not depend on heights.
- The wind is part of the column: where it is animated each frame is solved and tabulated anew.
"""
    (path_radiance_table.ROOT / "docs" / "measured" / "rough_surface.md").write_text(
        text, encoding="utf-8"
    )
    print(text)
