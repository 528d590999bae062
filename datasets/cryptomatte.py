"""Cryptomatte: names of objects as hashes, ranked by coverage in each pixel.

Source: J. Friedman & A. Jones, Fully automatic ID mattes with support for motion blur and
transparency, SIGGRAPH 2015; Cryptomatte specification 1.2.
"""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

_MASK = 0xFFFFFFFF
_PREFIX = "cryptomatte/"


def murmur3(name: str) -> int:
    """MurmurHash3 of a name, 32 bits, seed 0.

    Examples
    --------
    >>> hex(murmur3("hello")), hex(murmur3(""))
    ('0x248bfa47', '0x0')
    """
    data = name.encode("utf-8")
    state = 0
    whole = len(data) - len(data) % 4
    for start in range(0, whole, 4):
        state ^= _mixed(int.from_bytes(data[start : start + 4], "little"))
        state = (_rotated(state, 13) * 5 + 0xE6546B64) & _MASK
    state ^= _mixed(int.from_bytes(data[whole:], "little"))
    state ^= len(data)
    state = ((state ^ (state >> 16)) * 0x85EBCA6B) & _MASK
    state = ((state ^ (state >> 13)) * 0xC2B2AE35) & _MASK
    return state ^ (state >> 16)


def identifier(name: str) -> int:
    """Return the bits that stand for a name: its hash, made a normal float."""
    bits = murmur3(name)
    exponent = (bits >> 23) & 255
    return bits ^ (1 << 23) if exponent in {0, 255} else bits


def attributes(typename: str, names: Iterable[str]) -> dict[str, str]:
    """Return the attributes of a file that holds the ranks of a type, such as CryptoObject."""
    key = f"{_PREFIX}{murmur3(typename):08x}"[: len(_PREFIX) + 7]
    manifest = {name: f"{identifier(name):08x}" for name in sorted(names)}
    return {
        f"{key}/name": typename,
        f"{key}/hash": "MurmurHash3_32",
        f"{key}/conversion": "uint32_to_float32",
        f"{key}/manifest": json.dumps(manifest),
    }


def numbers(first_rank: ArrayLike, names: Iterable[str]) -> NDArray[np.float32]:
    """Return pictures of numbers: the place of a name in the list, from 1; 0 for none of them.

    ``first_rank`` holds identifiers, shape (height, width).
    """
    found = np.ascontiguousarray(first_rank, dtype=np.float32).view(np.uint32)
    known = np.array([identifier(name) for name in names], dtype=np.uint32)
    order = np.argsort(known)
    places = np.searchsorted(known[order], found).clip(0, max(len(known) - 1, 0))
    if not len(known):
        return np.zeros(found.shape, np.float32)
    match = known[order][places] == found
    return np.where(match, order[places] + 1, 0).astype(np.float32)


def _mixed(block: int) -> int:
    return (_rotated((block * 0xCC9E2D51) & _MASK, 15) * 0x1B873593) & _MASK


def _rotated(value: int, by: int) -> int:
    return ((value << by) | (value >> (32 - by))) & _MASK
