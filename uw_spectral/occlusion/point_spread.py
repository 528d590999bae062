"""How much of the light that is scattered forward on the way to a camera stays within a picture.

At distance t before an object the phase function's cone of half-angle θ is covered where the object
is wider than t tan θ. Taken over all of a path of length P the fraction of scattering that stays
within the object is, at a pixel, the mean of what is covered around it, weighed by

    K(φ) = dF̄ / dΩ,   F̄(tan φ) = ∫₀¹ F(arctan(tan φ / u)) du,

of the angle φ between view directions, where F(θ) is the fraction of the phase function within θ.
Neither the path nor the object's size is in K, so that one convolution of a picture serves for
everything in view.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..water.phase import BandPhase, Mixture, PhaseFunction
from .grid import Array
from .view_map import SIZE, ViewMap
from .visibility_buffer import VisibilityBuffer

_ANGLES, _STEPS = 1500, 200
_FINE = 5  # parts along a texel in which the kernel is added up
_TWICE = (2 * SIZE, 2 * SIZE)
_BRIGHT = 1.5  # standard deviations up to which a cloud is bright
_PLACES, _NEAREST = 16, 0.02  # m
_NEAR = 6  # texels from its middle that it is done in


def spread(pictures: Array, phase: PhaseFunction, per_unit: float) -> Array:
    """Pictures (..., h, w) as scattering forward spreads them: K * picture.

    ``per_unit`` is their resolution, pixels in a unit of 2 sin(φ/2).
    """
    height, width = pictures.shape[-2:]
    twice = 2 * height, 2 * width  # so that nothing comes round the sides
    kernel = _kernel(phase, per_unit, twice)
    found = np.fft.irfft2(np.fft.rfft2(pictures, twice) * kernel, twice)
    return found[..., :height, :width]


def at_middle(phase: PhaseFunction, view: ViewMap) -> float:
    """Fraction of scattering that stays within a texel: the middle of K."""
    return _middle(phase, float(view.per_unit))


def blocked_along(
    buffer: VisibilityBuffer,
    components: Sequence[PhaseFunction],
    parts: Array,
    ways: Array,
    on_floor: NDArray[np.bool_],
) -> Array:
    """Fraction of scattering that stays within what a view is filled with, along rays, (m, n).

    ``parts`` (k, n) are the shares of phase functions in the scattering of bands or channels;
    ``ways`` (m, 3) unit vectors away from the camera. Where the floor is seen, it counts as an
    object.
    """
    column, row = buffer.view.place([*(np.asarray(buffer.view.centre) + ways).T])
    at = np.rint(row).astype(np.intp), np.rint(column).astype(np.intp)
    pictures = np.stack([buffer.covered, buffer.with_floor])
    per_unit = float(buffer.view.per_unit)
    each = [spread(pictures, part, per_unit)[:, *at] for part in components]
    fractions = np.stack([np.where(on_floor, floor, surfaces) for surfaces, floor in each], axis=1)
    return np.clip(fractions @ parts, 0.0, 1.0)


def within_outline(phase: BandPhase | Mixture, size: float, distance: float) -> Array:
    """Fraction of scattering before a cloud that stays within its outline, shape (n,).

    A part of the picture gets as much of that as it gives.

    ``size`` is the standard deviation of the cloud's density, m.
    """
    reach = _BRIGHT * size / max(distance, _NEAREST)
    angles = np.arctan(reach / ((np.arange(_PLACES) + 0.5) / _PLACES))
    within = [float(np.mean(fraction_within(part, angles))) for part in phase.components]
    return np.clip(np.asarray(within) @ np.asarray(phase.weights), 0.0, 1.0)


def fraction_within(phase: PhaseFunction, angle: Array) -> Array:
    """Fraction F of a phase function within angles of the way ahead, rad."""
    angles, within = _fractions(phase)
    return np.interp(angle, angles, within)


@functools.lru_cache(maxsize=16)
def _fractions(phase: PhaseFunction) -> tuple[Array, Array]:
    angles = np.geomspace(1e-7, math.pi, 6000)
    middle = np.sqrt(angles[1:] * angles[:-1])
    parts = phase.per_steradian(np.sin(middle / 2) ** 2)
    within = np.cumsum(2.0 * math.pi * parts * np.sin(middle) * np.diff(angles))
    first = math.pi * float(phase.per_steradian(np.sin(angles[0] / 2) ** 2)) * angles[0] ** 2
    within = np.concatenate([[first], first + within])
    return angles, within / within[-1]


def fraction_on_path(phase: PhaseFunction, tangent: Array) -> Array:
    """Mean F̄ of that over a path, of a disc of a size over its distance (angle's tangent)."""
    u = (np.arange(_STEPS) + 0.5) / _STEPS
    return fraction_within(phase, np.arctan2(tangent[:, None], u)).mean(axis=1)


@functools.lru_cache(maxsize=16)
def _middle(phase: PhaseFunction, per_unit: float) -> float:
    return float(np.fft.irfft2(_kernel(phase, per_unit, _TWICE), _TWICE)[0, 0])


@functools.lru_cache(maxsize=16)
def _kernel(
    phase: PhaseFunction, per_unit: float, shape: tuple[int, int]
) -> NDArray[np.complex128]:
    """Fourier transform of K times the texel's solid angle, for texels about the middle."""
    angle = np.concatenate([[0.0], np.geomspace(1e-4, math.pi / 2 - 1e-4, _ANGLES)])
    total = fraction_on_path(phase, np.tan(angle))

    def within(texels: Array) -> Array:
        """Share within a circle of a radius."""
        unit = np.minimum(texels / per_unit, 2.0)
        return np.interp(2.0 * np.arcsin(unit / 2.0), angle, total)

    def per_texel(radius: Array) -> Array:
        step = 0.25
        low = np.maximum(radius - step, 0.0)
        area = math.pi * ((radius + step) ** 2 - low**2)
        return (within(radius + step) - within(low)) / area

    down, across = (np.fft.fftfreq(side, 1.0 / side) for side in shape)
    radius = np.hypot(down[:, None], across)
    kernel = per_texel(radius)
    near = np.arange(-_NEAR, _NEAR + 1)
    parts = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    for row in near:
        for column in near:
            fine = np.hypot(row + parts[:, None], column + parts)
            kernel[row, column] = per_texel(fine).mean()
    # The middle is steep: it has what the others leave of a circle that holds them.
    circle = radius <= _NEAR
    kernel[0, 0] = 0.0
    kernel[0, 0] = max(
        float(within(np.array([math.sqrt(circle.sum() / math.pi)]))[0]) - kernel[circle].sum(), 0.0
    )
    return np.fft.rfft2(kernel)
