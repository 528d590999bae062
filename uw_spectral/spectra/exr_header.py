"""The header of an OpenEXR file, and whether the file reaches its end, without reading pixels.

Ten thousand passes can be looked at in a second so. The layout is that of *OpenEXR File Layout*
(openexr.com): attributes, a table with the place of every chunk, the chunks.
"""

from __future__ import annotations

import contextlib
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

_MAGIC = 20000630
_SINGLE_PART = 0x1A00  # bits of the version that must not be set: tiled, deep, several parts
_LINES = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
# Bytes to look for the header in: as a rule, and for one with long texts.
_TYPICAL, _LONGEST = 1 << 12, 1 << 20


@dataclass(frozen=True)
class ExrHeader:
    """What a scanline image says of itself."""

    size: tuple[int, int]  #: Width and height.
    text: dict[str, str]  #: Its attributes of text.
    whole: bool  #: Whether every chunk lies in the file.


def read_header(path: Path) -> ExrHeader | None:
    """Return the header of a single-part scanline EXR; None if the file is none, or missing."""
    try:
        with path.open("rb") as file:
            length = os.fstat(file.fileno()).st_size
            for reach in (_TYPICAL, _LONGEST):
                with contextlib.suppress(struct.error, LookupError, ValueError):
                    return _header(file, length, reach)
                if length <= reach:
                    break
                file.seek(0)
    except OSError:
        pass
    return None


def _header(file: BinaryIO, length: int, reach: int) -> ExrHeader:
    head = file.read(reach)
    magic, version = struct.unpack_from("<ii", head)
    if magic != _MAGIC or version & _SINGLE_PART:
        raise ValueError("no single-part scanline EXR")
    attributes: dict[str, tuple[str, bytes]] = {}
    at = 8
    while True:
        name, at = _word(head, at)
        if not name:
            break
        kind, at = _word(head, at)
        (size,) = struct.unpack_from("<i", head, at)
        at += 4
        if size < 0 or at + size > len(head):
            raise ValueError("the header is cut")
        attributes[name] = kind, head[at : at + size]
        at += size
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    count = -((top - bottom - 1) // _LINES[attributes["compression"][1][0]])
    file.seek(at)
    table = file.read(8 * count)
    text = {
        name: content.decode("utf-8", "replace")
        for name, (kind, content) in attributes.items()
        if kind == "string"
    }
    return ExrHeader(
        (right - left + 1, bottom - top + 1), text, _reaches_end(file, table, count, length)
    )


def _word(head: bytes, at: int) -> tuple[str, int]:
    """Return text that ends with a zero, and where it ends."""
    end = head.index(b"\0", at)
    return head[at:end].decode("latin-1"), end + 1


def _reaches_end(file: BinaryIO, table: bytes, count: int, length: int) -> bool:
    if len(table) != 8 * count or not count:
        return False
    places = struct.unpack(f"<{count}Q", table)
    if min(places) <= 0 or max(places) + 8 > length:  # a place of 0 was never written
        return False
    file.seek(max(places))
    _, size = struct.unpack("<ii", file.read(8))
    return max(places) + 8 + size <= length
