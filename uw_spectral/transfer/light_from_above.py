"""Directions that the light from above comes from, the direct sun apart, for its shadows."""

from __future__ import annotations

import math

import numpy as np

from .solved_field import SolvedField
from .solved_layer import Array

_TURNS = 48  # azimuths of the light of a stream
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def light_from_above(field: SolvedField, y: float, count: int) -> Array:
    """Return k directions that carry equal fractions of the scalar irradiance from above, (k, 3).

    All bands together; the sun's beam with its forward peak is left out.

    They are unit vectors towards where the light comes from, z up; straight up where there is no
    light.

    Importance sampling of the radiance along the streams at the points of a golden-ratio
    sequence, first of the cosine and then of the azimuth.
    """
    turns = (np.arange(_TURNS) + 0.5) * (2.0 * math.pi / _TURNS)
    modes, _ = field.stream_modes([y], 2 * len(field.mu))
    waves = np.cos(np.arange(len(modes))[:, None] * turns)
    radiance = np.maximum(np.einsum("mns,mt->st", modes[:, :, 0], waves), 0.0)
    fraction = field.weights[:, None] * radiance
    if not fraction.sum() > 0:
        return np.tile([0.0, 0.0, 1.0], (count, 1))
    order = np.argsort(field.mu)
    fraction, weights = fraction[order], field.weights[order]
    places = np.linspace(0.5, count - 0.5, count) / count
    row, within = _drawn(np.broadcast_to(fraction.sum(axis=1), (count, len(order))), places)
    mu = np.cumsum(weights)[row] - (1.0 - within) * weights[row]
    column, within = _drawn(fraction[row], np.linspace(1.0, count, count) * _GOLDEN % 1.0)
    turn = (column + within) * (2.0 * math.pi / _TURNS) + math.atan2(field.sun[1], field.sun[0])
    across = np.sqrt(np.maximum(1.0 - mu**2, 0.0))
    return np.stack([-across * np.cos(turn), -across * np.sin(turn), mu], axis=-1)


def _drawn(fractions: Array, places: Array) -> tuple[np.ndarray, Array]:
    """Cell that a place from 0 to 1 falls into, and where in it, for rows of shares (k, c)."""
    ends = np.cumsum(fractions, axis=1)
    wanted = places * ends[:, -1]
    cell = np.minimum((ends < wanted[:, None]).sum(axis=1), fractions.shape[1] - 1)
    rows = np.arange(len(fractions))
    size = np.maximum(fractions[rows, cell], np.finfo(np.float64).tiny)
    return cell, np.clip((wanted - ends[rows, cell]) / size + 1.0, 0.0, 1.0)
