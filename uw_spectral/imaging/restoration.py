"""A picture without the water before its objects: the image formation, inverted."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]


class Formation(Protocol):
    """Image formation, computed (:class:`.FormationCurves`) or fitted (:class:`.FormationFit`)."""

    def transmittance(self, z: ArrayLike) -> Array:
        """Fraction of the light of objects left at ranges z in m, shape (..., k)."""
        ...

    def backscatter(self, z: ArrayLike) -> Array:
        """Light of the water before ranges z in m, shape (..., k)."""
        ...


def remove_water(
    values: ArrayLike, z: ArrayLike, formation: Formation, least: float = 0.02
) -> Array:
    """Return J = (I - B(z)) e^{β_D(z) z}, what objects would send if no water were before them.

    D. Akkaynak & T. Treibitz, CVPR 2019, Eq. 8.

    Parameters
    ----------
    values : array_like, shape (..., k)
        Linear values I of the sensor's channels, before white balance.
    z : array_like, shape (...)
        Euclidean ranges, m; infinite where open water is seen, which becomes black.
    least : float
        Transmittance that is not gone below, so that noise of what is hardly seen stays bounded.

    Raises
    ------
    InputError
        If shapes do not match, or a range is not positive.
    """
    seen, z = np.asarray(values, dtype=np.float64), np.asarray(z, dtype=np.float64)
    if seen.shape[:-1] != z.shape:
        raise InputError(f"restoration: values of shape {seen.shape} for ranges of {z.shape}")
    if not (z > 0).all():
        raise InputError("restoration: ranges must be positive; infinite for open water")
    transmittance = np.maximum(formation.transmittance(z), least)
    J = np.maximum(seen - formation.backscatter(z), 0.0) / transmittance
    return np.where(np.isfinite(z)[..., None], J, 0.0)
