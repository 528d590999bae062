"""Measurements and published numbers beside ours: docs/validation.md, docs/measured/outside.md.

Numbers of real time are those kept of their page; tests/validation/test_outside.py holds the same
comparisons to bounds of others.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..uw_spectral.water.inelastic_processes import raman_coefficient
from ..uw_spectral.water.phase_functions import FournierForand
from ..validation import caustics_at_sea as sea
from ..validation import constituent_seas, ecolight, hydrolight, raman_at_sea, tyler
from ..validation import measured_waters as waters
from ..validation.canonical_problems import PROBLEMS, canonical_field, canonical_values, closed_form
from ..validation.monzon import TABLE2
from . import planted_errors
from .runner import Ask, Page, Record, joined, ranged, table

MET, PARTLY, MISSED, OPEN = "met", "**partly**", "**missed**", "open"
CLOSED = ((1, 1), (1, 2), (2, 1), (2, 2), (6, 1))
"""Canonical problems that the closed form knows."""
_SHOWN = [0, 1, 4, 5]  # wavelengths of Raman light

Rows = list[tuple[str, str, str, str, str]]
"""What, whose, our number, theirs, the verdict."""


def _percent(values: object, form: str = "+.0f") -> str:
    return joined(100 * np.asarray(values), form)


def _tyler(rows: Rows) -> Mapping[str, Any]:
    """Radiance distributions of Lake Pend Oreille."""
    at = tyler.lake()
    fraction, lines, fits = at.sky_fraction(), [], {}
    for name in tyler.PHASES:
        fits[name] = [tyler.misfit(x) for x in tyler.modelled(name, fraction)]
        cells = [
            cell
            for x in fits[name]
            for cell in (_percent((x.median, x.tail, x.worst), ".0f"),
                         f"{100 * x.shape:.1f}/{100 * x.shape_tail:.0f}")
        ]  # fmt: skip
        lines.append([f"`{name}`", *cells])
    ff, petzold = fits["fournier-forand:1.10,0.0183"], fits["petzold"]
    broad, count = fits["hg:0.8"][0], int(at.compared.sum())
    said = [
        f"{_percent([x.median for x in pair], '.0f')} % off in the median, at each depth "
        f"{_percent([x.shape for x in pair], '.0f')} %; 90 % "
        f"{_percent([x.tail for x in pair], '.0f')} %"
        for pair in zip(ff, petzold, strict=True)
    ]
    theirs, where = "measured; lake even to ± 10 % in a", "Tyler 1958, Lake Pend Oreille"
    met = f"{MET} in the median" if max(ff[0].median, petzold[0].median) < 0.15 else MISSED
    rows += [
        (f"radiance, 7 depths × {count} directions, solved, Fournier-Forand/Petzold", where,
         said[0], theirs, met),
        ("the same, closed form", where, said[1], theirs, PARTLY),
        ("the same, solved, HG 0.8 of Monzon et al. 2024", where,
         f"{100 * broad.median:.0f} %, at each depth {100 * broad.shape:.0f} %", theirs,
         "the phase function is wrong"),
    ]  # fmt: skip
    heads = ("phase function", "solved: one factor", "each depth", "closed form: one", "each depth")
    return {
        "tyler": table(heads, lines), "directions": count, "c": at.c, "a": at.mean_absorption(),
        "sky": 100 * fraction, "shallow": ff[0].by_depth[0], "deep": ff[0].by_depth[-1],
    }  # fmt: skip


def _canonical(rows: Rows) -> Mapping[str, Any]:
    """Canonical problems of Mobley et al. (1993)."""
    for problem, case in PROBLEMS:
        field, off = canonical_field(problem, case), {}
        for row in canonical_values(problem, case):
            off.setdefault(row.quantity, []).append((row.found(field) / row.mean - 1, row.scatter))
        ours, theirs = (
            "; ".join(f"{name}{sign}{_percent([x[i] for x in each], form)} %"
                      for name, each in off.items())
            for i, sign, form in ((0, " ", "+.1f"), (1, " ± ", ".1f"))
        )  # fmt: skip
        worst = max(abs(d) / max(2 * s, 0.02) for each in off.values() for d, s in each)
        verdict = MET if worst <= 1 else PARTLY
        if problem == 4:
            verdict = f"{OPEN}: their atmospheres differ by 18 %"
        rows.append((f"problem {problem}, case {case}", "Mobley 1993", ours, theirs, verdict))
    closed = [
        _percent([
            float(closed_form(*each).Ed(row.depth)[0]) / row.mean - 1
            for row in canonical_values(*each) if row.quantity == "Ed"
        ], "+.1f")
        for each in CLOSED
    ]  # fmt: skip
    rows.append((
        "Ed of the closed form, " + "; ".join(f"{p}, {c}" for p, c in CLOSED), "Mobley 1993",
        "; ".join(f"{x} %" for x in closed), "as above",
        f"{PARTLY}: to 5 % where much is scattered, down to τ = 5",
    ))  # fmt: skip
    return {}


def _ecolight(rows: Rows) -> Mapping[str, Any]:
    """Light in waters of chlorophyll, minerals and CDOM by EcoLight."""
    found, lines = ecolight.differences(), []
    for name, off in found.items():
        three = [*np.percentile(np.abs(off), (50, 95)), np.abs(off).max()]
        lines.append([name, f"{100 * np.median(off):+.1f}", *(f"{100 * x:.1f}" for x in three)])
    worst = "; ".join(f"{name} {100 * np.abs(off).max():.1f} %" for name, off in found.items())
    rows.append((
        f"light at 1 and 2 m of {len(ecolight.published())} cases, 24 waters, at most off",
        "EcoLight 6.0.1", worst, "its directions are 10° wide", MET,
    ))  # fmt: skip
    heads = ("quantity", "median", "median of the amount", "95 %", "worst")
    leaving = hydrolight.differences()
    extremes = [f"{100 * off.min():+.1f} to {100 * off.max():+.1f}" for off in leaving.values()]
    rows.append((
        "reflectance of 16 waters, deep or over a floor, under a sky; under a sun",
        "HydroLight 4.2", "; ".join(f"{x} %" for x in extremes), "± 2 %",
        MET if all(np.abs(off).max() <= 0.02 for off in leaving.values()) else MISSED,
    ))  # fmt: skip
    sky, sun = extremes
    return {"ecolight": table(heads, lines), "under_sky": sky, "under_sun": sun}


def _waters(rows: Rows) -> Mapping[str, Any]:
    """Kd, b and phase functions against measurement; the sun of published profiles."""
    types = {name: waters.measured_water(name) for name in waters.MEASURED_TYPES}
    Kds = {name: water.Kd_ratio() for name, water in types.items()}
    bs = {name: water.default_b() for name, water in types.items()}
    near = [
        sum(int((np.abs(found[n] - 1) < 2 * getattr(w, f"{of}_spread") / getattr(w, of)).sum())
            for n, w in types.items())
        for found, of in ((Kds, "a"), (bs, "b"))
    ]  # fmt: skip
    Kd, b = (np.concatenate(list(x.values())) for x in (Kds, bs))
    lee = np.abs(constituent_seas.Lee2005_over_solved() - 1.0)
    suns, stations = waters.explaining_suns(), waters.petzold_stations()
    _, chi, _, ours = waters.boss_chi(FournierForand())
    backward = [fit.fitted[2] for fit in stations]
    harbour = [fit.default for fit in stations if fit.name.startswith("NUC")]
    average = np.array([fit.average for fit in stations if fit.name.startswith("NUC")])
    fit_3 = np.concatenate([suns[name][2] for name in ("I", "IA", "IB")])
    off_chi = _percent([np.min(ours / chi - 1), np.max(ours / chi - 1)])
    rows += [
        ("Kd of measured a and b, six Jerlov types, over measured Kd",
         "Williamson & Hollins 2022; Jerlov 1976",
         f"median {np.median(Kd):.2f}, {ranged(Kd)}, {near[0]} of {len(Kd)} within two spreads of "
         "a", "1", PARTLY),
        ("b of the default source over measured b", "Williamson & Hollins 2022",
         f"{ranged(b)}, {near[1]} of {len(b)} within two spreads", "1 ± 0.3",
         MISSED + ": an inversion; `williamson2022` is measured"),
        ("Kd of types I, IA, IB at 30° over the published", "HydroLight, Solonenko & Mobley 2015",
         ranged(1 / fit_3), "1 (two digits)", MET),
        ("Kd by Lee et al. (2005) over that solved, case 1 waters, sun at 10, 30, 60°",
         "HydroLight, Lee et al. 2005",
         f"{100 * np.mean(lee):.1f} % off on average, {100 * np.max(lee):.0f} % at most",
         "about 2 %, 12 % at most, in their waters", MET if np.max(lee) <= 0.12 else MISSED),
        ("sun that explains the profiles of 3C, 5C, 9C", "Monzon 2024, Fig. 15",
         "/".join(f"{suns[name][0]:.0f}°" for name in ("3C", "5C", "9C")),
         "not stated; at 30° Kd is 9 to 16 % off", OPEN),
        ("phase function backwards at eight stations, at their bb/b", "Petzold 1972",
         f"{ranged(backward)} of measured", "± 0.1", MET),
        ("default particles at the three harbour stations, all angles", "Petzold 1972",
         f"{ranged(harbour)} of measured",
         f"their average ± {100 * np.max(np.abs(average - 1)):.0f} %", PARTLY),
        ("default bb/b in open water", "Petzold 1972", "0.0183",
         "0.013 to 0.044 with the water's own", "a setting: no type fixes it"),
        ("χ = bb/(2π β), 90 to 160°", "Boss & Pegau 2001", f"{off_chi} % at most", "± 3 to 6 %",
         MET),
    ]  # fmt: skip
    jerlov = [[n, f"{np.median(x):.2f} ({ranged(x)})", ranged(bs[n])] for n, x in Kds.items()]
    profiles = [
        ["Kd over ours at 550 nm", *(f"{at_30[1]:.2f}" for _, at_30, _ in suns.values())],
        ["sun that fits", *(f"{sun:g}°" for sun, *_ in suns.values())],
    ]
    return {
        "jerlov": table(
            ("type", "Kd of measured a, b over measured Kd", "default b over measured b"), jerlov
        ),
        "suns": table(("type", *suns), profiles),
        "backward": ranged(backward, between=" to "),
        "harbour": ranged(harbour, between=" to "),
        "chi": off_chi,
    }


def _raman(rows: Rows) -> Mapping[str, Any]:
    """Raman light, and inelastic light against the Monte Carlo."""
    nm, coefficient = raman_at_sea.published("b_R")
    off, lines, ratios, older = raman_coefficient(nm) / coefficient - 1, [], [], []
    for C in raman_at_sea.CHLOROPHYLL:
        wavelengths, ours, theirs = raman_at_sea.at_the_surface(C)
        ratios.append(ours / theirs)
        _, with_older, theirs_then = raman_at_sea.at_the_surface(C, older=True)
        older.append(with_older / theirs_then)
        three = [x[_SHOWN] for x in (100 * ours, 100 * theirs, older[-1])]
        cells = [f"{x:.1f}/{y:.1f} ({then:.2f})" for x, y, then in zip(*three, strict=True)]
        lines.append([f"{C:g}", *cells])
    deep = [f"{100 * raman_at_sea.fraction(0.1, 650.0, y):.0f} %" for y in (0.0, 5.0, 10.0, 20.0)]
    ratios, older = np.array(ratios), np.array(older)
    lee = "Lee et al. 2013"
    rows += [
        ("Raman coefficient, 362 to 544 nm", "Bartlett 1998, as NASA has it",
         f"{_percent([off.min(), off.max()])} %", "± 10 %", MET),
        ("Raman over elastic light that leaves case 1 water, 551 and 667 nm",
         f"{lee} (HydroLight)", f"× {ranged(ratios[:, 4:])}", "1 ± 0.25", MET),
        ("the same, 488 and 531 nm", lee, f"× {ranged(ratios[:, 2:4])}", "1 ± 0.25", PARTLY),
        ("the same, 412 and 443 nm", lee, f"× {ranged(ratios[:, :2])}", "1 ± 0.25", MISSED),
        ("the same, pure water below 420 nm by Smith & Baker (1981)", lee,
         f"× {ranged(older[:, :2])}", "1 ± 0.25", PARTLY),
        ("fraction of Raman light at 650 nm, 20 m", "none found with numbers",
         f"{deep[-1]} (C = 0.1)", "–", OPEN),
    ]  # fmt: skip
    heads = ("C, mg/m³", *(f"{x:.0f} nm" for x in wavelengths[_SHOWN]))
    return {"raman": table(heads, lines), "raman_off": 100 * np.abs(off).max(),
            "raman_deep": ", ".join(deep)}  # fmt: skip


def _caustics(rows: Rows) -> Mapping[str, Any]:
    """Caustics against what was measured in the sea."""
    _, measured, modelled = sea.against_darecki(sea.DARECKI_WINDS[1])
    _, at_days, on_days = sea.against_days()
    buoy = [sea.against_gernez(zenith) for zenith in (20.0, 40.0, 60.0)]
    at_once, slow = ("/".join(f"{row[i]:.2f}" for row in buoy) for i in (0, -1))
    rows += [
        ("caustics, variation of Ed at 0.9 to 9.6 m over measured", "Darecki 2011",
         f"× {ranged(modelled / measured)}", "1 ± 0.1", PARTLY),
        ("the same near 1 m, five days of 3.9 to 10.3 m/s", "Darecki 2011",
         f"× {ranged(on_days / at_days)}, mean {(on_days / at_days).mean():.2f}", "1 ± 0.1",
         PARTLY),
        ("caustics at 3.2 m, sun at 20/40/60°", "Gernez & Antoine 2009",
         f"× {at_once}; averaged over ⅓ s {slow}", "1 ± 0.2",
         PARTLY + ": carried by the slow record at a high sun"),
    ]  # fmt: skip
    return {}


def _papers(rows: Rows) -> Mapping[str, Any]:
    """Numbers that a paper prints, beside those kept of real time."""
    record = Record.read("realtime_accuracy")
    lines = [line.split(" | ") for line in record.values["rows"]] if record else []
    found = {name: rmse for name, rmse, *_ in lines}
    names = ("EEVEE, real time", "paper, printed", "paper, corrected, RGB")
    ours, printed, corrected = (found.get(name, "–") for name in names)
    mean = f"{np.mean(list(TABLE2.values())):.3f}"
    rows.append((
        "sRGB RMSE of real time, mean of six waters and depths", "Monzon 2024, Table 2",
        f"{ours} (their formula there: {printed})", f"{mean}, in their scenes",
        "better, in other scenes",
    ))  # fmt: skip
    return {"rmse": mean, "ours": ours, "printed": printed, "corrected": corrected}


def measure(_: Ask) -> Mapping[str, object]:
    """Compare everything."""
    rows: Rows = []
    values: dict[str, Any] = {}
    for section in (_tyler, _canonical, _ecolight, _waters, _raman, _caustics, _papers):
        values |= section(rows)
    lines, above = [], ("", "")
    for quantity, source, ours, theirs, verdict in rows:
        named = tuple("same" if x == y else x for x, y in zip((source, theirs), above, strict=True))
        lines.append((quantity, named[0], ours, named[1], verdict))
        above = source, theirs
    planted = planted_errors.rows()
    alone, unseen = (
        ", ".join(row["error"] for row in planted if not row[of]) for of in ("others", "outside")
    )
    heads = ("quantity", "source", "this project", "reference", "verdict")
    return {**values, "summary": table(heads, lines), "planted": len(planted), "alone": alone,
            "unseen": unseen}  # fmt: skip


_SUMMARY = Page(
    "Validation",
    """
Measurements and published computations beside the numbers of this project ([in
detail](measured/outside.md)). Nothing is fitted unless it says so; ± in *reference* is its spread
or error; / is from depth to depth or case to case. Renderers against each other:
[accuracy](accuracy.md).

{summary}

## What has no reference yet
- Pictures: [photographs in a tank](measured/tank_photographs.md) of known visibility, but not of
  known water, light and camera. The scenes of the papers' figures are not published.
- Fractions of Raman light and fluorescence below the surface, in numbers.

Whether tests notice an error of 10 %: [planted errors](measured/outside.md#planted-errors).
""",
)
PAGE = Page(
    "Comparisons with measurements and published computations",
    """
The summary, with a verdict for each row, is [validation](../validation.md).

## Tyler's radiance distributions
Lake Pend Oreille, 28 April 1957, clear sky: relative radiance at seven depths from 4 to 66 m, in
{directions} directions more than 12° from the refracted sun, with Tyler's c = {c:.3f} 1/m, a =
{a:.3f} 1/m by Gershun's law and {sky:.1f} % of the light from the sky by SPECTRL2. Errors in %,
median / 90 % / worst with one factor fitted for all depths, median / 90 % with one at each.

{tyler}

The directions come out to 5 %; the tail looks up away from the sun, to hills. The drift with depth
(Fournier-Forand: × {shallow:.2f} at 4.24 m, × {deep:.2f} at 66.1 m) is that of 0.002 1/m more
absorption, the sky's fraction hardly matters, HG 0.8 fails at every depth, and the closed form is
worse in the tail only.

## Canonical problems
C. D. Mobley et al., Appl. Opt. 32, 7484 (1993): means of up to seven models and their scatter
(`data/mobley1993_canonical.csv`), solved by 32 streams; the errors of each problem and depth are in
[validation](../validation.md). *Met*: within twice the scatter, or 2 %. Problem 7 is Raman light by
power.

| problem | what is found |
|---|---|
| 2, case 1; 3 | printed Lu at 4 m (± 36 %) and at 60 m (± 43 %) is noise of the codes of 1993; 64 \
and 128 streams agree to 0.3 %, the [Monte Carlo](monte_carlo.md) to 2.5 of its errors |
| 4 | levels are those of each model's atmosphere; ratios of Ed and Eou within 1.2 %, Lu over Ed \
within 12 % (scatter 11 to 14 %) |
| 5 | sun at 80°, wind 7.23 m/s: without the sun that waves let in Ed is 14 % too low, without its \
flatter way 13 % too high |
| closed form | Ed 2 % off at τ = 1, 8 % at 5; at 10 up to 43 % too low where absorption prevails |

## EcoLight
Printouts of EcoLight 6.0.1 for 24 waters (chlorophyll .5 and 5 mg/m³; minerals .1, 1, 10 g/m³; CDOM
.01 to .6 1/m) at five wavelengths (`validation/ecolight.csv`), 1 m below a sea of 5 m/s under a
clear sky, sun at 30°; differences in %. Matched: a, b, bb/b (Fournier-Forand), pure water, slopes,
index, sun and sky in air. Not matched: the sky's distribution (theirs Harrison & Coombes, ours
CIE), and that theirs is an average over directions 10° wide. The largest are of 10 g/m³ minerals at
2 m.

{ecolight}

HydroLight 4.2, remote-sensing reflectance at the nadir of 16 waters
(`validation/hydrolight.csv`; b/c of .1 to .9, deep or over a floor of .2 at 2 m, flat surface, same
phase function): {under_sky} % off under a uniform sky, {under_sun} % under a sun at 30°; its middle
direction is 10° wide.

## Kd and b against measurement
a and b are the points of Williamson & Hollins (2022), means over 5 to 34 campaigns, Kd is Jerlov's
(1976), to a tenth of the light, sun at 45°: other water under the same name, so that the spread of
a (0.13 to 0.26) is all that can be expected.

{jerlov}

Violet light goes twice as deep in the measured coastal water as Jerlov has it. The b of the default
source (Solonenko & Mobley 2015) is an inversion's; pictures of scattering need `--water-source
williamson2022`.

### The sun of the published profiles
Kd printed with a and b of Solonenko & Mobley (2015) over ours with the sun at 30°, black sky, and
the sun that makes them equal; Figure 15 of Monzon et al. (2024) shows them and says no sun.

{suns}

### Scattering functions
Over those of Petzold's eight stations, their water in them, Fournier-Forand of the station's bb/b
(0.013 to 0.044) is {backward} backwards, the default particles {harbour} in the harbour at all
angles. χ of Boss & Pegau (2001), 90 to 160°, is met within {chi} % (its error 3 to 6 %).

## Raman light
b_R at 362 to 544 nm is within {raman_off:.0f} % of the means that NASA uses. Raman over elastic
light that leaves deep case 1 water (clear sky, sun at 30°), in %, ours / the fit of Lee et al.
(2013) at our reflectances; in brackets ours over theirs if pure water absorbs below 420 nm as Smith
& Baker (1981) have it, an upper bound:

{raman}

Most of what is too much at 412 and 443 nm in the clearest water is the absorption of 360 to 390 nm
that their runs assumed; the newer one is kept. The rest is probably CDOM, of which our case 1 has
less. Seen straight down at 650 nm (C = 0.1) the fraction of Raman light at 0, 5, 10, 20 m is
{raman_deep}; no table was found to compare.

## The papers' own numbers
Monzon et al. (2024), Table 2, print a mean sRGB RMSE of {rmse} against path tracing in scenes that
are not published; on our grey scene in the same waters EEVEE in real time has {ours}, their formula
{printed} as printed and {corrected} corrected ([realtime_accuracy.md](realtime_accuracy.md)).

Akkaynak et al. (2017) and Akkaynak & Treibitz (2018, 2019) found that a channel's β_D falls with
range and hangs on the reflectance, and that β_B is another. So do ours
(`test_image_formation.py`): of a Nikon D7000 at 5 m β_D of red, green, blue is .18, .11, .09 1/m
over 1 m of Jerlov IB (red .17 over 5 m; β_B .63 of β_D) and 3.1, 3.4, 4.0 of 9C (blue 3.5 over 5
m), the order of the types. Only abstracts were found, without coefficients to compare; of Nakath et
al. (2021, doi:10.1109/ICCVW54120.2021.00416), in stored pages and public code, no water parameters.

## Planted errors
One error of 10 % at a time in a copy of the checkout (`python3 dev.py run -m benchmarks
planted_errors`): each of {planted} fails fast tests, named in
[planted_errors.csv](planted_errors.csv). Only tests whose bound is someone else's number
(`tests/validation/test_outside.py`) see {alone}; they do not see {unseen}.

## What three bounds of tests rest on
- Six optimised bands, ΔE2000 against 150: 0.8, what half of all observers see (ISO/TR 28642:2016);
  found are 0.07 to 0.64 (`test_six_beat_eight_equal_bands`).
- One particle function for all bands, bb/b beyond 50 nm from 550 nm: 18 %; found are 16 %. Measured
  bb/b turns by up to 18 % from 550 to 700 nm (Snyder et al. 2008; Doxaran et al. 2007).
- a from an inverted Kd against another inversion, median of ten types: 12 %; found are 11 %,
  against known waters 3 %. Measured a differs by 13 to 26 % between campaigns.
""",
    also={"../validation.md": _SUMMARY},
    reads=("benchmarks/planted_errors.py", "docs/measured/planted_errors.csv"),
)
