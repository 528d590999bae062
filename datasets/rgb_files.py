"""Pictures of three channels that others made, as they are stored."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.colour_rendering import srgb_decode


def read_rgb(path: Path) -> NDArray[Any]:
    """Read a picture, (h, w, 3): codes of 8 or 16 bits, or floats; grey becomes all three.

    Raises
    ------
    InputError
        If there is none, or it has other channels.
    """
    import OpenImageIO as oiio  # noqa: N813

    source = oiio.ImageInput.open(str(path)) if path.is_file() else None
    if source is None:
        why = oiio.geterror() or "there is no such file"
        raise InputError(f"cannot read {path}: {why}; give a picture")
    try:
        spec = source.spec()
        pixels = source.read_image(spec.format)
    finally:
        source.close()
    if pixels is None:
        raise InputError(f"{path} is damaged or incomplete; bring it again")
    pixels = np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)
    if spec.nchannels in (1, 2):
        return pixels[..., :1].repeat(3, axis=2)
    if spec.nchannels in (3, 4):
        return pixels[..., :3]
    raise InputError(f"{path} has {spec.nchannels} channels; a picture has red, green and blue")


@functools.lru_cache(maxsize=4)
def linear_codes(kind: DTypeLike, *, linear: bool) -> NDArray[np.float32]:
    """Linear value of each code of a kind, of sRGB or as it is.

    Raises
    ------
    InputError
        If codes are neither of 8 nor of 16 bits.
    """
    if kind not in (np.uint8, np.uint16):
        raise InputError(f"pictures are of 8 or 16 bits, or floats, not {np.dtype(kind).name}")
    values = np.linspace(0.0, 1.0, np.iinfo(np.dtype(kind)).max + 1)
    return (values if linear else srgb_decode(values)).astype(np.float32)
