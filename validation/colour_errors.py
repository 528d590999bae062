"""How far pictures and colours are from what they should be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import (
    SensorReduction,
    delta_e_CIE2000_images,
    srgb_encode,
)
from ..uw_spectral.spectra.illuminant import Illuminant
from ..uw_spectral.spectra.reflectance import uplift


def srgb_rmse(rgb: ArrayLike, reference: ArrayLike) -> float:
    """Root mean square difference of two scene-linear images after sRGB encoding."""
    return float(np.sqrt(np.mean((srgb_encode(rgb) - srgb_encode(reference)) ** 2)))


@dataclass(frozen=True)
class RoundTripError:
    """ΔE2000 of RGB colours after uplift, light and sensor: mean and maximum."""

    mean: float
    maximum: float


def round_trip_error(
    bands: Bands, illuminant: Illuminant, reduction: SensorReduction, steps: int = 5
) -> RoundTripError:
    """How well diffuse RGB colours come back as the colours they were given as.

    The reduction is balanced for the illuminant, the light on the surface; ``steps`` are colours
    per axis of the regular grid over the RGB cube.
    """
    axis = np.linspace(0.0, 1.0, steps)
    rgb = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    radiance = uplift(rgb, bands) * illuminant.total_in(bands) / math.pi
    error = delta_e_CIE2000_images(reduction.apply(radiance), rgb)
    return RoundTripError(float(error.mean()), float(error.max()))
