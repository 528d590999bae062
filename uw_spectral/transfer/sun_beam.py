"""The direct sun in the water, and the angle by which it turns to a camera.

Directions, depth and shapes are those of :mod:`.radiance_field`.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..mathematics import NUMPY, Mathematics, Operand
from ..surface.caustics import SUN_RADIUS
from ..surface.refraction import REFRACTIVE_INDEX

SUN_DISC = (0.42 * SUN_RADIUS / REFRACTIVE_INDEX / 2.0) ** 2
"""Squared sine of half the angle at which the forward peak of sea particles is its mean over
the sun's disc in the water."""


def half_angle2(w: Sequence[Operand], sun: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Squared sine of half the angle by which sunlight turns to travel against w.

    It is held at the sun's disc, where the phase functions of particles have no bound.
    """
    x, y, z = (w[i] + sun[i] for i in range(3))
    return m.clamp((x * x + y * y + z * z) / 4.0, SUN_DISC, 1.0)
