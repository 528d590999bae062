"""How noisy a traced picture is, and which passes are to have more samples.

A pass is rendered in parts that are independent of each other. Half the difference of two halves of
them has the noise of their mean.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images

MEASURE = "mean over pixels of the expected ΔE2000 of a pixel's noise, before denoising"
_FEWEST, _MOST_PARTS = 4, 64
_GROWTH = 2.0  # at most in a round, for the first estimates are noisy themselves
_MARGIN = 0.97  # of the target, so that a last small round is rarely needed
_MOST_PIXELS = 1_000_000


@dataclass(frozen=True)
class PictureNoise:
    """Noise of a picture, :data:`MEASURE`: of all of it, and what each pass would make alone."""

    delta_e: float
    by_pass: tuple[float, ...]


def parts_of(most: int) -> tuple[int, int]:
    """Return how many parts a pass has at most, an even number, and the samples of each.

    Examples
    --------
    >>> parts_of(64), parts_of(1024)
    ((16, 4), (64, 16))
    """
    samples = max(_FEWEST, math.ceil(most / _MOST_PARTS))
    parts = max(math.ceil(most / samples), 2)
    return parts + parts % 2, samples


def picture_noise(halves: Sequence[NDArray[np.floating]]) -> PictureNoise:
    """Return the noise of a picture.

    ``halves`` are, of each pass, what two halves of its samples add to the scene-linear Rec.709
    picture, shape (2, h, w, 3).
    """
    pixels = halves[0].shape[1] * halves[0].shape[2]
    step = math.ceil(math.sqrt(pixels / _MOST_PIXELS))
    thin = [half[:, ::step, ::step].astype(np.float64) for half in halves]
    mean = np.sum([half.mean(axis=0) for half in thin], axis=0)
    apart = [(half[0] - half[1]) / 2.0 for half in thin]

    def seen(noise: NDArray[np.float64]) -> float:
        both = [delta_e_CIE2000_images(mean + sign * noise, mean) for sign in (-1.0, 1.0)]
        return float(np.mean(both))

    return PictureNoise(seen(np.sum(apart, axis=0)), tuple(map(seen, apart)))


def allot(noise: PictureNoise, samples: Sequence[int], target: float) -> tuple[float, ...]:
    """Return the samples that passes are to have in the next round, by those that they have so far.

    The fewest in all for the target: a pass gets samples as its noise in the picture, that of one
    sample (Neyman's allotment). What samples cost does not count, for seconds differ from run to
    run, and pictures would too.

    Examples
    --------
    >>> [round(x) for x in allot(PictureNoise(5.0, (4.0, 3.0)), (10, 10), 2.5)]
    [20, 20]
    >>> [round(x) for x in allot(PictureNoise(5.0, (4.8, 1.4)), (10, 10), 4.0)]
    [18, 10]
    """
    if noise.delta_e <= target:
        return tuple(map(float, samples))
    now = np.array(samples, dtype=np.float64)
    variance = np.square(noise.by_pass) * now
    # Noises of passes add up as squares, but for ΔE and for rays that they share.
    wanted = (_MARGIN * target / noise.delta_e) ** 2 * float(np.sum(variance / now))
    low, high = 0.0, float(np.sum(np.sqrt(variance))) / wanted
    for _ in range(60):
        middle = (low + high) / 2.0
        found = np.maximum(now, middle * np.sqrt(variance))
        low, high = (middle, high) if np.sum(variance / found) > wanted else (low, middle)
    return tuple(np.clip(high * np.sqrt(variance), now, _GROWTH * now).tolist())
