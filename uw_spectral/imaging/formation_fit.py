"""Image formation from pictures and range alone: β_D(z), β_B(z) and B∞ by least squares.

The model is I = J e^{-β_D(z) z} + B∞ (1 - e^{-β_B(z) z}) per channel (Akkaynak & Treibitz 2018).
Both terms decay alike, so that part of J could be taken for backscatter: what is black shows the
backscatter alone, which comes first; what the same surfaces show at several ranges then tells
β_D. Coefficients are those of wideband light, which fall with range: β(z) = a e^{bz} + c, b ≤ 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .range_attenuation import FEWEST, LOGARITHMS, Array, RangeAttenuation, least_squares

BLACK = 0
"""Label of what reflects nothing."""
OPEN_WATER = np.inf
"""Range where nothing but water is seen."""
_BINS = 24  # of range
_DARKEST = 0.01  # fraction of a bin's pixels that counts as black
_SCAN = np.geomspace(0.02, 40.0, 60)  # optical lengths over the longest range
_RATES = (-6.0, 3.0)

_Model = Callable[[Array], tuple[Array, Array]]


class Formation:
    """Image formation, computed (:class:`.FormationCurves`) or fitted (:class:`FormationFit`)."""

    beta_direct: Any
    beta_backscatter: Any
    B_inf: Any

    def transmittance(self, z: ArrayLike) -> Array:
        """Share e^{-β_D(z) z} of the direct light at ranges z, m, (..., k); 0 at infinite ones."""
        return self._left(z, self.beta_direct)

    def backscatter(self, z: ArrayLike) -> Array:
        """Backscatter B∞ (1 - e^{-β_B(z) z}) at ranges z in m, shape (..., k)."""
        return np.asarray(self.B_inf) * (1.0 - self._left(z, self.beta_backscatter))

    def _left(self, z: ArrayLike, beta: Any) -> Array:  # noqa: ANN401 - as the fields
        raise NotImplementedError


@dataclass(frozen=True)
class FormationFit(Formation):
    """Constants of the image formation, per channel."""

    #: β_D of the light of objects, and β_B of the backscatter.
    beta_direct: tuple[RangeAttenuation, ...]
    beta_backscatter: tuple[RangeAttenuation, ...]
    B_inf: tuple[float, ...]  #: Backscatter at infinite range, in the unit of the picture.

    def _left(self, z: ArrayLike, beta: tuple[RangeAttenuation, ...]) -> Array:
        return np.stack([channel.transmittance(z) for channel in beta], axis=-1)


def fit_formation(
    values: ArrayLike, z: ArrayLike, surfaces: ArrayLike | None = None
) -> FormationFit:
    """Fit the image formation to pixels of known range.

    Values, shape (n, k), are linear, of k channels; ranges z, (n,), Euclidean, m, infinite where
    open water is seen, which steadies B∞. ``surfaces``, (n,), is which one a pixel shows:
    :data:`BLACK`, or another number for each that is seen at several ranges. Without it, of the
    pixels at about the same range the darkest are taken for black, and the mean of all for one
    surface (Akkaynak & Treibitz 2019 find black so). Such means scatter: β_D is then a constant.

    D. Akkaynak & T. Treibitz, CVPR 2018, Eq. 20; CVPR 2019, Eq. 10 and 11.

    Raises
    ------
    InputError
        If shapes differ, a value is not finite, or too few ranges of a kind are there.
    """
    seen, z = np.asarray(values, np.float64), np.asarray(z, np.float64)
    if seen.ndim != 2 or z.shape != seen.shape[:1]:
        raise InputError(f"image formation: values of shape {seen.shape} need one range each")
    if not np.isfinite(seen).all() or not (z > 0).all():
        raise InputError("image formation: values must be finite, and ranges positive")
    if surfaces is None:
        seen, z, labels = _by_range(seen, z)
    else:
        labels = np.asarray(surfaces)
        if labels.shape != z.shape:
            raise InputError("image formation: give one surface per pixel")
    near = np.isfinite(z)
    black, lit = (labels == BLACK) | ~near, (labels != BLACK) & near
    for what, chosen in (("black", black & near), ("lit", lit)):
        if len(np.unique(z[chosen])) < FEWEST:
            raise InputError(
                f"image formation: something {what} must be seen at {FEWEST} ranges at least; "
                "take more pictures of it"
            )
    longest = float(z[near].max())
    found = [
        _fit_channel(channel, z, labels, black, lit, longest, constant=surfaces is None)
        for channel in seen.T
    ]
    D, B, B_inf = zip(*found, strict=True)
    return FormationFit(D, B, B_inf)


def _fit_channel(
    seen: Array,
    z: Array,
    labels: NDArray[np.int_],
    black: NDArray[np.bool_],
    lit: NDArray[np.bool_],
    longest: float,
    *,
    constant: bool,
) -> tuple[RangeAttenuation, RangeAttenuation, float]:
    def backscattered(p: Array) -> tuple[Array, Array]:
        fraction = 1.0 - _curve(p, longest).transmittance(z[black])
        level = fraction @ seen[black] / np.maximum(fraction @ fraction, np.finfo(np.float64).tiny)
        return np.atleast_1d(level), level * fraction - seen[black]

    beta_B, (B_inf,) = _fitted(backscattered, longest)
    backscatter = B_inf * (1.0 - beta_B.transmittance(z[lit]))
    direct, places = seen[lit] - backscatter, np.unique(labels[lit], return_inverse=True)[1]

    def attenuated(p: Array) -> tuple[Array, Array]:
        transmittance = _curve(p, longest).transmittance(z[lit])
        squares = np.bincount(places, transmittance * transmittance)
        J = np.bincount(places, transmittance * direct) / np.maximum(
            squares, np.finfo(np.float64).tiny
        )
        return J, J[places] * transmittance - direct

    beta_D, _ = _fitted(attenuated, longest, constant=constant)
    return beta_D, beta_B, float(B_inf)


def _fitted(
    model: _Model, longest: float, *, constant: bool = False
) -> tuple[RangeAttenuation, Array]:
    """Best constant coefficient of a scan, then the curve from there, or the constant itself."""

    def error(p: Array) -> Array:
        return model(p)[1]

    def level(p: Array) -> Array:
        return np.array([LOGARITHMS[0], 0.0, p[0]])

    def split(x: float) -> Array:
        return np.array([np.log(0.1 * x / longest), 0.0, np.log(0.9 * x / longest)])

    best = min(_SCAN, key=lambda x: float(np.square(error(split(x))).sum()))
    if constant:
        p = level(least_squares(lambda q: error(level(q)), np.log([best / longest])))
    else:
        p = least_squares(error, split(best))
    return _curve(p, longest), model(p)[0]


def _curve(p: Array, longest: float) -> RangeAttenuation:
    a, c = np.exp(np.clip(p[[0, 2]], *LOGARITHMS)).tolist()
    return RangeAttenuation(a, -float(np.exp(np.clip(p[1], *_RATES))) / longest, c, 0.0)


def _by_range(seen: Array, z: Array) -> tuple[Array, Array, NDArray[np.int_]]:
    """Darkest and mean values in bins of range, and open water."""
    near = np.isfinite(z)
    if np.count_nonzero(near) < FEWEST:
        raise InputError("image formation: too few pixels have a range")
    edges = np.quantile(z[near], np.linspace(0.0, 1.0, _BINS + 1))
    bins = np.clip(np.searchsorted(edges, z, side="right") - 1, 0, _BINS - 1)
    values, ranges, labels = [], [], []
    for number in range(_BINS):
        inside = np.flatnonzero((bins == number) & near)
        if not inside.size:
            continue
        order = np.argsort(seen[inside].sum(axis=1))
        dark = inside[order[: max(1, int(_DARKEST * inside.size))]]
        for label, chosen in ((BLACK, dark), (BLACK + 1, inside)):
            values.append(seen[chosen].mean(axis=0))
            ranges.append(z[chosen].mean())
            labels.append(label)
    if not near.all():
        values.append(seen[~near].mean(axis=0))
        ranges.append(OPEN_WATER)
        labels.append(BLACK)
    return np.array(values), np.array(ranges), np.array(labels)
