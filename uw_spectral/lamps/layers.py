"""Water that differs with depth, as the light of lamps meets it: its mean from lamp to camera."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..transfer.water_column import WaterColumn
from ..water.phase import BandPhase
from .lamp import Lamp
from .multiple_scattering import LampWater, lamp_water

_LEVEL = 1e-3  # m of depth, below which a way is level
_LEAST = 1e-9


def water_between(column: WaterColumn, phase: BandPhase, one: float, other: float) -> LampWater:
    """Return the mean water between two depths in m; above the surface there is none.

    The phase function of its first layer stands for that of layers with other parts.
    """
    layers = column.layers(phase)
    high, low = sorted((max(one, 0.0), max(other, 0.0)))
    ends = np.array([0.0, *(x.bottom for x in layers[:-1]), math.inf])
    if low - high < _LEVEL:
        fractions = np.zeros(len(layers))
        # Where two meet, the upper one.
        fractions[max(int(np.searchsorted(ends, (high + low) / 2.0)) - 1, 0)] = 1.0
    else:
        fractions = np.diff(np.clip(ends, high, low)) / (low - high)
    a = fractions @ np.array([x.absorption for x in layers])
    b = fractions @ np.array([x.scattering for x in layers])
    alike = [x.phase if x.phase.components == phase.components else phase for x in layers]
    scattered = fractions[:, None] * (np.array([x.scattering for x in layers]) + _LEAST)
    weights = np.einsum("ln,lkn->kn", scattered, np.array([x.weights for x in alike]))
    return lamp_water(a, b, BandPhase(phase.components, weights / scattered.sum(axis=0)))


def waters_of_lamps(
    column: WaterColumn, phase: BandPhase, lamps: Sequence[Lamp], camera: float
) -> tuple[LampWater, tuple[LampWater, ...]]:
    """Return the water of all lamps, by their light, and that of each, for a camera's depth, m."""
    each = tuple(water_between(column, phase, -float(x.position[2]), camera) for x in lamps)
    light = np.array([float(np.mean(lamp.intensity)) for lamp in lamps]) + _LEAST
    fractions = light / light.sum()
    scattered = fractions[:, None] * (np.array([x.b for x in each]) + _LEAST)
    weights = np.einsum("ln,lkn->kn", scattered, np.array([x.phase.weights for x in each]))
    mean = BandPhase(phase.components, weights / scattered.sum(axis=0))
    a, b = (fractions @ np.array([getattr(x, name) for x in each]) for name in ("a", "b"))
    return lamp_water(a, b, mean), each
