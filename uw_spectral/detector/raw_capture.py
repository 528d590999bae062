"""A raw picture: linear responses of a camera's channels through lens, mosaic and detector."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError, unknown_name
from .linear_detector import Detector, raw_counts

PATTERNS = ("RGGB", "BGGR", "GRBG", "GBRG")
"""Filters of the upper left four pixels, by rows."""
_CHANNELS = "RGB"


@dataclass(frozen=True)
class Vignetting:
    """Fraction of the light that reaches each pixel.

    D. B. Goldman, IEEE TPAMI 32, 2276 (2010).

    Raises
    ------
    InputError
        If a coefficient is not finite.
    """

    natural: bool = True  #: Whether it falls with cos⁴ of the angle from the optical axis.
    #: k1, k2, … of the fraction 1 + k1 r² + k2 r⁴ + …, with r from the principal point, 1 at the
    #: farthest corner.
    radial: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, self.radial)):
            raise InputError("vignetting: coefficients must be finite numbers")

    def fraction(
        self, size: tuple[int, int], focal: tuple[float, float], centre: tuple[float, float]
    ) -> NDArray[np.float64]:
        """Return the fraction of each pixel, shape (height, width).

        Focal lengths fx, fy and principal point cx, cy are in pixels from the upper left corner.

        Raises
        ------
        InputError
            If a fraction is negative.
        """
        width, height = size
        x = np.arange(width) + 0.5 - centre[0]
        y = (np.arange(height) + 0.5 - centre[1])[:, None]
        found = np.ones((height, width))
        if self.natural:
            found /= (1.0 + (x / focal[0]) ** 2 + (y / focal[1]) ** 2) ** 2
        if self.radial:
            corner = (
                max(centre[0], width - centre[0]) ** 2 + max(centre[1], height - centre[1]) ** 2
            )
            r2 = (x * x + y * y) / corner
            found *= np.polynomial.polynomial.polyval(r2, (1.0, *self.radial))
        if (found < 0).any():
            raise InputError(
                f"vignetting: the coefficients {self.radial} make the corners darker than black"
            )
        return found


@dataclass(frozen=True)
class RawSettings:
    """How raw pictures are taken.

    Raises
    ------
    InputError
        If the saturation is not positive.
    """

    detector: Detector
    #: Response of a channel that fills the well in this exposure, in the unit of the picture.
    saturation: float
    #: s; the light of the picture is that of this time, and the dark current grows with it.
    exposure_time: float = 0.01
    iso: float | None = None  #: The base ISO of the detector by default.
    #: One of :data:`PATTERNS`; every pixel sees three channels by default.
    pattern: str | None = None
    vignetting: Vignetting | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 < self.saturation < math.inf:
            raise InputError(f"raw picture: saturation must be positive, got {self.saturation}")

    def record(self) -> dict[str, Any]:
        """Return all of it as JSON holds it."""
        return dataclasses.asdict(self)


def capture(
    channels: ArrayLike,
    settings: RawSettings,
    *,
    focal: tuple[float, float] | None = None,
    centre: tuple[float, float] | None = None,
) -> NDArray[np.uint16]:
    """Return the counts of a raw picture, shape (height, width); without a mosaic (..., 3).

    ``channels``, shape (height, width, 3), are linear responses of the sensor before white balance;
    negative ones count as dark. ``focal`` and ``centre`` are focal lengths and principal point in
    pixels, for vignetting.

    Raises
    ------
    InputError
        If vignetting lacks the camera, or a value is out of its domain.
    """
    values = np.maximum(np.asarray(channels, dtype=np.float64), 0.0)
    if values.ndim != 3 or values.shape[2] != 3:
        raise InputError(f"raw picture: three channels are needed, not {values.shape}")
    electrons = values / settings.saturation * settings.detector.full_well
    if settings.vignetting is not None:
        if focal is None or centre is None:
            raise InputError("raw picture: vignetting needs focal lengths and principal point")
        height, width, _ = values.shape
        electrons = (
            electrons * settings.vignetting.fraction((width, height), focal, centre)[..., None]
        )
    if settings.pattern is not None:
        electrons = mosaic(electrons, settings.pattern)
    return raw_counts(
        electrons,
        settings.detector,
        settings.seed,
        exposure_time=settings.exposure_time,
        iso=settings.iso,
    )


def filter_of_pixels(shape: tuple[int, int], pattern: str) -> NDArray[np.intp]:
    """Return the channel of each pixel, 0 to 2, shape (height, width).

    Raises
    ------
    InputError
        If the pattern is unknown.

    Examples
    --------
    >>> filter_of_pixels((2, 4), "RGGB").tolist()
    [[0, 1, 0, 1], [1, 2, 1, 2]]
    """
    if pattern not in PATTERNS:
        raise unknown_name("mosaic", pattern, PATTERNS)
    tile = np.array([_CHANNELS.index(letter) for letter in pattern]).reshape(2, 2)
    height, width = shape
    return np.tile(tile, (height // 2 + 1, width // 2 + 1))[:height, :width]


def mosaic(channels: ArrayLike, pattern: str) -> NDArray[np.float64]:
    """Return what the pixels behind their filters see, of channels (height, width, 3).

    Raises
    ------
    InputError
        If the pattern is unknown, or there are not three channels.
    """
    values = np.asarray(channels, dtype=np.float64)
    if values.ndim != 3 or values.shape[2] != 3:
        raise InputError(f"mosaic: a picture of three channels is needed, not {values.shape}")
    height, width, _ = values.shape
    seen = filter_of_pixels((height, width), pattern)
    return np.take_along_axis(values, seen[..., None], axis=2)[..., 0]
