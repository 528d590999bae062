"""Pictures of what a flat surface mirrors or lets through, and where waves show what is in them.

A ray that a flat surface mirrors goes on as if it came straight from the mirror image of the camera
above the water. So one picture from there, of the water below, holds all that is mirrored. What
lies in the air is in a picture from the camera, where refraction at a flat surface puts it. A wave
turns the ray: what it meets is then looked for where that lies in the picture, at the distance that
the picture itself has near there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .refraction import direction_in_air, fraction_in_air, lifted_height

_LEAST = 1e-6
_RATIO, _LOOKS = 2.0, 2
_STEPS = tuple(8.0 / _RATIO**k for k in range(6))
"""Distances from the surface, m, at which a ray is looked for behind what the picture shows."""
_STEPS_IN_AIR = tuple(8.0 / _RATIO**k for k in range(8))
"""The same in the air: posts and hulls stand in the surface."""
_FARTHEST = 3e-4  # 1/m: what is farther away counts as there, for single precision
_LEVEL = 0.0, 0.0, 1.0


@dataclass(frozen=True)
class ReflectedView:
    """Places of the picture of a pinhole at the mirror image of a camera."""

    eye: Sequence[Operand]  #: The mirror image, m, above the surface.
    #: Columns from the left and rows from below are d·right/d·ahead and d·up/d·ahead, for a
    #: direction d from the eye.
    right: Sequence[Operand]
    up: Sequence[Operand]
    ahead: Sequence[Operand]  #: Unit vector, the axis.
    #: Size of the picture; 0 if there is none.
    columns: Operand
    rows: Operand

    def place(
        self, d: Sequence[Operand], m: Mathematics = NUMPY
    ) -> tuple[Operand, Operand, Operand]:
        """Column and row of a direction, in texels from the first's middle, and 1 if inside."""
        depth = dot(d, self.ahead)
        near = 1.0 / m.maximum(depth, _LEAST)
        h, v = dot(d, self.right) * near, dot(d, self.up) * near
        inside = m.less(_LEAST, depth)
        for x, size in ((h, self.columns), (v, self.rows)):
            inside = inside * m.less(0.0, x) * m.less(x, size)
        return (
            m.clamp(h - 0.5, 0.0, m.maximum(self.columns - 1.0, 0.0)),
            m.clamp(v - 0.5, 0.0, m.maximum(self.rows - 1.0, 0.0)),
            inside,
        )

    def towards(
        self,
        place: Sequence[Operand],
        down: Sequence[Operand],
        nearness: Operand,
        m: Mathematics = NUMPY,
    ) -> list[Operand]:
        """Direction from the eye to what a ray meets.

        ``place`` is where the ray leaves the surface, ``down`` its direction from there on,
        ``nearness`` one over the distance of what it meets from there, 1/m.
        """
        del m
        return [(p - e) * nearness + d for p, e, d in zip(place, self.eye, down, strict=True)]

    def found(
        self,
        place: Sequence[Operand],
        down: Sequence[Operand],
        nearness: Callable[[Operand, Operand], Operand],
        m: Mathematics = NUMPY,
    ) -> tuple[Operand, Operand, Operand]:
        """Place in the picture of what a ray meets that a wave has mirrored, as of :meth:`place`.

        The ray is followed over the picture in a few steps; what hides behind others is not met.

        ``place`` is where the ray leaves the surface, ``down`` its direction from there on;
        ``nearness`` tells what the picture has at a column and row.
        """
        return _followed(self, self, place, down, nearness, m)

    def at(
        self, place: Sequence[Operand], down: Sequence[Operand], t: float, m: Mathematics = NUMPY
    ) -> tuple[list[Operand], Operand]:
        """Direction from the eye to a point of a ray, and how far that lies beyond the surface."""
        d = [p - e + t * x for p, e, x in zip(place, self.eye, down, strict=True)]
        return d, m.sqrt(dot(d, d)) * (1.0 - self.eye[2] / m.maximum(-d[2], _LEAST))

    def nearness_from(
        self, place: Sequence[Operand], d: Sequence[Operand], nearness: Operand, m: Mathematics
    ) -> Operand:
        """One over the distance from a place of what is seen in a direction, 1/m.

        ``nearness`` is that from where the direction meets the surface.
        """
        to_surface = self.eye[2] / m.maximum(-d[2], _LEAST)
        near = 1.0 / m.sqrt(dot(d, d))
        way = [
            (e + to_surface * x - p) * nearness + x * near
            for p, e, x in zip(place, self.eye, d, strict=True)
        ]
        return nearness / m.maximum(m.sqrt(dot(way, way)), _LEAST)


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
        """Place in the picture of what a ray meets, as of :meth:`ReflectedView.found`."""
        return _followed(self.picture, self, place, up, nearness, m, _STEPS_IN_AIR)

    def nearness_from(
        self, place: Sequence[Operand], d: Sequence[Operand], nearness: Operand, m: Mathematics
    ) -> Operand:
        """As :meth:`ReflectedView.nearness_from`."""
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


def _followed(
    picture: ReflectedView,
    view: ReflectedView | RefractedView,
    place: Sequence[Operand],
    way: Sequence[Operand],
    nearness: Callable[[Operand, Operand], Operand],
    m: Mathematics = NUMPY,
    steps: Sequence[float] = _STEPS,
) -> tuple[Operand, Operand, Operand]:
    """Place in a picture of what a ray meets beyond the surface, as of :meth:`ReflectedView.place`.

    Arguments as of :meth:`ReflectedView.found`; ``steps`` are distances from the surface, m, at
    which the ray is looked for, the farthest first.
    """
    q: Operand = 0.0
    # The nearest of these steps comes last, and holds.
    for t in steps:
        d, beyond = view.at(place, way, t, m)
        h, v, inside = picture.place(d, m)
        near = nearness(h, v) * inside
        met = m.less(1.0, near * beyond) * m.less(near * (beyond - t / _RATIO), 1.0)
        q = m.select(met, near, q)
    for _ in range(_LOOKS):
        d = view.towards(place, way, q, m)
        h, v, inside = picture.place(d, m)
        near = view.nearness_from(place, d, nearness(h, v) * inside, m)
        q = m.select(m.less(0.0, near), near, q)  # open water, or the sky, is no better guess
    return picture.place(view.towards(place, way, q, m), m)
