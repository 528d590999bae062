"""Light scattered by a population of bubbles, by the Lorenz-Mie series of each size."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.spectral_image import replacing
from ..uw_spectral.water.bubbles import HINZE_RADIUS, SIZE_SLOPE, SMALLEST_RADIUS
from .mie import scattered_by_sphere

Array = NDArray[np.float64]

INDEX = 1.34
"""Of sea water against the air in a bubble."""
_DIFFRACTED_DEG = 3.0  # within which diffraction is told from the rest, which is even there
_STEP, _FINEST, _FINE = 0.125, 3e-4, 240  # degrees
# Angles in degrees between which the table has means: few, for each is a node of a shader.
_EDGES = (3, 12, 20, 31, 44, 58, 70, 79, 86, 92, 99, 108, 124, 180)
TILT_DEG = 6.0
"""Angle in degrees by which the table is spread. Bubbles of about a millimetre are flattened and
tumble: spheres would all cease to mirror totally at one angle."""
_ORDERS = 100  # of Legendre polynomials
_NEAREST, _MIDDLES, _ROUNDS = 1.0, 41, 12


@dataclass(frozen=True, eq=False)
class Population:
    """What bubbles of many sizes scatter.

    ``phase`` at scattering ``angles`` (rad), shape (k,), is all of it, diffraction included, 1/sr;
    ``per_void`` the scattering coefficient over the void fraction, 1/m; ``asymmetry`` the mean
    cosine.
    """

    angles: Array
    phase: Array
    per_void: float
    asymmetry: float

    def integral(self, of: NDArray[np.floating] | float = 1.0) -> float:
        """Integral of the phase function times something over the sphere."""
        density = self.phase * of * 2.0 * math.pi * np.sin(self.angles)
        return float(np.trapezoid(density, self.angles))

    @property
    def backscatter_ratio(self) -> float:
        """Fraction that is scattered backwards, bb/b."""
        return self.integral(1.0 * (self.angles > math.pi / 2))

    @property
    def diffracted(self) -> float:
        """Fraction of what is only diffracted: what is more than even within a few degrees."""
        near = self.angles < math.radians(_DIFFRACTED_DEG)
        even = self.mean(_DIFFRACTED_DEG, 2.0 * _DIFFRACTED_DEG)
        return self.integral(near * (1.0 - even / self.phase))

    def mean(self, low: float, high: float) -> float:
        """Mean over the solid angle between two angles in degrees, 1/sr."""
        degrees = np.degrees(self.angles)
        inside = (degrees >= low) & (degrees <= high)
        x, weight = self.angles[inside], np.sin(self.angles[inside])
        return float(np.trapezoid(self.phase[inside] * weight, x) / np.trapezoid(weight, x))


def bubbles(
    smallest: float = SMALLEST_RADIUS,
    largest: float = HINZE_RADIUS,
    slope: float = SIZE_SLOPE,
    wavelength: float = 550.0,
    count: int = 1500,
    seed: int = 0,
) -> Population:
    """Return what a population of bubbles scatters.

    Sizes are as of :func:`.sauter_radius`, ``wavelength`` is in air, nm; ``count`` sizes are
    summed, one at random in each of as many steps.
    """
    near = np.geomspace(_FINEST, 1.0, _FINE)
    degrees = np.concatenate([near, np.arange(1.0, 180.0 + _STEP / 2, _STEP)[1:]])
    angles = np.radians(degrees)
    edges = np.geomspace(smallest, largest, count + 1)
    radii = edges[:-1] * (edges[1:] / edges[:-1]) ** np.random.default_rng(seed).random(count)
    numbers = radii ** (1.0 + slope)
    phase, area, forward, volume = np.zeros(len(angles)), 0.0, 0.0, 0.0
    for radius, number in zip(radii.tolist(), numbers.tolist(), strict=True):
        size = 2.0 * math.pi * radius * INDEX / (wavelength * 1e-9)
        efficiency, asymmetry, _, p = scattered_by_sphere(size, 1.0 / INDEX, np.cos(angles))
        scattered = number * math.pi * radius**2 * efficiency
        phase += scattered * p
        area += scattered
        forward += scattered * asymmetry
        volume += number * 4.0 / 3.0 * math.pi * radius**3
    return Population(angles, phase / area, area / volume, forward / area)


def spread(found: Population) -> Population:
    """Return what is not diffracted, spread by :data:`TILT_DEG`; its integral is 1."""
    near = found.angles < math.radians(_DIFFRACTED_DEG)
    even = np.where(near, found.mean(_DIFFRACTED_DEG, 2.0 * _DIFFRACTED_DEG), found.phase)
    rest = replace(found, phase=even)
    x = np.cos(found.angles)
    total, before, legendre = np.zeros(len(x)), np.zeros(len(x)), np.ones(len(x))
    for n in range(_ORDERS):
        left = math.exp(-0.5 * n * (n + 1) * math.radians(TILT_DEG) ** 2)
        total += (2 * n + 1) / (4.0 * math.pi) * left * rest.integral(legendre) * legendre
        following = ((2 * n + 1) * x * legendre - n * before) / (n + 1)
        before, legendre = legendre, following
    return replace(found, phase=total / rest.integral())


def table(found: Population) -> tuple[Array, Array]:
    """Return angles in degrees, and what is not diffracted of a phase function there, 1/sr.

    Interpolated as :class:`.TabulatedPhase` does it, it has the means of :func:`spread`.
    """
    low, high = np.array(_EDGES[:-1], np.float64), np.array(_EDGES[1:], np.float64)
    angles = np.concatenate([[_NEAREST], 0.5 * (low + high), [180.0]])
    even = spread(found)
    wanted = np.array([even.mean(*ends) for ends in zip(low, high, strict=True)])
    fine = np.linspace(low, high, _MIDDLES)
    knots, places = (np.log(np.sin(np.radians(x) / 2.0)) for x in (angles, fine))
    weights = np.sin(np.radians(fine))
    values = wanted.copy()
    for _ in range(_ROUNDS):
        rows = np.concatenate([values[:1], values, values[-1:]])
        drawn = np.exp(np.interp(places, knots, np.log(rows)))
        values *= wanted / ((drawn * weights).sum(axis=0) / weights.sum(axis=0))
    return angles, np.concatenate([values[:1], values, values[-1:]])


def write(path: Path, found: Population) -> None:
    """Write the table of a population of bubbles."""
    lines = [
        "# Phase function of clean air bubbles in sea water without what is only diffracted, 1/sr",
        "# source: Lorenz-Mie series (validation/mie.py, validation/bubbles.py), relative index "
        f"1 / {INDEX:g}, 550 nm, radii {1e6 * SMALLEST_RADIUS:g} to {1e6 * HINZE_RADIUS:g} um, "
        f"number as r^{SIZE_SLOPE:g}",
        f"# whole: mean cosine {found.asymmetry:.4f}, bb/b {found.backscatter_ratio:.4f}, "
        f"diffracted {found.diffracted:.4f}; means between angles, spread by {TILT_DEG:g} degrees",
        "# licence: GPL-3.0-or-later. status: computed; python3 dev.py run tools/bubble_table.py",
        "# SPDX-License-Identifier: GPL-3.0-or-later",
        "angle_deg,phase_function_per_sr",
    ]
    lines += [f"{x:g},{y:.4g}" for x, y in zip(*table(found), strict=True)]
    with replacing(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n")
