"""What clouds do to the light of lamps, and what of it they scatter to the camera.

A cloud's light is that of :mod:`.cloud_light` with the lamp in place of the sun: scattered once,
spread forward on the way, and scattered again where it is. It comes to a place in the cloud as it
comes to an object that faces the lamp, and from there to the camera as the light of an object does:
what the water scatters forward on either way is in it (:attr:`.ChannelLight.floating`). Steps are
even in asinh(s/h), s from the point of the ray that is nearest to the lamp and h its distance from
it: fine about a lamp in the cloud.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..lamps.lamp import Lamp, RayPastLamp, disc_seen, ray_past_lamp
from ..lamps.lamp_channels import ChannelLight, LampChannels
from ..lamps.lamp_path import Quadrature
from ..lamps.multiple_scattering import asinh, light_along
from ..mathematics import Operand, dot
from ..transfer.sun_beam import half_angle2
from .cloud_light import Clouds
from .cloud_numbers import ISOTROPIC, SPAN, CloudNumbers, March, Sum, add_up, march
from .gaussian_blob import RayInBlob

STEPS = 8
"""Steps in which the light of a lamp that a blob scatters is added up."""
GRID_STEPS = 20
"""The same of a grid."""


@dataclass(frozen=True, eq=False)
class LampAndClouds:
    """A lamp, clouds, and a ray that passes them."""

    clouds: Clouds
    lamp: Lamp
    past: RayPastLamp  #: Where the ray passes the lamp.
    #: Where the ray begins, m, and its unit direction.
    origin: Sequence[Operand]
    w: Sequence[Operand]
    P: Operand  #: Its length, m.
    number: Operand = 0.0  #: Of the lamp.
    #: Of :meth:`.Clouds.rays`, for all grids.
    rays: Mapping[int, RayInBlob] = field(default_factory=dict)

    def seen(
        self,
        light: ChannelLight,
        integrate: Quadrature | None = None,
        add: Sum = add_up,
        follow: March = march,
    ) -> Operand:
        """Return the light of the lamp along the ray, in channels.

        ``integrate``, ``add`` and ``follow`` add up the terms of the quadratures, and the steps
        through blobs and grids.
        """
        m, lamp, past = self.clouds.m, self.lamp, self.past
        t0 = m.maximum(past.t0, 0.0)
        straight = self.clouds.transmittance("extinction", lambda cloud: self._column(cloud, t0))
        disc = light.unscattered.at(length=t0) * disc_seen(lamp, past, m)
        single, more = light_along(lamp, past, light, m, integrate, self.transmittance)

        (turned,) = self.clouds.group.total(lambda x: self.scattered(x, light, add, follow))
        return single + more + disc * straight + turned

    def transmittance(self, s: Operand, where: Sequence[Operand]) -> Operand:
        """Fraction of light that clouds leave on the way from the lamp: :data:`.Transmittance`."""
        m, start = self.clouds.m, self.lamp.position

        def lost(cloud: CloudNumbers) -> Sequence[Operand]:
            seen = self._column(cloud, s)
            between = cloud.from_lamp(self.number, start, where, m)
            return (cloud.scaled * seen + cloud.transport * between,)

        return m.exp(-self.clouds.group.total(lost)[0])

    def _ray(self, cloud: CloudNumbers) -> RayInBlob:
        known = self.rays.get(id(cloud))
        return known or cloud.blob.along(self.origin, self.w, self.clouds.m, nearly=True)

    def _column(self, cloud: CloudNumbers, s: Operand) -> Operand:
        return self._ray(cloud).column(s, self.clouds.m)

    def scattered(
        self, cloud: CloudNumbers, light: ChannelLight, add: Sum = add_up, follow: March = march
    ) -> Sequence[Operand]:
        """Light that one cloud scatters to the camera, on its way through all of them."""
        m, past = self.clouds.m, self.past
        ray = self._ray(cloud)
        first = m.maximum(past.t0 + past.first, 0.0)
        last = m.maximum(self.P, first)
        count = STEPS if cloud.grid is None else GRID_STEPS
        if cloud.grid is None:
            ends = [ray.middle + x / ray.rate for x in (-SPAN, SPAN)]
        else:
            ends = cloud.grid.crossing(self.origin, self.w, m)
        ends = (m.clamp(x, first, last) for x in ends)
        start, end = (asinh(s - past.t0, past.h, m) for s in ends)
        step = (end - start) / count
        # What all steps need is made before them.
        ray.until(0.0, m)

        def distance(place: Operand) -> Operand:
            grown = m.exp(start + place * step)
            return m.clamp(past.t0 + past.h * (grown - 1.0 / grown) / 2.0, first, last)

        def places(index: Operand) -> Sequence[Operand]:
            return [distance(index + beyond) for beyond in (0.0, 0.5, 1.0)]

        if cloud.grid is not None:

            def in_grid(point: Sequence[Operand], s: Operand, here: Sequence[Operand]) -> Operand:
                return self._source(cloud, light, s, point, m.exp(-(cloud.transport * here[2])))

            path = self.origin, self.w
            of_grid = self.clouds.grid_steps(cloud, self._ray, path, places, in_grid)
            return (follow(count, of_grid, m.less(0.0, step))[1],)

        def source(s: Operand) -> Operand:
            point = [x + along * s for x, along in zip(self.origin, self.w, strict=True)]
            return self._source(cloud, light, s, point, cloud.escaping_about(point, m))

        terms = self.clouds.steps(cloud, self._ray, places, (first, last, STEPS), source)
        return add(STEPS, terms)

    def _source(
        self, cloud: CloudNumbers, light: ChannelLight, s: Operand, point: Sequence[Operand],
        escaping: Operand,
    ) -> Operand:  # fmt: skip
        """Radiance of endless matter with the light of a place, less what the water takes."""
        m, lamp = self.clouds.m, self.lamp
        r, u = lamp.towards(point, m)
        where = [x - x0 for x, x0 in zip(point, lamp.position, strict=True)]
        E = light.floating_at(lamp.wet(r, where[2], m), s)
        lit = lamp.profile.value(dot(lamp.axis, u), m) * lamp.lit(where, m)
        E = E * (lit / (r * r + lamp.radius * lamp.radius))

        def between(other: CloudNumbers) -> Sequence[Operand]:
            column = other.from_lamp(self.number, lamp.position, where, m)
            return other.scaled * column, other.transport * column

        transmittance, widely = (m.exp(-part) for part in self.clouds.group.total(between))
        p = self.clouds.bluntly(cloud, half_angle2(self.w, u, m))
        total = p * transmittance + cloud.linear(-dot(self.w, u)) * (widely - transmittance)
        total = total + ISOTROPIC * cloud.again(escaping, widely)
        return m.maximum(total, 0.0) * cloud.albedo * E


def path_light(
    projected: LampChannels,
    clouds: Clouds,
    origin: Sequence[Operand],
    w: Sequence[Operand],
    P: Operand,
    *,
    before_surface: bool = False,
) -> NDArray[np.float64]:
    """Radiance of lamps along rays through clouds, as :meth:`.LampChannels.path_light`."""
    total, rays = np.zeros(3), clouds.rays(clouds.group.grids, origin, w, P, add_up)
    for number, (lamp, light) in enumerate(projected.lights()):
        past = ray_past_lamp(lamp, origin, w, P, before_surface=before_surface)
        through = LampAndClouds(clouds, lamp, past, origin, w, P, number, rays)
        total = total + through.seen(light)
    return total


def transmittance_to_surface(
    clouds: Clouds, lamp: Lamp, point: Sequence[Operand], number: Operand = 0.0
) -> Operand:
    """Fraction of the light of a lamp on an object at a place that clouds leave, in channels."""
    way = [x - x0 for x, x0 in zip(point, lamp.position, strict=True)]
    return clouds.transmittance(
        "transport", lambda x: x.from_lamp(number, lamp.position, way, clouds.m)
    )
