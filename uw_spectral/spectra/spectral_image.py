"""Spectral and RGB images on disk; every file appears whole or not at all."""

from __future__ import annotations

import contextlib
import json
import os
import re
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .bands import Bands
from .colour_rendering import srgb_encode
from .spectrum import is_file

RADIANCE_UNITS = "W.m^-2.sr^-1.nm^-1"
IRRADIANCE_UNITS = "W.m^-2.nm^-1"
LINEAR_REC709 = {"oiio:ColorSpace": "lin_rec709_scene"}
"""What a header says of scene-linear Rec.709; bands of a pass are no colours and have none."""
_SPECTRAL_CHANNEL = re.compile(r"S0\.(\d+(?:,\d+)?)nm")
_WIDTHS_ATTRIBUTE = "bandWidths_nm"


def write_exr(
    path: str | Path,
    pixels: ArrayLike,
    channels: Sequence[str],
    metadata: Mapping[str, Any] | None = None,
    formats: Sequence[str] | None = None,
) -> None:
    """Write a float32 OpenEXR image, shape (height, width, k).

    The file is replaced in one step once its content is complete. Attributes of the header are
    text, whole numbers, floats; anything else is stored as JSON text. Formats are ``"half"`` or
    ``"float"`` for each channel.

    Raises
    ------
    InputError
        If the file cannot be written; the message names the path.
    """
    values = np.asarray(pixels, dtype=np.float32)
    _write(path, values, channels, "float", metadata or {}, formats)


def write_rgb_exr(
    path: str | Path, rgb: ArrayLike, metadata: Mapping[str, Any] | None = None
) -> None:
    """Write scene-linear Rec.709, shape (height, width, 3), as float32 OpenEXR.

    A fourth channel is alpha, by which the colours are multiplied already.
    """
    write_exr(path, rgb, "RGBA"[: np.shape(rgb)[-1]], metadata)


def write_png(path: str | Path, rgb: ArrayLike) -> None:
    """Write scene-linear Rec.709, shape (height, width, 3), as 8-bit sRGB PNG.

    A fourth channel is alpha, by which the colours are multiplied already; those of a PNG are not.
    """
    values = np.nan_to_num(rgb)
    alpha = np.clip(values[..., 3:], 0.0, 1.0)
    colours = values[..., :3] / np.where(alpha > 0.0, alpha, 1.0) if alpha.size else values
    codes = np.round(np.concatenate([srgb_encode(colours), alpha], axis=-1) * 255).astype(np.uint8)
    header = {"oiio:ColorSpace": "srgb_rec709_scene", "oiio:UnassociatedAlpha": 1}
    _write(path, codes, "RGBA"[: codes.shape[-1]], "uint8", header)


def write_jpeg(path: str | Path, rgb: ArrayLike, quality: int = 90) -> None:
    """Write scene-linear Rec.709, shape (height, width, 3), as sRGB JPEG."""
    codes = np.round(srgb_encode(np.nan_to_num(rgb)) * 255).astype(np.uint8)
    _write(path, codes, ("R", "G", "B"), "uint8", {"compression": f"jpeg:{quality}"})


def write_codes(
    path: str | Path,
    codes: NDArray[np.uint8] | NDArray[np.uint16],
    metadata: Mapping[str, Any] | None = None,
) -> None:
    """Write whole numbers, (height, width) or (height, width, 3), as PNG or TIFF by the suffix.

    Raises
    ------
    InputError
        If the file cannot be written, or the numbers are of another kind.
    """
    kind = codes.dtype.name
    if kind not in {"uint8", "uint16"}:
        raise InputError(f"cannot write {path}: codes are uint8 or uint16, not {kind}")
    pixels = codes[..., None] if codes.ndim == 2 else codes
    _write(path, pixels, "Y" if pixels.shape[-1] == 1 else "RGB", kind, metadata or {})


def write_spectral_exr(
    path: str | Path,
    radiance: ArrayLike,
    bands: Bands,
    metadata: Mapping[str, Any] | None = None,
    units: str = RADIANCE_UNITS,
) -> None:
    """Write band radiances in the spectral OpenEXR layout of Fichet et al. 2021.

    Radiances have shape (height, width, n); centres name the channels (``S0.450,0nm``), widths go
    to the attribute ``bandWidths_nm`` and units to ``emissiveUnits``.

    Fichet, Pacanowski & Wilkie, An OpenEXR Layout for Spectral Images,
    JCGT 10(3), 2021.
    """
    header = {
        "spectralLayoutVersion": "1.0",
        "emissiveUnits": units,
        _WIDTHS_ATTRIBUTE: bands.widths.tolist(),
    }
    write_exr(path, radiance, spectral_channels(bands), {**header, **(metadata or {})})


def spectral_channels(bands: Bands) -> list[str]:
    """Channel names of the Fichet 2021 layout."""
    return [
        f"S0.{centre!r}nm".replace(".", ",").replace("S0,", "S0.")
        for centre in bands.centres.tolist()
    ]


def band_labels(bands: Bands) -> list[str]:
    """Names of bands in the channels of layers.

    Examples
    --------
    >>> band_labels(Bands.uniform(2))
    ['475,0nm', '625,0nm']
    """
    return [name.removeprefix("S0.") for name in spectral_channels(bands)]


def read_exr(path: str | Path) -> tuple[NDArray[np.float32], list[str]]:
    """Read an OpenEXR image, shape (height, width, k), and the k channel names.

    Raises
    ------
    InputError
        If the file is missing, damaged or incomplete.
    """
    pixels, spec = _read(path)
    return pixels, list(spec.channelnames)


def read_exr_texts(
    path: str | Path,
) -> tuple[NDArray[np.float32], list[str], dict[str, str]]:
    """Read an OpenEXR image as :func:`read_exr` does, and its attributes of text.

    Raises
    ------
    InputError
        If the file is missing, damaged or incomplete.
    """
    pixels, spec = _read(path)
    texts = {item.name: item.value for item in spec.extra_attribs if isinstance(item.value, str)}
    return pixels, list(spec.channelnames), texts


def read_spectral_exr(path: str | Path) -> tuple[NDArray[np.float32], Bands, str]:
    """Read a spectral image (height, width, n) of :func:`write_spectral_exr`, or of that layout.

    With its bands, sorted, and units.

    Raises
    ------
    InputError
        If the file is missing, damaged, or not a spectral image.
    """
    pixels, spec = _read(path)
    found = [(i, _SPECTRAL_CHANNEL.fullmatch(name)) for i, name in enumerate(spec.channelnames)]
    centres = {float(match[1].replace(",", ".")): i for i, match in found if match}
    if not centres:
        raise InputError(
            f"{path} has no spectral channels (S0.450,0nm), but {', '.join(spec.channelnames)}"
        )
    ordered = sorted(centres)
    bands = Bands.at_wavelengths(ordered)
    widths = spec.get_string_attribute(_WIDTHS_ATTRIBUTE)
    if widths:
        try:
            bands = Bands(bands.centres, np.array(json.loads(widths), dtype=np.float64))
        except (ValueError, TypeError) as error:
            raise InputError(
                f"{path}: the attribute {_WIDTHS_ATTRIBUTE} does not hold a width per band "
                f"({error}); write the image again"
            ) from error
    return (
        pixels[..., [centres[centre] for centre in ordered]],
        bands,
        spec.get_string_attribute("emissiveUnits"),
    )


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
    place = "RGBAXYZWV".find
    return {
        layer: np.stack([channels[name] for name in sorted(channels, key=place)], axis=-1)
        for layer, channels in found.items()
    }


def temporary_name(path: Path, what: str = "tmp") -> Path:
    """Return a hidden name beside a file that no other process takes, with the same suffix.

    It has the number of the process, by which what a dead one has left is found, and more:
    containers that share a folder share numbers.
    """
    unique = f"{os.getpid()}.{uuid.uuid4().hex}"
    return path.with_name(f".{path.stem}.{unique}.{what}{path.suffix}")


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary name next to a file, and put it in the file's place on success.

    It has the same suffix, and is removed if the body fails.

    Raises
    ------
    InputError
        If the folder does not exist, or the file cannot be put in place.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(f"cannot write {path}: {path.parent} is not a folder; create it first")
    temporary = temporary_name(path)
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise InputError(
            f"cannot write {path}: {error.strerror or error}; choose another output folder"
        ) from error
    finally:
        with contextlib.suppress(OSError):  # of a disk that lets nothing be changed
            temporary.unlink()


def _write(
    path: str | Path,
    pixels: NDArray[Any],
    channels: Sequence[str],
    kind: str,
    metadata: Mapping[str, Any],
    formats: Sequence[str] | None = None,
) -> None:
    import OpenImageIO as oiio  # noqa: N813

    if pixels.ndim != 3 or pixels.shape[2] != len(channels):
        raise InputError(
            f"cannot write {path}: pixels of shape {pixels.shape} for {len(channels)} channels"
        )
    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, kind)
    spec.channelnames = tuple(channels)
    if formats is not None:
        spec.channelformats = tuple(map(oiio.TypeDesc, formats))
    for name, value in metadata.items():
        plain = isinstance(value, str | int | float) and not isinstance(value, bool)
        spec.attribute(name, value if plain else json.dumps(value))
    with replacing(path) as temporary:
        output = oiio.ImageOutput.create(str(temporary))
        if output is None:
            raise InputError(f"cannot write {path}: {oiio.geterror()}")
        try:
            contiguous = np.ascontiguousarray(pixels)
            whole = output.open(str(temporary), spec) and output.write_image(contiguous)
        finally:
            # The last blocks reach the disk on closing: that can fail too.
            closed = output.close()
        if not (whole and closed):
            reason = (output.geterror() or "not everything was written").replace(
                str(temporary), path.__fspath__() if isinstance(path, Path) else path
            )
            raise InputError(f"cannot write {path}: {reason}; choose another output folder")


def _read(path: str | Path) -> tuple[NDArray[np.float32], Any]:
    import OpenImageIO as oiio  # noqa: N813

    if not is_file(path):
        raise InputError(f"cannot read {path}: there is no such file; check the path")
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise InputError(f"cannot read {path}: {oiio.geterror()}; it is damaged or not an image")
    try:
        pixels = source.read_image("float")
        reason = source.geterror()
        spec = source.spec()
    finally:
        source.close()
    if pixels is None or reason:
        raise InputError(f"{path} is incomplete or damaged ({reason}); render it again")
    return pixels.reshape(spec.height, spec.width, spec.nchannels), spec
