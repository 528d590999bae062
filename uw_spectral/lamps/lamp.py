"""A lamp in the water, and where a ray passes it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, added_up, dot
from ..table import Lookup
from .angular_spread import OBJECT
from .lamp_shadow import lit, scattered_lit
from .profile import IsotropicProfile, LampProfile

NEAREST = 1e-3
"""Distance of a ray from a lamp, over that of its origin, below which it counts as so much: a
pixel is as wide. A ray that meets the lamp sees the lamp, not the water around it."""
_SMALLEST = 1e-6  # m
_COTANGENT = 1.0 / math.tan(OBJECT)


@dataclass(frozen=True, eq=False)
class LitPart:
    """A part of the objects that a lamp stands for, which shine on what is near them."""

    #: World coordinates, m; unit vector about which it is Lambertian.
    position: Sequence[Operand]
    axis: Sequence[Operand]
    fraction: Operand  #: Of the lamp's intensity, (n,).
    radius: Operand  #: m.
    shadow: Lookup | None = None  #: How far it shines, a map of :data:`.PART_SIDE`.


class Parts(Protocol):
    """The parts of what a lamp stands for, of arrays or in a node tree."""

    def total(self, terms: Callable[[LitPart], tuple[Operand, ...]]) -> tuple[Operand, ...]:
        """Add up terms of each."""
        ...


class LitParts(tuple[LitPart, ...]):
    """Those of arrays."""

    def total(self, terms: Callable[[LitPart], tuple[Operand, ...]]) -> tuple[Operand, ...]:
        """Add up terms of each."""
        return added_up(map(terms, self))


@dataclass(frozen=True, eq=False)
class Lamp:
    """A torch, a strobe or the light of a vehicle, of n bands."""

    position: Sequence[Operand]  #: World coordinates, m, z up.
    axis: Sequence[Operand]  #: Unit vector it shines along.
    #: Radiant intensity where the profile is 1 (:func:`.radiant_intensity`), (n,).
    intensity: Operand
    profile: LampProfile = field(default_factory=IsotropicProfile)  #: Of the angle from the axis.
    radius: Operand = 0.01  #: Of what emits, m; nothing is nearer to the lamp than this.
    seen: Operand = 1.0  #: 1 where the lamp itself is seen, 0 where only its light is.
    #: How far it shines into the water (:func:`.shadow_map`); everywhere without.
    shadow: Lookup | None = None
    #: 1 where it stands for objects that throw light back (:func:`.virtual_point_lights`).
    virtual: Operand = 0.0
    unblocked: Operand = 0.0  #: 1 where objects do not keep its light from others.
    #: How high over the water it seems to be, m; 0 in the water (:mod:`.over_water`).
    dry: Operand = 0.0
    stands: Sequence[Operand] | None = None  #: Where it is, m, if that is not where it seems to be.
    #: What of its scattered light objects leave; without, what they leave of the other.
    soft: Lookup | None = None
    #: Of the objects that it stands for: what is not scattered comes from these to others.
    parts: Parts | None = None

    @property
    def own_place(self) -> Sequence[Operand]:
        """Where it is, m."""
        return self.position if self.stands is None else self.stands

    @property
    def known_parts(self) -> LitParts:
        """Its parts where they are arrays."""
        return self.parts if isinstance(self.parts, LitParts) else LitParts()

    def of_bands(self, indices: Sequence[int] | NDArray[np.intp]) -> Lamp:
        """Return the lamp in some of its bands."""
        parts = LitParts(replace(x, fraction=x.fraction[indices]) for x in self.known_parts)
        return replace(self, intensity=self.intensity[indices], parts=parts or None)

    def lit(self, place: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Fraction of its light that reaches a place seen from it, m; 1 where nothing is known."""
        reached = 1.0 if self.shadow is None else lit(self.shadow, place, m)
        return reached * self.under(place[2], m) if self.shines_in else reached

    @property
    def shines_in(self) -> bool:
        """Whether it may shine into the water from above."""
        return not isinstance(self.dry, float | int) or self.dry > 0.0

    def under(self, z: Operand, m: Mathematics = NUMPY) -> Operand:
        """1 where a place at a height seen from it is in the water, m; what is in air is dark."""
        return m.less(self.dry, m.maximum(0.0 - z, _SMALLEST)) if self.shines_in else 1.0

    def wet(self, r: Operand, z: Operand, m: Mathematics = NUMPY) -> Operand:
        """Length in the water of the way of light to a place, of r from it and at a height, m."""
        if not self.shines_in:
            return r
        return r * m.maximum(1.0 - self.dry / m.maximum(0.0 - z, self.dry + _SMALLEST), 0.0)

    def scattered_lit(self, place: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Fraction of its scattered light that reaches a place, likewise."""
        if self.soft is None:
            return self.lit(place, m)
        reached = scattered_lit(self.soft, place, m)
        return reached * self.under(place[2], m) if self.shines_in else reached

    def towards(
        self, point: Sequence[Operand], m: Mathematics = NUMPY
    ) -> tuple[Operand, tuple[Operand, Operand, Operand]]:
        """Distance of a point, at least the radius, and the unit vector to it (0 at the lamp)."""
        x, y, z = (point[i] - self.position[i] for i in range(3))
        r2 = x * x + y * y + z * z
        r = m.sqrt(m.maximum(r2, self.radius * self.radius + _SMALLEST * _SMALLEST))
        return r, (x / r, y / r, z / r)


@dataclass(frozen=True, eq=False)
class RayPastLamp:
    """A ray and a lamp: what all bands share."""

    t0: Operand  #: Distance along the ray to its point nearest to the lamp, m; negative behind.
    h: Operand  #: Distance of that point from the lamp, m; at least its radius.
    #: Distances of the ends of the path from that point, along the ray, m.
    near: Operand
    far: Operand
    first: Operand  #: Where light begins to count, likewise; see :func:`ray_past_lamp`.
    offset: Operand  #: Distance of the ray from the middle of the lamp, m.
    #: Cosine between the lamp's axis and the direction to the nearest point, and the ray.
    across: Operand
    along: Operand
    #: The nearest point as seen from the lamp, m; the direction of the ray.
    nearest: Sequence[Operand]
    w: Sequence[Operand]
    before_surface: bool = False  #: Whether no light comes from beyond the end.

    def place(self, s: Operand) -> tuple[Operand, ...]:
        """Return the place at a distance along the ray from the nearest, as the lamp sees it."""
        return tuple(x + s * along for x, along in zip(self.nearest, self.w, strict=True))


def ray_past_lamp(
    lamp: Lamp,
    origin: Sequence[Operand],
    w: Sequence[Operand],
    P: Operand,
    m: Mathematics = NUMPY,
    *,
    before_surface: bool = False,
) -> RayPastLamp:
    """Return where a ray passes a lamp.

    ``P`` is the length of the ray, m, finite: 1e6 for one without end. With ``before_surface`` an
    object is at the end, which keeps light from beyond it away: light that objects throw back
    counts where it is bent by more than :data:`OBJECT`, what is bent by less is that of the object.
    """
    to_lamp = [lamp.position[i] - origin[i] for i in range(3)]
    t0 = dot(to_lamp, w)
    x, y, z = (w[i] * t0 - to_lamp[i] for i in range(3))
    least = m.maximum(lamp.radius, NEAREST * m.absolute(t0)) + _SMALLEST
    offset = m.sqrt(x * x + y * y + z * z)
    h = m.maximum(offset, least)
    across = dot(lamp.axis, (x / h, y / h, z / h))
    along = dot(lamp.axis, w)
    near = first = 0.0 - t0
    if before_surface:
        first = m.maximum(near, 0.0 - h * (_COTANGENT / (lamp.virtual + _SMALLEST)))
    return RayPastLamp(
        t0, h, near, P - t0, first, offset, across, along, (x, y, z), tuple(w), before_surface
    )


def lamp_disc(lamp: Lamp, ray: RayPastLamp, c: Operand) -> Operand:
    """Radiance of the lamp itself where a ray meets it, as a disc that faces the camera."""
    return lamp.intensity * np.exp(-c * np.maximum(ray.t0, 0.0)) * disc_seen(lamp, ray)


def disc_seen(lamp: Lamp, ray: RayPastLamp, m: Mathematics = NUMPY) -> Operand:
    """Radiance of that disc over the intensity, without water, 1/m²; 0 beside it."""
    met = m.less(ray.offset, lamp.radius) * m.less(ray.near, 0.0) * m.less(0.0, ray.far)
    shining = lamp.profile.value(0.0 - ray.along, m) * met * lamp.seen
    return shining / (math.pi * lamp.radius * lamp.radius + _SMALLEST * _SMALLEST)
