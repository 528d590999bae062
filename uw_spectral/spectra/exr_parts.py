"""The passes of a render in one OpenEXR file, in parts or in one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError


def read_passes(path: Path) -> dict[str, NDArray[np.float32]]:
    """Read the passes of a file whose channels are called ``View Layer.Pass.Channel``.

    By name of the pass, (height, width, k); channels as they lie in the file, after R, G, B, A or
    X, Y, Z, W.

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    import OpenImageIO as oiio  # noqa: N813

    source = oiio.ImageInput.open(str(path)) if path.is_file() else None
    if source is None:
        raise InputError(f"cannot read {path}: there is no such picture; render it again")
    found: dict[str, dict[str, NDArray[np.float32]]] = {}
    try:
        part = 0
        while source.seek_subimage(part, 0):
            spec = source.spec()
            pixels = source.read_image(part, 0, 0, spec.nchannels, "float")
            if pixels is None:
                raise InputError(f"{path} is incomplete or damaged; render it again")
            image = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, -1)
            for index, name in enumerate(spec.channelnames):
                *_, layer, channel = ("", *name.rsplit(".", 2))
                found.setdefault(layer, {})[channel.upper()] = image[..., index]
            part += 1
    finally:
        source.close()
    return {
        layer: np.stack([channels[name] for name in sorted(channels, key=_place)], axis=-1)
        for layer, channels in found.items()
    }


def _place(channel: str) -> int:
    return "RGBAXYZWV".find(channel)
