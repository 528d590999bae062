"""The header of an OpenEXR file, and whether the file reaches its end, without reading pixels.

Ten thousand passes can be looked at in a second so. The layout is that of *OpenEXR File Layout*
(openexr.com): attributes, a table with the place of every chunk, the chunks.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

_MAGIC = 20000630
_SINGLE_PART = 0x1E00  # bits of the version that must not be set
_LINES = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}
_LONGEST = 1 << 16


@dataclass(frozen=True)
class ExrHeader:
    """What a scanline image says of itself.

    ``size`` is width and height, ``text`` its attributes of text, ``whole``
    whether every chunk lies in the file.
    """

    size: tuple[int, int]
    text: dict[str, str]
    whole: bool


def read_header(path: Path) -> ExrHeader | None:
    """Return the header of a single-part scanline EXR; None if the file is none, or missing."""
    try:
        with path.open("rb") as file:
            return _header(file, path.stat().st_size)
    except (OSError, struct.error, KeyError, ValueError):
        return None


def _header(file: BinaryIO, length: int) -> ExrHeader:
    magic, version = struct.unpack("<ii", file.read(8))
    if magic != _MAGIC or version & _SINGLE_PART:
        raise ValueError("no single-part scanline EXR")
    attributes: dict[str, tuple[str, bytes]] = {}
    while name := _word(file):
        kind = _word(file)
        (size,) = struct.unpack("<i", file.read(4))
        content = file.read(size)
        if size < 0 or len(content) != size:
            raise ValueError("the header is cut")
        attributes[name] = kind, content
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"][1])
    count = -((top - bottom - 1) // _LINES[attributes["compression"][1][0]])
    table = file.read(8 * count)
    text = {
        name: content.decode("utf-8", "replace")
        for name, (kind, content) in attributes.items()
        if kind == "string"
    }
    return ExrHeader(
        (right - left + 1, bottom - top + 1), text, _reaches_end(file, table, count, length)
    )


def _word(file: BinaryIO) -> str:
    """Read text that ends with a zero."""
    found = bytearray()
    while (byte := file.read(1)) != b"\0":
        found += byte
        if not byte or len(found) > _LONGEST:
            raise ValueError("the header is cut")
    return found.decode("latin-1")


def _reaches_end(file: BinaryIO, table: bytes, count: int, length: int) -> bool:
    if len(table) != 8 * count or not count:
        return False
    places = struct.unpack(f"<{count}Q", table)
    if min(places) <= 0 or max(places) + 8 > length:  # a place of 0 was never written
        return False
    file.seek(max(places))
    _, size = struct.unpack("<ii", file.read(8))
    return max(places) + 8 + size <= length
