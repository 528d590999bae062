"""The rock as one closed solid: a mound, less the tunnel, less the shafts to the light."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parts.noise import fractal_noise, generator, gradient_noise
from ..parts.sand import smooth_step
from ..parts.shapes import Shape, subdivided
from ..parts.solids import surface_net

Array = NDArray[np.float64]

FLOOR = -15.4
"""Lowest part of the tunnel, beneath the sand, m."""
LENGTH = 34.0
"""From mouth to mouth, m, along y."""
_LOW, _HIGH = np.array([-18.6, -21.0, -18.8]), np.array([18.6, 21.0, -2.2])
_SPACING = 0.26
_BAND = 2.6


@dataclass(frozen=True)
class Shaft:
    """Hole in the roof.

    ``at`` is its middle (x, y) 7 m deep, ``radius`` its half width there, and
    ``lean`` how far it goes in x and y per metre down.
    """

    at: tuple[float, float]
    radius: float
    lean: tuple[float, float]

    def axis(self, z: ArrayLike) -> tuple[Array, Array]:
        """Middle of the shaft at heights z."""
        down = -7.0 - np.asarray(z, float)
        return self.at[0] + self.lean[0] * down, self.at[1] + self.lean[1] * down


SHAFTS = (
    Shaft((-2.9, -9.2), 1.3, (0.17, 0.26)),
    Shaft((0.5, 0.0), 2.3, (0.10, 0.18)),
    Shaft((2.6, 7.4), 1.2, (0.15, 0.22)),
)


def _bump(y: Array, middle: float, width: float) -> Array:
    return np.exp(-(((y - middle) / width) ** 2))


def course(y: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Tunnel at y: x and z of its middle, half width, and half height, m."""
    y = np.asarray(y, float)
    x = 2.6 * np.sin(0.20 * y + 0.25)
    mouths = 0.9 * _bump(y, -18, 4) + 1.3 * _bump(y, 18, 5)
    wide = 2.6 + 2.5 * _bump(y, 1.5, 5.0) + mouths
    high = 2.1 + 1.6 * _bump(y, 1.5, 4.5) + 0.6 * mouths
    return x, FLOOR + high, wide, high


def swim_path(y: ArrayLike) -> Array:
    """Where a diver swims at y: points, shape (n, 3)."""
    y = np.atleast_1d(np.asarray(y, float))
    x, z, _, high = course(y)
    return np.stack([x, y, z + 0.12 * high + 0.1 * np.sin(0.4 * y)], axis=1)


def _smooth_max(a: Array, b: Array, width: float) -> Array:
    blend = np.clip(0.5 + 0.5 * (a - b) / width, 0, 1)
    return b + (a - b) * blend + width * blend * (1 - blend)


def _tunnel(points: Array) -> Array:
    """About the distance from the tunnel's wall, negative in it."""
    x, z, wide, high = course(points[:, 1])
    bend = 1 / np.hypot(1, 0.52 * np.cos(0.20 * points[:, 1] + 0.25))
    radius = np.hypot((points[:, 0] - x) * bend / wide, (points[:, 2] - z) / high)
    return (radius - 1) * np.minimum(wide, high)


def _shafts(points: Array) -> Array:
    """About the distance from the nearest shaft's wall, negative in it."""
    distance = np.full(len(points), np.inf)
    for shaft in SHAFTS:
        x, y = shaft.axis(points[:, 2])
        # They widen downwards, where rock has fallen out, and upwards into funnels.
        down = -7.0 - points[:, 2]
        radius = shaft.radius + 0.08 * np.clip(down, 0, 4) + 0.6 * np.clip(-down, 0, 3)
        around = np.hypot(points[:, 0] - x, points[:, 1] - y) - radius
        distance = np.minimum(distance, np.maximum(around, -12.0 - points[:, 2]))
    return distance


def _plain(points: Array) -> Array:
    """Rock without roughness: negative inside."""
    mound = (np.abs((points - (0, 0, -18)) / (15.5, 17.6, 13.0)) ** 3.2).sum(axis=1) ** (1 / 3.2)
    # Flat below, under the sand.
    outer = np.maximum((mound - 1) * 13.0, -18.0 - points[:, 2])
    return _smooth_max(_smooth_max(outer, -_tunnel(points), 0.6), -_shafts(points), 0.5)


def _roughness(points: Array, seed: int) -> Array:
    """Boulders, beds and clefts of the limestone, m."""
    rng = generator(seed, "cave")
    large = 1.0 * fractal_noise(points / 4.5, rng, 2)
    beds = 0.65 * gradient_noise(points * (0.33, 0.33, 1.5) + 0.2 * large[:, None], rng)
    clefts = 0.55 * (0.25 - np.abs(gradient_noise(points / 1.5, rng)))
    knobs = 0.16 * (0.25 - np.abs(gradient_noise(points / 0.62, rng)))
    # Not where the diver swims.
    near = np.linalg.norm(points - swim_path(points[:, 1]), axis=1)
    buried = 1 - smooth_step(-17.6, -16.4, points[:, 2])
    rough = (large + beds + clefts + knobs) * smooth_step(0.9, 2.0, near)
    return rough * (1 - buried)


def rock(seed: int, spacing_factor: float, finer: int) -> Shape:
    """Solid rock; attribute "inside" is 1 on the walls of the cave.

    ``spacing_factor`` is on the 0.26 m between the points of the field; ``finer`` is how often
    triangles are split in four.
    """
    spacing = _SPACING * spacing_factor
    axes = [np.arange(low, high, spacing) for low, high in zip(_LOW, _HIGH, strict=True)]
    shape = tuple(len(axis) for axis in axes)
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    field = _plain(grid)
    near = np.abs(field) < _BAND
    field[near] -= _roughness(grid[near], seed)
    solid = surface_net(field.reshape(shape), _LOW, spacing)
    for _ in range(finer):
        solid = subdivided(solid)
    if finer:
        rng = generator(seed, "cave skin")
        skin = 0.10 * (0.25 - np.abs(gradient_noise(solid.vertices / 0.34, rng)))
        skin += 0.05 * fractal_noise(solid.vertices / 0.16, rng, 2)
        solid = replace(solid, vertices=solid.vertices + solid.normals() * skin[:, None])
    inside = 1 - smooth_step(0.4, 2.0, np.minimum(_tunnel(solid.vertices), _BAND))
    mouth = smooth_step(LENGTH / 2 - 5, LENGTH / 2 + 0.5, np.abs(solid.vertices[:, 1]))
    return solid.with_attributes(inside=inside * (1 - mouth))
