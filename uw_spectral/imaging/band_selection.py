"""Fewer bands for the same colour: wavelengths and weights fitted to what a scene shows.

Seen through water, the spectra of a scene are few smooth shapes. A map from n
bands to linear Rec.709 that is right for those need not be an integral over
the spectrum: its weights are fitted so that the expected spectra get the
colours that many bands give them (an empirical quadrature), and the
wavelengths are those for which that goes best.

The weights belong to a camera, a depth and a white balance. The wavelengths
serve them all, so that bands can be developed otherwise after rendering.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.colour_rendering import (
    SensorReduction,
    delta_e_CIE2000_images,
    luminance,
    training_reflectances,
)
from ..spectra.reflectance import uplift
from ..spectra.sensor import standard_observer
from ..transfer.radiance_field import FARTHEST
from .viewpoint import Viewpoint
from .visibility import euphotic_depth

DEPTHS = (2.0, 8.0, 32.0)
"""Depths in m that wavelengths are chosen for, where nothing else is known."""

MOST_SEARCHED = 12
"""Bands up to which wavelengths are searched; more are equal bands, with fitted weights."""

_SMALLEST_GAP = 8.0  # nm between neighbours
# Relative error of each band's radiance, independent of the others, that the weights expect:
# it keeps them from taking differences of large numbers.
_BAND_ERROR = 0.01
# Distances of objects, in mean free paths of the light that is seen.
_DISTANCES = (0.1, 0.4, 1.0, 2.0)
# Fraction of the open water among the spectra seen in one direction.
_BACKGROUND_FRACTION = 0.1
# Fraction of objects lit by a lamp. Without any, bands that daylight no longer reaches get weights
# that are right for daylight and absurd for a lamp (ΔE2000 of 80 at 30 m).
_LAMP_FRACTION = 0.1
# Searches start from equal bands over these parts of the range; red is soon gone.
_STARTS = ((0.0, 1.0), (0.05, 0.8))
_MOST_SWEEPS = 10
_TINY = 1e-12
_DARKEST = 1e-30  # fraction of the surface light at a depth that still counts as light


@dataclass(frozen=True, eq=False)
class OptimisedBands:
    """Bands chosen for a water."""

    #: They meet half way between neighbours, so that a sum over them is still an integral where the
    #: water is not known.
    bands: Bands
    #: Expected ΔE2000 with the weights of :func:`fitted_reduction`, for the eye: root mean square
    #: over the expected spectra, geometric mean over the depths.
    delta_e: float


@dataclass(frozen=True, eq=False)
class FittedViewpoint(Viewpoint):
    """A camera whose weights are fitted: see :func:`fitted_reduction`."""

    reference: Viewpoint = dataclasses.field(kw_only=True)

    @functools.cached_property
    def reduction(self) -> SensorReduction:
        """Map from band radiances to scene-linear Rec.709."""
        return fitted_reduction(self, self.reference)

    @functools.cached_property
    def stops(self) -> float:
        """Exposure in stops, which is that of the reference."""
        return self.reference.stops


def optimised_bands(
    count: int, reference: Viewpoint, depths: Sequence[float] = DEPTHS
) -> OptimisedBands:
    """Choose the wavelengths from which the colours in a water can be told best.

    Among the centres of the reference's bands, bands are exchanged one at a time, starting from
    equal ones, until none makes the expected ΔE2000 smaller. That is taken for the eye (CIE 1931),
    which serves other cameras as well. More than :data:`MOST_SEARCHED` are equal ones.

    The reference is a camera in the water, with :data:`.description.REFERENCE_BANDS` bands or so
    over the range to choose from; its sensor, depth, white balance and exposure do not matter. Of
    the ``depths``, m, such as some of a camera's path, at most the euphotic one and that of the
    floor are used.

    Raises
    ------
    InputError
        If the count is not 1 to 512, or there is no light.
    """
    if not depths:
        raise InputError("optimised bands: give at least one depth")
    fine = reference.column.bands
    low = float(fine.centres[0] - fine.widths[0] / 2)
    length = float(fine.centres[-1] + fine.widths[-1] / 2) - low
    equal = Bands.uniform(count, low, low + length)
    targets = [_Target.of(view, view) for view in _eyes(reference, depths)]
    if count > MOST_SEARCHED or 3 * count > len(fine):
        # More bands than the reference has fall on the same ones.
        nearest = np.unique(_nearest(fine, equal))
        return OptimisedBands(equal, float(_delta_e(targets, nearest[None])[0]))
    gap = min(_SMALLEST_GAP, length / (2 * count))
    found = [
        _exchange(targets, fine, Bands.uniform(count, low + a * length, low + b * length), gap)
        for a, b in _STARTS
    ]
    chosen, delta_e = min(found, key=lambda item: item[1])
    return OptimisedBands(Bands.at_wavelengths(fine.centres[chosen]), delta_e)


def fitted_reduction(view: Viewpoint, reference: Viewpoint) -> SensorReduction:
    """Weights for few bands that develop a scene as many bands would.

    The least squares fit, in ΔE2000 about each colour, of ``reference.reduction`` over the expected
    spectra: reflectances measured (rawtoaces) and uplifted from RGB, at four distances level, up
    and down, in daylight and some in the light of a lamp, and the open water behind them. A white
    diffuser in the light at the camera's depth gets exactly the colour of the reference, which is
    the same viewpoint with many bands: its white balance and exposure count, and ``matrix``,
    ``white`` and ``delta_e`` of the result are its own.

    Raises
    ------
    InputError
        If the depths differ, or no light that the sensor sees is left there.
    """
    if view.depth != reference.depth:
        raise InputError(
            f"fitted weights: the depths differ, {view.depth:g} and {reference.depth:g} m"
        )
    target = _Target.of(view, reference)
    count = len(view.column.bands)
    found, delta_e = target.solve(np.arange(count)[None])
    weights, develop = found[0] * target.scale, reference.reduction
    return dataclasses.replace(
        develop,
        weights=weights,
        # Many bands have a matrix with an inverse.
        response=np.linalg.solve(develop.matrix, weights),
        method=f"{view.sensor.name} in {view.illuminant.name}, {count} bands with weights "
        f"fitted to {len(reference.column.bands)}, white balance {reference.white_balance}, "
        f"expected ΔE2000 {delta_e[0]:.2f}",
    )


@dataclass(frozen=True, eq=False)
class _Target:
    """Normal equations of the weights of N bands for a viewpoint.

    Radiances are multiplied by ``scale``, which makes them about 1. ``gram`` (N, N, 3, 3),
    ``moment`` (N, 3) and ``rest`` make the mean squared ΔE2000 of weights w: w·gram·w - 2 w·moment
    + rest. A diffuser at the camera has the radiances ``white`` and is to get ``white_rgb``.
    """

    gram: NDArray[np.float64]
    moment: NDArray[np.float64]
    rest: float
    white: NDArray[np.float64]
    white_rgb: NDArray[np.float64]
    scale: NDArray[np.float64]

    @classmethod
    def of(cls, view: Viewpoint, reference: Viewpoint) -> _Target:
        scene = _expected_scene(reference)
        metric, weight = scene.metric, scene.weight
        radiance = _expected_spectra(view, scene.distances, scene.lamp_gain)[0]
        size = np.sqrt(weight @ radiance**2)
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0)
        radiance = radiance * scale
        weighted = np.einsum("skl,sl->sk", metric, scene.rgb)
        n = len(scale)
        gram = np.empty((n, n, 3, 3))
        for i, j in itertools.combinations_with_replacement(range(3), 2):
            gram[:, :, i, j] = gram[:, :, j, i] = (radiance.T * metric[:, i, j]) @ radiance
        gram[np.arange(n), np.arange(n)] *= 1 + _BAND_ERROR**2
        # A band without light gets no weight.
        gram[np.arange(n), np.arange(n)] += _TINY * metric.sum(axis=0)
        return cls(
            gram,
            radiance.T @ weighted,
            float(np.sum(weighted * scene.rgb)),
            scale * view.light / math.pi,
            reference.reduction.apply(reference.light / math.pi),
            scale,
        )

    def solve(self, choices: NDArray[np.int_]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Best weights (m, 3, n) and their ΔE2000 (m,) for each of m choices of n bands."""
        m, n = choices.shape
        size = 3 * n
        # Lagrange multipliers hold the white.
        system = np.zeros((m, size + 3, size + 3))
        gram = self.gram[choices[:, :, None], choices[:, None, :]]
        system[:, :size, :size] = gram.transpose(0, 1, 3, 2, 4).reshape(m, size, size)
        white = np.kron(self.white[choices][:, None], np.eye(3))
        system[:, size:, :size], system[:, :size, size:] = white, white.transpose(0, 2, 1)
        moment = self.moment[choices].reshape(m, size)
        right = np.concatenate([moment, np.broadcast_to(self.white_rgb, (m, 3))], axis=1)
        solution = np.linalg.solve(system, right[..., None])[..., 0]
        w = solution[:, :size]
        # Along the constraint w·gram·w = w·moment - multipliers·white.
        squares = self.rest - np.sum(w * moment, axis=1) - solution[:, size:] @ self.white_rgb
        return w.reshape(m, n, 3).transpose(0, 2, 1), np.sqrt(np.maximum(squares, 0.0))


def _eyes(reference: Viewpoint, depths: Sequence[float]) -> list[Viewpoint]:
    """Return the eye at these depths of the water, as far as there is light."""
    column = reference.column
    deepest = min(euphotic_depth(column, reference.phase), 0.999 * column.floor_depth)
    return [
        Viewpoint(column, reference.phase, reference.illuminant, standard_observer(), depth)
        for depth in sorted({min(float(depth), deepest) for depth in depths})
    ]


def _nearest(fine: Bands, bands: Bands) -> NDArray[np.int_]:
    """Return the indices of the fine bands next to some bands."""
    return np.abs(fine.centres[:, None] - bands.centres).argmin(axis=0)


def _exchange(
    targets: list[_Target], fine: Bands, start: Bands, gap: float
) -> tuple[NDArray[np.int_], float]:
    """Improve bands by exchanging one at a time: indices into the fine bands, and ΔE2000."""
    chosen = _nearest(fine, start)
    best = float(_delta_e(targets, chosen[None])[0])
    for _ in range(_MOST_SWEEPS):
        before = best
        for other in chosen.copy():
            others = chosen[chosen != other]
            apart = np.abs(fine.centres[:, None] - fine.centres[others]).min(axis=1, initial=np.inf)
            free = np.flatnonzero(apart >= gap)
            choices = np.sort(np.column_stack([np.tile(others, (len(free), 1)), free]), axis=1)
            errors = _delta_e(targets, choices)
            if errors.min() < best:
                chosen, best = choices[errors.argmin()], float(errors.min())
        if best > 0.999 * before:
            break
    return chosen, best


def _delta_e(targets: list[_Target], choices: NDArray[np.int_]) -> NDArray[np.float64]:
    """Expected ΔE2000 of each choice: the geometric mean over the targets.

    A change by some share then counts the same at every depth.
    """
    errors = [np.maximum(target.solve(choices)[1], 1e-6) for target in targets]
    return np.exp(np.mean(np.log(errors), axis=0))


@dataclass(frozen=True, eq=False)
class _ExpectedScene:
    """What a reference makes of the expected spectra.

    ``rgb`` (s, 3) and ``metric`` (s, 3, 3), the quadratic form of ΔE2000²
    about them times ``weight`` (s,).
    """

    distances: NDArray[np.float64]
    lamp_gain: float
    rgb: NDArray[np.float64]
    weight: NDArray[np.float64]
    metric: NDArray[np.float64]


# Few bands of several numbers are fitted to one reference.
@functools.lru_cache(maxsize=8)
def _expected_scene(reference: Viewpoint) -> _ExpectedScene:
    if not reference.light.max() > _DARKEST * _lamp(reference).max():
        raise InputError(
            f"fitted weights: no daylight is left at {reference.depth:g} m; move the camera up, "
            "or take equal bands"
        )
    develop, column = reference.reduction, reference.column
    seen = np.maximum(luminance(develop.weights.T) * reference.light, 0.0)
    attenuation = max(seen @ column.attenuation, seen.sum() / FARTHEST)
    distances = np.array(_DISTANCES) * seen.sum() / attenuation
    # The lamp is as bright as the daylight.
    daylight, lamp = luminance(develop.apply([reference.light, _lamp(reference)]))
    spectra, weight = _expected_spectra(reference, distances, daylight / lamp)
    rgb = develop.apply(spectra)
    metric = _metric(rgb) * weight[:, None, None]
    return _ExpectedScene(distances, daylight / lamp, rgb, weight, metric)


def _lamp(view: Viewpoint) -> NDArray[np.float64]:
    """Light of a lamp on the bands: that above the surface."""
    return view.illuminant.total_in(view.column.bands)


def _expected_spectra(
    view: Viewpoint, distances: NDArray[np.float64], lamp_gain: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radiances that the camera sees, shape (s, n), and their weights, which add up to 1."""
    reflectances = _reflectances(view.column.bands)
    x, y, _ = view.level
    lamp = (_lamp(view) * lamp_gain, reflectances[::4], _LAMP_FRACTION)
    background_weight = _BACKGROUND_FRACTION * len(distances)
    spectra, weights = [], []
    for w in ((x, y, 0.0), (0.7 * x, 0.7 * y, -math.sqrt(0.51)), (0.8 * x, 0.8 * y, 0.6)):
        ends = np.clip(view.depth - w[2] * distances, 0.0, view.column.floor_depth)
        P = (view.depth - ends) / w[2] if w[2] else distances
        transmittances = np.exp(-view.attenuation * P[:, None])
        background, *beyond = view.field.radiance([view.depth, *ends], w)
        path = background - transmittances * beyond
        spectra.append(background[None])
        weights.append([background_weight])
        for water, transmittance_ratio, Ed in zip(
            path, transmittances, view.field.Ed(ends), strict=True
        ):
            daylight = (Ed, reflectances, 1 - _LAMP_FRACTION)
            for light, surfaces, fraction in (daylight, lamp):
                spectra.append(water + transmittance_ratio * surfaces * light / math.pi)
                weights.append(np.full(len(surfaces), fraction / len(surfaces)))
    weight = np.concatenate(weights)
    return np.vstack(spectra), weight / weight.sum()


@functools.lru_cache(maxsize=8)
def _reflectances(bands: Bands) -> NDArray[np.float64]:
    """Reflectances of objects under water, measured ones and uplifted RGB, shape (k, n)."""
    measured = training_reflectances()
    axis = (0.05, 0.4, 0.9)
    rgb = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    held = measured.at(np.clip(bands.centres, *measured.range)).T[::2]
    return np.vstack([held, uplift(rgb, bands)])


def _metric(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quadratic form of ΔE2000² for small differences of linear Rec.709, shape (..., 3, 3)."""
    step = 1e-3 * np.maximum(luminance(rgb), 1e-3)[:, None]

    def squared(direction: NDArray[np.float64]) -> NDArray[np.float64]:
        return (delta_e_CIE2000_images(rgb + direction * step, rgb) / step[:, 0]) ** 2

    form = np.empty((*rgb.shape, 3))
    axes = np.eye(3)
    for k in range(3):
        form[:, k, k] = squared(axes[k])
    for i, j in itertools.combinations(range(3), 2):
        both = squared(axes[i] + axes[j])
        form[:, i, j] = form[:, j, i] = (both - form[:, i, i] - form[:, j, j]) / 2
    return form
