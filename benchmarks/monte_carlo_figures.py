"""Published figures by Monte Carlo. Writes docs/measured/monte_carlo_figures.md and its pictures.

``python3 dev.py run -m benchmarks monte_carlo_figures PHOTONS THREADS``.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import reduction, srgb_encode
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.spectra.sensor import parse_sensor
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.bio_optics import named_waters
from ..uw_spectral.water.inelastic_processes import PROCESSES
from ..uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from ..uw_spectral.water.phase import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from ..validation.monte_carlo import MonteCarloResult, bio_optical_medium, simulate
from .inelastic_table import BANDS, CAMERA, CONE, SUN_ZENITH, column_of, first_order
from .path_radiance_table import ROOT

VIEW = (math.cos(math.radians(10)), 0.0, -math.sin(math.radians(10)))
CASES = {"elastic": (), "+ chlorophyll": ("chlorophyll",), "+ all": PROCESSES}
WAVELENGTHS = (450.0, 550.0, 650.0)
PROFILE_DEPTHS = np.linspace(0.0, 30.0, 31)
# Depths count where this share of the light is left.
_LEFT = 0.01


def baltic_radiance(photons: int, threads: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Radiance and standard error by part, per band: elastic and each process."""
    water = named_waters()["baltic"].constituents
    found, factors = first_order(
        water, [CAMERA], [(CAMERA, VIEW)], photons=photons, threads=threads, cone=CONE
    )
    elastic = found.parts["elastic"].L
    parts = {"elastic": (elastic.mean[0][::2], elastic.error[0][::2])}
    for name in PROCESSES:
        light = found.parts[f"{name} light"].L
        parts[name] = tuple(x[0][1::2] / factors[name] for x in (light.mean, light.error))
    return parts


def event_shares(photons: int, threads: int) -> tuple[dict[str, float], MonteCarloResult]:
    """Share of each event in the number of events of the Baltic, and the simulation."""
    water = named_waters()["baltic"].constituents
    parts, processes = bio_optical_medium(water, BANDS)
    found = simulate(
        column_of(water), parts, [CAMERA], inelastic=processes, photons=photons, threads=threads
    )
    ten = found.events[:-2]  # the last two are surface and floor
    # Each band starts the same number of photons, whatever its light: weigh by power.
    total = sum(event.power.sum() for event in ten)
    return {event.name: float(event.power.sum() / total) for event in ten}, found


def colour(radiance: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Return the sRGB, the brightest channel at 0.8; the eye is adapted to the light above."""
    eye = parse_sensor("cie1931")
    seen = BANDS.centres > 360  # the observer knows no shorter ones
    bands = Bands(BANDS.centres[seen], BANDS.widths[seen])
    to_rgb = reduction(eye, bands, parse_illuminant("clear-sky", SUN_ZENITH), light[seen])
    rgb = np.maximum(to_rgb.apply(radiance[seen]), 0.0)
    return srgb_encode(0.8 * rgb / rgb.max())


def profile(name: str, photons: int, threads: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ed over its value below the surface, its relative error, and published Kd, of a type."""
    water = Water.jerlov(name)
    bands = Bands(np.array(WAVELENGTHS), np.ones(len(WAVELENGTHS)))
    b = water.b(WAVELENGTHS)
    entering = 1 - float(fresnel_reflectance(math.cos(math.radians(SUN_ZENITH)), REFRACTIVE_INDEX))
    column = WaterColumn(
        bands=bands,
        absorption=water.a(WAVELENGTHS),
        scattering=b,
        sun_irradiance=entering,
        sun_cosine=float(in_water_cosine(SUN_ZENITH)),
        sun_direction=sun_travel_direction(SUN_ZENITH, 0.0),
        sky_radiance=0.0,
        floor_depth=math.inf,
        floor_reflectance=0.0,
        surface="flat",
        refractive_index=REFRACTIVE_INDEX,
    )
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(WAVELENGTHS))
    Ed = simulate(column, phase, PROFILE_DEPTHS, photons=photons, threads=threads).total.Ed
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        Kd = water.Kd(WAVELENGTHS)
    return Ed.mean / Ed.mean[0], Ed.relative_error, Kd


def mean_Kd(relative: np.ndarray) -> float:
    """Kd over the depths that keep 1 % of the light, by regression through the surface."""
    y, log = PROFILE_DEPTHS[relative > _LEFT], np.log(relative[relative > _LEFT])
    return float(-(y * log).sum() / (y**2).sum())


def _draw_profiles(profiles: dict, path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    sheet, axes = plt.subplots(2, 5, figsize=(9, 4.6), dpi=72, sharex=True, sharey=True)
    for axis, (name, (Ed, _, Kd)) in zip(axes.flat, profiles.items(), strict=True):
        for i, ink in enumerate(("tab:blue", "tab:green", "tab:red")):
            axis.plot(Ed[:, i], PROFILE_DEPTHS, ".", color=ink, markersize=3)
            axis.plot(np.exp(-Kd[i] * PROFILE_DEPTHS), PROFILE_DEPTHS, color=ink, linewidth=1)
        axis.set_title(f"Jerlov {name}", fontsize=8)
        axis.set_xscale("log")
        axis.set_xlim(1e-3, 1.5)
        axis.set_ylim(PROFILE_DEPTHS[-1], 0)
        axis.tick_params(labelsize=7)
    sheet.supxlabel("Ed / Ed(0); dots: Monte Carlo, lines: exp(-Kd y)", fontsize=8)
    sheet.supylabel("depth, m", fontsize=8)
    sheet.tight_layout()
    sheet.savefig(path, metadata={"Software": None})
    plt.close(sheet)


def _draw_baltic(radiance: dict, colours: dict, shares: dict, path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    sheet, (left, middle, right) = plt.subplots(
        1, 3, figsize=(10, 3.2), dpi=72, layout="constrained", width_ratios=(1, 3, 3)
    )
    for i, (name, rgb) in enumerate(colours.items()):
        left.bar(i, 1, width=1, color=rgb)
        left.text(i, 0.5, name, ha="center", fontsize=7, rotation=90)
    left.set_axis_off()
    for name, (mean, error) in radiance.items():
        middle.errorbar(BANDS.centres, np.maximum(mean, 1e-12), error, label=name, linewidth=1)
    middle.set_yscale("log")
    top = radiance["elastic"][0].max()
    middle.set_ylim(1e-6 * top, 2 * top)
    middle.set_xlabel("wavelength, nm", fontsize=8)
    middle.set_title("radiance", fontsize=8)
    middle.legend(fontsize=7)
    names = list(shares)
    right.barh(names, [100 * shares[name] for name in names])
    right.set_xscale("log")
    right.set_title("share of the events, %", fontsize=8)
    for axis in (middle, right):
        axis.tick_params(labelsize=7)
    sheet.savefig(path, metadata={"Software": None})
    plt.close(sheet)


def main(arguments: list[str]) -> None:
    """Measure, draw and write; photons per simulation, threads."""
    photons = int(float(arguments[0])) if arguments else 400_000
    threads = int(arguments[1]) if len(arguments) > 1 else 1
    docs = ROOT / "docs" / "measured"
    radiance = baltic_radiance(photons, threads)
    shares, simulation = event_shares(photons, threads)
    light = simulation.total.Ed.mean[0]
    sums = {
        case: radiance["elastic"][0] + sum((radiance[name][0] for name in on), np.zeros(len(BANDS)))
        for case, on in CASES.items()
    }
    colours = {case: colour(total, light) for case, total in sums.items()}
    seen = (BANDS.centres > 380) & (BANDS.centres < 780)
    observer = parse_sensor("cie1931").sensitivity.at_or_zero(BANDS.centres)[:, 1]
    total = sums["+ all"]
    share_rows = []
    for name in (*PROCESSES, "all"):
        mean = sum(radiance[n][0] for n in PROCESSES) if name == "all" else radiance[name][0]
        errors = [radiance[n][1] for n in (PROCESSES if name == "all" else (name,))]
        error = math.sqrt(sum((e[seen] ** 2).sum() for e in errors)) / total[seen].sum()
        share_rows.append(
            f"| {name} | {100 * mean[seen].sum() / total[seen].sum():.2f}±{100 * error:.2f} % "
            f"| {100 * (mean @ observer) / (total @ observer):.2f} % |"
        )
    _draw_baltic(radiance, colours, shares, docs / "monte_carlo_baltic.png")
    profiles = {name: profile(name, photons, threads) for name in JERLOV_TYPES}
    _draw_profiles(profiles, docs / "monte_carlo_jerlov.png")
    profile_rows, largest = [], 0.0
    for name, (Ed, error, Kd) in profiles.items():
        off, furthest = [], []
        for i in range(len(WAVELENGTHS)):
            kept = (Ed[:, i] > _LEFT) & (PROFILE_DEPTHS > 0)
            ratio = np.exp(-Kd[i] * PROFILE_DEPTHS[kept]) / Ed[kept, i]
            off.append(f"{100 * (Kd[i] / mean_Kd(Ed[:, i]) - 1):+.1f}")
            furthest.append(100 * (ratio[np.argmax(np.abs(np.log(ratio)))] - 1))
            largest = max(largest, float(error[kept, i].max()))
        far = max(furthest, key=abs)
        profile_rows.append(f"| {name} | {'/'.join(off)} | {far:+.0f} |")
    newline = "\n"
    events = ", ".join(f"{name} {100 * share:.2f}" for name, share in shares.items())
    codes = ", ".join(
        f"{case} `#{''.join(f'{round(255 * float(v)):02x}' for v in rgb)}`"
        for case, rgb in colours.items()
    )
    text = f"""# Published figures by Monte Carlo

Written by `python3 dev.py run -m benchmarks monte_carlo_figures`; {photons} photons in each
simulation.

## Gutierrez et al. (2008), Figures 4 and 5: the Baltic
![Colour, radiance and events](monte_carlo_baltic.png)

Seen at {CAMERA:g} m, 10° below level, clear sky, sun at {SUN_ZENITH:g}°, quantum yield of
chlorophyll 0.02, constituents as in [bio_optics.md](bio_optics.md). Colours: {codes}. Fraction of
the radiance, 380 to 780 nm, and of its luminance; the paper reports about 2 %.

| process | radiance | luminance |
|---|---|---|
{newline.join(share_rows)}

Fraction of the ten events by the power of the light; *chlorophyll light* and *cdom light* are the
absorptions that can excite, of which at most two in a hundred emit.

In %: {events}.

## Monzon et al. (2024), Figure 15: irradiance profiles of the Jerlov types
![Profiles](monte_carlo_jerlov.png)

Kd published with a and b of Solonenko & Mobley (2015) over that of the Monte Carlo, default phase
function, sun at {SUN_ZENITH:g}° in a black sky, in % at
{"/".join(f"{nm:g}" for nm in WAVELENGTHS)} nm; then the ratio of exp(-Kd y) to the Monte Carlo
that is furthest from 1, down to 1 % of the light or {PROFILE_DEPTHS[-1]:g} m, in % (standard error
at most {100 * largest:.1f} %).

| type | Kd | furthest off |
|---|---|---|
{newline.join(profile_rows)}
"""
    (docs / "monte_carlo_figures.md").write_text(text, encoding="utf-8")
    print(text)
