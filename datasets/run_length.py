"""Masks as run lengths, in COCO's order (down the columns) and its compressed text."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

_OFFSET = 48  # of the first printable code
_BITS = 5  # of a value that a character carries


def run_lengths(mask: ArrayLike) -> list[int]:
    """Return the lengths of the runs of 0 and 1 in turn, down the columns, 0 first.

    Examples
    --------
    >>> run_lengths([[0, 1], [1, 1]])
    [1, 3]
    >>> run_lengths([[1, 0], [1, 0]])
    [0, 2, 2]
    """
    flat = np.asarray(mask, dtype=bool).ravel(order="F")
    changes = np.flatnonzero(np.diff(flat)) + 1
    lengths = np.diff([0, *changes.tolist(), flat.size]).tolist()
    return [0, *lengths] if flat.size and flat[0] else lengths


def compressed(lengths: list[int]) -> str:
    """Return run lengths as COCO's text.

    From the third on, a length is counted from that two before it. A number is written in
    parts of five bits, the lowest first, a sixth bit saying that more follow, and sign
    extension from the last.

    Examples
    --------
    >>> compressed([1, 3])
    '13'
    """
    text = []
    for place, length in enumerate(lengths):
        value = length - lengths[place - 2] if place > 2 else length
        while True:
            part = value & 0x1F
            value >>= _BITS
            done = value == (-1 if part & 0x10 else 0)
            text.append(chr(_OFFSET + (part if done else part | 0x20)))
            if done:
                break
    return "".join(text)
