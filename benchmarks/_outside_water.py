"""Sections of docs/measured/outside.md on measured waters, caustics, the papers' numbers."""

from __future__ import annotations

import re

import numpy as np

from ..uw_spectral.water.phase import FournierForand, PetzoldAverage
from . import _caustic_causes as causes
from . import _event_weights, gutierrez_figures
from . import _measured_waters as waters
from ._outside import MET, MISSED, OPEN, PARTLY, Row, Section, grid, percent
from .path_radiance_table import ROOT

TABLE2 = {"3C 3 m": 0.059, "3C 9 m": 0.041, "I 5 m": 0.117, "IA 9 m": 0.107, "IB 5 m": 0.107,
          "II 3 m": 0.107}  # fmt: skip
"""sRGB RMSE of the method of Monzon et al. (2024) against their path tracer, their Table 2."""
WIND = 5.25
_WANTED = 0.15
GERNEZ_ZENITHS = (20.0, 40.0, 60.0)


def measured_waters() -> Section:
    """Kd, b and phase functions against measurement; the sun of published profiles."""
    lines, every, inside, b_ratio, within = [], [], 0, [], 0
    for name in waters.MEASURED_TYPES:
        water = waters.measured_water(name)
        ratio, b = water.Kd_ratio(), water.default_b()
        kept = np.abs(ratio - 1) < 2 * water.a_spread / water.a
        b_kept = np.abs(b - 1) < 2 * water.b_spread / water.b
        every.append(ratio)
        inside += int(kept.sum())
        b_ratio.append(b)
        within += int(b_kept.sum())
        lines.append(
            f"| {name} | {len(ratio)} "
            f"| {np.median(ratio):.2f} ({ratio.min():.2f} … {ratio.max():.2f}) "
            f"| {np.median(water.a_spread / water.a):.2f} | {int(kept.sum())} "
            f"| {b.min():.2f} … {b.max():.2f} | {int(b_kept.sum())} |"
        )
    Kd, b = np.concatenate(every), np.concatenate(b_ratio)
    jerlov = grid(
        "| type | wavelengths | Kd of measured a, b over measured Kd: median (range) | spread of a "
        "| within two spreads | default b over measured b | within two spreads |",
        lines,
    )
    lee = np.abs(gutierrez_figures.Lee2005_over_solved() - 1.0)
    suns = waters.explaining_suns()
    sun_table = grid(
        "| type | published Kd over ours, sun at 30°: 450 / 550 / 650 nm | sun that fits "
        "| the same there |",
        [
            f"| {name} | {' / '.join(f'{x:.2f}' for x in at_30)} | {zenith:g}° "
            f"| {' / '.join(f'{x:.2f}' for x in best)} |"
            for name, (zenith, at_30, best) in suns.items()
        ],
    )
    stations = waters.petzold_stations()
    station_table = grid(
        "| station | bb/b | Fournier-Forand of that bb/b | default particles | Petzold average |",
        [
            f"| {fit.name} | {fit.backscatter:g} | "
            + " | ".join(
                " / ".join(f"{x:.2f}" for x in part)
                for part in (fit.fitted, fit.default, fit.average)
            )
            + " |"
            for fit in stations
        ],
    )
    angles, chi, error, ours = waters.boss_chi(FournierForand())
    petzold = waters.boss_chi(PetzoldAverage())[3]
    chi_table = grid(
        "| | " + " | ".join(f"{angle:g}°" for angle in angles) + " |",
        [
            "| measured | " + " | ".join(f"{x:.2f}" for x in chi) + " |",
            "| error, % | " + " | ".join(f"{100 * x:.0f}" for x in error) + " |",
            "| default particles | " + " | ".join(f"{x:.2f}" for x in ours) + " |",
            "| Petzold average | " + " | ".join(f"{x:.2f}" for x in petzold) + " |",
        ],
    )
    backward = [fit.fitted[2] for fit in stations]
    harbour = [fit.default for fit in stations if fit.name.startswith("NUC")]
    average = np.array([fit.average for fit in stations if fit.name.startswith("NUC")])
    coast = [suns[name][0] for name in ("3C", "5C", "9C")]
    fit_3 = np.concatenate([suns[name][2] for name in ("I", "IA", "IB")])
    rows = [
        Row("Kd of measured a and b, six Jerlov types, over measured Kd",
            "Williamson & Hollins 2022; Jerlov 1976",
            f"median {np.median(Kd):.2f}, {Kd.min():.2f} … {Kd.max():.2f}, {inside} of {len(Kd)} "
            "within two spreads of a", "1", PARTLY),
        Row("b of the default source over measured b", "Williamson & Hollins 2022",
            f"{b.min():.2f} … {b.max():.2f}, {within} of {len(b)} within two spreads",
            "1 ± 0.3", MISSED + ": an inversion; `williamson2022` is measured"),
        Row("Kd of types I, IA, IB at 30° over the published",
            "HydroLight, Solonenko & Mobley 2015",
            f"{1 / fit_3.max():.2f} … {1 / fit_3.min():.2f}", "1 (two digits)", MET),
        Row("Kd by Lee et al. (2005) over that solved, case 1 waters, sun at 10, 30, 60°",
            "HydroLight, Lee et al. 2005",
            f"{100 * np.mean(lee):.1f} % off on average, {100 * np.max(lee):.0f} % at most",
            "about 2 %, 12 % at most, in their waters", MET if np.max(lee) <= 0.12 else MISSED),
        Row("sun that explains the profiles of 3C, 5C, 9C", "Monzon 2024, Fig. 15",
            " / ".join(f"{z:.0f}°" for z in coast), "not stated; at 30° Kd is 9 to 16 % off", OPEN),
        Row("phase function backwards at eight stations, at their bb/b", "Petzold 1972",
            f"{min(backward):.2f} … {max(backward):.2f} of measured", "± 0.1", MET),
        Row("default particles at the three harbour stations, all angles", "Petzold 1972",
            f"{np.min(harbour):.2f} … {np.max(harbour):.2f} of measured",
            f"their average ± {100 * np.max(np.abs(average - 1)):.0f} %", PARTLY),
        Row("default bb/b in open water", "Petzold 1972", "0.0183",
            "0.013 to 0.044 with the water's own", "a setting: no type fixes it"),
        Row("χ = bb/(2π β), 90 to 160°", "Boss & Pegau 2001",
            f"{percent([np.min(ours / chi - 1), np.max(ours / chi - 1)])} % at most",
            "± 3 to 6 %", MET),
    ]  # fmt: skip
    text = f"""## Kd and b against measurement
a and b are the measured points of Williamson & Hollins (2022), means over 5 to 34 campaigns, Kd
is Jerlov's (1976): other water under the same name, so more than the campaigns' spread is not to be
expected. Kd to the depth of a tenth of the light, sun at {waters.MEASURED_ZENITH:g}°, SPECTRL2
sky.

{jerlov}

Violet light of the coastal types goes twice as deep in the measured water as Jerlov has it: their
a is half his. The b of the default source (Solonenko & Mobley 2015) was found by inversion of Kd
and is 0.4 to 5 times that measured; pictures of scattering need `--water-source williamson2022`.

### The sun of the published profiles
Kd printed with a and b of Solonenko & Mobley (2015), over ours to a tenth of the light, black
sky. Figure 15 of Monzon et al. (2024) shows the same profiles and does not say where the sun is.

{sun_table}

### Scattering functions
Ratio of phase functions to that measured, median of
{" / ".join(f"{low:g} to {high:g}°" for low, high in waters.RANGES)}. The water is in
the measurement and not in the functions: at the clear AUTEC stations half of the backscatter is
its own.

{station_table}

χ of Boss & Pegau (2001), the mean of 41 measured functions:

{chi_table}
"""
    return rows, text


def caustics() -> Section:
    """What makes modelled caustics too strong in the deep."""
    depths, found = causes.darecki(WIND)
    table = grid(
        "| model | " + " | ".join(f"{y:g} m" for y in depths) + " |",
        [
            f"| {cause} | "
            + " | ".join(" / ".join(f"{x:.2f}" for x in row) for row in found[cause])
            + " |"
            for cause in causes.CAUSES
        ],
    )
    clear = causes.sea.sunlit_water(causes.sea.DARECKI_WATER, causes.sea.DARECKI_ZENITH)
    lost = causes.within(clear.field.phase_at(0.0), causes.ACCEPTANCE)
    buoy = {zenith: causes.gernez(zenith) for zenith in GERNEZ_ZENITHS}
    buoy_table = grid(
        "| sun zenith | " + " | ".join(f"{t:.2g} s" for t in causes.EXPOSURES) + " |",
        [f"| {z:g}° | " + " | ".join(f"{x:.2f}" for x in row) + " |" for z, row in buoy.items()],
    )
    both, below = found[causes.CAUSES[-2]], depths > 2.0
    before, after = found[causes.CAUSES[0]][below], found[causes.CAUSES[-1]][below]
    plain, shallow = (found[causes.CAUSES[i]][~below] for i in (0, -1))
    rows = [
        Row("caustics, variation of Ed at 2.8 to 9.6 m over measured", "Darecki 2011",
            f"× {before.min():.2f} … {before.max():.2f}; with the cause found "
            f"{after.min():.2f} … {after.max():.2f}", "1 ± 0.2",
            PARTLY + ": carried by what a c-meter does not see of b"),
        Row("the same at 0.9 and 1.7 m", "Darecki 2011",
            f"× {plain.min():.2f} … {plain.max():.2f}; with the cause found "
            f"{shallow.min():.2f} … {shallow.max():.2f}, and with twice the waves of 6 to 30 cm "
            f"{both[~below].min():.2f} … {both[~below].max():.2f}", "1 ± 0.2",
            MISSED + ": carried by how many decimetre waves there are"),
        Row("caustics at 3.2 m, sun at 20 / 40 / 60°", "Gernez & Antoine 2009",
            "× " + " / ".join(f"{row[0]:.2f}" for row in buoy.values()) + "; averaged over ⅓ s "
            + " / ".join(f"{row[-1]:.2f}" for row in buoy.values()), "1 ± 0.2",
            PARTLY + ": carried by the slow record at a high sun"),
    ]  # fmt: skip
    text = f"""## Caustics: what makes them too strong
Coefficient of variation of Ed, modelled over measured by Darecki et al. (2011), at 443 / 532 /
670 nm, wind {WIND:g} m/s; one cause at a time:

{table}

- **The c-meter carries it.** b was taken from the published c(555) = 0.68 1/m. A c-meter counts
  light scattered by less than its acceptance angle as unscattered; of our particles' scattering
  that is
  {100 * lost.mean():.0f} % within {causes.ACCEPTANCE:g}° (an ac-9). With b larger by what it does
  not see, nothing else changed, the contrast at 10 m falls by a quarter. Which meter was used is
  not known to us; a C-Star (1.2°) would hide 28 %. Nothing is fitted, but it is a cause that
  fits, not one that was measured there.
- Collector, tile and the width of the sun do nothing below 3 m. Fewer short waves make it worse
  there: they blur the pattern that the long ones focus.
- **Waves of some decimetres carry what is missing near the surface.** They focus there. The
  spectrum that the sea has here, Elfouhaily's, dips between its long and its short waves; that of
  Romeiser & Alpers (1997) has 1.5 times as much slope in waves of 10 to 30 cm and half of it in
  ripples, and with it the contrast at .9 m rises by 16 %. Twice as much, and b as the c-meter
  sees it, bring all depths and wavelengths within {100 * np.abs(both - 1.0).max():.0f} %, and
  {(np.abs(both - 1.0) <= _WANTED).sum()} of {both.size} within {100 * _WANTED:.0f} %. How rough
  that sea was at these lengths was not measured, so the model keeps its spectrum.
- Whitecaps cover {100 * causes.whitecaps(WIND):.1f} % of the sea at this wind (Monahan &
  O'Muircheartaigh 1980). If no image of the sun passed them, the contrast would fall by as much.
- Near the surface the model stays a fifth to a third too weak at this wind; at 4.1 m/s, the
  calmest of the record, × 0.77 to 0.83.

At the buoy of Gernez & Antoine (2009) the water is clear, and scattering cannot be the cause.
Their record does not resolve a third of a second; the model averaged over times, over the measured:

{buoy_table}

At a high sun that is all of it. At 60° a factor of 1.4 is left, which would need more wind or
more haze than assumed; neither is published with the medians.
"""
    return rows, text


def papers() -> Section:
    """Numbers that the two papers print."""
    page = (ROOT / "docs" / "measured" / "realtime_accuracy.md").read_text(encoding="utf-8")
    found = {}
    for name in ("EEVEE, real time", "paper, printed", "paper, corrected, RGB"):
        line = re.search(rf"^\| {re.escape(name)} \|(.*)\|$", page, re.MULTILINE)
        cells = line[1].split("|") if line else []
        values = [float(cell.strip(" *")) for cell in cells]
        found[name] = [*values[: len(TABLE2)], values[-1]]  # without the column of HG 0.8
    mean = float(np.mean(list(TABLE2.values())))
    rmse = grid(
        "| | " + " | ".join(TABLE2) + " | mean |",
        [
            "| Monzon et al. 2024, Table 2, their scenes | "
            + " | ".join(f"{x:.3f}" for x in TABLE2.values()) + f" | {mean:.3f} |",
            *(f"| {name}, our grey scene | " + " | ".join(f"{x:.3f}" for x in values) + " |"
              for name, values in found.items()),
        ],
    )  # fmt: skip
    ours, water = _event_weights.ours(), _event_weights.parameters()
    events = grid(
        "| event | printed | ours |",
        [f"| {name} | {x:.2e} | {ours[name]:.2e} |" for name, x in _event_weights.PRINTED.items()],
    )
    elastic = [name for name in ours if name.startswith(("scattering by m", "scattering by p"))]
    rows = [
        Row("sRGB RMSE of real time, mean of six waters and depths", "Monzon 2024, Table 2",
            f"{found['EEVEE, real time'][-1]:.3f} (their formula there: "
            f"{found['paper, printed'][-1]:.3f})", f"{mean:.3f}, in their scenes",
            "better, in other scenes"),
        Row("event weights at 500 nm, particles' scattering", "Gutierrez 2008, §4.1",
            " / ".join(f"{ours[name]:.3f}" for name in elastic),
            " / ".join(f"{_event_weights.PRINTED[name]:.3f}" for name in elastic),
            "fitted: their water is not printed"),
        Row("weight of Raman scattering at 500 nm", "Gutierrez 2008, §4.1",
            f"{ours['Raman scattering']:.1e}", f"{_event_weights.PRINTED['Raman scattering']:.1e}",
            "theirs is no published coefficient"),
        Row("weights of fluorescence, phytoplankton / CDOM", "Gutierrez 2008, §4.1",
            f"{ours['fluorescence of phytoplankton']:.1e} / {ours['fluorescence of CDOM']:.1e}",
            f"{_event_weights.PRINTED['fluorescence of phytoplankton']:.1e} / "
            f"{_event_weights.PRINTED['fluorescence of CDOM']:.1e}",
            "theirs needs yields of 31 and 13 %"),
    ]  # fmt: skip
    text = f"""## The papers' own numbers
**Monzon et al. (2024), Table 2.** sRGB RMSE against path tracing. Their scenes, textures and
exposure are not published; the grey scene has the same waters and depths, under a clear sky with
the default phase function, over squares of 3 × 3 pixels
([realtime_accuracy.md](realtime_accuracy.md)).

{rmse}

**Gutierrez et al. (2008), §4.1.** The weights of the ten events at 500 nm, without the water they
belong to. Their own equations give it: κ = {water.extinction:.4f} 1/m,
{water.constituents.described()}. Beside them
our weights of that water. Absorption by water differs because theirs is Smith & Baker's; by CDOM,
detritus and particles because κ is larger with our phytoplankton and molecules. Their
fluorescence would need quantum yields of 31 % (phytoplankton; 1 to 10 % are measured) and 13 %
(CDOM; 1 %), their Raman scattering a coefficient of 1e-10 1/m (2.3e-4 is measured).

{events}

**Gutierrez et al. (2008), Figure 2**: our swatches of the twelve printed waters are in
[bio_optics.md](bio_optics.md); the pictures themselves print no number.
"""
    return rows, text
