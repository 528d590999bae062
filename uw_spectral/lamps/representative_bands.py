"""Three bands that stand for all of a water: what scattering does differs little from band to band.

Values f of n bands, of many places, are those of three of them, f_λ = Σ_j fraction_jλ f_j: an
interpolative decomposition (Cheng, Gimbutas, Martinsson & Rokhlin, SIAM J. Sci. Comput. 26, 1389,
2005), each band and place counting by its light. The bands are found one by one where most is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

COUNT = 3
_RANK = 1e-16  # of the squares of all values, below which nothing is left to stand for
_CONDITION = 1e-10  # of the three bands, below which they are taken for fewer


@dataclass(frozen=True, eq=False)
class RepresentativeBands:
    """Three of n bands, and the fraction of each in every band."""

    indices: NDArray[np.intp]  #: One of them may stand more than once, (3,).
    fractions: Array  #: They may be negative, (3, n).


def representative_bands(values: ArrayLike, light: ArrayLike) -> RepresentativeBands:
    """Return the bands that stand for all, by values of k places, (k, n).

    ``light`` (k, n) is how much each value counts. A place counts by the mean square of both, so
    that all do alike.
    """
    found, weights = np.asarray(values, np.float64), np.asarray(light, np.float64)
    size = np.sqrt((found * weights * found * weights).sum(axis=-1, keepdims=True))
    lit = size[:, 0] > 0.0
    found, weights = found[lit] / size[lit], weights[lit]
    left = found * weights
    least = _RANK * float((left * left).sum())
    chosen: list[int] = []
    for _ in range(COUNT):
        rest = (left * left).sum(axis=0)
        band = int(np.argmax(rest))
        if rest[band] <= least:
            break
        chosen.append(band)
        along = left[:, band] / np.sqrt(rest[band])
        left = left - along[:, None] * (along @ left)
    chosen = sorted(chosen) or [0]
    fractions = np.zeros((COUNT, found.shape[1]))
    for band in range(found.shape[1]):
        count = weights[:, band : band + 1]
        own, wanted = found[:, chosen] * count, found[:, band] * count[:, 0]
        fractions[: len(chosen), band] = np.linalg.lstsq(own, wanted, rcond=_CONDITION)[0]
    # What is chosen is itself, in all its digits.
    fractions[:, chosen] = np.eye(COUNT)[:, : len(chosen)]
    indices = np.array(chosen + [chosen[-1]] * (COUNT - len(chosen)), dtype=np.intp)
    return RepresentativeBands(indices, fractions)
