"""The optics against the outside world: writes docs/validation.md.

``python3 dev.py run -m benchmarks validation`` takes some CPU minutes, most of them for the
caustics; the table of planted errors is that of ``benchmarks planted_errors``, the numbers of
inelastic light and of pictures are read from their own pages. tests/validation/test_outside.py
holds the same comparisons to bounds of others.
"""

from __future__ import annotations

from . import _answers, planted_errors
from . import _outside_light as light
from . import _outside_water as water
from ._outside import grid
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

Without the outside no fast test would see: {", ".join(alone) or "none of them"}.
"""


def main(_arguments: list[str]) -> None:
    """Compare everything and write docs/validation.md."""
    sections = [
        light.tyler(), light.canonical(), water.measured_waters(), light.raman(),
        water.caustics(), water.papers(), _answers.pictures(),
    ]  # fmt: skip
    lead = grid(
        "| quantity | source | ours | theirs | verdict |",
        [
            f"| {row.quantity} | {row.source} | {row.ours} | {row.theirs} | {row.verdict} |"
            for rows, _ in sections
            for row in rows
        ],
    )
    texts = "\n".join(text for _, text in sections)
    text = f"""# Against the outside world

Numbers that others measured or computed, and ours beside them; nothing is fitted unless it says
so. *Theirs* with ± is their spread or error.

{lead}

{texts}
{planted()}
{_answers.answers()}
## What the comparison put right
- Problem 1 of Mobley et al. was solved with another phase function than the paper's, in numpy,
  Monte Carlo and Cycles alike; one digit of Lu (problem 2, case 2, 0.5 m) was transcribed wrongly.
- The Ed that Cycles is tested against had no source and was 0.07 % off at 5 m; it now is that of
  two discrete-ordinates solvers, 64 streams each.
- Ed of the two streams “to 1 %”, caustics whose fall with the sun “is met”, three renderers “that
  agree”, inelastic light without a verdict: each now says where it holds
  ([physics.md](physics.md), [caustics.md](caustics.md), [inelastic.md](inelastic.md), the README).
- Figure 2 of Gutierrez et al. is drawn with the waters that the paper prints.

## What has no outside yet
- Pictures: no photograph with measured water, light and camera was found. The figures of the
  papers show scenes that are not published; [our numbers for them](paper_figures.md) are beside
  what they say.
- Shares of Raman light and fluorescence below the surface, in numbers.

Written by `python3 dev.py run -m benchmarks validation`.
"""
    (ROOT / "docs" / "validation.md").write_text(text, encoding="utf-8")
    print(text)
