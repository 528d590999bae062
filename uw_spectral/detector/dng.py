"""Raw pictures as DNG: uncompressed counts behind a mosaic, and what a developer must know.

One image directory, as *Digital Negative Specification 1.4* and TIFF 6.0 describe it, little
endian, with the linear counts as they are. Of EXIF it has the ISO; lens corrections and previews
are not in it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from ..spectra.spectral_image import replacing
from .raw_capture import PATTERNS, RawSettings

_BYTE, _ASCII, _SHORT, _LONG, _RATIONAL, _SRATIONAL = 1, 2, 3, 4, 5, 10
_CODES = {_BYTE: "B", _SHORT: "H", _LONG: "I", _RATIONAL: "I", _SRATIONAL: "i"}
_MOSAIC, _D65 = 32803, 21
_STRIP, _EXIF = 273, 34665  # tags with the places of the counts and of EXIF's directory
_HEADER = 8  # bytes
_DENOMINATOR = 1_000_000
_HIGHEST_ISO = 65535  # as EXIF writes what its tag cannot hold
_Tags = dict[int, tuple[int, list[int] | str]]
"""Of a directory: kind and content by number."""


def write_dng(
    path: Path,
    counts: NDArray[np.uint16],
    settings: RawSettings,
    xyz_to_camera: ArrayLike,
    neutral: ArrayLike,
    camera: str,
    software: str = "Underwater Spectral",
) -> None:
    """Write the counts of a mosaic that was taken with settings.

    ``xyz_to_camera``, shape (3, 3), leads from CIE XYZ under D65 to the camera's channels before
    white balance, ``neutral``, (3,), is what these see of grey; both to a factor.

    Adobe, Digital Negative (DNG) Specification 1.4.0.0 (2012).

    Raises
    ------
    InputError
        If the counts are no mosaic, a matrix or grey is not usable, or the file cannot be written.
    """
    matrix, grey = np.asarray(xyz_to_camera, np.float64), np.asarray(neutral, np.float64)
    if counts.dtype != np.uint16 or counts.ndim != 2:
        raise InputError(f"cannot write {path}: a DNG holds one 16-bit count per pixel")
    detector, iso = settings.detector, settings.iso
    if settings.pattern not in PATTERNS:
        raise unknown_name("mosaic", str(settings.pattern), PATTERNS)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all() or not np.linalg.det(matrix):
        raise InputError(f"cannot write {path}: the colour matrix must be 3×3 and invertible")
    if grey.shape != (3,) or not (np.isfinite(grey).all() and (grey > 0).all()):
        raise InputError(f"cannot write {path}: grey must be seen by all three channels")
    height, width = counts.shape
    # A white of luminance 1 brings the channel that sees most of it to 1.
    white = np.array([0.9505, 1.0, 1.089])
    matrix = matrix / np.max(matrix @ white)
    pixels = counts.astype("<u2").tobytes()
    tags: _Tags = {
        254: (_LONG, [0]),  # a full picture
        256: (_LONG, [width]),
        257: (_LONG, [height]),
        258: (_SHORT, [16]),
        259: (_SHORT, [1]),  # not compressed
        262: (_SHORT, [_MOSAIC]),
        271: (_ASCII, software),
        272: (_ASCII, camera),
        _STRIP: (_LONG, [0]),
        274: (_SHORT, [1]),  # upright
        277: (_SHORT, [1]),
        278: (_LONG, [height]),
        279: (_LONG, [len(pixels)]),
        284: (_SHORT, [1]),
        305: (_ASCII, software),
        33421: (_SHORT, [2, 2]),
        33422: (_BYTE, ["RGB".index(letter) for letter in settings.pattern]),
        _EXIF: (_LONG, [0]),
        50706: (_BYTE, [1, 4, 0, 0]),
        50707: (_BYTE, [1, 1, 0, 0]),
        50708: (_ASCII, camera),
        50714: (_RATIONAL, _rationals([detector.black_level])),
        50717: (_LONG, [detector.saturation(iso)]),
        50721: (_SRATIONAL, _rationals(matrix.ravel().tolist())),
        50728: (_RATIONAL, _rationals((grey / grey.max()).tolist())),
        50778: (_SHORT, [_D65]),
    }
    taken_at = detector.base_iso if iso is None else iso
    exif: _Tags = {34855: (_SHORT, [min(round(taken_at), _HIGHEST_ISO)])}
    with replacing(path) as temporary:
        temporary.write_bytes(_tiff(tags, exif, pixels))


def _rationals(values: Sequence[float]) -> list[int]:
    found = [Fraction(value).limit_denominator(_DENOMINATOR) for value in values]
    return [part for value in found for part in (value.numerator, value.denominator)]


def _tiff(tags: _Tags, exif: _Tags, pixels: bytes) -> bytes:
    """The directory after the header, then that of EXIF, then the counts."""
    place_of_exif = _HEADER + len(_directory(tags, _HEADER))
    directory_of_exif = _directory(exif, place_of_exif)
    placed = {
        **tags,
        _EXIF: (_LONG, [place_of_exif]),
        _STRIP: (_LONG, [place_of_exif + len(directory_of_exif)]),
    }
    header = struct.pack("<2sHI", b"II", 42, _HEADER)
    return header + _directory(placed, _HEADER) + directory_of_exif + pixels


def _directory(tags: _Tags, place: int) -> bytes:
    """One directory that lies at a place, and what does not fit into it."""
    entries, extra = b"", b""
    start = place + 2 + 12 * len(tags) + 4
    for tag, (kind, values) in sorted(tags.items()):
        if isinstance(values, str):
            content = values.encode("ascii", "replace") + b"\0"
            count = len(content)
        else:
            content = struct.pack(f"<{len(values)}{_CODES[kind]}", *values)
            count = len(values) // (2 if kind in (_RATIONAL, _SRATIONAL) else 1)
        entries += struct.pack("<HHI", tag, kind, count)
        if len(content) > 4:
            entries += struct.pack("<I", start + len(extra))
            extra += content + b"\0" * (len(content) % 2)
        else:
            entries += content.ljust(4, b"\0")
    return struct.pack("<H", len(tags)) + entries + struct.pack("<I", 0) + extra
