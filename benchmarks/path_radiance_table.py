"""Closed-form path radiance against discrete ordinates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..validation import discrete_ordinates_reference as cases
from .runner import Ask, Page, spread, table


def measure(_: Ask) -> Mapping[str, object]:
    """Compare rays of all waters, of particles, and irradiances."""
    rows = [row for water in cases.WATERS for row in cases.compare(water)]
    groups = {"**all**": rows}
    for of, names, label in (("view", cases.VIEWS, "{}"), ("water", cases.WATERS, "water {}")):
        groups |= {label.format(x): [row for row in rows if row[of] == x] for x in names}
    medians = []
    for name, some in groups.items():
        off = 100 * cases.errors(some)
        cells = [f"{x:.1f}" for x in (*np.median(off, axis=0), np.percentile(off[:, -1], 90))]
        medians.append([name, *cells])
    particles = []
    for name, phase in (("Fournier-Forand 1.10, 0.0183", "fournier-forand:1.10,0.0183"),
                        ("HG 0.95", "hg:0.95")):  # fmt: skip
        some = [row for w in cases.WATERS
                for row in cases.compare(w, (450.0, 550.0), (5.0,), phase)]  # fmt: skip
        particles.append([name, *(f"{x:.1f}" for x in 100 * np.median(cases.errors(some), axis=0))])
    irradiance = [
        [name, *(spread(100 * x, ".1f", (0.5, 0.9, 1.0)) for x in values)]
        for name, values in cases.compare_irradiance().items()
    ]
    return {
        "rays": table(("rays", *cases.FORMS, "closed form, 90 %"), medians),
        "particles": table(("phase function", *cases.FORMS), particles),
        "irradiance": table(("median/90 %/worst", "floor 0", "floor 0.2"), irradiance),
    }


PAGE = Page(
    "Path radiance against discrete ordinates",
    """
Median relative error in % of the path radiance L(y_o, w) - e^(-cP) L(y_o + w_y P, w). Every ray
counts, none is left out.

- Reference: PythonicDISORT, 48 streams. Waters I, IA, IB, II, 3C, 400, 450, 500, 550, 600, 650 nm,
  Henyey-Greenstein 0.8, sun at 30° in the water, index-matched surface, no sky.
- Camera at 3, 5, 9 m, floor 3 m below it, reflectance 0 and 0.2; five elevations up, level and
  down, three azimuths, P = 2 m, 5 m and to the surface or floor.
- Eq. 9 of Monzón et al. 2024 gets Kd and E of the reference itself.

{rays}

Phase functions of sea particles, camera at 5 m, 450 and 550 nm:

{particles}

## Irradiance

Light field of the closed form, floor at 8 m, depths 1, 3 and 7.5 m, all waters and bands. *Eu* is
that of the two streams, *Eu, integrated* that of the radiance (`upwelling_irradiance`).

{irradiance}
""",
)
