"""What layers of a picture are to each other: which a renderer has to draw, and the others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .layers import BACKSCATTER

Array = NDArray[np.float64]

_DARKEST = 1e-12
_FARTHEST = 1e-3  # fraction of light that is left


def drawn_for(names: Iterable[str]) -> frozenset[str]:
    """Return the layers that others are made of, besides those themselves.

    Examples
    --------
    >>> sorted(drawn_for(["T", "range"]))
    ['D', 'J', 'T', 'range']
    """
    found = set(names)
    if "B" in found:
        found |= set(BACKSCATTER)
    if "T" in found:
        found |= {"D", "J"}
    return frozenset(found)


def scattered_again(water: ArrayLike, single: ArrayLike) -> Array:
    """Backscatter of sun and sky less what was scattered once."""
    return np.asarray(water, np.float64) - np.asarray(single, np.float64)


def backscatter(parts: Mapping[str, ArrayLike]) -> Array:
    """Sum of the parts of the backscatter that are there."""
    there = [np.asarray(parts[name], np.float64) for name in BACKSCATTER if name in parts]
    return np.sum(there, axis=0)


def remaining_single(image: ArrayLike, others: Iterable[ArrayLike]) -> Array:
    """Light scattered once of which only the sum with everything else is drawn."""
    return np.asarray(image, np.float64) - sum(np.asarray(x, np.float64) for x in others)


def transmittance_ratio(direct: ArrayLike, scene: ArrayLike) -> Array:
    """Transmittance D / J of channels; 0 where nothing shines.

    Examples
    --------
    >>> transmittance_ratio([0.1, 0.0], [0.4, 0.0]).tolist()
    [0.25, 0.0]
    """
    D, J = np.broadcast_arrays(np.asarray(direct, np.float64), np.asarray(scene, np.float64))
    lit = np.abs(J) > _DARKEST
    return np.divide(D, J, out=np.zeros(J.shape), where=lit)


def unscattered(
    drawn: ArrayLike, c: ArrayLike, drawn_c: ArrayLike, z: ArrayLike
) -> tuple[Array, Array, Array, Array]:
    """Return J, D, F and T of light that a renderer drew without the forward peak.

    A renderer that counts light which turns by a few degrees as unscattered draws
    J exp(-c' z), of which J exp(-c z) is direct, and the rest forward-scattered.

    Coefficients are mean extinctions of the path, c and the c' that was drawn, 1/m; the range is
    infinite where nothing is seen. Where next to nothing is left of J, it is not known and 0.
    """
    z = np.asarray(z, np.float64)[..., None]
    seen = np.isfinite(z)
    near = np.where(seen, z, 0.0)
    light = np.asarray(drawn, np.float64)
    T = np.where(seen, np.exp(-np.asarray(c) * near), 0.0)
    transmittance = np.where(seen, np.exp(-np.asarray(drawn_c) * near), 0.0)
    J = np.divide(light, transmittance, out=np.zeros(light.shape), where=transmittance > _FARTHEST)
    D = J * T
    return J, D, light - D, T
