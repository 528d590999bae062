"""Irradiance that lamps put on things in the water.

Unscattered light falls off as e^{-c r}. What the forward peak of the phase function scatters
on the way arrives nearly as if it had not been, blurred: e^{-cp r} - e^{-c r} of it, cp being
the extinction without the peak. Renderers shadow the first and spread the second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .lamp import Lamp


@dataclass(frozen=True, eq=False)
class PatchPastLamp:
    """A lamp as a patch sees it: what all bands share.

    Attributes
    ----------
    r : float or array
        Distance, m, at least the radius of the lamp.
    per_intensity : float or array
        Normal irradiance over intensity without water, Φ(θ) / (r² + R²), 1/m².
    cosine : float or array
        Between the patch's normal and the direction to the lamp; negative behind it.
    """

    r: Operand
    per_intensity: Operand
    cosine: Operand


def patch_past_lamp(
    lamp: Lamp, point: Sequence[Operand], normal: Sequence[Operand], m: Mathematics = NUMPY
) -> PatchPastLamp:
    """Return how a patch sees a lamp.

    Parameters
    ----------
    lamp : Lamp
        A lamp of finite radius R counts as a disc that faces the patch: on its axis the normal
        irradiance of a disc is π L R²/(r² + R²), exactly, and so it stays finite at the lamp.
    point, normal : three floats or arrays
        World coordinates, m; unit vector.
    m : Mathematics
        Elementary functions.

    Examples
    --------
    >>> lamp = Lamp((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), 1.0, radius=0.0)
    >>> patch = patch_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    >>> float(patch.r), float(patch.per_intensity), float(patch.cosine)
    (2.0, 0.25, 1.0)
    """
    r, u = lamp.towards(point, m)
    profile = lamp.profile.value(dot(lamp.axis, u), m)
    return PatchPastLamp(r, profile / (r * r + lamp.radius * lamp.radius), 0.0 - dot(normal, u))


def surface_irradiance(
    lamp: Lamp, patch: PatchPastLamp, c: Operand, cp: Operand, m: Mathematics = NUMPY
) -> tuple[Operand, Operand]:
    """Irradiance on a patch: unscattered, and scattered forward on the way.

    Parameters
    ----------
    lamp : Lamp
    patch : PatchPastLamp
        Arrays need a last axis of 1 for the bands.
    c, cp : array, shape (n,)
        Extinction with and without the forward peak, 1/m (:class:`.LampWater`).
    m : Mathematics
        Elementary functions.

    Returns
    -------
    tuple of array, shape (..., n)
        In the unit of the intensity per m²; none from behind.

    Examples
    --------
    >>> lamp = Lamp((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), 1.0)
    >>> patch = patch_past_lamp(lamp, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    >>> [round(float(E), 4) for E in surface_irradiance(lamp, patch, 0.5, 0.2)]
    [0.092, 0.0756]
    """
    falling = lamp.intensity * patch.per_intensity * m.maximum(patch.cosine, 0.0)
    direct = m.exp(-c * patch.r)
    return falling * direct, falling * m.maximum(m.exp(-cp * patch.r) - direct, 0.0)
