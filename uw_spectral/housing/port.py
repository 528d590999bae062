"""Ports: a flat window or a dome between the air around a lens and the water.

Both are symmetric about an axis through the lens's entrance pupil: the normal of a flat port, and
the line from the centre of a dome to the pupil. A ray stays in the plane of its direction and that
axis, so tracing it is a formula of one angle, and aiming it at a point is one equation
(A. Agrawal et al., CVPR 2012, 3346; M. She et al., ISPRS J. 2022 for the dome).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..surface.refraction import fresnel_reflectance
from .media import GLASSES, Glass

Array = NDArray[np.float64]
Vector = tuple[float, float, float]

_STEPS = 100
_ROUNDING = 4e-16
_FORWARD = (0.0, 0.0, 1.0)


class Port:
    """A port in the axes of the camera, its pupil at the origin, lengths in m."""

    glass: Glass  #: What it is made of.

    @property
    def axis(self) -> Array:
        """Unit vector of the axis of symmetry, shape (3,); forward by default."""
        return np.array(_FORWARD)

    def leaving(self, angle: Array, glass: Array, water: Array) -> tuple[Array, Array, Array]:
        """Trace a ray from the pupil, by its angle to the axis in air, to the outer face.

        Three values: its place there along the axis and across it, and its angle to the axis in the
        water. NaN comes of rays that do not meet the port.
        """
        raise NotImplementedError

    def angle_towards(self, along: Array, across: Array, glass: Array, water: Array) -> Array:
        """Angle in air of the ray that reaches a point in the water; NaN if none does."""
        raise NotImplementedError

    def transmittance(self, angle: Array, glass: Array, water: Array) -> Array:
        """Fraction of the light that both faces let through, by the angle to the axis in air."""
        raise NotImplementedError

    def passes(self, points: Array) -> NDArray[np.bool_]:
        """Whether points of the outer face, shape (..., 3), are glass, not frame; here all."""
        return np.isfinite(points).all(axis=-1)


@dataclass(frozen=True)
class FlatPort(Port):
    """A plane window.

    Raises
    ------
    InputError
        If the pupil is not behind the port, or the port does not look forward.

    Examples
    --------
    >>> port = FlatPort(0.03, 0.01)
    >>> along, across, angle = port.leaving(np.radians(45.0), np.array(1.5168), np.array(1.34))
    >>> float(along), round(float(across), 5), round(float(np.degrees(angle)), 2)
    (0.04, 0.03527, 31.85)
    """

    distance: float  #: From the entrance pupil to the inner face along its normal, m.
    thickness: float  #: m; 0 is a window that does not count.
    glass: Glass = field(default_factory=lambda: GLASSES["BK7"])
    #: Outwards, in the camera's axes, of any length; a tilt turns it away from (0, 0, 1).
    normal: Vector = _FORWARD

    def __post_init__(self) -> None:
        if not 0 < self.distance < math.inf:
            raise InputError(
                f"flat port: the entrance pupil must be behind it, got a distance of "
                f"{self.distance:g} m"
            )
        if not 0 <= self.thickness < math.inf:
            raise InputError(f"flat port: a thickness of {self.thickness:g} m is none")
        if not (all(map(math.isfinite, self.normal)) and self.normal[2] > 0):
            raise InputError(f"flat port: its normal {self.normal} must look forward, z above 0")

    @classmethod
    def tilted(
        cls,
        distance: float,
        thickness: float,
        glass: Glass,
        *,
        degrees: float,
        towards: float = 0.0,
    ) -> FlatPort:
        """Return a port whose normal is turned away from the optical axis.

        The normal leans ``towards`` an angle from the right of the picture (0) to below (90); both
        in degrees.
        """
        tilt, turn = math.radians(degrees), math.radians(towards)
        side = math.sin(tilt)
        normal = (side * math.cos(turn), side * math.sin(turn), math.cos(tilt))
        return cls(distance, thickness, glass, normal)

    @property
    def axis(self) -> Array:
        """The normal."""
        normal = np.array(self.normal)
        return normal / np.linalg.norm(normal)

    def leaving(self, angle: Array, glass: Array, water: Array) -> tuple[Array, Array, Array]:
        """As of :class:`Port`."""
        tangent = np.tan(np.where(angle < math.pi / 2, angle, np.nan))
        across = self.distance * tangent + self.thickness * _slope(tangent, glass)[0]
        along = np.full_like(across, self.distance + self.thickness)
        return along, across, np.arctan(_slope(tangent, water)[0])

    def angle_towards(self, along: Array, across: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`.

        The distance from the axis is a concave function of the tangent: Newton's method from
        below never oversteps, and needs no bounds.
        """
        beyond = along - (self.distance + self.thickness)
        beyond = np.where(beyond >= 0, beyond, np.nan)
        tangent = np.zeros(np.broadcast(beyond, across, glass, water).shape)
        for _ in range(_STEPS):
            in_glass, of_glass = _slope(tangent, glass)
            in_water, of_water = _slope(tangent, water)
            reached = self.distance * tangent + self.thickness * in_glass + beyond * in_water
            slope = self.distance + self.thickness * of_glass + beyond * of_water
            step = (across - reached) / slope
            tangent = np.maximum(tangent + step, 0.0)
            if not (np.abs(step) > _ROUNDING * (1.0 + tangent)).any():
                break
        return np.arctan(tangent)

    def transmittance(self, angle: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`."""
        outer = np.sqrt(1.0 - (np.sin(angle) / glass) ** 2)
        return _through_faces(np.cos(angle), outer, glass, water)


@dataclass(frozen=True)
class NoPort(Port):
    """Nothing between the lens and the water: what the lens sees is as it was calibrated."""

    glass: Glass = field(default_factory=lambda: Glass.of_index(1.0))

    def leaving(self, angle: Array, glass: Array, water: Array) -> tuple[Array, Array, Array]:
        """As of :class:`Port`: rays begin at the pupil and are not bent."""
        here = np.zeros(np.broadcast(angle, glass, water).shape)
        return here, here, angle + here

    def angle_towards(self, along: Array, across: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`."""
        angle = np.arctan2(across, along)
        return angle + np.zeros(np.broadcast(angle, glass, water).shape)

    def transmittance(self, angle: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`."""
        return np.ones(np.broadcast(angle, glass, water).shape)


def _through_faces(inner: Array, outer: Array, glass: Array, water: Array) -> Array:
    """Fraction of light that two faces let through, by the cosines at them in air and glass."""
    into_air = fresnel_reflectance(inner, glass)
    return (1.0 - into_air) * (1.0 - fresnel_reflectance(outer, water / glass))


def _slope(tangent: Array, index: Array) -> tuple[Array, Array]:
    """Tangent of the angle in a medium by that in air (Snell's law), and its derivative."""
    n2 = index * index
    root = n2 + (n2 - 1.0) * tangent * tangent
    return tangent / np.sqrt(root), n2 / root**1.5


@dataclass(frozen=True)
class DomePort(Port):
    """A spherical shell.

    Raises
    ------
    InputError
        If the pupil is not inside the dome, or a size is none.

    Examples
    --------
    >>> dome = DomePort(0.05, 0.006, pupil=(0.0, 0.0, 0.01))
    >>> _, _, angle = dome.leaving(np.radians(45.0), np.array(1.5168), np.array(1.34))
    >>> round(float(np.degrees(angle)), 2)
    42.54
    """

    radius: float  #: Of the outer face, m.
    thickness: float  #: m; 0 is a shell that does not count.
    glass: Glass = field(default_factory=lambda: GLASSES["BK7"])
    #: Place of the entrance pupil, from the centre of the dome, in the camera's axes, m; (0, 0, 0)
    #: is centred, and z above 0 is too far forward.
    pupil: Vector = (0.0, 0.0, 0.0)
    #: How far the dome reaches to all sides, degrees from the optical axis at its centre.
    half_angle: float = 90.0

    def __post_init__(self) -> None:
        if not 0 < self.radius < math.inf:
            raise InputError(f"dome port: a radius of {self.radius:g} m is none")
        if not 0 <= self.thickness < self.radius:
            raise InputError(
                f"dome port: the thickness must be less than the radius of {self.radius:g} m, got "
                f"{self.thickness:g} m"
            )
        if not self.offset < self.inner_radius:
            raise InputError(
                f"dome port: the entrance pupil lies {self.offset:g} m from the centre, which is "
                f"not inside the inner face of {self.inner_radius:g} m radius"
            )
        if not 0 < self.half_angle <= 180:
            raise InputError(f"dome port: a half angle of {self.half_angle:g}° is not 0 to 180")

    @property
    def inner_radius(self) -> float:
        """Of the inner face, m."""
        return self.radius - self.thickness

    @property
    def offset(self) -> float:
        """Distance of the pupil from the centre, m."""
        return math.hypot(*self.pupil)

    @property
    def axis(self) -> Array:
        """From the centre to the pupil; forward if the dome is centred, where any would do."""
        return np.array(self.pupil) / self.offset if self.offset > 0 else np.array(_FORWARD)

    def leaving(self, angle: Array, glass: Array, water: Array) -> tuple[Array, Array, Array]:
        """As of :class:`Port`.

        Refractive index times distance of the ray from the centre is the same in all media
        (Bouguer), and the ray comes around the centre by the difference of two arcsines.
        """
        turned, invariant = self._at_outer_face(angle, glass)
        along = self.radius * np.cos(turned) - self.offset
        across = self.radius * np.sin(turned)
        return along, across, turned + np.arcsin(invariant / (water * self.radius))

    def angle_towards(self, along: Array, across: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`, by Newton's method within bounds."""
        along = along + self.offset
        far = np.hypot(along, across)
        far = np.where(far >= self.radius, far, np.nan)
        wanted = np.arctan2(across, along)
        angle = np.broadcast_to(wanted, np.broadcast(wanted, far, glass, water).shape).copy()
        low, high = np.zeros_like(angle), np.full_like(angle, math.pi)
        for _ in range(_STEPS):
            turned, invariant = self._at_outer_face(angle, glass)
            at = turned + np.arcsin(invariant / (water * self.radius))
            miss = at - np.arcsin(invariant / (water * far)) - wanted
            low, high = np.where(miss < 0, angle, low), np.where(miss > 0, angle, high)
            step = miss / self._turning(angle, invariant, glass, water, far)
            moved = angle - step
            inside = (moved >= low) & (moved <= high)
            moved = np.where(inside, moved, 0.5 * (low + high))
            changed = np.abs(moved - angle) > _ROUNDING * 4.0
            angle = moved
            if not (changed & np.isfinite(miss)).any():
                break
        return np.where(np.isfinite(far), angle, np.nan)

    def transmittance(self, angle: Array, glass: Array, water: Array) -> Array:
        """As of :class:`Port`."""
        invariant = self.offset * np.sin(angle)
        inner, outer = invariant / self.inner_radius, invariant / (glass * self.radius)
        cosines = np.sqrt(1.0 - inner * inner), np.sqrt(1.0 - outer * outer)
        return _through_faces(*cosines, glass, water)

    def passes(self, points: Array) -> NDArray[np.bool_]:
        """As of :class:`Port`: within the half angle."""
        from_centre = points + np.array(self.pupil)
        least = self.radius * math.cos(math.radians(self.half_angle))
        return from_centre[..., 2] >= least

    def _at_outer_face(self, angle: Array, glass: Array) -> tuple[Array, Array]:
        """Polar angle about the centre where a ray leaves the shell, and its invariant, m."""
        invariant = self.offset * np.sin(angle)
        inside = angle - np.arcsin(invariant / self.inner_radius)
        return (
            inside
            + np.arcsin(invariant / (glass * self.inner_radius))
            - np.arcsin(invariant / (glass * self.radius))
        ), invariant

    def _turning(
        self, angle: Array, invariant: Array, glass: Array, water: Array, far: Array
    ) -> Array:
        """Derivative of the polar angle at a distance by the angle in air."""

        def of(length: Array | float) -> Array:
            return 1.0 / np.sqrt(length * length - invariant * invariant)

        inner, outer = self.inner_radius, self.radius
        change = of(inner) - of(glass * inner) + of(glass * outer)
        change = change - of(water * outer) + of(water * far)
        return 1.0 - self.offset * np.cos(angle) * change
