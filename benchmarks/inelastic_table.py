"""Closed form of inelastic light against the Monte Carlo. Writes docs/measured/inelastic.md.

``python3 dev.py run -m benchmarks inelastic_table PHOTONS THREADS``.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Sequence

import numpy as np

from ..uw_spectral.closed_form.light_field import light_field_of
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
)
from ..uw_spectral.transfer.radiance_field import under_surface, upwelling_irradiance
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.bio_optics import Constituents, named_waters
from ..uw_spectral.water.inelastic_processes import PROCESSES, inelastic_processes
from ..validation.inelastic_light import InelasticLight, excitation_fields, solve_inelastic
from ..validation.monte_carlo import (
    Constituent,
    InelasticInteraction,
    MonteCarloResult,
    bio_optical_medium,
    simulate,
)
from .gutierrez_figures import SUN_ZENITH, column
from .path_radiance_table import ROOT

BANDS = Bands.uniform(25, 300, 800)
SEEN = slice(5, 20)  # 400 to 700 nm
WATERS = {"baltic": (1.0, 3.0, 5.0, 10.0), "clear": (1.0, 5.0, 10.0, 20.0)}
CAMERA, CONE = 5.0, 10.0
VIEWS = {"down": -1.0, "30° below level": -0.5, "10° below level": -0.17, "30° above level": 0.5}
INTEGRATED = "Eu, integrated"
QUANTITIES = ("Ed", "Eu", INTEGRATED, "E0")
QUICK = 400_000
_APART = 1e-6
_TARGET, _VERDICT = 10.0, "VERDICT"

View = tuple[float, Sequence[float]] | tuple[float, Sequence[float], float]


def constituents_of(name: str) -> Constituents:
    """Return the Baltic, or clear case 1 water of 0.03 mg/m³ chlorophyll."""
    return Constituents.case1(0.03) if name == "clear" else named_waters()[name].constituents


def column_of(constituents: Constituents, bands: Bands = BANDS) -> WaterColumn:
    """Deep water under a flat surface and a clear sky."""
    nm = bands.centres
    return column(bands, constituents.absorption(nm), constituents.scattering(nm))


def _direction(up: float) -> tuple[float, float, float]:
    return (math.sqrt(1 - up**2), 0.0, up)


def first_order(
    constituents: Constituents, depths: Sequence[float], views: Sequence[View], **options: object
) -> tuple[MonteCarloResult, dict[str, float]]:
    """Trace photons that change their band at most once, with many more such events.

    Each band is there twice: the sun shines into one, the changed light comes
    out in the other, from which nothing is emitted again. So the light of a
    process is proportional to its strength, and each is made as strong as the
    absorption that it is part of allows (Raman scattering takes its events from
    the absorption of the water); the result is to be divided by the factors.

    Returns
    -------
    result : MonteCarloResult
        Odd bands: the light of changed wavelength, each process times its factor.
    factors : dict of str to float
        By process.
    """
    n = len(BANDS)
    twice = Bands((BANDS.centres[:, None] + [0.0, _APART]).ravel(), np.repeat(BANDS.widths, 2))
    once = column_of(constituents)
    shone_into = np.tile([1.0, 0.0], n)
    column = dataclasses.replace(
        once,
        bands=twice,
        absorption=np.repeat(once.absorption, 2),
        scattering=np.repeat(once.scattering, 2),
        floor_reflectance=np.repeat(once.floor_reflectance, 2),
        sun_irradiance=np.repeat(once.sun_irradiance, 2) * shone_into,
        sky_radiance=np.repeat(once.sky_radiance, 2) * shone_into,
    )
    parts, processes = bio_optical_medium(constituents, BANDS)
    absorbed = {part.name: part.absorption for part in parts}
    stronger, factors = [], {}
    for name, process in zip(PROCESSES, processes, strict=True):
        matrix = np.zeros((2 * n, 2 * n))
        if name == "raman":
            factor = float((absorbed["water"] / process.coefficient).min())
            matrix[::2, 1::2] = process.redistribution
        else:
            factor = 1.0 / float(process.redistribution.sum(axis=1).max())
            matrix[::2, 1::2] = process.redistribution * factor
        coefficient = np.repeat(process.coefficient, 2) * shone_into
        stronger.append(
            InelasticInteraction(
                process.name,
                coefficient * factor if name == "raman" else coefficient,
                matrix,
                process.phase,
                process.absorber or "water",
            )
        )
        factors[name] = factor
    doubled = [
        Constituent(p.name, np.repeat(p.absorption, 2), _doubled(p.scattering), p.phase)
        for p in parts
    ]
    result = simulate(column, doubled, depths, views=views, inelastic=stronger, **options)
    return result, factors


def _doubled(values: np.ndarray) -> np.ndarray:
    return np.repeat(np.broadcast_to(values, len(BANDS)), 2)


def compare(name: str, photons: int, threads: int = 1, cone: float = CONE) -> list[dict]:
    """One row per process, quantity, place and band: Monte Carlo, its error, closed form."""
    constituents, depths = constituents_of(name), WATERS[name]
    views = [(CAMERA, _direction(up)) for up in VIEWS.values()]
    truth, factors = first_order(
        constituents, depths, views, photons=photons, threads=threads, cone=cone
    )
    column, phase = column_of(constituents), constituents.phase(BANDS.centres)
    exciting, field = excitation_fields(column, phase), light_field_of(column, phase)
    rows = []
    for process in PROCESSES:
        one = inelastic_processes(constituents, BANDS, BANDS, (process,))
        closed = solve_inelastic(one, exciting, BANDS, field, BANDS)
        light = truth.parts[f"{process} light"]
        places = [
            (
                quantity,
                f"{y:g} m",
                getattr(light, quantity[:2]),
                i,
                _irradiance(closed, quantity, y),
            )
            for quantity in QUANTITIES
            for i, y in enumerate(depths)
        ]
        places += [
            ("L", view, light.L, i, _seen(closed, _direction(up)))
            for i, (view, up) in enumerate(VIEWS.items())
        ]
        rows += [
            {
                "water": name,
                "process": process,
                "quantity": quantity,
                "place": place,
                "truth": estimate.mean[i][1::2] / factors[process],
                "error": estimate.error[i][1::2] / factors[process],
                "value": value,
            }
            for quantity, place, estimate, i, value in places
        ]
    return rows


def _seen(closed: InelasticLight, w: tuple[float, float, float]) -> np.ndarray:
    return closed.radiance(CAMERA, w, under_surface(closed, w, 0.0, REFRACTIVE_INDEX))


def _irradiance(closed: InelasticLight, quantity: str, y: float) -> np.ndarray:
    if quantity == INTEGRATED:
        return upwelling_irradiance(closed.radiance, y)
    return getattr(closed, quantity)(y)


def summed(row: dict) -> tuple[float, float, float]:
    """Monte Carlo, its standard error and closed form, over 400 to 700 nm.

    The errors of the bands add up as if independent.
    """
    return (
        float(row["truth"][SEEN].sum()),
        float(np.sqrt((row["error"][SEEN] ** 2).sum())),
        float(row["value"][SEEN].sum()),
    )


def difference(row: dict) -> float:
    """Relative difference of the closed form, over 400 to 700 nm."""
    truth, _, value = summed(row)
    return value / truth - 1


def _judged(rows: list[dict]) -> str:
    """How many numbers there are, within the target and certainly beyond it, and the largest."""
    sums = [summed(row) for row in rows]
    off = [(100 * (value / truth - 1), 100 * error / truth) for truth, error, value in sums]
    met = sum(abs(value) <= _TARGET for value, _ in off)
    missed = sum(abs(value) - 2 * error > _TARGET for value, error in off)
    value, error = max(off, key=lambda pair: abs(pair[0]))
    return f"{len(off)} | {met} | {missed} | {value:+.1f}±{error:.1f}"


def _bands(rows: list[dict]) -> str:
    """Per band, where the Monte Carlo knows it to 5 %."""
    found = []
    for row in rows:
        truth = row["truth"][SEEN]
        known = (truth > 0) & (row["error"][SEEN] < 0.05 * truth)
        found += list(np.abs(row["value"][SEEN][known] / truth[known] - 1))
    if not found:
        return "– | – | –"
    found = 100 * np.array(found)
    return f"{np.median(found):.1f} % | {np.percentile(found, 90):.1f} % | {found.max():.1f} %"


def verdict(text: str) -> str:
    """Say of the table of docs/measured/inelastic.md how many numbers meet the target."""
    kinds = {"radiances": ("L",), "irradiances": QUANTITIES}
    said = []
    for name, quantities in kinds.items():
        rows = re.findall(r"^\| \w+ \| ([\w, ]+) \| (\d+) \| (\d+) \| (\d+) \|", text, re.MULTILINE)
        count, met, missed = (
            sum(int(row[i]) for row in rows if row[0] in quantities) for i in (1, 2, 3)
        )
        said.append(f"of {count} {name} {met} are within {_TARGET:g} % and {missed} certainly not")
    return f"The target is met in part: {', '.join(said)}; of the others the noise does not tell."


def main(arguments: list[str]) -> None:
    """Measure and write docs/measured/inelastic.md; photons per water, threads."""
    photons = int(float(arguments[0])) if arguments else QUICK
    threads = int(arguments[1]) if len(arguments) > 1 else 1
    text = f"""# Inelastic light

Written by `python3 dev.py run -m benchmarks inelastic_table`.

The closed form (`validation.inelastic_light`) against the Monte Carlo in deep water, clear sky, sun
at {SUN_ZENITH:g}°, {len(BANDS)} bands, {photons} photons per water: the inelastic part
alone, each process, summed over 400 to 700 nm, at four depths or in four directions at
{CAMERA:g} m. Target: within {_TARGET:g} %; *beyond*: by more than two standard
errors. Then single bands that are known to 5 %.
{_VERDICT}

Neglected are light that changes twice, the anisotropy of Raman scattering, and the spread of light
in bands where its source dies away steeply (CDOM in the Baltic). *{INTEGRATED}* is the radiance's
from below (`upwelling_irradiance`), *Eu* that of the two streams.

| water | quantity | numbers | within | beyond | largest | bands: median | 90 % | worst |
|---|---|---|---|---|---|---|---|---|
"""
    for name in WATERS:
        rows = compare(name, photons, threads)
        for quantity in (*QUANTITIES, "L"):
            mine = [row for row in rows if row["quantity"] == quantity]
            text += f"| {name} | {quantity} | {_judged(mine)} | {_bands(mine)} |\n"
    described = "; ".join(f"{name}: {constituents_of(name).described()}" for name in WATERS)
    text += f"\nWaters: {described}.\n"
    text = text.replace(_VERDICT, f"**{verdict(text)}**")
    (ROOT / "docs" / "measured" / "inelastic.md").write_text(text, encoding="utf-8")
    print(text)
