"""Command line of the Monte Carlo solver: irradiance with depth as a table, CSV and plot.

python -m uw_spectral.monte_carlo --water jerlov:II --depths 0,1,2,5,10 --plot II.png
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TextIO

import numpy as np

from ..bands import Bands
from ..errors import InputError
from ..illuminant import band_mean, parse_illuminant
from ..phase import parse_phase
from ..sun import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ..water import Water, molecular_scattering
from ..water_column import SURFACES, WaterColumn
from ..water_names import parse_water
from .results import MonteCarloResult
from .solver import ENGINES, SKIES, simulate

_BAR = 40


def main(arguments: list[str] | None = None, out: TextIO | None = None) -> int:
    """Run the command line; return the exit status: 0, or 2 if the input cannot be used."""
    out = out or sys.stdout
    options = _parser().parse_args(arguments)
    try:
        _run(options, out)
    except (InputError, OSError) as error:
        print(f"\nmonte_carlo: {error}", file=sys.stderr)  # noqa: T201
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m uw_spectral.monte_carlo", description=__doc__.partition("\n")[0]
    )
    add = parser.add_argument
    add("--water", default="jerlov:IB", help="jerlov:TYPE, a CSV file, or a,b in 1/m")
    add("--phase", default="mixture", help="hg:0.8, fournier-forand:1.10,0.0183, petzold, mixture")
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
    column, b_molecular = _column(options, bands)
    phase = parse_phase(options.phase).for_bands(column.scattering, b_molecular)
    views = [(depth, (0.0, 0.0, z)) for depth in depths for z in (1.0, -1.0)]
    result = simulate(
        column,
        phase,
        depths,
        views=views if options.csv else (),
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


def _column(options: argparse.Namespace, bands: Bands) -> tuple[WaterColumn, np.ndarray]:
    water = _water(options.water)
    n = options.index if options.surface != "none" else 1.0
    light = parse_illuminant(options.illuminant, options.sun_zenith)
    cosine = math.cos(math.radians(options.sun_zenith))
    mu_s = float(in_water_cosine(options.sun_zenith, n))
    column = WaterColumn(
        bands=bands,
        absorption=water.a(bands.centres),
        scattering=water.b(bands.centres),
        sun_irradiance=band_mean(light.direct, bands) * (1 - fresnel_reflectance(cosine, n)),
        sun_cosine=mu_s,
        sun_direction=sun_travel_direction(options.sun_zenith, 0.0, n),
        sky_radiance=band_mean(light.diffuse, bands) / math.pi,
        floor_depth=options.floor_depth,
        floor_reflectance=options.floor_reflectance,
        surface=options.surface,
        refractive_index=options.index,
    )
    return column, molecular_scattering(bands.centres)


def _water(text: str) -> Water:
    if "," in text:
        return Water.uniform(*_numbers("--water", text, 2))
    return parse_water(text)


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
    heads = " ".join(f"{name:>11} {'±':>8}" for name in ("Ed", "Eu", "E0"))
    out.write(f"{'nm':>7} {'depth/m':>8} {heads}\n")
    for band, wavelength in enumerate(result.wavelengths):
        for row, depth in enumerate(result.depths):
            cells = " ".join(
                f"{e.mean[row, band]:11.5g} {e.error[row, band]:8.1e}"
                for e in (light.Ed, light.Eu, light.E0)
            )
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


if __name__ == "__main__":
    sys.exit(main())
