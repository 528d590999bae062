"""Pictures as they are stored: whole numbers of 8 or 16 bits, or floats."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import srgb_decode, srgb_encode

_CODES = 1 << 14


def read_rgb(path: Path) -> NDArray[Any]:
    """Read a picture of three channels, (h, w, 3); grey becomes all three, alpha is left out.

    Raises InputError if there is none, or it has other channels.
    """
    pixels = _stored(path)
    channels = pixels.shape[-1]
    if channels in (1, 2):
        return pixels[..., :1].repeat(3, axis=2)
    if channels in (3, 4):
        return pixels[..., :3]
    raise InputError(f"{path} has {channels} channels; a picture has red, green and blue")


def read_codes(path: Path) -> NDArray[np.uint16]:
    """Read a picture of one channel as whole numbers, shape (height, width).

    Raises InputError if there is no such picture, or it has more channels.
    """
    pixels = _stored(path)
    if pixels.shape[-1] != 1 or not np.issubdtype(pixels.dtype, np.unsignedinteger):
        raise InputError(f"{path} is not a picture of one channel of 8 or 16 bits")
    return pixels[..., 0].astype(np.uint16)


def _stored(path: Path) -> NDArray[Any]:
    """Pixels (h, w, channels) as they are: OpenImageIO scales codes when asked for others."""
    import OpenImageIO as oiio  # noqa: N813

    source = oiio.ImageInput.open(str(path)) if path.is_file() else None
    if source is None:
        why = oiio.geterror() or "there is no such file"
        raise InputError(f"cannot read {path}: {why}; bring or write it again")
    try:
        spec = source.spec()
        pixels = source.read_image(spec.format)
    finally:
        source.close()
    if pixels is None:
        raise InputError(f"{path} is damaged or incomplete; bring or write it again")
    return np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)


@functools.lru_cache(maxsize=4)
def linear_codes(kind: DTypeLike, *, linear: bool) -> NDArray[np.float32]:
    """Linear value of each code of 8 or 16 bits, else InputError; of sRGB or as it is."""
    if kind not in (np.uint8, np.uint16):
        raise InputError(f"pictures are of 8 or 16 bits, or floats, not {np.dtype(kind).name}")
    values = np.linspace(0.0, 1.0, np.iinfo(np.dtype(kind)).max + 1)
    return (values if linear else srgb_decode(values)).astype(np.float32)


def srgb_codes(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """8-bit sRGB codes (h, w, 3) of linear Rec.709 (3, h, w)."""
    codes, found = _srgb_of(), np.empty((*linear.shape[1:], 3), np.uint8)
    for row, line in enumerate(np.moveaxis(linear, 0, -1)):
        place = np.clip(line, 0.0, 1.0) * np.float32(_CODES - 1) + np.float32(0.5)
        found[row] = codes.take(place.astype(np.int32), mode="clip")
    return found


@functools.cache
def _srgb_of() -> NDArray[np.uint8]:
    return np.round(srgb_encode(np.linspace(0.0, 1.0, _CODES)) * 255).astype(np.uint8)
