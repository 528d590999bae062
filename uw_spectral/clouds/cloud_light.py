"""What clouds do to a pixel: light that they let through, and light that they scatter to it.

Scaled as the closed form of the water is: light that the forward peak of a cloud's matter scatters
counts as unscattered (:class:`.BluntPhase`). What is left scatters widely, and to any order:

- once, of the sun, with its way through all clouds exactly (a closed form for puffs),
- of the water's own diffuse light, as far as it enters along the six directions of the axes,
- and again: of what has been scattered the share p that escapes leaves, the rest is scattered once
  more where it is (Sobolev's escape probability). That sums to a series in closed form.

In light from all sides that is the same everywhere, a cloud that does not absorb is invisible.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .puff import FAR, Puff, RayInPuff

STEPS = 8
"""Steps in which the light that a cloud scatters to the camera is added up."""
# Standard deviations about the middle that are divided into steps.
_SPAN = 2.6
_LEAST = 1e-12
_ISOTROPIC = 1.0 / (4.0 * math.pi)
# Depth in m over which light may differ from that in the middle by its decay there.
_DEEPEST_DIFFERENCE = 40.0

Sum = Callable[[int, Callable[[Operand], Sequence[Operand]]], Sequence[Operand]]
"""Adds up terms of 0 to count - 1."""


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
        Of :class:`.Puff`.
    extinction, scaled : channels
        Of its matter where it is densest, with and without the forward peak, 1/m.
    albedo : channels
        Share of the scaled extinction that scatters.
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
    kept : channels
        What keeps light from things below, at density 1, 1/m: it is not scattered forward.
    reference : number
        Distance in m that the light is given for.
    asymmetry, ceiling, peak : numbers
        Of :class:`.BluntPhase`.
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
    kept: Operand
    albedo_kept: Operand
    reference: Operand
    asymmetry: Operand
    ceiling: Operand
    peak: Operand

    @property
    def puff(self) -> Puff:
        """Where it is."""
        return Puff(self.middle, self.rows)


@dataclass(frozen=True, eq=False)
class Veil:
    """What clouds before a place do to its light, in channels.

    Attributes
    ----------
    unscattered : channels
        Share of light that passes without any change.
    passed : channels
        Share that passes, or is scattered within the forward peak.
    light : channels
        Radiance that the clouds themselves scatter to the camera.
    middle : number
        Mean distance of the clouds, m.
    forward : channels
        Of the clouds, see :class:`CloudNumbers`, as a mean.
    """

    unscattered: Operand
    passed: Operand
    light: Operand
    middle: Operand
    forward: Operand


def add_up(count: int, terms: Callable[[Operand], Sequence[Operand]]) -> Sequence[Operand]:
    """Add up terms as :data:`Sum` says, of arrays."""
    found = [terms(float(i)) for i in range(count)]
    return [functools.reduce(operator.add, parts) for parts in zip(*found, strict=True)]


@dataclass(frozen=True, eq=False)
class Clouds:
    """Clouds, and the sun that shines on them.

    Attributes
    ----------
    clouds : sequence of CloudNumbers
    phases : sequence of Wide
        Phase function of the matter of each.
    sun : three numbers
        Unit direction that sunlight travels to in the water, z up.
    m : Mathematics
    """

    clouds: Sequence[CloudNumbers]
    phases: Sequence[Wide]
    sun: Sequence[Operand]
    m: Mathematics = NUMPY

    def sunlight_left(self, point: Sequence[Operand]) -> Operand:
        """Share of the sun's light that clouds leave on a thing at a place, in channels."""
        return self.m.exp(-self._towards_sun(point, [cloud.kept for cloud in self.clouds]))

    def skylight_left(self, point: Sequence[Operand]) -> Operand:
        """Share of all other light from above that they leave there, in channels.

        The part of it that comes along the sun's beam is dimmed as that is; the rest is not.
        """
        left: Operand = 1.0
        for cloud in self.clouds:
            share = cloud.spread / (cloud.spread + cloud.ambient + _LEAST)
            kept = self.m.exp(-(cloud.kept * self._column(cloud, point)))
            left = (1.0 - share * (1.0 - kept)) * left
        return left

    def veil(
        self,
        origin: Sequence[Operand],
        w: Sequence[Operand],
        P: Operand,
        s2: Operand,
        add: Sum = add_up,
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
        add : callable
            Adds up the steps.
        """
        m = self.m
        rays = [cloud.puff.along(origin, w, m) for cloud in self.clouds]
        columns = [ray.column(P, m) for ray in rays]
        direct = _sum(
            [c.extinction * column for c, column in zip(self.clouds, columns, strict=True)]
        )
        scaled = _sum([c.scaled * column for c, column in zip(self.clouds, columns, strict=True)])
        light: Operand = 0.0
        weight: Operand = _LEAST
        middle: Operand = 0.0
        forward: Operand = 0.0
        for number, (ray, share) in enumerate(zip(rays, columns, strict=True)):
            light = self._scattered(number, rays, origin, w, P, s2, add)[0] + light
            middle = m.clamp(ray.middle, 0.0 * P, P) * share + middle
            forward = self.clouds[number].forward * share + forward
            weight = share + weight
        return Veil(m.exp(-direct), m.exp(-scaled), light, middle / weight, forward / weight)

    def _scattered(
        self,
        number: int,
        rays: Sequence[RayInPuff],
        origin: Sequence[Operand],
        w: Sequence[Operand],
        P: Operand,
        s2: Operand,
        add: Sum,
    ) -> Sequence[Operand]:
        """Light that one cloud scatters to the camera, on its way through all of them."""
        m, cloud, ray = self.m, self.clouds[number], rays[number]
        others = [i for i in range(len(rays)) if i != number]
        p = self.phases[number].per_steradian(s2, m)
        p = m.minimum(p / (1.0 - cloud.peak), cloud.ceiling)
        start = m.clamp(ray.middle - _SPAN / ray.rate, 0.0 * P, P)
        step = (m.clamp(ray.middle + _SPAN / ray.rate, 0.0 * P, P) - start) / STEPS

        def term(index: Operand) -> Sequence[Operand]:
            near = start + index * step
            here = near + 0.5 * step
            # The tails count to the first and the last step.
            far = m.select(m.less(STEPS - 1.5, index), P, near + step)
            near = near * m.less(0.5, index)
            left, gone = (m.exp(-cloud.scaled * ray.column(s, m)) for s in (near, far))
            share = left - gone
            for i in others:
                share = share * m.exp(-self.clouds[i].scaled * rays[i].column(here, m))
            point = [x + along * here for x, along in zip(origin, w, strict=True)]
            return (share * self._source(cloud, point, here, p, w),)

        return add(STEPS, term)

    def _source(
        self, cloud: CloudNumbers, point: Sequence[Operand], s: Operand, p: Operand,
        w: Sequence[Operand],
    ) -> Operand:  # fmt: skip
        """Radiance of endless matter with the light of a place, less what the water takes."""
        m = self.m
        below = m.clamp(cloud.middle[2] - point[2], -_DEEPEST_DIFFERENCE, _DEEPEST_DIFFERENCE)
        left, widely = (
            m.exp(-self._towards_sun(point, [getattr(c, rate) for c in self.clouds]))
            for rate in ("scaled", "kept")
        )
        unspread = cloud.sun * m.exp(-(cloud.sun_decay * below))
        decay = m.exp(-(cloud.ambient_decay * below))
        sun = unspread * left
        turned = unspread * (widely - left)
        spread = cloud.spread * decay * widely
        escaping = _sum([m.exp(-cloud.kept * x) for x in cloud.puff.outwards(point, m)]) / 6.0
        ambient = cloud.ambient * decay * escaping
        again = (1.0 - escaping) * cloud.albedo_kept
        again = again * (sun + turned + spread + ambient) / (1.0 - again)
        linear = _ISOTROPIC * (1.0 + 3.0 * cloud.asymmetry * -dot(w, self.sun))
        total = p * sun + 0.5 * (p + linear) * spread + linear * turned
        total = total + _ISOTROPIC * (ambient + again)
        # Light that is nearer than the reference would grow without bound in a long sum.
        way = m.exp(-(cloud.water * (s - cloud.reference)))
        return m.maximum(total, 0.0) * cloud.albedo * way

    def _towards_sun(self, point: Sequence[Operand], rates: Sequence[Operand]) -> Operand:
        pairs = zip(rates, self.clouds, strict=True)
        return _sum([rate * self._column(cloud, point) for rate, cloud in pairs])

    def _column(self, cloud: CloudNumbers, point: Sequence[Operand]) -> Operand:
        """Integral of the density of a cloud from a place towards the sun, m."""
        back = [-x for x in self.sun]
        return cloud.puff.along(point, back, self.m).column(FAR, self.m)


def _sum(terms: Sequence[Operand]) -> Operand:
    return functools.reduce(operator.add, terms)
