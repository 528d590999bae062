"""How the light of a lamp is spread over directions.

A profile is a function of the cosine of the angle θ from the lamp's axis, without unit; the
radiant intensity is its value times the lamp's. Its integral over the sphere, the solid
angle, turns a power into that intensity. Values come over any :class:`.Mathematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..spectra.spectrum import read_table, shipped_table

_STEP = 1e-4
"""Of the cosine, over which a table that ends above zero falls to zero."""
_NARROWEST_BLEND = 1e-4
"""Of the cosine, over which the edge of a spot rises at least; Blender's own bound in EEVEE."""
_BRIGHTEST = 1e9
_BEAM, _BEAM_STEPS = 0.1, 1801
_NARROWEST = 1e-12  # square of the sine of half the angle of an edge
NO_EDGE = -2.0
"""In place of the cosine of an edge, where a lamp may or may not have one."""


class LampProfile:
    """Angular profile of a lamp, symmetric about its axis."""

    def sampled(self, count: int) -> NDArray[np.float64]:
        """Values at so many places of :func:`sample_place`, for a table that is looked up."""
        # The last is doubled: beyond the edge a look-up is no mean with what is within.
        fractions = np.minimum(np.arange(count) / (count - 2.0), 1.0) ** 2
        return np.asarray(self.value(1.0 - 2.0 * float(_width(self.edge)) * fractions))

    @property
    def edge(self) -> Operand | None:
        """Cosine of the half angle of the cone outside which there is no light, 0 to 1.

        None where there is no such cone, or one wider than a half space.
        """
        return None

    @property
    def beam(self) -> float:
        """Cosine of the angle outside which it is below a tenth of its highest; -1 without one.

        Examples
        --------
        >>> round(math.degrees(math.acos(SpotProfile(math.radians(60.0), 0.3).beam)), 1)
        29.1
        """
        widest = math.pi if self.edge is None else math.acos(self.edge)
        angles = np.linspace(0.0, widest, _BEAM_STEPS)
        values = np.asarray(self.value(np.cos(angles)))
        last = int(np.flatnonzero(values >= _BEAM * values.max())[-1])
        return float(np.cos(angles[last]))

    @property
    def solid_angle(self) -> Operand:
        """Integral of the profile over the sphere, sr."""
        raise NotImplementedError

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at the cosine of the angle from the axis."""
        raise NotImplementedError


def sample_place(
    cosine: Operand, count: int, m: Mathematics = NUMPY, edge: Operand | None = None
) -> Operand:
    """Place, 0 to count - 1, of a cosine among the samples of :meth:`LampProfile.sampled`.

    They are even in the sine of half the angle: fine on the axis, where lamps are bright. With the
    cosine of an edge, :data:`NO_EDGE` for none, the last but one is there: a beam of any width has
    them all.
    """
    fraction = m.clamp((0.5 - 0.5 * cosine) / _width(edge, m), 0.0, 1.0)
    return m.sqrt(fraction) * (count - (1.0 if edge is None else 2.0))


def _width(edge: Operand | None, m: Mathematics = NUMPY) -> Operand:
    """Square of the sine of half the angle of an edge; 1 without one."""
    return 1.0 if edge is None else m.clamp(0.5 - 0.5 * edge, _NARROWEST, 1.0)


@dataclass(frozen=True)
class IsotropicProfile(LampProfile):
    """The same in every direction: Blender's point light.

    Examples
    --------
    >>> round(IsotropicProfile().solid_angle / math.pi, 6)
    4.0
    """

    @property
    def solid_angle(self) -> float:
        """4π sr."""
        return 4.0 * math.pi

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return 1."""
        del m
        return 0.0 * cosine + 1.0


@dataclass(frozen=True)
class SpotProfile(LampProfile):
    """Blender's spot light.

    With k = cos(size / 2), x = (cos θ - k) / ((1 - k) blend) held between 0 and 1, the value
    is the smoothstep x² (3 - 2 x), as Cycles and EEVEE have it. It is 1 on the axis, where the
    intensity is that of a point light of the same power: P/4π.

    Raises
    ------
    InputError
        If one is out of its range.

    Examples
    --------
    >>> spot = SpotProfile(math.radians(90), 0.5)
    >>> spot.value(np.cos(np.radians([0, 40, 45]))).round(3)
    array([1.   , 0.356, 0.   ])
    """

    size: float  #: Full angle of the cone, rad, 0 to π.
    blend: float = 0.15  #: 0 to 1: the fraction of the cone's cosines over which the edge rises.

    def __post_init__(self) -> None:
        if not 0 < self.size <= math.pi:
            raise InputError(
                f"spot: the full angle must be above 0 and at most π rad, got {self.size:g}"
            )
        if not 0 <= self.blend <= 1:
            raise InputError(f"spot: the blend must be 0 to 1, got {self.blend:g}")

    @property
    def edge(self) -> float:
        """Cosine of half the full angle."""
        return math.cos(self.size / 2.0)

    @property
    def _inverse_width(self) -> float:
        # A cone narrower than the bound blends over all of itself.
        whole = 2.0 * math.sin(self.size / 4.0) ** 2
        return 1.0 / max(whole * self.blend, min(_NARROWEST_BLEND, whole))

    @property
    def solid_angle(self) -> float:
        """Of the cone, less half of the rising edge, sr."""
        whole = 2.0 * math.sin(self.size / 4.0) ** 2
        return 2.0 * math.pi * (whole - 0.5 / self._inverse_width)

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the smoothstep."""
        x = m.clamp((cosine - self.edge) * self._inverse_width, 0.0, 1.0)
        return x * x * (3.0 - 2.0 * x)


@dataclass(frozen=True)
class SpreadProfile(LampProfile):
    """Blender's area light with a spread below 180°: a matt surface behind the slats of a grid.

    With T the tangent of half the spread, the value is cos θ - sin θ / T, from 1 on the axis to 0
    at half the spread, as Cycles has it. Its light is that of the matt surface without a grid,
    only narrower.

    Raises
    ------
    InputError
        If it is out of its range.

    Examples
    --------
    >>> round(SpreadProfile(math.radians(120)).solid_angle / math.pi, 4)
    0.3954
    """

    spread: float  #: Full angle, rad, above 0 and below π.

    def __post_init__(self) -> None:
        if not 0 < self.spread < math.pi:
            raise InputError(
                f"area lamp: the spread must be between 0 and π rad, got {self.spread:g}"
            )

    @property
    def edge(self) -> float:
        """Cosine of half the spread."""
        return math.cos(self.spread / 2.0)

    @property
    def solid_angle(self) -> float:
        """π (1 - h / tan h) of half the spread h, sr."""
        half = self.spread / 2.0
        return math.pi * (1.0 - half / math.tan(half))

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the fraction of the light that passes the grid, times the cosine."""
        sine = m.sqrt(m.maximum(1.0 - cosine * cosine, 0.0))
        return m.maximum(cosine - sine * (1.0 / math.tan(self.spread / 2.0)), 0.0)


@dataclass(frozen=True, eq=False)
class TableProfile(ComparedByContent, LampProfile):
    """Measured profile, linear in the cosine between its points; make it of angles.

    A shader evaluates two or three nodes a point: thin a long table out
    (:meth:`of_angles`, ``points``).
    """

    cosines: NDArray[np.float64]  #: Increasing, -1 to 1; the last is 1, (n,).
    values: NDArray[np.float64]  #: Not negative, (n,).

    @classmethod
    def of_angles(
        cls,
        angles: ArrayLike,
        values: ArrayLike,
        points: int | None = None,
        place: str = "lamp profile",
    ) -> TableProfile:
        """Make it of angles from the axis, degrees; there is no light beyond the last.

        Intensities are in any unit, the highest becomes 1; of the points at most so many are kept,
        those that matter most.

        Raises
        ------
        InputError
            If the angles do not start at 0, do not increase or pass 180, a value is
            negative or not finite, or there is no light.
        """
        theta = np.atleast_1d(np.asarray(angles, dtype=np.float64))
        found = np.atleast_1d(np.asarray(values, dtype=np.float64))
        if theta.ndim != 1 or theta.shape != found.shape or len(theta) < 2:
            raise InputError(f"{place}: give one value per angle, at least two")
        if theta[0] != 0 or np.any(np.diff(theta) <= 0) or not theta[-1] <= 180:
            raise InputError(
                f"{place}: angles must start at 0, increase and end at 180° at most; "
                f"got {theta[0]:g} to {theta[-1]:g}; sort the rows, no doubles"
            )
        bad = ~((found >= 0) & (found <= _BRIGHTEST))
        if bad.any():
            raise InputError(
                f"{place}: {found[bad][0]:g} at {theta[bad][0]:g}° is negative or too large to be "
                "true; correct that row"
            )
        if not found.max() > 0:
            raise InputError(f"{place}: the lamp emits no light; give a value above 0")
        cosines, heights = np.cos(np.radians(theta))[::-1], (found / found.max())[::-1]
        # Angles that differ too little for their cosines to differ are one point.
        keep = np.concatenate([[True], np.diff(cosines) > 1e-12])
        cosines, heights = cosines[keep], heights[keep]
        if heights[0] > 0 and cosines[0] > -1 + _STEP:
            cosines = np.concatenate([[cosines[0] - _STEP], cosines])
            heights = np.concatenate([[0.0], heights])
        if points is not None:
            kept = _most_important(cosines, heights, max(points, 2))
            cosines, heights = cosines[kept], heights[kept]
        return cls(constant(cosines), constant(heights))

    @property
    def edge(self) -> float | None:
        """Cosine where the table reaches zero, if that is within a half space."""
        lit = int(np.argmax(self.values > 0))
        if lit == 0 or self.cosines[lit - 1] <= 0:
            return None
        return float(self.cosines[lit - 1])

    @property
    def solid_angle(self) -> float:
        """Exact for the linear interpolation, sr."""
        held = self.values[0] * (self.cosines[0] + 1.0) + self.values[-1] * (1 - self.cosines[-1])
        return 2.0 * math.pi * (float(np.trapezoid(self.values, self.cosines)) + float(held))

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Interpolate; the ends are held."""
        return m.interpolate(cosine, self.cosines, self.values)


LAMBERT = TableProfile(constant([0.0, 1.0]), constant([0.0, 1.0]))
"""The cosine from the axis, of half a space: a matt surface."""


def rov_lamp() -> TableProfile:
    """Measured profile of a lamp of a remotely operated vehicle (Song et al. 2020).

    Examples
    --------
    >>> float(rov_lamp().value(math.cos(math.radians(40))))
    0.5
    """
    table = shipped_table("rov_lamp_profile.csv")
    return TableProfile.of_angles(table.columns["angle_deg"], table.columns["intensity"])


def profile_from_csv(path: str, points: int | None = None) -> TableProfile:
    """Read a profile ``angle_deg,intensity``.

    Raises
    ------
    InputError
        If the file cannot be used.
    """
    table = read_table(path, ("angle_deg", "intensity"))
    columns = table.columns
    return TableProfile.of_angles(columns["angle_deg"], columns["intensity"], points, str(path))


def _most_important(x: NDArray, y: NDArray, count: int) -> list[int]:
    """Indices of the points that, added one by one where the line errs most, draw it best."""
    kept = [0, len(x) - 1]
    while len(kept) < min(count, len(x)):
        error = np.abs(np.interp(x, x[kept], y[kept]) - y)
        worst = int(np.argmax(error))
        if error[worst] <= 1e-9:
            break
        kept = sorted([*kept, worst])
    return kept
