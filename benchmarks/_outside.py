"""What the sections of docs/measured/outside.md have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MET, PARTLY, MISSED, OPEN = "met", "**partly**", "**missed**", "open"


@dataclass(frozen=True)
class Row:
    """A line of the table that leads: what, whose, our number, theirs, the verdict."""

    quantity: str
    source: str
    ours: str
    theirs: str
    verdict: str


Section = tuple[list[Row], str]


def percent(values: object, digits: int = 0) -> str:
    return "/".join(f"{100 * value:+.{digits}f}" for value in np.ravel(np.asarray(values)))


def grid(head: str, lines: list[str]) -> str:
    return "\n".join([head, "|---" * (head.count("|") - 1) + "|", *lines])
