"""Measurements and published numbers beside ours: docs/validation.md, docs/measured/outside.md.

``python3 dev.py run -m benchmarks validation`` takes some CPU minutes, most of them for the
caustics; the table of planted errors is that of ``benchmarks planted_errors``, the numbers of
inelastic light are read from their own page. tests/validation/test_outside.py holds the same
comparisons to bounds of others.
"""

from __future__ import annotations

from . import _outside_light as light
from . import _outside_water as water
from . import planted_errors
from ._outside import Row, grid
from .path_radiance_table import ROOT


def planted() -> str:
    """The table of planted errors."""
    rows = planted_errors.rows()
    alone, unseen = (
        ", ".join(row["error"] for row in rows if not row[of]) for of in ("others", "outside")
    )
    return f"""## Planted errors
One error of 10 % at a time in a copy of the checkout (`python3 dev.py run -m benchmarks
planted_errors`): each of {len(rows)} fails fast tests, named in
[planted_errors.csv](planted_errors.csv). Only tests whose bound is
someone else's number (`tests/validation/test_outside.py`) see {alone}; they do not
see {unseen}.
"""


_BOUNDS = """## What three bounds of tests rest on
- Six optimised bands, ΔE2000 against 150: 0.8, what half of all observers see
  (ISO/TR 28642:2016); found are 0.07 to 0.64 (`test_six_beat_eight_equal_bands`).
- One particle function for all bands, bb/b beyond 50 nm from 550 nm: 18 %; found are 16 %.
  Measured bb/b turns by up to 18 % from 550 to 700 nm (Snyder et al. 2008; Doxaran et al. 2007).
- a from an inverted Kd against another inversion, median of ten types: 12 %; found are 11 %,
  against known waters 3 %. Measured a differs by 13 to 26 % between campaigns.
"""


def lines_of(rows: list[Row]) -> list[str]:
    """Lines of the table; sources and references are not repeated."""
    lines, above = [], ("", "")
    for row in rows:
        named = row.source, row.theirs
        source, theirs = ("same" if x == y else x for x, y in zip(named, above, strict=True))
        cells = row.quantity, source, row.ours, theirs, row.verdict
        lines.append(f"| {' | '.join(cells)} |".replace(" / ", "/").replace(" … ", "…"))
        above = named
    return lines


def summary(lead: str) -> str:
    """Return docs/validation.md."""
    return f"""# Validation

Measurements and published computations beside the numbers of this project
([in detail](measured/outside.md)). Nothing is fitted unless it says so; ± in *reference* is its
spread or error; / is from depth to depth or case to case. Renderers against each other:
[accuracy](accuracy.md).

{lead}

## What has no reference yet
- Pictures: no photograph with measured water, light and camera was found. The scenes of the papers'
  figures are not published ([our numbers for them](measured/paper_figures.md)).
- Fractions of Raman light and fluorescence below the surface, in numbers.

Whether tests notice an error of 10 %: [planted errors](measured/outside.md#planted-errors).

Written by `python3 dev.py run -m benchmarks validation`.
"""


def details(texts: str, errors: str) -> str:
    """Return docs/measured/outside.md."""
    return f"""# Comparisons with measurements and published computations

The summary, with a verdict for each row, is [validation](../validation.md).

{texts}
{errors}
{_BOUNDS}
Written by `python3 dev.py run -m benchmarks validation`.
"""


def main(_arguments: list[str]) -> None:
    """Compare everything and write both pages."""
    sections = [
        light.tyler(), light.canonical(), water.measured_waters(), light.raman(),
        water.caustics(), water.papers(),
    ]  # fmt: skip
    rows = [row for found, _ in sections for row in found]
    lead = grid("| quantity | source | this project | reference | verdict |", lines_of(rows))
    texts = "\n".join(text for _, text in sections)
    docs = ROOT / "docs"
    pages = {
        docs / "validation.md": summary(lead),
        docs / "measured" / "outside.md": details(texts, planted()),
    }
    for path, text in pages.items():
        path.write_text(text, encoding="utf-8")
        print(text)
