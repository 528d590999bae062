"""What clouds do to a pixel: light that they let through, and light that they scatter to it.

Scaled as the closed form of the water is: light that the forward peak of a cloud's matter scatters
counts as unscattered (:class:`.BluntPhase`). What is left scatters widely, and to any order:

- once, of the sun, with its way through all clouds exactly (a closed form for blobs),
- of the water's own diffuse light, as far as it enters along the six directions of the axes,
- and again: of what has been scattered the fraction p that escapes leaves, the rest is
  scattered once more where it is (Sobolev's escape probability). That sums to a series in
  closed form.

In light from all sides that is the same everywhere, a cloud that does not absorb is invisible.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import NUMPY, Mathematics, Operand, added_up, dot
from ..water.phase import PhaseFunction
from . import density_grid
from .cloud_numbers import (
    DEEPEST_DIFFERENCE,
    ISOTROPIC,
    LAYER,
    LEAST,
    SPAN,
    STEPS,
    CloudNumbers,
    March,
    Sum,
    Veil,
    add_up,
    march,
)
from .density_grid import Grid
from .gaussian_blob import RayInBlob


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
    """Clouds one by one, and others beside them; a :class:`Group`."""

    clouds: Sequence[CloudNumbers]
    others: Group | None = None  #: Without grids.

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up terms of each."""
        found = [] if self.others is None else [self.others.total(terms)]
        return added_up([*found, *map(terms, self.clouds)])

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply factors of each."""
        found = [] if self.others is None else [self.others.product(factor)]
        return functools.reduce(operator.mul, [*found, *map(factor, self.clouds)])

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        return self.others is None and len(self.clouds) == 1

    @property
    def grids(self) -> Sequence[CloudNumbers]:
        """Those that have a grid."""
        return [cloud for cloud in self.clouds if cloud.grid is not None]


@dataclass(frozen=True, eq=False)
class Clouds:
    """Clouds, and the sun that shines on them."""

    group: Group
    phases: Sequence[PhaseFunction]  #: Phase functions of their matter, by kind.
    sun: Sequence[Operand]  #: Unit direction that sunlight travels to in the water, z up.
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

        ``all_round`` tells whether what clouds scatter out of that beam is left as well, wherever
        it goes: water scatters it to all sides. It is that of two streams in a layer, 1 / (1 + ¾ τ
        (1 - g)).
        """

        def transmittance(cloud: CloudNumbers) -> Operand:
            fraction = cloud.spread / (cloud.spread + cloud.ambient + LEAST)
            lost = cloud.transport * cloud.towards_sun(point, self.back, self.m)
            transport = 1.0 / (1.0 + LAYER * lost) if all_round else self.m.exp(-lost)
            return 1.0 - fraction * (1.0 - transport)

        return self.group.product(transmittance)

    def transmittance(self, rate: str, column: Callable[[CloudNumbers], Operand]) -> Operand:
        """Fraction of light that clouds leave, in channels.

        ``rate`` is a field of :class:`CloudNumbers`, ``column`` the integral of the density of a
        cloud along the way, m.
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

        ``s2`` is sin² of half the angle by which sunlight turns to travel against w; ``add`` and
        ``follow`` add up the steps, through blobs and through grids.
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
        weight = weight + LEAST
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

        ``places`` gives the distances of the beginning, the middle and the end of a step along it,
        m; ``ends`` are those of the path, and the number of steps: what is before and beyond these
        counts to the first and the last one. ``source`` gives the radiance of endless matter with
        the light of a place at a distance, as it arrives.
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

        Arguments as of :meth:`steps`, but for the ``path``, where the ray begins and its direction;
        ``source`` also gets the place, and what the nodes have there. A step gives its column, what
        it scatters, and its column times the distance.
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
        below = m.clamp(cloud.middle[2] - point[2], -DEEPEST_DIFFERENCE, DEEPEST_DIFFERENCE)

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
