"""The waterline on the glass before a camera that is half under water, and its meniscus.

The glass stands upright before the lens. A pixel shows the air or the water, whichever its ray
meets behind the glass. At the line the water climbs the glass. With the capillary
length a its surface has, at a height h over the level, an inclination ψ with h² = 2 a² (1 - cos ψ)
(Landau & Lifshitz, Fluid Mechanics, § 61). A level ray meets it from inside: where it is flat it is
reflected totally, down by 2 ψ, so that a band shows the water below; near its edge the ray is
refracted down, and the band shows the air's side.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

CAPILLARY_LENGTH = 2.7e-3
"""Of water, m: sqrt(surface tension / (density g)), 0.073 N/m."""
CONTACT_ANGLE = math.radians(20.0)
"""Of water on clean glass."""

Array = NDArray[np.float64]


def meniscus_height(contact_angle: float = CONTACT_ANGLE) -> float:
    """Height in m to which the water climbs an upright glass."""
    return CAPILLARY_LENGTH * math.sqrt(2.0 * (1.0 - math.sin(contact_angle)))


def meniscus_turn(height: ArrayLike, refractive_index: float) -> tuple[Array, NDArray[np.bool_]]:
    """Angle by which the meniscus turns a level ray down, rad, and whether it stays in the water.

    ``height`` is over the level, m, 0 to :func:`meniscus_height`.
    """
    cosine = 1.0 - np.asarray(height, dtype=np.float64) ** 2 / (2.0 * CAPILLARY_LENGTH**2)
    inclination = np.arccos(np.clip(cosine, -1.0, 1.0))
    incidence = math.pi / 2.0 - inclination
    sine = refractive_index * np.sin(incidence)
    inside = sine >= 1.0
    refracted = np.arcsin(np.minimum(sine, 1.0)) - incidence
    return np.where(inside, 2.0 * inclination, refracted), inside


def split_picture(
    air: NDArray[np.floating],
    water: NDArray[np.floating],
    height: Array,
    down: tuple[float, float],
    pixels_per_tangent: float,
    refractive_index: float,
) -> NDArray[np.float32]:
    """Join what a camera sees through air and through water, with the meniscus between.

    These, shape (h, w, c), are the same view with the camera in either; the same picture twice if
    it holds both halves. ``height``, (h, w), is that of the pixels' places on the glass over the
    water there, m, ``down`` the unit direction in the picture, rows and columns, in which it falls.
    The tangent is that of the angle from the middle of the picture; the index is that of the water
    against air.
    """
    step = max(float(np.abs(np.gradient(height, axis=0)).max()), 1e-9) if len(height) > 1 else 1e-9
    fraction = np.clip(0.5 - height / step, 0.0, 1.0)[..., None]
    wall = meniscus_height()
    within = (height > 0.0) & (height < wall)
    turn, inside = meniscus_turn(np.clip(height, 0.0, wall), refractive_index)
    away = np.minimum(np.tan(np.minimum(turn, _WIDEST)), _FARTHEST) * pixels_per_tangent
    rows, columns = np.indices(height.shape)
    found = []
    for picture, below in ((water, True), (air, False)):
        at = []
        for places, along, size in zip((rows, columns), down, height.shape, strict=True):
            at.append(np.clip(np.rint(places + along * away), 0, size - 1).astype(int))
        shown = picture[at[0], at[1]]
        wrong = (height[at[0], at[1]] > 0.0) == below
        found.append(np.where(wrong[..., None] & (air is water), picture, shown))
    band = np.where(inside[..., None], found[0], found[1] * _EDGE_LIGHT)
    split = fraction * water + (1.0 - fraction) * air
    edge = np.clip(np.minimum(height, wall - height) / step + 0.5, 0.0, 1.0)[..., None]
    return np.where(within[..., None], edge * band + (1.0 - edge) * split, split).astype(np.float32)


_WIDEST = math.radians(75.0)  # turn that has a place in a picture
_FARTHEST = 3.0  # its tangent
_EDGE_LIGHT = 0.96  # what a surface that is met at a right angle lets through
