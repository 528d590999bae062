"""A lamp behind a flat port, whose profile was measured in air."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from .profile import LampProfile

_GRAZING = 0.02
"""Cosine in air below which light at the port counts as so much: flat, not without end."""
_STEPS = 4001


@dataclass(frozen=True)
class BehindFlatPort(LampProfile):
    """Profile in water of a lamp that shines through a flat port.

    Snell's law at the port narrows it, sin θ_w = sin θ_a / n, and the intensity gains
    n² cos θ_w / cos θ_a, so that the power stays: what the port reflects, some 6 % on the axis
    and more at its side, is not counted. There is no light beyond the critical angle.

    Raises
    ------
    InputError
        If the index is not above 1.
    """

    profile: LampProfile
    n: float

    def __post_init__(self) -> None:
        if not self.n > 1:
            raise InputError(f"port: the refractive index must be above 1, got {self.n:g}")

    @property
    def edge(self) -> float:
        """Cosine of the refracted edge, or of the critical angle."""
        inner = self.profile.edge
        sine2 = 1.0 if inner is None else 1.0 - inner * inner
        return math.sqrt(1.0 - sine2 / self.n**2)

    @property
    def solid_angle(self) -> float:
        """By quadrature over the cone, sr."""
        # Even in the square of the angle from the rim, where it is steepest.
        rim = math.acos(self.edge)
        theta = rim * (1.0 - np.linspace(1.0, 0.0, _STEPS) ** 2)
        values = np.asarray(self.value(np.cos(theta))) * np.sin(theta)
        return 2.0 * math.pi * float(np.trapezoid(values, theta))

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return that of the angle in air times the gain."""
        n2 = self.n * self.n
        sine2 = n2 * (1.0 - cosine * cosine)
        air = m.sqrt(m.maximum(1.0 - sine2, 0.0))
        passes = m.less(sine2, 1.0) * m.less(0.0, cosine)
        return self.profile.value(air, m) * passes * cosine * n2 / m.maximum(air, _GRAZING)
