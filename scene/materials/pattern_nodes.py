"""Blender's patterns at places, arrays of shape (n, 3), and the distribution of its noise."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import bpy
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_NOISE = np.array([
    0.366, 0.403, 0.426, 0.443, 0.458, 0.471, 0.483, 0.494,
    0.505, 0.517, 0.529, 0.542, 0.557, 0.574, 0.596, 0.634,
])  # fmt: skip
"""Quantiles of Blender's noise texture, measured at a detail of 8 and a roughness of 0.5; much the
same with a detail of 3 or 15."""
_RANKS = (np.arange(len(_NOISE)) + 0.5) / len(_NOISE)
_WHOLE = 1e-6  # what places are moved by, so that those on borders fall to one side
_AXES = {"X": 0, "Y": 1, "Z": 2}


def noise(ranks: Array) -> Array:
    """Return values of normalised noise by their ranks, 0 to 1."""
    return np.interp(ranks, _RANKS, _NOISE)


def voronoi(
    node: bpy.types.ShaderNodeTexVoronoi, draw: np.random.Generator, count: int
) -> Array | None:
    """Return distances in cells drawn by chance, shape (n, 1); None of kinds that are not known."""
    randomness = min(max(node.inputs["Randomness"].default_value, 0.0), 1.0)
    axes = int(node.voronoi_dimensions[0])
    cells = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=axes)))
    points = cells + randomness * draw.random((count, len(cells), axes))
    away = points - draw.random((count, 1, axes))
    lengths = {
        "EUCLIDEAN": lambda: np.linalg.norm(away, axis=2),
        "MANHATTAN": lambda: np.abs(away).sum(axis=2),
        "CHEBYCHEV": lambda: np.abs(away).max(axis=2),
    }.get(node.distance)
    most = 0.5 + 0.5 * randomness
    if node.feature == "DISTANCE_TO_EDGE":
        found = _to_edge(away)
    elif lengths is None or node.feature == "N_SPHERE_RADIUS":
        return None
    else:
        first, second = np.partition(lengths(), 1, axis=1)[:, :2].T
        found = {"F2": second}.get(node.feature, first)
        if node.feature == "SMOOTH_F1":
            found = _smooth(lengths(), node.inputs["Smoothness"].default_value / 2.0)
        most *= {"EUCLIDEAN": axes**0.5, "MANHATTAN": axes}.get(node.distance, 1.0)
        most *= 2.0 if node.feature == "F2" else 1.0
    return found[:, None] / (most if node.normalize else 1.0)


def _to_edge(away: Array) -> Array:
    """Return distances from the borders of the cells of the nearest of points, shape (n, m, k)."""
    order = np.argsort(np.linalg.norm(away, axis=2), axis=1)[..., None]
    near = np.take_along_axis(away, order, axis=1)
    across, middle = near[:, 1:] - near[:, :1], (near[:, 1:] + near[:, :1]) / 2.0
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), _WHOLE)
    return (middle * across).sum(axis=2).min(axis=1)


def _smooth(lengths: Array, smoothness: float) -> Array:
    """Return the least of lengths, shape (n, m), rounded off one by one as Blender does it."""
    found, width = lengths[:, 0], min(max(smoothness, _WHOLE), 0.5)
    for length in lengths.T[1:]:
        h = np.clip(0.5 + 0.5 * (found - length) / width, 0.0, 1.0)
        h = h * h * (3.0 - 2.0 * h)
        found = found + h * (length - found) - width * h * (1.0 - h)
    return found


def checker(place: Array) -> NDArray[np.bool_]:
    """Whether the first colour shows, shape (n, 1)."""
    cells = np.floor((place + _WHOLE) * (1.0 - _WHOLE))
    return cells.sum(axis=1, keepdims=True) % 2.0 == 1.0


def gradient(kind: str, place: Array) -> Array:
    """Return the values of a gradient of a type, shape (n, 1)."""
    x, y, _ = (place[:, [n]] for n in range(3))
    inside = np.maximum(0.999999 - np.linalg.norm(place, axis=1, keepdims=True), 0.0)
    found = {
        "LINEAR": x,
        "QUADRATIC": np.maximum(x, 0.0) ** 2,
        "EASING": np.clip(x, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(x, 0.0, 1.0)),
        "DIAGONAL": (x + y) / 2.0,
        "RADIAL": np.arctan2(y, x) / (2.0 * np.pi) + 0.5,
        "QUADRATIC_SPHERE": inside**2,
        "SPHERICAL": inside,
    }[kind]
    return np.clip(found, 0.0, 1.0)


def wave(node: bpy.types.ShaderNodeTexWave, place: Array, phase: Array) -> Array:
    """Return the values of waves without distortion, shape (n, 1)."""
    place = (place + _WHOLE) * (1.0 - _WHOLE)
    bands = node.wave_type == "BANDS"
    direction = node.bands_direction if bands else node.rings_direction
    if bands:
        along = (
            20.0 * place[:, [_AXES[direction]]]
            if direction in _AXES
            else (10.0 * place.sum(axis=1, keepdims=True))
        )
    else:
        across = place * [direction != axis for axis in "XYZ"]
        along = 20.0 * np.linalg.norm(across, axis=1, keepdims=True)
    along = along + phase
    if node.wave_profile == "SIN":
        return 0.5 + 0.5 * np.sin(along - np.pi / 2.0)
    turns = along / (2.0 * np.pi)
    if node.wave_profile == "SAW":
        return turns - np.floor(turns)
    return np.abs(turns - np.floor(turns + 0.5)) * 2.0


def brick(
    node: bpy.types.ShaderNodeTexBrick, place: Array, values: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Return the fraction of mortar, and that of the second colour in a brick, shape (n, 1).

    ``values`` are those of the inputs.
    """
    wide, high = values["Brick Width"], values["Row Height"]
    x, y = place[:, [0]], place[:, [1]]
    row = np.floor(y / high)
    offset = np.zeros_like(x)
    if node.offset_frequency and node.squash_frequency:
        wide = wide * np.where(row % node.squash_frequency, 1.0, node.squash)
        offset = np.where(row % node.offset_frequency, 0.0, wide * node.offset)
    number = np.floor((x + offset) / wide)
    x, y = (x + offset) - wide * number, y - high * row
    drawn = _hashed(row * 65536.0 + number % 65536.0)
    edge = np.minimum(np.minimum(x, y), np.minimum(wide - x, high - y))
    size, smooth = values["Mortar Size"], values["Mortar Smooth"]
    fraction = np.where(smooth == 0.0, 1.0, (1.0 - edge / np.maximum(size, _WHOLE)))
    fraction = np.clip(fraction / np.where(smooth == 0.0, 1.0, smooth), 0.0, 1.0)
    mortar = np.where(edge >= size, 0.0, fraction * fraction * (3.0 - 2.0 * fraction))
    return mortar, np.clip(drawn + values["Bias"], 0.0, 1.0)


def _hashed(numbers: Array) -> Array:
    """Return the number from 0 to 1 that Blender draws for each brick (``brick_noise``)."""
    n = numbers.astype(np.int64).astype(np.uint32) + np.uint32(1013) & np.uint32(0x7FFFFFFF)
    n ^= n >> 13
    drawn = n * (n * n * np.uint32(60493) + np.uint32(19990303)) + np.uint32(1376312589)
    return (drawn & np.uint32(0x7FFFFFFF)) / 2.0**31
