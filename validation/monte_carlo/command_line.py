"""Command line of the Monte Carlo solver: irradiance with depth as a table, CSV and plot.

python -m validation --water jerlov:II --depths 0,1,2,5,10 --plot II.png
python -m validation --water case:baltic --inelastic all --range 300,800 --bands 25
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TextIO

from ...uw_spectral.errors import InputError
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.illuminant import band_mean, parse_illuminant
from ...uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ...uw_spectral.transfer.water_column import SURFACES, WaterColumn
from ...uw_spectral.water.bio_optics import Constituents
from ...uw_spectral.water.inelastic_processes import parse_processes
from ...uw_spectral.water.named import constituents_of, parse_uniform_water
from ...uw_spectral.water.optical_properties import Water
from ...uw_spectral.water.phase import BandPhase
from ...uw_spectral.water.phase_functions import parse_phase
from ...uw_spectral.water.pure_water import molecular_scattering
from .bio_optical import bio_optical_medium
from .medium import Constituent, InelasticInteraction
from .results import MonteCarloResult
from .solver import ENGINES, SKIES, simulate

_BAR = 40
_OWN_PHASE = "mixture"

Medium = tuple[BandPhase | list[Constituent], list[InelasticInteraction]]


def main(arguments: list[str] | None = None, out: TextIO | None = None) -> int:
    """Run the command line; return the exit status: 0, or 2 if the input cannot be used."""
    options = _parser().parse_args(arguments)
    try:
        _run(options, out or sys.stdout)
    except (InputError, OSError) as error:
        print(f"\nmonte_carlo: {error}", file=sys.stderr)  # noqa: T201
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m validation", description=(__doc__ or "").partition("\n")[0]
    )
    add = parser.add_argument
    add(
        "--water",
        default="jerlov:IB",
        help="jerlov:TYPE, bio:chl=1,cdom=0.1, chl:3, case:baltic, file:PATH, or a,b in 1/m",
    )
    add(
        "--phase",
        default=_OWN_PHASE,
        help="hg:0.8, fournier-forand:1.10,0.0183, petzold, mixture; a bio: or case: water has, "
        "without it, those of its constituents",
    )
    add(
        "--inelastic",
        default="",
        help="light that changes its wavelength: raman, chlorophyll, cdom, or all; --range must "
        "hold what excites it, from 300 nm, and fluorescence needs a bio: or case: water",
    )
    add("--bands", type=int, default=6, help="number of equal bands")
    add("--range", default="400,700", help="their range in nm")
    add("--depths", default="0,1,2,5,10", help="in m, increasing")
    add("--illuminant", default="equal-energy", help="d65, equal-energy, clear-sky, file:PATH")
    add("--sun-zenith", type=float, default=30.0, help="in air, degrees")
    add("--sky", choices=SKIES, default="uniform", help="shape of the illuminant's diffuse part")
    add("--surface", choices=SURFACES, default="flat")
    add("--index", type=float, default=REFRACTIVE_INDEX, help="refractive index of the water")
    add("--floor-depth", type=float, default=math.inf, help="in m; without: deep water")
    add("--floor-reflectance", type=float, default=0.0)
    add("--photons", type=float, default=1e6)
    add("--seed", type=int, default=0)
    add("--engine", choices=ENGINES, default="auto")
    add("--threads", type=int, default=1)
    add("--csv", type=Path, help="write every estimate, with radiances up and down at each depth")
    add("--plot", type=Path, help="write a picture of the irradiances (needs matplotlib)")
    return parser


def _run(options: argparse.Namespace, out: TextIO) -> None:
    low, high = _numbers("--range", options.range, 2)
    depths = _numbers("--depths", options.depths)
    bands = Bands.uniform(options.bands, low, high)
    constituents = _constituents(options)
    column = _column(options, bands, constituents)
    water, inelastic = _medium(options, column, constituents)
    views = [(depth, (0.0, 0.0, z)) for depth in depths for z in (1.0, -1.0)]
    result = simulate(
        column,
        water,
        depths,
        views=views if options.csv else (),
        inelastic=inelastic,
        photons=options.photons,
        seed=options.seed,
        engine=options.engine,
        threads=options.threads,
        sky=options.sky,
        progress=_progress,
    )
    print(file=sys.stderr)  # noqa: T201
    _table(result, out)
    if options.csv:
        result.write_csv(options.csv)
    if options.plot:
        _plot(result, options.plot)


def _constituents(options: argparse.Namespace) -> Constituents | None:
    """Return what is in the water, unless it scatters with another phase function."""
    return constituents_of(options.water) if options.phase == _OWN_PHASE else None


def _medium(
    options: argparse.Namespace, column: WaterColumn, constituents: Constituents | None
) -> Medium:
    """Return the water and the inelastic processes for :func:`.simulate`."""
    switched_on, bands = parse_processes(options.inelastic), column.bands
    if constituents is not None:
        return bio_optical_medium(constituents, bands, switched_on)
    if set(switched_on) - {"raman"}:
        raise InputError(
            "--inelastic: chlorophyll and cdom need a bio: or case: --water, and no other --phase"
        )
    phase = parse_phase(options.phase)
    _, inelastic = bio_optical_medium(Constituents(), bands, switched_on)
    return phase.for_bands(column.scattering, molecular_scattering(bands.centres)), inelastic


def _column(
    options: argparse.Namespace, bands: Bands, constituents: Constituents | None
) -> WaterColumn:
    water = _water(options.water)
    a, b = water.a(bands.centres), water.b(bands.centres)
    if constituents is not None:  # the water's table lies between their curves
        a, b = constituents.absorption(bands.centres), constituents.scattering(bands.centres)
    n = options.index if options.surface != "none" else 1.0
    light = parse_illuminant(options.illuminant, options.sun_zenith)
    cosine = math.cos(math.radians(options.sun_zenith))
    mu_s = float(in_water_cosine(options.sun_zenith, n))
    return WaterColumn(
        bands=bands,
        absorption=a,
        scattering=b,
        sun_irradiance=band_mean(light.direct, bands) * (1 - fresnel_reflectance(cosine, n)),
        sun_cosine=mu_s,
        sun_direction=sun_travel_direction(options.sun_zenith, 0.0, n),
        sky_radiance=band_mean(light.diffuse, bands) / math.pi,
        floor_depth=options.floor_depth,
        floor_reflectance=options.floor_reflectance,
        surface=options.surface,
        refractive_index=options.index,
    )


def _water(text: str) -> Water:
    if "," in text and ":" not in text:
        a, b = _numbers("--water", text, 2)
        return Water.uniform(a, b)
    return parse_uniform_water(text)


def _numbers(option: str, text: str, count: int | None = None) -> list[float]:
    try:
        values = [float(cell) for cell in text.split(",")]
    except ValueError as error:
        raise InputError(f"{option} {text!r}: write numbers with commas between") from error
    if count is not None and len(values) != count:
        raise InputError(f"{option} {text!r}: {count} numbers are needed")
    return values


def _progress(done: int, total: int) -> None:
    filled = _BAR * done // total
    bar = "█" * filled + "·" * (_BAR - filled)
    sys.stderr.write(f"\r{bar} {100 * done // total} %, {done:.3g} photons")
    sys.stderr.flush()


def _table(result: MonteCarloResult, out: TextIO) -> None:
    light = result.total
    changed = [part for name, part in result.parts.items() if name != "elastic"]
    heads = " ".join(f"{name:>11} {'±':>8}" for name in ("Ed", "Eu", "E0"))
    heads += f" {'inelastic Ed':>13} {'Eu':>8}" if changed else ""
    out.write(f"{'nm':>7} {'depth/m':>8} {heads}\n")
    for band, wavelength in enumerate(result.wavelengths):
        for row, depth in enumerate(result.depths):
            cells = " ".join(
                f"{e.mean[row, band]:11.5g} {e.error[row, band]:8.1e}"
                for e in (light.Ed, light.Eu, light.E0)
            )
            if changed:
                down = sum(part.Ed.mean[row, band] for part in changed)
                up = sum(part.Eu.mean[row, band] for part in changed)
                cells += f" {down:13.3g} {up:8.3g}"
            out.write(f"{wavelength:7.1f} {depth:8.2f} {cells}\n")
    out.write(
        f"{result.photons} photons, engine {result.engine}, seed {result.seed}; "
        f"energy balance {result.energy_balance:.1e}\n"
    )


def _plot(result: MonteCarloResult, path: Path) -> None:
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError as error:
        raise InputError("--plot needs matplotlib; install it, or use --csv") from error
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    for axis, name in zip(axes, ("Ed", "Eu"), strict=True):
        estimate = getattr(result.total, name)
        for band, wavelength in enumerate(result.wavelengths):
            mean, error = estimate.mean[:, band], estimate.error[:, band]
            seen = mean > 0
            axis.errorbar(
                mean[seen], result.depths[seen], xerr=error[seen], label=f"{wavelength:.0f} nm"
            )
        axis.set(xscale="log", xlabel=name)
    axes[0].invert_yaxis()
    axes[0].set_ylabel("depth in m")
    axes[1].legend()
    figure.savefig(path, dpi=120)
