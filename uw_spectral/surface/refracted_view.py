"""Where a picture of the air, taken through a flat surface, shows what rays meet that waves turn.

The picture is that of a pinhole in the water that sees objects in the air where refraction at a
flat surface puts them. A wave lets a ray out into another direction: what it meets there is looked
for where that seems to be in the picture, at the distance that the picture itself has near there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .reflected_view import ReflectedView, followed
from .refraction import direction_in_air, fraction_in_air, lifted_height

_LEAST = 1e-6
_FARTHEST = 3e-4  # 1/m: what is farther away counts as there, for single precision
_LEVEL = 0.0, 0.0, 1.0
_STEPS = tuple(8.0 / 2.0**k for k in range(8))
"""Distances from the surface, m, at which a ray is looked for; posts and hulls stand in it."""


@dataclass(frozen=True)
class RefractedView:
    """The air as an eye in the water sees it through a flat surface."""

    picture: ReflectedView
    index: Operand

    def at(
        self, place: Sequence[Operand], up: Sequence[Operand], t: float, m: Mathematics = NUMPY
    ) -> tuple[list[Operand], Operand]:
        """Direction in which a point of a ray is seen, and its way in the air from there, m.

        ``place`` is where the ray leaves the surface, ``up`` its direction in the air, t the
        distance of the point from there, m.
        """
        d, air = self._bent(place, up, 1.0 / t, m)
        return d, air * t

    def towards(
        self,
        place: Sequence[Operand],
        up: Sequence[Operand],
        nearness: Operand,
        m: Mathematics = NUMPY,
    ) -> list[Operand]:
        """Direction in the water in which a flat surface shows what a ray meets.

        Arguments as of :meth:`at`; ``nearness`` is one over the distance of what it meets, 1/m.
        """
        return self._bent(place, up, nearness, m)[0]

    def found(
        self,
        place: Sequence[Operand],
        up: Sequence[Operand],
        nearness: Callable[[Operand, Operand], Operand],
        m: Mathematics = NUMPY,
    ) -> tuple[Operand, Operand, Operand]:
        """Place in the picture of what a ray meets, as of :meth:`.ReflectedView.found`."""
        return followed(self.picture, self, place, up, nearness, m, _STEPS)

    def nearness_from(
        self, place: Sequence[Operand], d: Sequence[Operand], nearness: Operand, m: Mathematics
    ) -> Operand:
        """One over the distance from a place of what is seen in a direction, 1/m.

        ``nearness`` is that from where the direction meets the surface.
        """
        length = m.sqrt(dot(d, d))
        to_surface = -self.picture.eye[2] / m.maximum(d[2], _LEAST)
        air = direction_in_air([x / length for x in d], _LEVEL, self.index, m)
        way = [
            (e + to_surface * x - p) * nearness + a
            for p, e, x, a in zip(place, self.picture.eye, d, air, strict=True)
        ]
        return nearness / m.maximum(m.sqrt(dot(way, way)), _LEAST)

    def _bent(
        self, place: Sequence[Operand], up: Sequence[Operand], nearness: Operand, m: Mathematics
    ) -> tuple[list[Operand], Operand]:
        """Direction to where a point seems to be, and its way in the air over its distance.

        All lengths are divided by that distance.
        """
        near = m.maximum(nearness, _FARTHEST)
        x, y, _ = ((p - e) * near + a for p, e, a in zip(place, self.picture.eye, up, strict=True))
        depth, height = -self.picture.eye[2] * near, m.maximum(up[2], _LEAST)
        distance = m.sqrt(x * x + y * y)
        fraction = fraction_in_air(distance, depth, height, self.index, m)
        air = m.sqrt(fraction * fraction * (x * x + y * y) + height * height)
        return [x, y, depth + lifted_height(depth, fraction, m)], air
