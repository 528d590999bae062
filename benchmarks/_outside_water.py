"""Sections of docs/measured/outside.md on measured waters, caustics, the papers' numbers."""

from __future__ import annotations

import re

import numpy as np

from ..uw_spectral.water.phase import FournierForand
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
            f"| {name} | {np.median(ratio):.2f} ({ratio.min():.2f}…{ratio.max():.2f}) "
            f"| {b.min():.2f}…{b.max():.2f} |"
        )
    Kd, b = np.concatenate(every), np.concatenate(b_ratio)
    jerlov = grid(
        "| type | Kd of measured a, b over measured Kd | default b over measured b |",
        lines,
    )
    lee = np.abs(gutierrez_figures.Lee2005_over_solved() - 1.0)
    suns = waters.explaining_suns()
    sun_table = grid(
        "| type | " + " | ".join(suns) + " |",
        [
            "| Kd over ours at 550 nm | "
            + " | ".join(f"{at_30[1]:.2f}" for _, at_30, _ in suns.values())
            + " |",
            "| sun that fits | " + " | ".join(f"{sun:g}°" for sun, *_ in suns.values()) + " |",
        ],
    )
    stations = waters.petzold_stations()
    _, chi, _, ours = waters.boss_chi(FournierForand())
    backward = [fit.fitted[2] for fit in stations]
    harbour = [fit.default for fit in stations if fit.name.startswith("NUC")]
    average = np.array([fit.average for fit in stations if fit.name.startswith("NUC")])
    coast = [suns[name][0] for name in ("3C", "5C", "9C")]
    fit_3 = np.concatenate([suns[name][2] for name in ("I", "IA", "IB")])
    rows = [
        Row("Kd of measured a and b, six Jerlov types, over measured Kd",
            "Williamson & Hollins 2022; Jerlov 1976",
            f"median {np.median(Kd):.2f}, {Kd.min():.2f}…{Kd.max():.2f}, {inside} of {len(Kd)} "
            "within two spreads of a", "1", PARTLY),
        Row("b of the default source over measured b", "Williamson & Hollins 2022",
            f"{b.min():.2f}…{b.max():.2f}, {within} of {len(b)} within two spreads",
            "1 ± 0.3", MISSED + ": an inversion; `williamson2022` is measured"),
        Row("Kd of types I, IA, IB at 30° over the published",
            "HydroLight, Solonenko & Mobley 2015",
            f"{1 / fit_3.max():.2f}…{1 / fit_3.min():.2f}", "1 (two digits)", MET),
        Row("Kd by Lee et al. (2005) over that solved, case 1 waters, sun at 10, 30, 60°",
            "HydroLight, Lee et al. 2005",
            f"{100 * np.mean(lee):.1f} % off on average, {100 * np.max(lee):.0f} % at most",
            "about 2 %, 12 % at most, in their waters", MET if np.max(lee) <= 0.12 else MISSED),
        Row("sun that explains the profiles of 3C, 5C, 9C", "Monzon 2024, Fig. 15",
            "/".join(f"{z:.0f}°" for z in coast), "not stated; at 30° Kd is 9 to 16 % off", OPEN),
        Row("phase function backwards at eight stations, at their bb/b", "Petzold 1972",
            f"{min(backward):.2f}…{max(backward):.2f} of measured", "± 0.1", MET),
        Row("default particles at the three harbour stations, all angles", "Petzold 1972",
            f"{np.min(harbour):.2f}…{np.max(harbour):.2f} of measured",
            f"their average ± {100 * np.max(np.abs(average - 1)):.0f} %", PARTLY),
        Row("default bb/b in open water", "Petzold 1972", "0.0183",
            "0.013 to 0.044 with the water's own", "a setting: no type fixes it"),
        Row("χ = bb/(2π β), 90 to 160°", "Boss & Pegau 2001",
            f"{percent([np.min(ours / chi - 1), np.max(ours / chi - 1)])} % at most",
            "± 3 to 6 %", MET),
    ]  # fmt: skip
    text = f"""## Kd and b against measurement
a and b are the points of Williamson & Hollins (2022), means over 5 to 34 campaigns, Kd is Jerlov's
(1976), to a tenth of the light, sun at {waters.MEASURED_ZENITH:g}°: other water under the same
name, so that the spread of a (0.13 to 0.26) is all that can be expected.

{jerlov}

Violet light goes twice as deep in the measured coastal water as Jerlov has it. The b of the default
source (Solonenko & Mobley 2015) is an inversion's; pictures of scattering need
`--water-source williamson2022`.

### The sun of the published profiles
Kd printed with a and b of Solonenko & Mobley (2015) over ours with the sun at 30°, black sky, and
the sun that makes them equal; Figure 15 of Monzon et al. (2024) shows them and says no sun.

{sun_table}

### Scattering functions
Over those of Petzold's eight stations, their water in them, Fournier-Forand of the station's bb/b
({min(fit.backscatter for fit in stations):g} to {max(fit.backscatter for fit in stations):g})
is {min(backward):.2f} to {max(backward):.2f} backwards, the default particles
{np.min(harbour):.2f} to {np.max(harbour):.2f} in the harbour at all angles. χ of Boss & Pegau
(2001), 90 to 160°, is met within {percent([np.min(ours / chi - 1), np.max(ours / chi - 1)])} %
(its error 3 to 6 %).
"""
    return rows, text


def caustics() -> Section:
    """What makes modelled caustics too strong in the deep."""
    depths, found = causes.darecki(WIND)
    table = grid(
        "| model | " + " | ".join(f"{y:g} m" for y in depths) + " |",
        [
            f"| {cause} | " + " | ".join(f"{x:.2f}" for x in found[cause][:, 1]) + " |"
            for cause in (causes.CAUSES[0], *causes.CAUSES[3:4], *causes.CAUSES[5:])
        ],
    )
    clear = causes.sea.sunlit_water(causes.sea.DARECKI_WATER, causes.sea.DARECKI_ZENITH)
    lost = causes.within(clear.field.phase_at(0.0), causes.ACCEPTANCE)
    buoy = {zenith: causes.gernez(zenith) for zenith in GERNEZ_ZENITHS}
    both, below = found[causes.CAUSES[-2]], depths > 2.0
    before, after = found[causes.CAUSES[0]][below], found[causes.CAUSES[-1]][below]
    plain, shallow = (found[causes.CAUSES[i]][~below] for i in (0, -1))
    rows = [
        Row("caustics, variation of Ed at 2.8 to 9.6 m over measured", "Darecki 2011",
            f"× {before.min():.2f}…{before.max():.2f}; with the cause found "
            f"{after.min():.2f}…{after.max():.2f}", "1 ± 0.2",
            PARTLY + ": carried by what a c-meter does not see of b"),
        Row("the same at 0.9 and 1.7 m", "Darecki 2011",
            f"× {plain.min():.2f}…{plain.max():.2f}; with the cause found "
            f"{shallow.min():.2f}…{shallow.max():.2f}, and with twice the waves of 6 to 30 cm "
            f"{both[~below].min():.2f}…{both[~below].max():.2f}", "1 ± 0.2",
            MISSED + ": carried by how many decimetre waves there are"),
        Row("caustics at 3.2 m, sun at 20 / 40 / 60°", "Gernez & Antoine 2009",
            "× " + "/".join(f"{row[0]:.2f}" for row in buoy.values()) + "; averaged over ⅓ s "
            + "/".join(f"{row[-1]:.2f}" for row in buoy.values()), "1 ± 0.2",
            PARTLY + ": carried by the slow record at a high sun"),
    ]  # fmt: skip
    text = f"""## Caustics: what makes them too strong
Variation of Ed, modelled over measured by Darecki et al. (2011), at 532 nm, wind {WIND:g} m/s; one
cause at a time.

{table}

- Disc, collector and tile do nothing below 3 m; there the c-meter carries it: b was taken from
  the published c(555), and {100 * lost.mean():.0f} % of our scattering is within the
  {causes.ACCEPTANCE:g}° of an ac-9 (28 % within the 1.2° of a C-Star); which meter was used is
  not known.
- Above, waves of some decimetres are missing: with those of Romeiser & Alpers (1997), 1.5 times the
  slope at 10 to 30 cm, contrast at .9 m rises by 16 %; twice as many, and the c-meter, bring all
  depths and wavelengths within {100 * np.abs(both - 1.0).max():.0f} %
  ({(np.abs(both - 1.0) <= _WANTED).sum()} of {both.size} within {100 * _WANTED:.0f} %). How rough
  that sea was is not measured: the model keeps its spectrum and is **a fifth to a third too weak**
  there (× 0.77 to 0.83 at 4.1 m/s). Whitecaps cover {100 * causes.whitecaps(WIND):.1f} %.
- At the buoy of Gernez & Antoine (2009), 3.2 m, the model is
  {"/".join(f"{row[0]:.2f}" for row in buoy.values())} of the measured with the sun at 20 / 40 /
  60°, averaged over ⅓ s {"/".join(f"{row[-1]:.2f}" for row in buoy.values())}: a slow record, and
  at 60° more wind or haze than assumed.
"""
    return rows, text


def papers() -> Section:
    """Numbers that the two papers print."""
    page = (ROOT / "docs" / "measured" / "realtime_accuracy.md").read_text(encoding="utf-8")
    found = {}
    for name in ("EEVEE, real time", "paper, printed", "paper, corrected, RGB"):
        line = re.search(rf"^\| {re.escape(name)} \| ([\d.]+) \|", page, re.MULTILINE)
        if line is None:
            raise ValueError(f"docs/measured/realtime_accuracy.md: no row of {name!r}")
        found[name] = float(line[1])
    mean = float(np.mean(list(TABLE2.values())))
    ours, water = _event_weights.ours(), _event_weights.parameters()
    elastic = [name for name in ours if name.startswith(("scattering by m", "scattering by p"))]
    rows = [
        Row("sRGB RMSE of real time, mean of six waters and depths", "Monzon 2024, Table 2",
            f"{found['EEVEE, real time']:.3f} (their formula there: "
            f"{found['paper, printed']:.3f})", f"{mean:.3f}, in their scenes",
            "better, in other scenes"),
        Row("event weights at 500 nm, particles' scattering", "Gutierrez 2008, §4.1",
            "/".join(f"{ours[name]:.3f}" for name in elastic),
            "/".join(f"{_event_weights.PRINTED[name]:.3f}" for name in elastic),
            "fitted: their water is not printed"),
        Row("weight of Raman scattering at 500 nm", "Gutierrez 2008, §4.1",
            f"{ours['Raman scattering']:.1e}", f"{_event_weights.PRINTED['Raman scattering']:.1e}",
            "theirs is no published coefficient"),
        Row("weights of fluorescence, phytoplankton / CDOM", "Gutierrez 2008, §4.1",
            f"{ours['fluorescence of phytoplankton']:.1e}/{ours['fluorescence of CDOM']:.1e}",
            f"{_event_weights.PRINTED['fluorescence of phytoplankton']:.1e} / "
            f"{_event_weights.PRINTED['fluorescence of CDOM']:.1e}",
            "theirs needs yields of 31 and 13 %"),
    ]  # fmt: skip
    text = f"""## The papers' own numbers
Monzon et al. (2024), Table 2, print a mean sRGB RMSE of {mean:.3f} against path tracing in scenes
that are not published; on our grey scene in the same waters EEVEE in real time has
{found["EEVEE, real time"]:.3f}, their formula {found["paper, printed"]:.3f} as printed and
{found["paper, corrected, RGB"]:.3f} corrected ([realtime_accuracy.md](realtime_accuracy.md)).

The ten event weights of Gutierrez et al. (2008), §4.1, at 500 nm give a water by their equations:
κ = {water.extinction:.4f} 1/m, {water.constituents.described()}. Their fluorescence would need
quantum yields of 31 % (phytoplankton; 1 to 10 % are measured) and 13 % (CDOM; 1 %), their Raman
scattering a coefficient of 1e-10 1/m (2.3e-4 is measured).
"""
    return rows, text
