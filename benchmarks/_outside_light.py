"""Sections of docs/measured/outside.md on light: radiance, canonical problems, Raman light."""

from __future__ import annotations

import numpy as np

from ..uw_spectral.water.inelastic_processes import raman_coefficient
from . import _raman_at_sea, _tyler, inelastic_table
from ._canonical import LAYERS, PROBLEMS, WIND, canonical_field, canonical_values, closed_form
from ._outside import MET, MISSED, OPEN, PARTLY, Row, Section, grid, percent
from .path_radiance_table import ROOT

RAMAN_DEPTHS = (0.0, 5.0, 10.0, 20.0)
CLOSED = ((1, 1), (1, 2), (2, 1), (2, 2), (6, 1))
"""Problems that the closed form knows."""


def tyler() -> Section:
    """Radiance distributions of Lake Pend Oreille."""
    at = _tyler.lake()
    share = at.sky_share()
    lines, fits = [], {}
    for part, kind in ((share, "clear"), (0.25, "clear"), (0.25, "uniform")):
        for name in _tyler.PHASES if part == share else _tyler.PHASES[:2]:
            solved, closed = (_tyler.misfit(x) for x in _tyler.modelled(name, part, kind))
            fits.setdefault(name, (solved, closed))
            cells = [
                f"{100 * x.median:.0f} / {100 * x.tail:.0f} / {100 * x.worst:.0f} "
                f"| {100 * x.shape:.1f} / {100 * x.shape_tail:.0f}"
                for x in (solved, closed)
            ]
            lines.append(f"| `{name}` | {100 * part:.1f} %, {kind} | {' | '.join(cells)} |")
    table = grid(
        "| phase function | sky | solved: one factor, median / 90 % / worst | each depth, "
        "median / 90 % | closed form: one factor | each depth |",
        lines,
    )
    drift = grid(
        "| phase function | " + " | ".join(f"{y:g} m" for y in at.depths) + " |",
        [
            f"| `{name}`, {label} | " + " | ".join(f"{x:.2f}" for x in fit.by_depth) + " |"
            for name in (_tyler.PHASES[0], _tyler.PHASES[1], _tyler.PHASES[-1])
            for label, fit in zip(("solved", "closed form"), fits[name], strict=True)
        ],
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
            f"{100 * ff.median:.0f} / {100 * petzold.median:.0f} % off in the median, at each "
            f"depth {100 * ff.shape:.0f} / {100 * petzold.shape:.0f} %; 90 % "
            f"{100 * ff.tail:.0f} / {100 * petzold.tail:.0f} %",
            theirs, MET + " in the median" if max(ff.median, petzold.median) < 0.15 else MISSED,
        ),
        Row(
            "the same, closed form", where,
            f"{100 * ff_closed.median:.0f} / {100 * petzold_closed.median:.0f} %, at each depth "
            f"{100 * ff_closed.shape:.0f} / {100 * petzold_closed.shape:.0f} %, "
            f"90 % {100 * ff_closed.tail:.0f} / {100 * petzold_closed.tail:.0f} %",
            theirs, PARTLY,
        ),
        Row(
            "the same, solved, HG 0.8 of Monzon et al. 2024", where,
            f"{100 * broad.median:.0f} %, at each depth {100 * broad.shape:.0f} %",
            theirs, "the phase function is wrong",
        ),
    ]  # fmt: skip
    absorption = ", ".join(f"{x:.3f}" for x in at.absorption())
    text = f"""## Tyler's radiance distributions
Lake Pend Oreille, 28 April 1957: clear sky, sun 56.6° high, 430 to 546 nm, radiance of a relative
unit from 19 tilts and 10 azimuths at seven depths from 4 to 66 m, over four decades. c =
{at.c:.3f}
1/m is Tyler's; a = {at.mean_absorption():.3f} 1/m follows from his radiances by Gershun's law
(between his
depths {absorption}: the first lacks light of the sun's glitter, the others fall with depth, so
the lake is not quite even). Sky: {100 * share:.1f} % of the irradiance by SPECTRL2, CIE clear; n =
{_tyler.INDEX:g}.
Radiances are means over the 6.6° that the tubes accept, in the {count} directions more than
{_tyler.FROM_SUN:g}° from the refracted sun. One factor is fitted: for all depths, or at each.
Errors in %.

{table}

Median of modelled over measured by depth, one factor for all:

{drift}

The directions come out to 5 %: looking level or down to 2 to 5 %, looking up to 10 %. The tail
looks up through the surface away from the sun, 17 to 29 m deep, where we have a third too much
light: probably the sky and the hills, which the CIE's has not. What is left grows with
depth as a wrong absorption would: 0.002 1/m, a sixtieth, makes 13 % over the 62 m. The sky's
fraction hardly matters. HG 0.8 scatters 2.8 times too much light back and fails at every depth. The
closed form is as good in the median and worse in the tail.
"""
    return rows, text


def canonical() -> Section:
    """Canonical problems of Mobley et al. (1993)."""
    rows, lines = [], []
    for problem, case in PROBLEMS:
        field, values = canonical_field(problem, case), canonical_values(problem, case)
        off = {}
        for row in values:
            found = row.found(field)
            off.setdefault(row.quantity, []).append((found / row.mean - 1, row.scatter))
            lines.append(
                f"| {problem}, {case} | {row.depth:g} | {row.quantity} | {found:.4g} "
                f"| {row.mean:.4g} | {percent(found / row.mean - 1, 1)} | {100 * row.scatter:.1f} |"
            )
        ours = "; ".join(
            f"{name} {percent([d for d, _ in each], 1)} %" for name, each in off.items()
        )
        theirs = "; ".join(
            f"{name} ± {' / '.join(f'{100 * s:.1f}' for _, s in each)} %"
            for name, each in off.items()
        )
        worst = max(abs(d) / max(2 * s, 0.02) for each in off.values() for d, s in each)
        verdict = MET if worst <= 1 else PARTLY
        if problem == 4:
            verdict = f"{OPEN}: their atmospheres differ by 18 %"
        rows.append(
            Row(f"problem {problem}, case {case}, by depth", "Mobley 1993", ours, theirs, verdict)
        )
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
            "Ed of the closed form, " + "; ".join(f"{p}, {c}" for p, c in CLOSED) + ", by depth",
            "Mobley 1993", "; ".join(f"{percent(off, 1)} %" for off in closed.values()),
            "as above", f"{PARTLY}: to 5 % where much is scattered, down to τ = 5",
        )
    )  # fmt: skip
    table = grid(
        "| problem, case | depth, m | quantity | ours | theirs | off, % | scatter, % |", lines
    )
    text = f"""## Canonical problems
C. D. Mobley et al., Appl. Opt. 32, 7484 (1993): means of up to seven models and their scatter
(`data/mobley1993_canonical.csv`). Solved by 32 streams. *Met*: within twice the scatter, or 2 %.

{table}

- Problem 1 has the phase function (1 + cos²) of Rayleigh. Earlier versions of this project gave
  it that of sea water (1 + 0.835 cos²), and Lu at 0.8 m, case 1, 1.68e-3 for 1.71e-3: 2.5 % off
  instead of 0.8 %.
- Lu is held to converged solutions where the models scatter: 64 and 128 streams agree to 0.3 %,
  the Monte Carlo, over a cone of 5°, to 2.5 of its standard errors
  ([monte_carlo.md](monte_carlo.md)). The printed means of 2, case 1, at 4 m
  (6.24e-7, ± 36 %) and 3 at 60 m (± 43 %) are noise of the Monte Carlo codes of 1993.
- 3 is water whose chlorophyll peaks at 17 m: {len(LAYERS)} layers here.
- 4 has an atmosphere that each model makes itself; ours is SPECTRL2's sky. Ed at two depths over
  that at 0.1 m, and Eou over Ed, are within 1.2 %, Lu over Ed within 12 % (their scatter: 11 to
  14 %); the level is that of the atmosphere.
- 5 has the sun at 80° and wind of {WIND:g} m/s. The waves on average let in a fifth more of that
  sun than a flat surface, and tilted facets send it on 5° flatter. Without the first Ed at 0.1 m is
  14 % too low, without the second at 1 m 13 % too high.
- The closed form's Ed is 2 % off at τ = 1, up to 8 % at τ = 5, and at τ = 10 up to 43 % too low
  where absorption prevails: its asymptotic decay is too fast.
- 7 is Raman light at 486 nm excited at 417 nm; the paper scatters power, not photons, which is 14
  % more than photons would bring.
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
        lines.append(
            f"| {C:g} | "
            + " | ".join(
                f"{o:.1f} / {t:.1f}" for o, t in zip(100 * ours, 100 * theirs, strict=True)
            )
            + " |"
        )
    surface = grid("| C, mg/m³ | " + " | ".join(f"{x:.0f} nm" for x in wavelengths) + " |", lines)
    surface_older = grid(
        "| C, mg/m³ | " + " | ".join(f"{x:.0f} nm" for x in wavelengths) + " |",
        [
            f"| {C:g} | " + " | ".join(f"{x:.2f}" for x in row) + " |"
            for C, row in zip(_raman_at_sea.CHLOROPHYLL, older, strict=True)
        ],
    )
    deep = grid(
        "| C, mg/m³ | " + " | ".join(f"{y:g} m" for y in RAMAN_DEPTHS) + " |",
        [
            f"| {C:g} | "
            + " | ".join(f"{100 * _raman_at_sea.share(C, 650.0, y):.0f} %" for y in RAMAN_DEPTHS)
            + " |"
            for C in _raman_at_sea.CHLOROPHYLL
        ],
    )
    ratios, older = np.array(ratios), np.array(older)
    verdict = inelastic_table.verdict(
        (ROOT / "docs" / "measured" / "inelastic.md").read_text(encoding="utf-8")
    )
    rows = [
        Row("Raman coefficient, 362 to 544 nm", "Bartlett 1998, as NASA has it",
            f"{percent([off.min(), off.max()])} %", "± 10 %", MET),
        Row("Raman over elastic light that leaves case 1 water, 551 and 667 nm",
            "Lee et al. 2013 (HydroLight)",
            f"× {ratios[:, 4:].min():.2f} … {ratios[:, 4:].max():.2f}", "1 ± 0.25", MET),
        Row("the same, 488 and 531 nm", "Lee et al. 2013",
            f"× {ratios[:, 2:4].min():.2f} … {ratios[:, 2:4].max():.2f}", "1 ± 0.25", PARTLY),
        Row("the same, 412 and 443 nm", "Lee et al. 2013",
            f"× {ratios[:, :2].min():.2f} … {ratios[:, :2].max():.2f}", "1 ± 0.25", MISSED),
        Row("the same, pure water below 420 nm by Smith & Baker (1981)", "Lee et al. 2013",
            f"× {older[:, :2].min():.2f} … {older[:, :2].max():.2f}", "1 ± 0.25", PARTLY),
        Row("fraction of Raman light at 650 nm, 20 m", "none found with numbers",
            f"{100 * _raman_at_sea.share(0.1, 650.0, 20.0):.0f} % (C = 0.1)",
            "–", OPEN),
        Row("inelastic light in closed form", "our Monte Carlo", verdict.partition(": ")[2],
            "10 %", PARTLY),
    ]  # fmt: skip
    text = f"""## Raman light
b_R at {", ".join(f"{x:.0f}" for x in nm)} nm: {percent(off)} % against the means of Bartlett's
law that NASA uses. Below: Raman over elastic light in what leaves deep case 1 water, in %, ours
/ the fit of Lee et al. (2013) at our own reflectances; solved field, clear sky, sun at 30°.

{surface}

At 412 and 443 nm ours is {ratios[:, :2].min():.1f} to {ratios[:, :2].max():.1f} times theirs.
That light is excited at 360 to 390 nm, where pure water absorbs less than was thought when their
runs were made. With Smith & Baker (1981) below 420 nm, an upper bound, ours over theirs becomes

{surface_older}

so that in the clearest water more than half of what is too much at 412 nm, nearly all at 443 nm, is
theirs. The newer absorption is kept. The rest, where there is more chlorophyll, is CDOM, which our
case 1 water probably has less of than their runs. Problem 7 above holds the transfer itself to 3 %.

Fraction of Raman light in the radiance seen straight down at 650 nm:

{deep}

No table of such fractions below the surface was found to compare with.

Inelastic light in closed form against the Monte Carlo ([inelastic.md](inelastic.md)):
{verdict[0].lower() + verdict[1:]}
"""
    return rows, text
