"""Measurements and published numbers beside ours: docs/validation.md, docs/measured/outside.md.

``python3 dev.py run -m benchmarks validation`` takes some CPU minutes, most of them for the
caustics; the table of planted errors is that of ``benchmarks planted_errors``, the numbers of
inelastic light and of pictures are read from their own pages. tests/validation/test_outside.py
holds the same comparisons to bounds of others.
"""

from __future__ import annotations

from . import _answers, planted_errors
from . import _outside_light as light
from . import _outside_water as water
from ._outside import Row, grid
from .path_radiance_table import ROOT


def planted() -> str:
    """The table of planted errors."""
    lines = []
    for row in planted_errors.rows():
        others = [name for name in row["others"].split("; ") if name]
        shown = ", ".join(f"`{name}`" for name in others[:2])
        more = f" and {len(others) - 2} more" if len(others) > 2 else ""
        outside = ", ".join(f"`{name}`" for name in row["outside"].split("; ") if name)
        lines.append(f"| {row['error']} | {outside or '–'} | {shown + more or '–'} |")
    alone = [row["error"] for row in planted_errors.rows() if not row["others"]]
    return f"""## Planted errors
One error of 10 % at a time in a copy of the checkout, and the fast tests of the optics
(`python3 dev.py run -m benchmarks planted_errors`). *Outside*: tests whose bound is someone
else's number (`tests/validation/test_outside.py`). All tests by name:
[planted_errors.csv](planted_errors.csv).

{grid("| planted error | caught outside by | and by tests of the optics |", lines)}

Only tests with outside references see: {", ".join(alone) or "none of them"}.
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


def details(texts: str, errors: str, answers: str) -> str:
    """Return docs/measured/outside.md."""
    return f"""# Comparisons with measurements and published computations

The summary, with a verdict for each row, is [validation](../validation.md).

{texts}
{errors}
{answers}
Written by `python3 dev.py run -m benchmarks validation`.
"""


def main(_arguments: list[str]) -> None:
    """Compare everything and write both pages."""
    sections = [
        light.tyler(), light.canonical(), water.measured_waters(), light.raman(),
        water.caustics(), water.papers(), _answers.pictures(),
    ]  # fmt: skip
    rows = [row for found, _ in sections for row in found]
    lead = grid("| quantity | source | this project | reference | verdict |", lines_of(rows))
    texts = "\n".join(text for _, text in sections)
    docs = ROOT / "docs"
    pages = {
        docs / "validation.md": summary(lead),
        docs / "measured" / "outside.md": details(texts, planted(), _answers.answers()),
    }
    for path, text in pages.items():
        path.write_text(text, encoding="utf-8")
        print(text)
