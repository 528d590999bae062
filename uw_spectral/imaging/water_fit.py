"""The water that explains what a camera saw of known surfaces at known distances.

A level camera sees of a surface of reflectance ρ at the distance P

    I = g_s T(P) ρ E_d/π + g_w (1 - T(P)) B,    T = e^{-cP}

in each band, B being the radiance of the open water (:meth:`.Viewpoint.seen_level`). All of it
follows from the constituents and the depth but the gains: g_w is the camera's exposure, g_s that
and how a surface is turned to the light. Constituents are fitted by least squares. The valley
of the squared error is curved where one stands for another, so that intervals are those of the
profile likelihood: as far as one goes, the others following, until the error has risen too much.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.spectrum import Spectrum
from ..water.bio_optics import Constituents
from .description import BandsDescription, Description
from .optics import resolve
from .range_attenuation import least_squares
from .viewpoint import Viewpoint

FITTED = {"chlorophyll": (0.02, 100.0), "cdom": (0.005, 5.0), "minerals": (0.02, 100.0)}
"""What is fitted: the amount that counts as little, and the largest."""

_BANDS = BandsDescription(121)
STARTS = tuple(itertools.product((0.2, 3.0), (0.02, 0.2), (0.05, 2.0)))
"""Amounts from which a fit begins."""
_STEP = 0.02  # of a logarithm, or that part of it, for slopes
_STRIDE = 1e-4, 0.7  # of logarithms, along a profile of the error
_BESIDE = 0.7  # of a logarithm, from the edge of what is fitted
_SETTLED = 1e-4  # relative fall of the squared error that counts as none
_CLEAR = 0.005, 0.001  # standard deviation: of a value, and of the largest
_TOLD = 0.35  # standard deviation of ln c(550) above which the water is not told
_EXPLAINED = 10.0  # deviations by which values may be off
_95 = 1.96

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SeenSurfaces:
    """What a level camera saw of matte surfaces, and of open water.

    Raises
    ------
    InputError
        If shapes differ, a value is not finite, a distance or deviation not positive, or all black.
    """

    reflectances: Sequence[Spectrum | float]  #: Of m surfaces; 0 for what is black.
    distances: Array  #: From the camera, m, (m,); infinite for open water.
    #: Of the camera's three channels, linear, without the black level, one exposure, (m, 3).
    values: Array
    #: Standard deviations of the values, (m, 3); .5 % and .1 % of the largest where not given.
    deviations: Array | None = None

    def __post_init__(self) -> None:
        seen, P = np.asarray(self.values, np.float64), np.asarray(self.distances, np.float64)
        count = len(self.reflectances)
        if seen.shape != (count, 3) or P.shape != (count,):
            raise InputError(
                f"fit: {count} surfaces need as many distances and values of three channels, not "
                f"shapes {P.shape} and {seen.shape}"
            )
        if not np.isfinite(seen).all() or not (P > 0).all():
            row = int(np.argmin(np.isfinite(seen).all(axis=1) & (P > 0)))
            raise InputError(f"fit: row {row + 1} has a value or distance that is not positive")
        if not seen.max() > 0:
            raise InputError("fit: all values are 0; the picture is black")
        sd = self.deviations
        if sd is None:
            sd = np.hypot(_CLEAR[0] * seen, _CLEAR[1] * seen.max())
        if np.shape(sd) != seen.shape or not (np.asarray(sd) > 0).all():
            raise InputError("fit: each value needs a standard deviation above 0")
        for name, value in (("values", seen), ("distances", P), ("deviations", np.asarray(sd))):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class FittedWater:
    """Constituents that explain what was seen."""

    constituents: Constituents
    #: Lower and upper ends of the intervals of 95 %.
    low: Constituents
    high: Constituents
    misfit: float  #: Root mean square of what is not explained, in standard deviations.

    @property
    def text(self) -> str:
        """The water as options and the panel take it, see :func:`.parse_water`."""
        return f"bio:{self.constituents.described()}"


def fit_water(
    seen: SeenSurfaces, description: Description, depth: float, *, facing_up: bool = False
) -> FittedWater:
    """Fit chlorophyll, CDOM and minerals to what was seen at a depth in m.

    Of the description all counts but the water and the bands. Surfaces that face up are lit by Ed
    as computed; others may be brighter or darker by one factor for all.

    Raises
    ------
    InputError
        If there are too few values, they do not tell the water, or no water explains them.
    """
    free = seen.values.size - (1 if facing_up else 2)
    if free <= len(FITTED):
        raise InputError(
            f"fit: {seen.values.size} values cannot tell {len(FITTED)} constituents and the light; "
            "give more surfaces or distances"
        )
    centres = resolve(dataclasses.replace(description, bands=_BANDS)).bands.centres
    rho = np.array([
        np.full(len(centres), x) if isinstance(x, int | float) else x.at(centres)
        for x in seen.reflectances
    ])  # fmt: skip

    deviations = np.asarray(seen.deviations)
    wanted = (seen.values / deviations).ravel()

    def error(x: Array) -> Array:
        parts = _seen(constituents_of(x), description, depth, rho, seen.distances)
        columns = [parts[0] + parts[1]] if facing_up else list(parts)
        scaled = np.stack([(part / deviations).ravel() for part in columns], axis=1)
        gains = np.linalg.lstsq(scaled, wanted, rcond=None)[0]
        return scaled @ np.maximum(gains, 0.0) - wanted

    def deviance(x: Array) -> float:
        return _square(error(x))

    starts = sorted((logarithms(start) for start in STARTS), key=deviance)
    minima = sorted((_settled(error, start) for start in starts[:3]), key=deviance)
    x, least = minima[0], deviance(minima[0])
    misfit = math.sqrt(least / (free - len(x)))
    if misfit > _EXPLAINED:
        raise InputError(
            f"fit: no water of chlorophyll, CDOM and minerals explains the values, {misfit:.0f} "
            "standard deviations off; check that they are linear, of this camera, and the depth"
        )
    rise, followed = _95 * max(misfit, 1.0), functools.partial(_followed, error)
    # Another water may explain the values as well, with what explains them less between.
    likely = {tuple(y.round(1)): y for y in minima[::-1] if deviance(y) < least + rise**2}
    found = []
    for y in [x, *(y for y in likely.values() if y is not x)]:
        left = error(y)
        slopes = np.stack([(error(y + _STEP * e) - left) / _STEP for e in np.eye(len(y))], axis=1)
        normal = slopes.T @ slopes / max(misfit, 1.0) ** 2
        of_best = least if found else None
        found.append(intervals(deviance, followed, y, normal, rise, of_best))
    low, high = (
        Constituents(**{name: end(getattr(each[k], name) for each in found) for name in FITTED})
        for k, end in enumerate((min, max))
    )
    return FittedWater(constituents_of(x), low, high, misfit)


def intervals(
    deviance: Callable[[Array], float],
    followed: Callable[[Array, int], Array],
    x: Array,
    normal: Array,
    rise: float,
    least: float | None = None,
) -> tuple[Constituents, Constituents]:
    """Return lower and upper ends of intervals about the best parameters, or others as likely.

    ``deviance`` takes parameters (p,), as :func:`constituents_of` does; ``followed`` these and a
    number, and returns those of the least deviance when it is held. ``normal``, (p, p), is half the
    curvature of the deviance, ``rise`` the root of what it rises by at the ends, ``least`` that of
    the best parameters, if these are others.

    Raises
    ------
    InputError
        If not even the attenuation is told.
    """
    # Beyond what a logarithm spans nothing is told; without this, of what does not count at all.
    spread = np.linalg.inv(normal + np.eye(len(x)) / 10.0**2)
    if least is None:
        _require_told(x, spread)
        least = deviance(x)

    def ends(rise: float) -> Constituents:
        each = [
            _end(lambda x: deviance(x) - least, followed, x, spread[i], i, rise)
            for i in range(len(x))
        ]
        return constituents_of(np.array(each))

    return ends(-rise), ends(rise)


def _end(
    above: Callable[[Array], float],
    followed: Callable[[Array, int], Array],
    best: Array,
    follow: Array,
    i: int,
    rise: float,
) -> float:
    """Return how far up or down parameter i goes until the root of the deviance has risen.

    ``follow`` are the covariances of the parameter, along which the others begin to follow;
    ``rise`` is negative for down.
    """
    x, risen = best, math.sqrt(max(above(best), 0.0))
    sign, rise = math.copysign(1.0, rise), abs(rise)
    step, towards = rise / 3.0 * math.sqrt(follow[i]), follow / follow[i]
    while True:
        step = min(step, _STRIDE[1] / float(np.abs(towards).max()))
        there = inside(x + sign * step * towards)
        if there[i] == x[i]:
            return float(x[i])  # nothing, or as much as is fitted
        there = followed(there, i)
        then = math.sqrt(max(above(there), 0.0))
        if then > 1.5 * rise and step > _STRIDE[0]:
            step /= 2.0
            continue
        if then >= rise:
            return float(x[i] + (there[i] - x[i]) * (rise - risen) / (then - risen))
        towards = (there - x) / (there[i] - x[i])
        step *= min(max(rise / 3.0 / max(then - risen, 1e-9), 0.5), 2.0)
        x, risen = there, then


def _followed(error: Callable[[Array], Array], x: Array, i: int) -> Array:
    """Return parameters of the least error whose number i is held."""
    others = np.delete(np.arange(len(x)), i)

    def placed(y: Array) -> Array:
        p = x.copy()
        p[others] = y
        return p

    return inside(placed(_least(lambda y: error(placed(y)), x[others])))


def _seen(
    water: Constituents, description: Description, depth: float, rho: Array, P: Array
) -> tuple[Array, Array]:
    """Return light of surfaces and of the water that three channels see, (m, 3) both."""
    view = viewpoint_in(water, description, depth, _BANDS)
    response = view.reduction.response.T
    left = np.exp(-view.attenuation * P[:, None])
    surfaces = left * rho * view.light / math.pi
    return surfaces @ response, ((1.0 - left) * view.background) @ response


def viewpoint_in(
    water: Constituents, description: Description, depth: float, bands: BandsDescription
) -> Viewpoint:
    """Return the camera of a description in other water, on other bands, at 0 stops."""
    described = dataclasses.replace(description.water, water=water, second="")
    optics = resolve(dataclasses.replace(description, water=described, bands=bands))
    return optics.viewpoint(depth, stops=0.0)


def constituents_of(x: Array) -> Constituents:
    """Return the water of parameters, logarithms of each amount and what counts as little."""
    # Exactly 0 where the logarithm is that of 0.
    amounts = {
        name: float(np.clip(little * math.expm1(min(each - math.log(little), 20.0)), 0.0, most))
        for each, (name, (little, most)) in zip(x, FITTED.items(), strict=True)
    }
    return Constituents(**amounts)


def logarithms(amounts: Sequence[float]) -> Array:
    """Return the parameters of amounts."""
    few = zip(amounts, FITTED.values(), strict=True)
    return np.array([math.log(amount + little) for amount, (little, _) in few])


def inside(x: Array) -> Array:
    """Return parameters within what is fitted."""
    nothing, most = [0.0] * len(x), [most for _, most in FITTED.values()]
    return np.clip(x, logarithms(nothing), logarithms(most))


def _settled(error: Callable[[Array], Array], start: Array) -> Array:
    """Return the parameters of the least error near a start.

    A step to beyond what is fitted would be the last, for nothing changes there: what ends at its
    edge begins once more beside it.
    """
    x = inside(_least(error, start))
    edges = inside(np.full(len(x), -np.inf)) + _BESIDE, inside(np.full(len(x), np.inf)) - _BESIDE
    beside = np.clip(x, *edges)
    if (beside == x).all():
        return x
    return min(x, inside(_least(error, beside)), key=lambda x: _square(error(x)))


def _least(error: Callable[[Array], Array], start: Array) -> Array:
    return least_squares(error, start, _STEP, _SETTLED)


def _square(error: Array) -> float:
    return float(error @ error)


def _require_told(x: Array, spread: Array) -> None:
    """Refuse where not even the attenuation is known."""
    middle = [550.0]

    def c(x: Array) -> float:
        water = constituents_of(x).water()
        return math.log(float(water.a(middle)[0] + water.b(middle)[0]))

    slope = np.array([(c(x + _STEP * e) - c(x)) / _STEP for e in np.eye(len(x))])
    off = math.sqrt(float(slope @ spread @ slope))
    if off > _TOLD:
        raise InputError(
            f"fit: the values do not tell the water: its attenuation at 550 nm is "
            f"{math.exp(c(x)):.2g} 1/m within a factor of {math.exp(_95 * off):.1f}; give surfaces "
            "that are farther away, brighter or black ones, or open water"
        )
