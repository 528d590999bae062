"""Sections of docs/measured/outside.md on light: radiance, canonical problems, Raman light."""

from __future__ import annotations

import numpy as np

from ..uw_spectral.water.inelastic_processes import raman_coefficient
from . import _raman_at_sea, _tyler, inelastic_table
from ._canonical import PROBLEMS, WIND, canonical_field, canonical_values, closed_form
from ._outside import MET, MISSED, OPEN, PARTLY, Row, Section, grid, percent
from .path_radiance_table import ROOT

RAMAN_DEPTHS = (0.0, 5.0, 10.0, 20.0)
_SHOWN = [0, 1, 4, 5]  # wavelengths of Raman light
CLOSED = ((1, 1), (1, 2), (2, 1), (2, 2), (6, 1))
"""Problems that the closed form knows."""


def tyler() -> Section:
    """Radiance distributions of Lake Pend Oreille."""
    at = _tyler.lake()
    share = at.sky_share()
    lines, fits = [], {}
    for name in _tyler.PHASES:
        fits[name] = [_tyler.misfit(x) for x in _tyler.modelled(name, share)]
        cells = [
            f"{100 * x.median:.0f}/{100 * x.tail:.0f}/{100 * x.worst:.0f} "
            f"| {100 * x.shape:.1f}/{100 * x.shape_tail:.0f}"
            for x in fits[name]
        ]
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    table = grid(
        "| phase function | solved: one factor | each depth | closed form: one | each depth |",
        lines,
    )
    count = int(at.compared.sum())
    (ff, ff_closed), (petzold, petzold_closed), broad = (
        fits["fournier-forand:1.10,0.0183"],
        fits["petzold"],
        fits["hg:0.8"][0],
    )
    theirs = "measured; lake even to ± 10 % in a"
    where = "Tyler 1958, Lake Pend Oreille"
    rows = [
        Row(
            f"radiance, 7 depths × {count} directions, solved, Fournier-Forand / Petzold", where,
            f"{100 * ff.median:.0f}/{100 * petzold.median:.0f} % off in the median, at each "
            f"depth {100 * ff.shape:.0f}/{100 * petzold.shape:.0f} %; 90 % "
            f"{100 * ff.tail:.0f}/{100 * petzold.tail:.0f} %",
            theirs, MET + " in the median" if max(ff.median, petzold.median) < 0.15 else MISSED,
        ),
        Row(
            "the same, closed form", where,
            f"{100 * ff_closed.median:.0f}/{100 * petzold_closed.median:.0f} %, at each depth "
            f"{100 * ff_closed.shape:.0f}/{100 * petzold_closed.shape:.0f} %, "
            f"90 % {100 * ff_closed.tail:.0f}/{100 * petzold_closed.tail:.0f} %",
            theirs, PARTLY,
        ),
        Row(
            "the same, solved, HG 0.8 of Monzon et al. 2024", where,
            f"{100 * broad.median:.0f} %, at each depth {100 * broad.shape:.0f} %",
            theirs, "the phase function is wrong",
        ),
    ]  # fmt: skip
    text = f"""## Tyler's radiance distributions
Lake Pend Oreille, 28 April 1957, clear sky: relative radiance at seven depths from 4 to 66 m, in
{count} directions more than {_tyler.FROM_SUN:g}° from the refracted sun, with Tyler's c =
{at.c:.3f} 1/m, a = {at.mean_absorption():.3f} 1/m by Gershun's law and {100 * share:.1f} % of the
light from the sky by SPECTRL2. Errors in %, median / 90 % / worst with one factor fitted for all
depths, median / 90 % with one at each.

{table}

The directions come out to 5 %; the tail looks up away from the sun, to hills.
The drift with depth (Fournier-Forand:
× {ff.by_depth[0]:.2f} at {at.depths[0]:g} m, × {ff.by_depth[-1]:.2f} at {at.depths[-1]:g} m) is
that of 0.002 1/m more absorption, the sky's fraction
hardly matters, HG 0.8 fails at every depth, and the closed form is worse in the tail only.
"""
    return rows, text


def canonical() -> Section:
    """Canonical problems of Mobley et al. (1993)."""
    rows = []
    for problem, case in PROBLEMS:
        field, values = canonical_field(problem, case), canonical_values(problem, case)
        off = {}
        for row in values:
            found = row.found(field)
            off.setdefault(row.quantity, []).append((found / row.mean - 1, row.scatter))
        ours = "; ".join(
            f"{name} {percent([d for d, _ in each], 1)} %" for name, each in off.items()
        )
        theirs = "; ".join(
            f"{name}±{'/'.join(f'{100 * s:.1f}' for _, s in each)} %" for name, each in off.items()
        )
        worst = max(abs(d) / max(2 * s, 0.02) for each in off.values() for d, s in each)
        verdict = MET if worst <= 1 else PARTLY
        if problem == 4:
            verdict = f"{OPEN}: their atmospheres differ by 18 %"
        rows.append(Row(f"problem {problem}, case {case}", "Mobley 1993", ours, theirs, verdict))
    closed = {
        each: [
            float(closed_form(*each).Ed(row.depth)[0]) / row.mean - 1
            for row in canonical_values(*each)
            if row.quantity == "Ed"
        ]
        for each in CLOSED
    }
    rows.append(
        Row(
            "Ed of the closed form, " + "; ".join(f"{p}, {c}" for p, c in CLOSED),
            "Mobley 1993", "; ".join(f"{percent(off, 1)} %" for off in closed.values()),
            "as above", f"{PARTLY}: to 5 % where much is scattered, down to τ = 5",
        )
    )  # fmt: skip
    text = f"""## Canonical problems
C. D. Mobley et al., Appl. Opt. 32, 7484 (1993): means of up to seven models and their scatter
(`data/mobley1993_canonical.csv`), solved by 32 streams; the errors of each problem and depth are in
[validation](../validation.md). *Met*: within twice the scatter, or 2 %. Problem 7 is Raman light by
power.

| problem | what is found |
|---|---|
| 2, case 1; 3 | printed Lu at 4 m (± 36 %) and at 60 m (± 43 %) is noise of the codes of 1993; \
64 and 128 streams agree to 0.3 %, the [Monte Carlo](monte_carlo.md) to 2.5 of its errors |
| 4 | levels are those of each model's atmosphere; ratios of Ed and Eou within 1.2 %, Lu over \
Ed within 12 % (scatter 11 to 14 %) |
| 5 | sun at 80°, wind {WIND:g} m/s: without the sun that waves let in Ed is 14 % too low, without \
its flatter way 13 % too high |
| closed form | Ed 2 % off at τ = 1, 8 % at 5; at 10 up to 43 % too low where absorption prevails |
"""
    return rows, text


def raman() -> Section:
    """Raman light, and inelastic light against the Monte Carlo."""
    nm, coefficient = _raman_at_sea.published("b_R")
    off = raman_coefficient(nm) / coefficient - 1
    lines, ratios, older = [], [], []
    for C in _raman_at_sea.CHLOROPHYLL:
        wavelengths, ours, theirs = _raman_at_sea.at_the_surface(C)
        ratios.append(ours / theirs)
        _, with_older, theirs_then = _raman_at_sea.at_the_surface(C, older=True)
        older.append(with_older / theirs_then)
        three = [x[_SHOWN] for x in (100 * ours, 100 * theirs, older[-1])]
        cells = [f"{x:.1f}/{y:.1f} ({then:.2f})" for x, y, then in zip(*three, strict=True)]
        lines.append(f"| {C:g} | {' | '.join(cells)} |")
    surface = grid(
        "| C, mg/m³ | " + " | ".join(f"{x:.0f} nm" for x in wavelengths[_SHOWN]) + " |", lines
    )
    deep = ", ".join(f"{100 * _raman_at_sea.share(0.1, 650.0, y):.0f} %" for y in RAMAN_DEPTHS)
    ratios, older = np.array(ratios), np.array(older)
    verdict = inelastic_table.verdict(
        (ROOT / "docs" / "measured" / "inelastic.md").read_text(encoding="utf-8")
    )
    rows = [
        Row("Raman coefficient, 362 to 544 nm", "Bartlett 1998, as NASA has it",
            f"{percent([off.min(), off.max()])} %", "± 10 %", MET),
        Row("Raman over elastic light that leaves case 1 water, 551 and 667 nm",
            "Lee et al. 2013 (HydroLight)",
            f"× {ratios[:, 4:].min():.2f}…{ratios[:, 4:].max():.2f}", "1 ± 0.25", MET),
        Row("the same, 488 and 531 nm", "Lee et al. 2013",
            f"× {ratios[:, 2:4].min():.2f}…{ratios[:, 2:4].max():.2f}", "1 ± 0.25", PARTLY),
        Row("the same, 412 and 443 nm", "Lee et al. 2013",
            f"× {ratios[:, :2].min():.2f}…{ratios[:, :2].max():.2f}", "1 ± 0.25", MISSED),
        Row("the same, pure water below 420 nm by Smith & Baker (1981)", "Lee et al. 2013",
            f"× {older[:, :2].min():.2f}…{older[:, :2].max():.2f}", "1 ± 0.25", PARTLY),
        Row("fraction of Raman light at 650 nm, 20 m", "none found with numbers",
            f"{100 * _raman_at_sea.share(0.1, 650.0, 20.0):.0f} % (C = 0.1)",
            "–", OPEN),
        Row("inelastic light in closed form", "our Monte Carlo", verdict.partition(": ")[2],
            "10 %", PARTLY),
    ]  # fmt: skip
    text = f"""## Raman light
b_R at {nm[0]:.0f} to {nm[-1]:.0f} nm is within {100 * np.abs(off).max():.0f} % of the means that
NASA uses. Raman over elastic light that leaves deep case 1 water (clear sky, sun at 30°), in %,
ours / the fit of Lee et al. (2013) at our reflectances; in brackets ours over theirs if pure water
absorbs below 420 nm as Smith & Baker (1981) have it, an upper bound:

{surface}

Most of what is too much at 412 and 443 nm in the clearest water is the absorption of 360 to 390 nm
that their runs assumed; the newer one is kept. The rest is probably CDOM, of which our case 1 has
less. Seen straight down at 650 nm (C = 0.1) the fraction of Raman light at
{", ".join(f"{y:g}" for y in RAMAN_DEPTHS)} m is {deep}; no table was found to compare.
Inelastic light in closed form against the Monte Carlo ([inelastic.md](inelastic.md)):
{verdict[0].lower() + verdict[1:]}
"""
    return rows, text
