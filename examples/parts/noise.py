"""Seeded random numbers and gradient noise."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def generator(seed: int, part: str) -> np.random.Generator:
    """Return the random generator of one part of the scene.

    Every part draws from its own stream, so a change in one leaves the others
    as they were.
    """
    return np.random.default_rng([seed, zlib.crc32(part.encode())])


def gradient_noise(points: Array, rng: np.random.Generator) -> Array:
    """Perlin's gradient noise at points of shape (n, 3); feature size 1, about ±0.7."""
    permutation = np.tile(rng.permutation(256), 2)
    gradients = rng.normal(size=(256, 3))
    gradients /= np.linalg.norm(gradients, axis=1, keepdims=True)
    cell = np.floor(points).astype(np.int64)
    inside = points - cell
    fade = inside**3 * (inside * (inside * 6 - 15) + 10)
    cell &= 255
    # By axis: contiguous columns are several times as fast as rows of three.
    gradient, near = gradients.T.copy(), (inside.T.copy(), (inside - 1).T.copy())
    weights, cells = ((1 - fade).T.copy(), fade.T.copy()), cell.T.copy()
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        i, j, k = ((c + step) & 255 for c, step in zip(cells, corner, strict=True))
        hashed = permutation[permutation[permutation[i] + j] + k]
        u, v, w = (weights[step][axis] for axis, step in enumerate(corner))
        x, y, z = (gradient[axis][hashed] * near[step][axis] for axis, step in enumerate(corner))
        total += u * v * w * (x + y + z)
    return total


def fractal_noise(points: Array, rng: np.random.Generator, octaves: int = 4) -> Array:
    """Sum octaves of gradient noise, each twice as fine and half as strong."""
    return sum(
        0.5**octave * gradient_noise(points * 2.0**octave + 17.3 * octave, rng)
        for octave in range(octaves)
    )


def meander(points: Array, wavelength: float, rng: np.random.Generator, waves: int = 60) -> Array:
    """Random field of one wavelength; its level lines meander like the grooves of brain corals.

    ``wavelength`` is the distance from groove to groove, in the units of the points, shape (n, 3);
    ``waves`` plane waves are summed to zero mean and unit variance, shape (n,).
    """
    directions = rng.normal(size=(waves, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    phases = rng.uniform(0, 2 * np.pi, waves)
    total = np.zeros(len(points))
    for direction, phase in zip(directions, phases, strict=True):
        total += np.cos(points @ direction * (2 * np.pi / wavelength) + phase)
    return total * np.sqrt(2 / waves)
