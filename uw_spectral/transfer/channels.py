"""Channels: the few linear functionals of the spectrum that a renderer draws.

Everything between a surface and a sensor is linear in the spectrum, so n bands need not reach a
shader: what it computes are three sums over them. In real time the channels are what the sensor
or the display sees; in band passes they are the three bands of a pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.reflectance import emission_basis, uplift_basis

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Channels:
    """Three functionals of n bands, and what a red, a green and a blue colour are in these."""

    weights: Array  #: What a channel has per unit radiance of each band, (3, n).
    reflectance: Array  #: Of a red, a green and a blue surface, (n, 3).
    emission: Array  #: Radiance of a red, a green and a blue light, (n, 3).

    def project(self, spectra: ArrayLike) -> Array:
        """Return the channels of spectra, shape (..., n) to (..., 3).

        Examples
        --------
        >>> channels = channels_of(Bands.uniform(3), np.eye(3))
        >>> channels.project([1.0, 2.0, 3.0]).tolist()
        [1.0, 2.0, 3.0]
        """
        return np.asarray(spectra, dtype=np.float64) @ self.weights.T

    def project_colours(self, light: ArrayLike, basis: ArrayLike | None = None) -> Array:
        """Return the channels of a light on red, green and blue, shape (..., n) to (..., 3, 3).

        Element [c, k] is channel c of colour k: what a surface of unit reflectance k makes of
        the light, or of another basis (n, k) than :attr:`reflectance`.

        Examples
        --------
        >>> channels = channels_of(Bands.uniform(3), np.eye(3))
        >>> channels.project_colours([1.0, 1.0, 1.0]).sum(axis=-1).round(6).tolist()
        [1.0, 1.0, 1.0]
        """
        chosen = self.reflectance if basis is None else np.asarray(basis, dtype=np.float64)
        coloured = np.asarray(light, dtype=np.float64)[..., None, :] * chosen.T
        return np.swapaxes(self.project(coloured), -1, -2)

    def mean(self, values: ArrayLike, light: ArrayLike) -> Array:
        """Return the mean of values over the bands as each channel sees a light, (..., 3).

        Where a channel sees nothing, it is that over all bands alike.

        Examples
        --------
        >>> channels = channels_of(Bands.uniform(2), [[1, 0], [0, 1], [1, 1]])
        >>> channels.mean([2.0, 4.0], [1.0, 3.0]).tolist()
        [2.0, 4.0, 3.5]
        """
        values, light = np.asarray(values, np.float64), np.asarray(light, np.float64)
        # Channels may weigh bands negatively: what counts is how much of each there is.
        fractions = np.abs(self.weights) * light[..., None, :]
        total = fractions.sum(axis=-1)
        seen = total > np.finfo(np.float64).tiny
        even = np.full(fractions.shape, 1.0 / fractions.shape[-1])
        fractions = np.where(
            seen[..., None], fractions / np.where(seen, total, 1.0)[..., None], even
        )
        return (fractions * values[..., None, :]).sum(axis=-1)


def channels_of(bands: Bands, weights: ArrayLike) -> Channels:
    """Return the channels that weigh n bands, (3, n).

    Raises
    ------
    InputError
        If the weights are not three finite rows of n.
    """
    rows = np.asarray(weights, dtype=np.float64)
    if rows.shape != (3, len(bands)) or not np.all(np.isfinite(rows)):
        raise InputError(
            f"channels: three finite weights for each of {len(bands)} bands are needed, "
            f"got an array of shape {rows.shape}"
        )
    return Channels(rows, uplift_basis(bands), emission_basis(bands))


def channels_of_bands(bands: Bands, indices: Sequence[int], gains: ArrayLike = 1.0) -> Channels:
    """Return the channels that are one to three bands; those that are missing see nothing."""
    weights = np.zeros((3, len(bands)))
    rows = np.arange(len(indices))
    weights[rows, list(indices)] = np.broadcast_to(gains, rows.shape)
    return channels_of(bands, weights)
