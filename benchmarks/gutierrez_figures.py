"""Waters of constituents: colours, Kd, inelastic light."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..uw_spectral.water.inelastic_processes import PROCESSES
from ..uw_spectral.water.named import named_waters
from ..validation.constituent_seas import (
    case1_rows,
    constituents_of_figure2,
    inversion_round_trip,
    kd_round_trip,
    luminous_fractions,
    water_colour,
)
from ..validation.kd import chlorophyll_jerlov, jerlov_chlorophyll
from .runner import Ask, Page, pyplot, spread, table

PHOTONS = 20_000
"""Per band, of the Kd by Monte Carlo: its error is below 1 %."""
_LEFT_OUT = {
    "Lee 2005",
    *(f"{of}, {by}" for of in ("case 1", "fitted") for by in ("Lee 2005", "Monte Carlo")),
}


def draw(path: Path) -> None:
    """Draw the swatches of Figures 2, 3 and 4."""
    plt = pyplot()
    figure2 = [
        (f"C {c.chlorophyll:g}\na_d {c.detritus:g}, a_y {c.cdom:g}", water_colour(c, PROCESSES))
        for c in constituents_of_figure2()
    ]
    seas = named_waters()
    figure3 = [(name, water_colour(sea.constituents, PROCESSES)) for name, sea in seas.items()]
    baltic = seas["baltic"].constituents
    figure4 = [
        (f"baltic\n{label}", water_colour(baltic, on))
        for label, on in (("elastic only", ()), ("+ chlorophyll", ("chlorophyll",)),
                          ("+ all", PROCESSES))
    ]  # fmt: skip
    sheet, axes = plt.subplots(5, 4, figsize=(5.6, 7.0), dpi=72)
    for axis, (label, rgb) in itertools.zip_longest(
        axes.flat, [*figure2, *figure3, *figure4], fillvalue=("", np.ones(3))
    ):
        axis.set(facecolor=rgb, xticks=[], yticks=[])
        axis.set_title(label, fontsize=7)
    sheet.tight_layout()
    sheet.savefig(path, metadata={"Software": None})
    plt.close(sheet)


def _percent(values: np.ndarray) -> str:
    error = 100 * (np.asarray(values) - 1)
    return f"{np.median(error):+.0f} ({error.min():+.0f}…{error.max():+.0f})"


def measure(ask: Ask) -> Mapping[str, object]:
    """Solve and trace the waters."""
    draw(ask.shown("bio_optics.png"))
    trip = kd_round_trip(PHOTONS)
    overall = []
    for key in dict.fromkeys(key for row in trip.values() for key in row if key not in _LEFT_OUT):
        values = np.concatenate([row[key] for row in trip.values() if key in row])
        overall.append((key, spread(100 * np.abs(values - 1), ".1f", (0.5, 0.9, 1.0))))
    parts = (*PROCESSES, "all", "all, luminance")
    fractions = {name: luminous_fractions(sea.constituents) for name, sea in named_waters().items()}
    back = inversion_round_trip()
    over = {
        key: 100 * np.abs(np.concatenate([row[key].ravel() for row in back.values()]) - 1)
        for key in ("a", "blind")
    }
    case1 = [
        [f"{x.chlorophyll:g}", f"{x.published:.4f}",
         *(f"{100 * (Kd / x.published - 1):+.0f}"
           for Kd in (x.merged, x.before, x.by_lee, x.solved, x.measured)),
         f"{x.scattering_before:.3f}, {x.scattering:.3f}"]
        for x in case1_rows()
    ]  # fmt: skip
    return {
        "shares": table(
            ("sea", *parts),
            [[n, *(f"{100 * x[p]:.2f}" for p in parts)] for n, x in fractions.items()],
        ),
        "case1": table(
            ("C, mg/m³", "measured", "merged", "before", "Lee 2013", "solved", "`chl:C`",
             "b before, now"), case1
        ),
        "inverted": table(
            ("sun", "a", "b", "a, blind"),
            [[f"{z:g}°", *(_percent(x[k]) for k in ("a", "b", "blind"))] for z, x in back.items()],
        ),
        "over": spread(over["a"], ".1f", (0.5, 0.9, 1.0)),
        "blind": spread(over["blind"], ".1f", (0.5, 0.9, 1.0)),
        "overall": table(("", "median/90 %/worst, %"), overall),
        "chlorophyll": ", ".join(
            f"{n} {jerlov_chlorophyll(n):.2f}" for n in ("I", "IA", "IB", "II", "III")
        ),
        "nearest": chlorophyll_jerlov(0.3),
    }  # fmt: skip


PAGE = Page(
    "Waters from their constituents, and inelastic light",
    """
## Colours
![Swatches of the waters](bio_optics.png)

Deep water seen level from 5 m with all inelastic light, equal brightness: Figures 2, 3 (the seas of
`named_waters`, which has their constituents and sources) and 4 of Gutierrez et al. (2008).
Inelastic light hardly changes the Baltic's colour.

## Inelastic fraction
In % of the radiance between 380 and 780 nm, level at 5 m, quantum yield 0.02. The paper reports
about 2 % for its Baltic. Raman light seen straight down: see [outside.md](outside.md#raman-light).

{shares}

## Case 1 waters against measured Kd(490) and b
`bio:case1=C` by Bricaud et al. (1998), Morel & Gentili (2009), Loisel & Morel (1998) and Morel &
Maritorena (2001). Kd(490) in % off the regression of Morel et al. (2007), 0.0166 + 0.07242
C^0.68955 (*merged*: on the measurements of others too); *before*: version 0.1.0. Sun at 30°,
*solved* at 45°; b of the particles at 550 nm, before and now.

{case1}

What is left above 1 mg/m³ lies between published laws; nothing is tuned to close them.

`chl:C` inverts the Kd of Morel & Maritorena (2001) for a sun at 30°; wanted was Kd(490) within 5 %.
It has no fluorescence.

## Kd inverted, round trip
Kd of light fields solved for the case 1 waters above, to 10 % of the light, inverted with the sun
of the field: error in percent, median (lowest … highest), at 412, 443, 490, 510, 555, 620, 670 nm.
*Blind*: bb/b 0.0183, sun at 30°, as the inversion once did.

{inverted}

Over all a is off by {over} % (median/90 %/worst); blind, by {blind} %.

## Round trip to Kd
Against the Kd of Solonenko & Mobley (2015), ten types, 400 to 700 nm, absolute error. *Inversion*:
a and b from their Kd; *case 1*: the water of the type's Kd(490), I to III; *fitted*: chlorophyll,
CDOM and minerals by Lee et al. (2013). Kd does not tell b, nor chlorophyll up to type 5C.

{overall}

Chlorophyll of the oceanic types by Kd(490) (Morel et al. 2007), mg/m³: {chlorophyll}. Back from 0.3
(Kd 0.0482 1/m) the nearest is {nearest}.
""",
)
