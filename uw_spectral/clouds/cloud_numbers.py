"""What the light of a cloud takes: its numbers, and sums over clouds and steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mathematics import NUMPY, Mathematics, Operand, added_up, dot, sum_of
from ..table import Lookup, Scale, Table
from .density_grid import Grid
from .gaussian_blob import FAR, GaussianBlob

STEPS = 8
"""Steps in which the light that a cloud scatters to the camera is added up."""
SPAN = 2.6
"""Standard deviations about the middle that are divided into steps."""
LEAST = 1e-12
LAYER = 0.75
ISOTROPIC = 1.0 / (4.0 * math.pi)
"""Phase function of light that is scattered alike to all sides, 1/sr."""
# Depth in m over which light may differ from that in the middle by its decay there.
DEEPEST_DIFFERENCE = 40.0
ESCAPES = Scale(24, 0.0, 4.5)
"""Of the row of light that leaves a cloud, from its middle outwards, standard deviations."""
ESCAPING = (ESCAPES.axis("out"),)
Sum = Callable[[int, Callable[[Operand], Sequence[Operand]]], Sequence[Operand]]
"""Adds up terms of 0 to count - 1."""
March = Callable[
    [int, Callable[[Operand, Operand], tuple[Operand, Sequence[Operand]]], Operand],
    Sequence[Operand],
]
"""Adds up the same of a number, and of terms that know the sum of the number before them.

Where the last operand is 0 all are 0, and need not be made.
"""


@dataclass(frozen=True, eq=False)
class CloudNumbers:
    """What formulas need of a cloud; channels are arrays of three, or vectors of a shader."""

    #: Of :class:`.GaussianBlob`.
    middle: Sequence[Operand]
    rows: Sequence[Operand]
    #: Channels: of its matter where it is densest, with and without the forward peak, 1/m.
    extinction: Operand
    scaled: Operand
    albedo: Operand  #: Channels: fraction of the scaled extinction that scatters.
    #: Channels: normal irradiance of the sun, its forward peak included, in the depth of the
    #: middle, as it is seen from ``reference``.
    sun: Operand
    #: Channels: scalar irradiance of the other light, likewise: of a beam along that of the sun
    #: which has its net downward irradiance, and of the rest, from all sides.
    spread: Operand
    ambient: Operand
    #: Channels: decay of both with depth, 1/m.
    sun_decay: Operand
    ambient_decay: Operand
    water: Operand  #: Channels: decay along the view, 1/m.
    #: Channels: what water scatters forward from behind the cloud to in front of it, beyond the
    #: peak of the water's own tables: the cloud blocks that, 1/m.
    forward: Operand
    #: Channels: what keeps light from objects below, at density 1, 1/m: it is not scattered
    #: forward.
    transport: Operand
    transport_albedo: Operand
    reference: Operand  #: Distance in m that the light is given for.
    #: Of :class:`.BluntPhase`.
    asymmetry: Operand
    ceiling: Operand
    peak: Operand
    #: Place of the phase function of its matter among those of :class:`Clouds`.
    kind: Operand = 0.0
    #: What :meth:`escaping` is at so many standard deviations from the middle, as a mean over all
    #: sides; see :func:`with_escapes`.
    escapes: Lookup | None = None
    #: Its density, if it is none of a blob: ``middle`` and ``rows`` are then those of the blob that
    #: is most like it.
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
        return sum_of([m.exp(-self.transport * x) for x in self.blob.outwards(point, m)]) / 6.0

    def escaping_about(self, point: Sequence[Operand], m: Mathematics) -> Operand:
        """Return the same as a mean over all places as far out; in short."""
        if self.escapes is None:
            return self.escaping(point, m)
        u = self.blob.place(point)
        return self.escapes.at(out=m.sqrt(dot(u, u)))

    def again(self, escaping: Operand, light: Operand) -> Operand:
        """Scalar irradiance of what of a place's light is scattered there twice and more often."""
        again = (1.0 - escaping) * self.transport_albedo
        return again * light / (1.0 - again)

    def linear(self, cosine: Operand) -> Operand:
        """Phase function of the same mean cosine that is linear in that of the angle, 1/sr."""
        return ISOTROPIC * (1.0 + 3.0 * self.asymmetry * cosine)


@dataclass(frozen=True, eq=False)
class Veil:
    """What clouds before a place do to its light, in channels."""

    unscattered: Operand  #: Fraction of light that passes without any change.
    passed: Operand  #: Fraction that passes, or is scattered within the forward peak.
    light: Operand  #: Radiance that the clouds themselves scatter to the camera.
    middle: Operand  #: Mean distance of the clouds, m.
    forward: Operand  #: Of the clouds, see :class:`CloudNumbers`, as a mean.
    #: Of :func:`.daylit_fractions`.
    sunlit: Operand = 1.0
    daylit: Operand = 1.0


def with_escapes(cloud: CloudNumbers) -> CloudNumbers:
    """Return a cloud with the row of what leaves it."""
    sides = np.array([x for x in np.ndindex(3, 3, 3) if x != (1, 1, 1)]) - 1.0
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    out = ESCAPES.values()
    own = np.linalg.inv(np.reshape(cloud.rows, (3, 3)))
    places = np.asarray(cloud.middle) + out[:, None, None] * sides @ own.T
    found = cloud.escaping(list(np.moveaxis(places[..., None], 2, 0)), NUMPY)
    return replace(cloud, escapes=Table(np.asarray(found).mean(axis=1), ESCAPING))


def add_up(count: int, terms: Callable[[Operand], Sequence[Operand]]) -> Sequence[Operand]:
    """Add up terms as :data:`Sum` says, of arrays."""
    return added_up([terms(float(i)) for i in range(count)])


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
    return added_up(found)
