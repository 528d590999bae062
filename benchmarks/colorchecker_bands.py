"""Colour error of few bands: the ColorChecker in air, by sensor and number of bands."""

from __future__ import annotations

from collections.abc import Mapping

from ..validation.colorchecker import (
    COUNTS,
    FINE,
    SENSORS,
    d50,
    delta_e_to_published,
    rendered_rgb,
    table,
)
from .runner import Ask, Page
from .runner import table as cells


def measure(_: Ask) -> Mapping[str, object]:
    """Compare bands with each other, and the eye with the published values."""
    in_d65 = delta_e_to_published(rendered_rgb("cie1931", FINE))
    in_d50 = delta_e_to_published(rendered_rgb("cie1931", FINE, d50()))
    rows = table()
    lines = [
        [n, *("{:.2f}/{:.2f} ({:.2f})".format(*rows[sensor, n]) for sensor in SENSORS)]
        for n in COUNTS
    ]
    return {
        "mean50": in_d50.mean(), "worst50": in_d50.max(),
        "mean65": in_d65.mean(), "worst65": in_d65.max(),
        "rows": cells(("bands", *SENSORS), lines),
    }  # fmt: skip


PAGE = Page(
    "Colour with few bands: the ColorChecker in air, D65",
    """
CIE 1931 with 350 bands against the published Lab values, which are for D50: ΔE2000 mean
{mean50:.2f}, worst {worst50:.2f} in D50. In D65 it is {mean65:.2f}, worst {worst65:.2f}: what
chromatic adaptation (Bradford) from one light to the other cannot know.

Below: equal bands from 400 to 700 nm against CIE 1931 on the fine grid, ΔE2000 mean / worst patch,
from measured spectra. In brackets the mean round trip of RGB colours, uplifted to bands and back
through sensor and light.

{rows}
""",
)
