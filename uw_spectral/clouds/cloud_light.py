"""What clouds do to a pixel: light that they let through, and light that they scatter to it.

Scaled as the closed form of the water is: light that the forward peak of a cloud's matter scatters
counts as unscattered (:class:`.BluntPhase`). What is left scatters widely, and to any order:

- once, of the sun, with its way through all clouds exactly (a closed form for blobs),
- of the water's own diffuse light, as far as it enters along the six directions of the axes,
- and again: of what has been scattered the fraction p that escapes leaves, the rest is scattered
once
  more where it is (Sobolev's escape probability). That sums to a series in closed form.

In light from all sides that is the same everywhere, a cloud that does not absorb is invisible.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..look_up import multilinear_of_columns
from ..mathematics import NUMPY, Mathematics, Operand, dot
from . import density_grid
from .density_grid import Grid
from .gaussian_blob import FAR, GaussianBlob, RayInBlob

STEPS = 8
"""Steps in which the light that a cloud scatters to the camera is added up."""
SPAN = 2.6
"""Standard deviations about the middle that are divided into steps."""
_LEAST = 1e-12
_LAYER = 0.75
ISOTROPIC = 1.0 / (4.0 * math.pi)
"""Phase function of light that is scattered alike to all sides, 1/sr."""
# Depth in m over which light may differ from that in the middle by its decay there.
_DEEPEST_DIFFERENCE = 40.0
ESCAPES = 24
"""Entries of the row of light that leaves a cloud, from its middle outwards."""
_FARTHEST_OUT = 4.5  # standard deviations

Sum = Callable[[int, Callable[[Operand], Sequence[Operand]]], Sequence[Operand]]
"""Adds up terms of 0 to count - 1."""
March = Callable[
    [int, Callable[[Operand, Operand], tuple[Operand, Sequence[Operand]]], Operand],
    Sequence[Operand],
]
"""Adds up the same of a number, and of terms that know the sum of the number before them.

Where the last operand is 0 all are 0, and need not be made.
"""


class Row(Protocol):
    """A few entries, in channels."""

    def at(self, place: Operand) -> Operand:
        """Interpolate linearly between them."""
        ...


class Wide(Protocol):
    """A phase function."""

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at s2 = sin²(angle / 2), 1/sr."""
        ...


@dataclass(frozen=True, eq=False)
class CloudNumbers:
    """What formulas need of a cloud; channels are arrays of three, or vectors of a shader.

    Attributes
    ----------
    middle, rows
        Of :class:`.GaussianBlob`.
    extinction, scaled : channels
        Of its matter where it is densest, with and without the forward peak, 1/m.
    albedo : channels
        Fraction of the scaled extinction that scatters.
    sun : channels
        Normal irradiance of the sun, its forward peak included, in the depth of the middle,
        as it is seen from ``reference``.
    spread, ambient : channels
        Scalar irradiance of the other light, likewise: of a beam along that of the sun which has
        its net downward irradiance, and of the rest, from all sides.
    sun_decay, ambient_decay : channels
        Decay of both with depth, 1/m.
    water : channels
        Decay along the view, 1/m.
    forward : channels
        What water scatters forward from behind the cloud to in front of it, beyond the peak of the
        water's own tables: the cloud blocks that, 1/m.
    transport : channels
        What keeps light from objects below, at density 1, 1/m: it is not scattered forward.
    reference : number
        Distance in m that the light is given for.
    asymmetry, ceiling, peak : numbers
        Of :class:`.BluntPhase`.
    kind : number
        Place of the phase function of its matter among those of :class:`Clouds`.
    escapes : Row, optional
        What :meth:`escaping` is at so many standard deviations from the middle, as a mean over
        all sides; see :func:`with_escapes`.
    grid : Grid, optional
        Its density, if it is none of a blob: ``middle`` and ``rows`` are then those of the blob
        that is most like it.
    """

    middle: Sequence[Operand]
    rows: Sequence[Operand]
    extinction: Operand
    scaled: Operand
    albedo: Operand
    sun: Operand
    spread: Operand
    ambient: Operand
    sun_decay: Operand
    ambient_decay: Operand
    water: Operand
    forward: Operand
    transport: Operand
    transport_albedo: Operand
    reference: Operand
    asymmetry: Operand
    ceiling: Operand
    peak: Operand
    kind: Operand = 0.0
    escapes: Row | None = None
    grid: Grid | None = None

    @property
    def blob(self) -> GaussianBlob:
        """Where it is."""
        return GaussianBlob(self.middle, self.rows)

    def towards_sun(
        self, point: Sequence[Operand], back: Sequence[Operand], m: Mathematics
    ) -> Operand:
        """Integral of the density from a place along the direction to the sun, m."""
        if self.grid is not None:
            return self.grid.towards_sun(point, back, m)
        return self.blob.along(point, back, m).column(FAR, m)

    def from_lamp(
        self, number: Operand, lamp: Sequence[Operand], way: Sequence[Operand], m: Mathematics
    ) -> Operand:
        """Integral of the density from a lamp of a number over a way, m."""
        if self.grid is not None:
            return self.grid.from_lamp(number, lamp, way, m)
        return self.blob.between(lamp, way, m)

    def escaping(self, point: Sequence[Operand], m: Mathematics) -> Operand:
        """Fraction of light scattered at a place that leaves the cloud, in channels."""
        if self.grid is not None:
            return m.exp(-self.transport * self.grid.at(point, m)[2])
        return _sum([m.exp(-self.transport * x) for x in self.blob.outwards(point, m)]) / 6.0

    def escaping_about(self, point: Sequence[Operand], m: Mathematics) -> Operand:
        """Return the same as a mean over all places as far out; in short."""
        if self.escapes is None:
            return self.escaping(point, m)
        u = self.blob.place(point)
        out = m.minimum(m.sqrt(dot(u, u)) * ((ESCAPES - 1.0) / _FARTHEST_OUT), ESCAPES - 1.001)
        return self.escapes.at(out)

    def again(self, escaping: Operand, light: Operand) -> Operand:
        """Scalar irradiance of what of a place's light is scattered there twice and more often."""
        again = (1.0 - escaping) * self.transport_albedo
        return again * light / (1.0 - again)

    def linear(self, cosine: Operand) -> Operand:
        """Phase function of the same mean cosine that is linear in that of the angle, 1/sr."""
        return ISOTROPIC * (1.0 + 3.0 * self.asymmetry * cosine)


@dataclass(frozen=True, eq=False)
class Veil:
    """What clouds before a place do to its light, in channels.

    Attributes
    ----------
    unscattered : channels
        Fraction of light that passes without any change.
    passed : channels
        Fraction that passes, or is scattered within the forward peak.
    light : channels
        Radiance that the clouds themselves scatter to the camera.
    middle : number
        Mean distance of the clouds, m.
    forward : channels
        Of the clouds, see :class:`CloudNumbers`, as a mean.
    sunlit, daylit : channels
        Of :func:`.daylit_fractions`.
    """

    unscattered: Operand
    passed: Operand
    light: Operand
    middle: Operand
    forward: Operand
    sunlit: Operand = 1.0
    daylit: Operand = 1.0


@dataclass(frozen=True, eq=False)
class ArrayRow:
    """A row of arrays, shape (k, 3)."""

    values: NDArray[np.float64]

    def at(self, place: Operand) -> Operand:
        """Interpolate at places of shape (..., 1), or of no shape; shape (..., 3)."""
        return multilinear_of_columns(self.values, (place,))


def with_escapes(cloud: CloudNumbers) -> CloudNumbers:
    """Return a cloud with the row of what leaves it."""
    sides = np.array([x for x in np.ndindex(3, 3, 3) if x != (1, 1, 1)]) - 1.0
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    out = np.linspace(0.0, _FARTHEST_OUT, ESCAPES)
    own = np.linalg.inv(np.reshape(cloud.rows, (3, 3)))
    places = np.asarray(cloud.middle) + out[:, None, None] * sides @ own.T
    found = cloud.escaping(list(np.moveaxis(places[..., None], 2, 0)), NUMPY)
    return replace(cloud, escapes=ArrayRow(np.asarray(found).mean(axis=1)))


def add_up(count: int, terms: Callable[[Operand], Sequence[Operand]]) -> Sequence[Operand]:
    """Add up terms as :data:`Sum` says, of arrays."""
    return _added([terms(float(i)) for i in range(count)])


def march(
    count: int,
    terms: Callable[[Operand, Operand], tuple[Operand, Sequence[Operand]]],
    met: Operand = 1.0,
) -> Sequence[Operand]:
    """Add up as :data:`March` says, of arrays."""
    del met
    before, found = 0.0, []
    for index in range(count):
        number, others = terms(float(index), before)
        before = before + number
        found.append((number, *others))
    return _added(found)


def _added(found: Sequence[Sequence[Operand]]) -> Sequence[Operand]:
    return [functools.reduce(operator.add, parts) for parts in zip(*found, strict=True)]


class Group(Protocol):
    """Some clouds, which formulas add up over without knowing how many there are."""

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up several terms of each cloud."""
        ...

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply channels of each cloud, which are positive."""
        ...

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        ...

    @property
    def grids(self) -> Sequence[CloudNumbers]:
        """Those that have a grid."""
        ...


@dataclass(frozen=True, eq=False)
class Several:
    """Clouds one by one; a :class:`Group`."""

    clouds: Sequence[CloudNumbers]

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up terms of each."""
        return _added([terms(cloud) for cloud in self.clouds])

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply factors of each."""
        return functools.reduce(operator.mul, [factor(cloud) for cloud in self.clouds])

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        return len(self.clouds) == 1

    @property
    def grids(self) -> Sequence[CloudNumbers]:
        """Those that have a grid."""
        return [cloud for cloud in self.clouds if cloud.grid is not None]


@dataclass(frozen=True, eq=False)
class Together:
    """Puffs, and grids one by one; a :class:`Group`.

    Attributes
    ----------
    grids : sequence of CloudNumbers
        One or more.
    """

    blobs: Group | None
    grids: Sequence[CloudNumbers]

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        return self.blobs is None and len(self.grids) == 1

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up terms of each."""
        own = [] if self.blobs is None else [self.blobs.total(terms)]
        return _added([*own, *(terms(cloud) for cloud in self.grids)])

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply factors of each."""
        own = [] if self.blobs is None else [self.blobs.product(factor)]
        return functools.reduce(operator.mul, [*own, *(factor(cloud) for cloud in self.grids)])


@dataclass(frozen=True, eq=False)
class Clouds:
    """Clouds, and the sun that shines on them.

    Attributes
    ----------
    phases : sequence of Wide
        Phase functions of their matter, by kind.
    sun : three numbers
        Unit direction that sunlight travels to in the water, z up.
    """

    group: Group
    phases: Sequence[Wide]
    sun: Sequence[Operand]
    m: Mathematics = NUMPY

    @property
    def back(self) -> list[Operand]:
        """Unit direction to the sun."""
        return [-x for x in self.sun]

    def sunlight_transmittance(self, point: Sequence[Operand]) -> Operand:
        """Fraction of the sun's light that clouds leave on an object at a place, in channels."""
        return self.transmittance(
            "transport", lambda cloud: cloud.towards_sun(point, self.back, self.m)
        )

    def skylight_transmittance(
        self, point: Sequence[Operand], *, all_round: bool = False
    ) -> Operand:
        """Fraction of all other light from above that they leave there, in channels.

        The part of it that comes along the sun's beam is dimmed as that is; the rest is not.

        Parameters
        ----------
        point : three numbers
            m.
        all_round : bool
            Whether what clouds scatter out of that beam is left as well, wherever it goes: water
            scatters it to all sides. It is that of two streams in a layer, 1 / (1 + ¾ τ (1 - g)).
        """

        def transmittance(cloud: CloudNumbers) -> Operand:
            fraction = cloud.spread / (cloud.spread + cloud.ambient + _LEAST)
            lost = cloud.transport * cloud.towards_sun(point, self.back, self.m)
            transport = 1.0 / (1.0 + _LAYER * lost) if all_round else self.m.exp(-lost)
            return 1.0 - fraction * (1.0 - transport)

        return self.group.product(transmittance)

    def transmittance(self, rate: str, column: Callable[[CloudNumbers], Operand]) -> Operand:
        """Fraction of light that clouds leave, in channels.

        Parameters
        ----------
        rate : str
            Field of :class:`CloudNumbers`.
        column : callable
            Integral of the density of a cloud along the way, m.
        """
        return self.m.exp(-self.group.total(lambda x: (getattr(x, rate) * column(x),))[0])

    def veil(
        self,
        origin: Sequence[Operand],
        w: Sequence[Operand],
        P: Operand,
        s2: Operand,
        add: Sum = add_up,
        follow: March = march,
    ) -> Veil:
        """Return what clouds on a path do to what is seen along it.

        Parameters
        ----------
        origin : three numbers
            Where the camera is, m.
        w : three numbers
            Unit view direction, away from the camera.
        P : number
            Length of the path, m.
        s2 : number
            sin² of half the angle by which sunlight turns to travel against w.
        add, follow : callable
            Add up the steps, through blobs and through grids.
        """
        m = self.m

        # What is alone follows its own way.
        grids = () if self.group.alone else self.group.grids
        rays = self.rays(grids, origin, w, P, add)

        def way(cloud: CloudNumbers) -> RayInBlob:
            return rays.get(id(cloud)) or cloud.blob.along(origin, w, m)

        def of_cloud(cloud: CloudNumbers) -> Sequence[Operand]:
            p = self.bluntly(cloud, s2)
            if cloud.grid is not None:
                return of_column(cloud, *through_grid(cloud, cloud.grid, p))
            ray = way(cloud)
            fraction = ray.column(P, m)
            start = m.clamp(ray.middle - SPAN / ray.rate, 0.0 * P, P)
            step = (m.clamp(ray.middle + SPAN / ray.rate, 0.0 * P, P) - start) / STEPS

            def places(index: Operand) -> Sequence[Operand]:
                near = start + index * step
                return near, near + 0.5 * step, near + step

            def source(s: Operand) -> Operand:
                point = [x + along * s for x, along in zip(origin, w, strict=True)]
                return self._source(cloud, point, s, p, w)

            (light,) = add(STEPS, self.steps(cloud, way, places, (0.0, P, STEPS), source))
            return of_column(cloud, fraction, light, m.clamp(ray.middle, 0.0 * P, P) * fraction)

        def through_grid(cloud: CloudNumbers, grid: Grid, p: Operand) -> Sequence[Operand]:
            start, step = grid.steps(origin, w, P, m)

            def places(index: Operand) -> Sequence[Operand]:
                near = start + index * step
                return near, near + 0.5 * step, near + step

            def source(point: Sequence[Operand], s: Operand, here: Sequence[Operand]) -> Operand:
                return self._source(cloud, point, s, p, w, here)

            terms = self.grid_steps(cloud, way, (origin, w), places, source)
            return follow(density_grid.STEPS, terms, m.less(0.0, step))

        def of_column(
            cloud: CloudNumbers, fraction: Operand, light: Operand, middle: Operand
        ) -> Sequence[Operand]:
            direct, scaled = cloud.extinction * fraction, cloud.scaled * fraction
            return direct, scaled, light, middle, cloud.forward * fraction, fraction

        direct, scaled, light, middle, forward, weight = self.group.total(of_cloud)
        weight = weight + _LEAST
        return Veil(m.exp(-direct), m.exp(-scaled), light, middle / weight, forward / weight)

    def steps(
        self,
        cloud: CloudNumbers,
        ray: Callable[[CloudNumbers], RayInBlob],
        places: Callable[[Operand], Sequence[Operand]],
        ends: tuple[Operand, Operand, int],
        source: Callable[[Operand], Operand],
    ) -> Callable[[Operand], Sequence[Operand]]:
        """Return the steps in which what a cloud scatters along a ray is added up.

        Parameters
        ----------
        ray : callable
            The way through each cloud.
        places : callable
            Distances of the beginning, the middle and the end of a step along it, m.
        ends : number, number, int
            Of the path, and the number of steps: what is before and beyond these counts to the
            first and the last one.
        source : callable
            Radiance of endless matter with the light of a place at a distance, as it arrives.
        """
        m, (first, last, count) = self.m, ends
        own_ray = ray(cloud)

        def term(index: Operand) -> Sequence[Operand]:
            near, here, far = places(index)
            near = m.select(m.less(0.5, index), near, first)
            far = m.select(m.less(count - 1.5, index), last, far)
            transmittance, gone = (m.exp(-cloud.scaled * own_ray.column(s, m)) for s in (near, far))

            def dimmed(other: CloudNumbers) -> Sequence[Operand]:
                return (other.scaled * ray(other).column(here, m),)

            fraction = transmittance - gone
            if not self.group.alone:
                own = cloud.scaled * own_ray.column(here, m)
                fraction = fraction * m.exp(own - self.group.total(dimmed)[0])
            return (fraction * source(here),)

        return term

    def bluntly(self, cloud: CloudNumbers, s2: Operand) -> Operand:
        """Return what the phase function of a cloud has beyond its peak, see :meth:`veil`."""
        p = self.phases[0].per_steradian(s2, self.m)
        for place, phase in enumerate(self.phases[1:], 1):
            chosen = self.m.less(place - 0.5, cloud.kind)
            p = self.m.select(chosen, phase.per_steradian(s2, self.m), p)
        return self.m.minimum(p / (1.0 - cloud.peak), cloud.ceiling)

    def rays(
        self, grids: Sequence[CloudNumbers], origin: Sequence[Operand], w: Sequence[Operand],
        P: Operand, add: Sum,
    ) -> dict[int, RayInBlob]:  # fmt: skip
        """Return ways through grids as those through blobs of the same moments, by identity.

        Loops cannot look into each other: what they need of grids is found before them.
        """
        return {id(x): self._moments(x.grid, origin, w, P, add) for x in grids if x.grid}

    def _moments(
        self, grid: Grid, origin: Sequence[Operand], w: Sequence[Operand], P: Operand, add: Sum
    ) -> RayInBlob:
        m = self.m
        start, step = grid.steps(origin, w, P, m)

        def moments(index: Operand) -> Sequence[Operand]:
            s = start + (index + 0.5) * step
            point = [x + along * s for x, along in zip(origin, w, strict=True)]
            column = grid.at(point, m)[0] * step
            return column, column * s, column * s * s

        column, first, second = add(density_grid.STEPS, moments)
        return density_grid.ray_of(column, first, second, m)

    def grid_steps(
        self,
        cloud: CloudNumbers,
        ray: Callable[[CloudNumbers], RayInBlob],
        path: tuple[Sequence[Operand], Sequence[Operand]],
        places: Callable[[Operand], Sequence[Operand]],
        source: Callable[[Sequence[Operand], Operand, Sequence[Operand]], Operand],
    ) -> Callable[[Operand, Operand], tuple[Operand, Sequence[Operand]]]:
        """Return the same for a cloud with a grid, of which each step knows what is before it.

        Parameters
        ----------
        ray, places : callable
            Of :meth:`steps`.
        path : three numbers, three numbers
            Where the ray begins, m, and its unit direction.
        source : callable
            As there, of a place, its distance, and what the nodes have there.

        Returns
        -------
        callable
            Column of a step, what it scatters, and its column times the distance.
        """
        m, grid = self.m, cloud.grid
        assert grid is not None, "a cloud with a grid"

        def term(index: Operand, before: Operand) -> tuple[Operand, Sequence[Operand]]:
            near, s, far = places(index)
            point = [x + along * s for x, along in zip(*path, strict=True)]
            here = grid.at(point, m)
            column = here[0] * (far - near)
            transmittance, gone = (m.exp(-cloud.scaled * x) for x in (before, before + column))

            def dimmed(other: CloudNumbers) -> Sequence[Operand]:
                return (other.scaled * ray(other).column(s, m),)

            fraction = transmittance - gone
            if not self.group.alone:
                own = cloud.scaled * ray(cloud).column(s, m)
                fraction = fraction * m.exp(own - self.group.total(dimmed)[0])
            return column, (fraction * source(point, s, here), column * s)

        return term

    def _source(
        self, cloud: CloudNumbers, point: Sequence[Operand], s: Operand, p: Operand,
        w: Sequence[Operand], here: Sequence[Operand] | None = None,
    ) -> Operand:  # fmt: skip
        """Radiance of endless matter with the light of a place, less what the water takes.

        ``here`` is what the nodes of a grid have there.
        """
        m = self.m
        below = m.clamp(cloud.middle[2] - point[2], -_DEEPEST_DIFFERENCE, _DEEPEST_DIFFERENCE)

        def towards_sun(other: CloudNumbers) -> Sequence[Operand]:
            column = other.towards_sun(point, self.back, m)
            return other.scaled * column, other.transport * column

        if here is not None and self.group.alone:
            columns = cloud.scaled * here[1], cloud.transport * here[1]
        else:
            columns = self.group.total(towards_sun)
        transmittance, widely = (m.exp(-part) for part in columns)
        unspread = cloud.sun * m.exp(-(cloud.sun_decay * below))
        decay = m.exp(-(cloud.ambient_decay * below))
        sun = unspread * transmittance
        turned = unspread * (widely - transmittance)
        spread = cloud.spread * decay * widely
        escaping = cloud.escaping(point, m) if here is None else m.exp(-(cloud.transport * here[2]))
        ambient = cloud.ambient * decay * escaping
        again = cloud.again(escaping, sun + turned + spread + ambient)
        linear = cloud.linear(-dot(w, self.sun))
        total = p * sun + 0.5 * (p + linear) * spread + linear * turned
        total = total + ISOTROPIC * (ambient + again)
        # Light that is nearer than the reference would grow without bound in a long sum.
        way = m.exp(-(cloud.water * (s - cloud.reference)))
        return m.maximum(total, 0.0) * cloud.albedo * way


def _sum(terms: Sequence[Operand]) -> Operand:
    return functools.reduce(operator.add, terms)
