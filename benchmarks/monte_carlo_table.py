"""The Monte Carlo against published problems, and the closed form against it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

from ..validation import monte_carlo_cases as cases
from .runner import Ask, Page, spread, table


def _published() -> tuple[str, list[list[str]]]:
    rows, met = [], []
    for problem, case in ((1, 1), (1, 2), (2, 1), (2, 2), (6, 1)):
        found = cases.canonical(problem, case, cases.PUBLISHED_PHOTONS // (1 if case == 1 else 5))
        met += [abs(x.difference) <= x.tolerance for x in found]
        cells = [
            "/".join(f"{100 * x.difference:+.2f}" for x in found if x.quantity == name)
            for name in ("Ed", "Eou", "Lu")
        ]
        rows.append([f"{problem}, {case}", *cells])
    return f"{sum(met)} of {len(met)}", rows


def measure(ask: Ask) -> Mapping[str, object]:
    """Trace the problems, irradiances and path radiances."""
    within, published = _published()
    every = cases.irradiances(cases.IRRADIANCE_PHOTONS, ask.threads)
    irradiance = []
    for phase, quantity in itertools.product(cases.PHASES, cases.QUANTITIES):
        mine = [x for x in every if (x["phase"], x["quantity"]) == (phase, quantity)]
        by_floor = (100 * cases.differences([x for x in mine if x["r"] == r]) for r in cases.FLOORS)
        cells = (spread(x, ".1f", (0.5, 0.9, 1.0)) for x in by_floor)
        irradiance.append([f"{phase}, {quantity}", *cells])
    return {
        "within": within,
        "published": table(("problem, case", "Ed", "Eou", "Lu"), published),
        "irradiance": table(("", *(f"floor {r:g}" for r in cases.FLOORS)), irradiance),
    }


PAGE = Page(
    "Monte Carlo",
    """
The solver is `validation.monte_carlo`; `python -m validation --help` lists its options.

## Against published problems

Canonical problems of Mobley et al. (1993), sun at 60°, black sky: difference from the published
mean in % at τ = 1 / 5. Tolerance: three times the spread of their models or 1 %, 5 % for Lu (mean
over a cone of 5°).

{within} are within the tolerance.

{published}

## Irradiance of the closed form against the Monte Carlo

I, IA, IB, II, 3C at 450 and 550 nm, flat surface, sun at 30°, black sky, floor at 8 m, 2000000
photons in each case; none is left out. At 1, 3, 5, 7.5 m, relative error in %, median/90 %/worst.
Targets: Ed within 2 %, Eu within 5 %; the medians meet them, **not every case**. *Two streams* is
`LightField.Eu`, *integrated* `upwelling_irradiance`.

{irradiance}

The path radiance is held against discrete ordinates: [path_radiance.md](path_radiance.md).
""",
    settings={"threads": 1},
)
