"""The cone that stands for all light from above but the direct sun, for its shadows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .light_field import LightField

NARROWEST, WIDEST = math.radians(1.0), math.radians(60.0)
"""Bounds of the half angle; a wider cone has an edge too flat for a renderer's distant disc."""


@dataclass(frozen=True, eq=False)
class LightCone:
    """Light of equal radiance from every direction in a cone.

    Parameters
    ----------
    direction : array, shape (3,)
        Unit vector that its axis travels to; x, y horizontal, z up.
    half_angle : float
        From the axis to the edge, rad.
    """

    direction: NDArray[np.float64]
    half_angle: float


def light_cone(field: LightField, y: float, sun: ArrayLike) -> LightCone:
    """Cone with the flux and the scalar irradiance of the light from above at a depth.

    That light is the sunlight scattered forward, along the sun's direction, and
    the downwelling half of the diffuse light, whose axis is taken to be vertical;
    all bands together.

    Parameters
    ----------
    field : LightField
        Of n bands.
    y : float
        Depth, m.
    sun : array_like, shape (3,)
        Unit direction that sunlight travels to in the water.

    Returns
    -------
    LightCone
        Straight down and as wide as can be where there is no light.

    Notes
    -----
    A cone of half angle α has a mean cosine of (1 + cos α)/2 about its axis.

    Examples
    --------
    >>> from .light_field import solve_light_field
    >>> field = solve_light_field([0.05], [0.1], [0.8], [0.64], [1.0], 0.9)
    >>> cone = light_cone(field, 5.0, (0.436, 0.0, -0.9))
    >>> cone.direction.round(2), round(math.degrees(cone.half_angle))
    (array([ 0.3 ,  0.  , -0.95]), 57)
    """
    _, forward, down = (float(part.sum()) for part in field.surface_irradiance(y, field.mu_s, 1.0))
    along = forward / field.mu_s
    scalar = along + float(np.maximum(field.E0(y) / 2.0 + 3.0 * field.F(y) / 4.0, 0.0).sum())
    flux = along * np.asarray(sun, dtype=np.float64) - [0.0, 0.0, down]
    size = float(np.linalg.norm(flux))
    if not (size > 0 and scalar > 0):
        return LightCone(np.array([0.0, 0.0, -1.0]), WIDEST)
    half_angle = math.acos(min(max(2.0 * size / scalar - 1.0, -1.0), 1.0))
    return LightCone(flux / size, min(max(half_angle, NARROWEST), WIDEST))
