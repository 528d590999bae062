"""The linear camera model of EMVA 1288: from photoelectrons to counts, with their noise.

Electrons are collected with shot noise, dark current among them, up to the full well; read noise
joins them, and the overall system gain K turns them into counts, which are rounded:

    σ_y² = K² σ_d² + 1/12 + K (μ_y - μ_y.dark)

is the line that a photon transfer measures. Two properties stay with a pixel: its offset (DSNU)
and its gain (PRNU), drawn from a seed of the device, not of the picture.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]

MOST_BITS = 16


@dataclass(frozen=True)
class Detector:
    """A detector at its base ISO.

    EMVA Standard 1288, Release 4.0 Linear (2021).

    Raises
    ------
    InputError
        If a number is out of its domain.
    """

    full_well: float = 15_000.0  #: Electrons that a pixel holds.
    read_noise: float = 3.0  #: Temporal dark noise σ_d without dark current, electrons.
    dark_current: float = 0.1  #: Electrons per second and pixel.
    gain: float = 0.25  #: Overall system gain K, counts per electron, at the base ISO.
    bits: int = 12  #: Of a count, 1 to 16.
    black_level: float = 64.0  #: Counts without light.
    base_iso: float = 100.0  #: A higher ISO multiplies the gain.
    offsets: float = 0.0  #: DSNU: standard deviation of the pixels' offsets, electrons.
    gains: float = 0.0  #: PRNU: standard deviation of the pixels' gains, as a fraction.
    device_seed: int = 0  #: Of the pixels' offsets and gains.
    #: Whether electrons come by chance; without it and with the rest at 0 counts are the expected
    #: ones, rounded.
    shot_noise: bool = True

    def __post_init__(self) -> None:
        for name in ("full_well", "gain", "base_iso"):
            if not 0 < getattr(self, name) < math.inf:
                raise InputError(f"detector: {name} must be positive, got {getattr(self, name)}")
        for name in ("read_noise", "dark_current", "black_level", "offsets", "gains"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(f"detector: {name} must be 0 or more, got {getattr(self, name)}")
        if not 1 <= self.bits <= MOST_BITS:
            raise InputError(f"detector: bits must be 1 to {MOST_BITS}, got {self.bits}")
        if not self.black_level < self.white_level:
            raise InputError(
                f"detector: a black level of {self.black_level:g} leaves no room below "
                f"{self.white_level}; lower it, or take more bits"
            )

    @property
    def white_level(self) -> int:
        """Largest count."""
        return 2**self.bits - 1

    def saturation(self, iso: float | None = None) -> int:
        """Count of a full pixel: where the well is full, or the largest count if that is less.

        Examples
        --------
        >>> Detector().saturation(), Detector().saturation(800.0)
        (3814, 4095)
        """
        full = self.full_well * self.gain_at(iso) + self.black_level
        return min(self.white_level, round(full))

    def gain_at(self, iso: float | None) -> float:
        """Overall system gain at an ISO, counts per electron; None is the base ISO.

        Raises
        ------
        InputError
            If the ISO is below that of the detector.

        Examples
        --------
        >>> Detector(gain=0.25).gain_at(400.0)
        1.0
        """
        if iso is None:
            return self.gain
        if not self.base_iso <= iso < math.inf:
            raise InputError(
                f"detector: ISO {iso:g} is below the base of {self.base_iso:g}; expose longer"
            )
        return self.gain * iso / self.base_iso


def raw_counts(
    electrons: ArrayLike,
    detector: Detector,
    seed: int,
    *,
    exposure_time: float = 0.0,
    iso: float | None = None,
) -> NDArray[np.uint16]:
    """Counts of a detector.

    ``electrons``, shape (height, width), are the photoelectrons that are expected in each pixel,
    with exposure and vignetting; the exposure time, s, is for the dark current.

    Raises
    ------
    InputError
        If there are negative or infinite electrons, or time or ISO are out of their domain.
    """
    mean = _expected(electrons, detector, exposure_time)
    random = np.random.default_rng([seed, 1])
    collected = random.poisson(mean).astype(np.float64) if detector.shot_noise else mean
    collected = np.clip(collected, 0.0, detector.full_well)
    if detector.read_noise:
        collected = collected + random.normal(0.0, detector.read_noise, mean.shape)
    if detector.offsets:
        pattern = np.random.default_rng([detector.device_seed, 3])
        collected = collected + pattern.normal(0.0, detector.offsets, mean.shape)
    counts = np.round(collected * detector.gain_at(iso) + detector.black_level)
    return np.clip(counts, 0, detector.white_level).astype(np.uint16)


def expected_counts(
    electrons: ArrayLike,
    detector: Detector,
    *,
    exposure_time: float = 0.0,
    iso: float | None = None,
) -> Array:
    """Counts without noise and rounding; arguments as of :func:`raw_counts`.

    Examples
    --------
    >>> expected_counts([[100.0]], Detector(gain=0.25, black_level=64.0))
    array([[89.]])
    """
    mean = np.minimum(_expected(electrons, detector, exposure_time), detector.full_well)
    counts = mean * detector.gain_at(iso) + detector.black_level
    return np.minimum(counts, detector.white_level)


def dark_counts(
    shape: tuple[int, int],
    detector: Detector,
    seed: int,
    *,
    exposure_time: float = 0.0,
    iso: float | None = None,
) -> NDArray[np.uint16]:
    """Counts with the lens cap on."""
    dark = np.zeros(shape)
    return raw_counts(dark, detector, seed, exposure_time=exposure_time, iso=iso)


def _expected(electrons: ArrayLike, detector: Detector, exposure_time: float) -> Array:
    """Electrons with the pixels' gains and the dark current."""
    mean = np.asarray(electrons, dtype=np.float64)
    if not (np.isfinite(mean).all() and (mean >= 0).all()):
        raise InputError("detector: electrons must be finite and not negative")
    if not 0 <= exposure_time < math.inf:
        raise InputError(f"detector: the exposure time must be 0 s or more, got {exposure_time:g}")
    if detector.gains:
        pattern = np.random.default_rng([detector.device_seed, 2])
        mean = mean * np.maximum(1.0 + pattern.normal(0.0, detector.gains, mean.shape), 0.0)
    # Beyond twice the full well a pixel is full whatever chance brings.
    return np.minimum(mean, 2.0 * detector.full_well) + detector.dark_current * exposure_time
