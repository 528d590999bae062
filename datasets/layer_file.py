"""The layers of one picture in one OpenEXR file, ``NNNN_layers.exr``.

Names of the channels, as layers of OpenEXR:

=======================  ======================================================================
``D.R``, ``D.G``, ``D.B``  layer ``D`` in the three channels of the sensor, linear, before white
                         balance and exposure (X, Y, Z of an observer)
``D_bands.450,0nm``      layer ``D`` in the band around 450 nm, as :func:`.spectral_channels` has it
``range``                a map of one channel
``normal.X``             a map of several
``CryptoObject00.R``     Cryptomatte's ranks, with its own attributes
=======================  ======================================================================

The attribute ``underwaterLayers`` is JSON: ``layers`` with units and meaning of each, how
each was made, and what else is known of the picture.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr_texts, write_exr
from .camera import PinholeCamera

ATTRIBUTE = "underwaterLayers"
FORMAT = 1
SENSOR = ("R", "G", "B")
_BANDS = "_bands"
_CRYPTOMATTE = "cryptomatte/"
_HALF = (1 / 64, 6.5e4)  # largest values of which 16 bits hold what counts

Image = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class LayerImage:
    """A layer of a picture."""

    values: NDArray[Any]  #: Shape (height, width, k).
    channels: tuple[str, ...] = ("",)  #: Their k names; one without a name is the layer itself.
    units: str = ""
    text: str = ""  #: What it holds and how it was made.
    whole: bool = False  #: Whether it needs 32 bits.

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=np.float32)
        if values.ndim != 3 or values.shape[2] != len(self.channels):
            raise InputError(
                f"layer: values of shape {values.shape} for {len(self.channels)} channel(s)"
            )
        object.__setattr__(self, "values", values)


@dataclass(frozen=True, eq=False)
class FrameLayers:
    """The layers of one picture, by name; those of bands are called ``D_bands``.

    ``header`` is what else is known, as JSON holds it: frame, camera, instances, bands;
    ``attributes`` are others of the file, such as those of Cryptomatte.
    """

    layers: Mapping[str, LayerImage]
    header: Mapping[str, Any] = field(default_factory=dict)
    attributes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("layers", "header", "attributes"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        if len({image.values.shape[:2] for image in self.layers.values()}) > 1:
            raise InputError("layers: the layers of a picture have different sizes")

    def __contains__(self, name: str) -> bool:
        """Whether a layer is there."""
        return name in self.layers

    def __getitem__(self, name: str) -> Image:
        """Return the values of a layer, shape (h, w, k), or (h, w) where it has one channel.

        Raises InputError if it is not there.
        """
        found = self.layers.get(name)
        if found is None:
            raise InputError(
                f"layers: there is no {name!r}, but {', '.join(self.layers)}; render it with "
                "--layers"
            )
        return found.values[..., 0] if found.channels == ("",) else found.values

    def bands(self, name: str) -> Image:
        """Return a layer in bands, shape (h, w, n)."""
        return self[bands_name(name)]

    @property
    def instances(self) -> dict[int, str]:
        """Names of the objects by their numbers in the layer ``instance``."""
        return {int(number): name for number, name in self.header.get("instances", {}).items()}


def camera_of(header: Mapping[str, Any]) -> tuple[PinholeCamera, NDArray[np.float64]]:
    """Return the camera that took a picture, by the header of its layers, and its pose."""
    camera = header["camera"]
    K = np.array(camera["K"])
    pinhole = PinholeCamera(
        camera["width"], camera["height"], K[0, 0], K[1, 1], K[0, 2], K[1, 2],
        tuple(camera["distortion"]),
    )  # fmt: skip
    return pinhole, np.array(camera["camera_to_world"], dtype=np.float64)


def joined(parts: Sequence[FrameLayers]) -> FrameLayers:
    """Return the layers of all parts in one."""
    layers, header, attributes = {}, {}, {}
    for part in parts:
        layers |= part.layers
        header |= part.header
        attributes |= part.attributes
    return FrameLayers(layers, header, attributes)


def side_by_side(parts: Sequence[FrameLayers]) -> FrameLayers:
    """Return the layers of passes in one: bands side by side, channels of the sensor added.

    What is the same for all light is that of the first pass that has it.
    """
    layers: dict[str, LayerImage] = {}
    for part in parts:
        for name, image in part.layers.items():
            before = layers.get(name)
            if before is None:
                layers[name] = image
            elif is_of_bands(name):
                values = np.concatenate([before.values, image.values], axis=-1)
                layers[name] = replace(
                    before, values=values, channels=(*before.channels, *image.channels)
                )
            else:
                layers[name] = replace(before, values=before.values + image.values)
    return replace(joined(list(reversed(parts))), layers=layers)


def bands_name(name: str) -> str:
    """Return the name of a layer in bands, such as ``D_bands``."""
    return f"{name}{_BANDS}"


def is_of_bands(name: str) -> bool:
    """Whether a layer is one in bands."""
    return name.endswith(_BANDS)


def write_layers(path: Path, frame: FrameLayers) -> None:
    """Write layers; whole under its name, or not at all.

    A channel has 16 bits where these suffice. Raises InputError if there are none, or the file
    cannot be written.
    """
    if not frame.layers:
        raise InputError(f"cannot write {path}: there are no layers")
    channels, formats, values = [], [], []
    for name, image in frame.layers.items():
        channels += [f"{name}.{channel}" if channel else name for channel in image.channels]
        formats += ["float" if image.whole or not fits_half(image.values) else "half"] * len(
            image.channels
        )
        values.append(image.values)
    known = {
        name: {"channels": image.channels, "units": image.units, "text": image.text}
        for name, image in frame.layers.items()
    }
    text = json.dumps({"format": FORMAT, **frame.header, "layers": known})
    write_exr(
        path,
        np.concatenate(values, axis=-1),
        channels,
        {**frame.attributes, ATTRIBUTE: text},
        formats,
    )


def read_layers(path: Path) -> FrameLayers:
    """Read what :func:`write_layers` wrote.

    Raises InputError if the file is missing, damaged, or holds no layers.
    """
    pixels, channels, texts = read_exr_texts(path)
    try:
        header = json.loads(texts.get(ATTRIBUTE, ""))
        known = header.pop("layers")
        found = header.pop("format")
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{path} holds no layers; render them with --layers") from error
    if found != FORMAT:
        raise InputError(f"{path} has format {found!r}; this reads {FORMAT}")
    place = {channel: index for index, channel in enumerate(channels)}
    layers = {}
    for name, image in known.items():
        wanted = [f"{name}.{channel}" if channel else name for channel in image["channels"]]
        missing = [channel for channel in wanted if channel not in place]
        if missing:
            raise InputError(f"{path} lacks channel {missing[0]!r}; write it again")
        values = pixels[..., [place[channel] for channel in wanted]]
        layers[name] = LayerImage(values, tuple(image["channels"]), image["units"], image["text"])
    others = {name: text for name, text in texts.items() if name.startswith(_CRYPTOMATTE)}
    return FrameLayers(layers, header, others)


def fits_half(values: ArrayLike) -> bool:
    """Whether 16 bits hold values to their usual digits.

    Examples
    --------
    >>> [fits_half(values) for values in ([0.0, 0.5, 2.0], [1e-6, 2e-6], [1e6])]
    [True, False, False]
    """
    size = np.abs(np.asarray(values, dtype=np.float64))
    largest = float(size[np.isfinite(size)].max(initial=0.0))
    return largest == 0.0 or _HALF[0] <= largest < _HALF[1]
