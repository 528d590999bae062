"""The solved light field as tables that a renderer looks up: where objects are, and how made.

Scattered light M(y, w) is tabulated over depth, elevation and azimuth to the sun, the
irradiance on a patch over depth, the sun's aureole over depth and angle. The positions are
formulas over a :class:`.Mathematics`, so numpy and shader nodes look up alike. Light is
divided by ``scale e^{-decay y}``, so that it varies slowly with depth and stays near 1.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import LOGARITHMIC, Scale, Spacing, Table
from .aureole import WIDEST
from .depth_scale import DepthScale
from .solved_field import SolvedField
from .sun_beam import SUN_DISC

ELEVATIONS, AZIMUTHS = 48, 32
TILTS, TURNS = 24, 32
"""Elevations and azimuths of the normals of patches."""
ANGLES = 32
"""Angles to the sun of its aureole."""
MOST_ZONES = 4
"""Zones of depth that a table tells apart."""

_HORIZON = 1.0  # of the warp of elevations: they lie this dense about the horizon
_SLANT = 1e-6  # horizontal component below which there is no azimuth
_DARK = 1e-8  # fraction of the light at which the table of deep water ends
_DEEPEST = 2000.0
_LARGEST_EXPONENT = 40.0  # beyond it there is rounding, and no light
_NOTHING = 1e-200  # irradiance below which there is no light
_FAINT, _GROWTH = 1e-3, 10.0  # fraction of the light that the rate holds for; of what is left later
TABLE_STREAMS = 24
"""Streams of a field that is tabulated; more change less than the tables' own error."""
OCCLUSION_STREAMS = 6
"""Streams whose forward peak counts as unscattered where objects occlude: what is left of the light
then changes with direction about as slowly as occlusion is known."""
_FIRST = 0.3  # optical depths, in the most turbid band, of the scale of the first slices
_CHANGE = 1.2  # factor of the extinction in any band from which on slices are dense around it
_ORDERS, _AROUND = 12, 256  # azimuthal orders of the light on patches, and of what brings it

Array = NDArray[np.float64]


def _stereographic(horizon: float) -> Spacing:
    """Return what is even in the radius of a stereographic map, and as dense about the horizon."""

    def of(up: Operand, m: Mathematics) -> Operand:
        size = m.absolute(up)
        radius = m.sqrt(m.maximum(1.0 - size * size, 0.0)) / (1.0 + size)
        fraction = 1.0 - radius
        if math.isfinite(horizon):
            fraction = fraction * (1.0 + horizon) / (fraction + horizon)
        return (2.0 * m.less(0.0, up) - 1.0) * fraction

    def inverse(u: Array) -> Array:
        size = np.abs(u)
        t = 1.0 - size / (1.0 + (1.0 - size) / horizon)
        return np.sign(u) * (1.0 - t * t) / (1.0 + t * t)

    return Spacing(of, inverse)


UP = Scale(ELEVATIONS, -1.0, 1.0, _stereographic(_HORIZON))
"""Upward components of directions."""
TILT = Scale(TILTS, -1.0, 1.0, _stereographic(math.inf))
"""Upward components of normals.

What lies below is dim, and brightens fast as a patch is tilted: tilts are as dense there.
"""
_ROUND = Spacing(lambda x, m: m.sqrt(0.5 + 0.5 * x), lambda u: 2.0 * np.arcsin(u))
AZIMUTH, TURN = (Scale(count, -1.0, 1.0, _ROUND) for count in (AZIMUTHS, TURNS))
"""Cosines of :func:`azimuth`, towards the sun first; values are the angles to it, rad."""
SUN_ANGLE = Scale(ANGLES, SUN_DISC, WIDEST, LOGARITHMIC)
"""Squared sines of half the angles to the sun."""


def azimuth(w: Sequence[Operand], sun: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
    """Cosine between the azimuths of a direction, or a normal, and of the way of sunlight."""
    size = (w[0] * w[0] + w[1] * w[1]) * (sun[0] * sun[0] + sun[1] * sun[1])
    return (w[0] * sun[0] + w[1] * sun[1]) / m.sqrt(m.maximum(size, _SLANT**4))


@dataclass(frozen=True, eq=False)
class RadianceTable:
    """Tables of n bands; make them with :func:`tabulate`."""

    depth_scale: DepthScale
    #: What is tabulated is divided by ``scale e^{-decay y}``, (n,).
    scale: Array
    decay: Array
    radiance: Array  #: Scattered light M(y, w), (n, slices, ELEVATIONS, AZIMUTHS).
    #: On a patch that faces a direction, without the direct sun and its forward peak,
    #: (n, slices, TILTS, TURNS).
    irradiance: Array
    #: Radiance of the surface from just below and of the floor, over ``scale`` alone,
    #: (n, ELEVATIONS, AZIMUTHS).
    image: Array
    #: Factor on sunlight scattered once, :meth:`.SolvedField.aureole`, (n, slices, ANGLES).
    aureole: Array

    def scattered(self, y: Array, w: Sequence[Array], sun: Sequence[float]) -> Array:
        """Radiance M(y, w) by linear interpolation, shape (..., n)."""
        return self._at(self.radiance, y, w, sun, (UP, AZIMUTH)) * self._unit(y)

    def patch_irradiance(self, y: Array, normal: Sequence[Array], sun: Sequence[float]) -> Array:
        """Irradiance on a patch at depth y, without the direct sun, shape (..., n)."""
        return self._at(self.irradiance, y, normal, sun, (TILT, TURN)) * self._unit(y)

    def boundary_image(self, w: Sequence[Array], sun: Sequence[float]) -> Array:
        """Radiance of the surface from just below, or of the floor, along w, (..., n)."""
        image = self.image[:, None]
        return self._at(image, np.zeros_like(w[2]), w, sun, (UP, AZIMUTH)) * self.scale

    def _at(
        self, values: Array, y: Array, w: Sequence[Array], sun: Sequence[float],
        scales: tuple[Scale, Scale],
    ) -> Array:  # fmt: skip
        axes = self.depth_scale.axis, scales[0].axis("up"), scales[1].axis("azimuth")
        y, *w = (part[..., None] for part in np.broadcast_arrays(y, *w))
        table = Table(np.moveaxis(values, 0, -1), axes)
        return table.at(depth=y, up=w[2], azimuth=azimuth(w, sun))

    def _unit(self, y: Array) -> Array:
        return self.scale * np.exp(-self.decay * np.asarray(y)[..., None])


@functools.lru_cache(maxsize=8)
def tabulate(field: SolvedField) -> RadianceTable:
    """Tabulate a solved field, once."""
    # Beyond it the light falls off as it does there.
    deepest = _deepest(field)
    depth_scale = _depth_scale(field, deepest)
    depths = depth_scale.depths()
    decay = decay_rate(depths, field.scalar_irradiance(depths))
    grown = np.exp(np.minimum(decay[:, None] * depths, _LARGEST_EXPONENT))[..., None, None]
    mu, turns = UP.values(), AZIMUTH.values()
    # Peaks that the streams do not resolve ring, below 0 too.
    radiance = np.maximum(field.scattered_on_grid(depths, mu, turns), 0.0)
    image = np.maximum(_boundary_image(field, mu, turns, radiance[:, 0]), 0.0)
    radiance *= grown
    irradiance = np.maximum(_on_patches(field, depths), 0.0) * grown
    largest = np.maximum(*(part.max(axis=(1, 2, 3)) for part in (radiance, irradiance)))
    scale = np.maximum(largest, float(np.finfo(np.float32).tiny))
    over = scale[:, None, None]
    return RadianceTable(
        depth_scale,
        scale,
        decay,
        radiance / over[..., None],
        irradiance / over[..., None],
        image / over,
        field.aureole(depths, SUN_ANGLE.values()),
    )


def _depth_scale(field: SolvedField, deepest: float) -> DepthScale:
    """Slices that are dense where the light bends: below the surface, at the floor, at changes."""
    tops = [y for y in field.changes(_CHANGE)[: MOST_ZONES - 1] if y < deepest]
    ends = [0.0, *sorted(tops), deepest]
    inverse = [
        max(float(field.extinction_between(*zone, scaled=True).max()) / _FIRST, 1e-3)
        for zone in itertools.pairwise(ends)
    ]
    return DepthScale.between(ends, inverse, floor=deepest == field.floor_depth)


def _deepest(field: SolvedField) -> float:
    """Depth of the floor, or where hardly any light is left in the brightest band."""
    depths = np.concatenate([[0.0], np.geomspace(0.1, _DEEPEST, 60)])
    E0 = field.scalar_irradiance(np.minimum(depths, field.floor_depth)).max(axis=1)
    dark = _DARK * E0[0] >= E0
    return min(field.floor_depth, depths[1:][dark[1:]].min(initial=_DEEPEST))


def decay_rate(depths: Array, E0: Array) -> Array:
    """Rate at which E0 (d, n) falls to a faint share, as far as what is left does not grow much."""
    y = depths[1:, None]
    lost = np.log(np.maximum(E0[0], _NOTHING)) - np.log(np.maximum(E0[1:], _NOTHING))
    faint = lost > -math.log(_FAINT)
    first = np.where(faint.any(axis=0), faint.argmax(axis=0), len(lost) - 1)
    rate = np.take_along_axis(lost / y, first[None], axis=0)[0]
    # Depths that no light reaches say nothing, but for the first.
    grown = np.where((E0[1:] > _NOTHING) | (y == y[0]), (lost + math.log(_GROWTH)) / y, math.inf)
    return np.maximum(np.minimum(rate, grown.min(axis=0)), 0.0)


def _on_patches(field: SolvedField, depths: Array) -> Array:
    """Irradiance on patches at depths, shape (n, d, TILTS, TURNS)."""
    mu = np.concatenate([field.mu, -field.mu])
    weights = np.concatenate([field.weights, field.weights])
    kernel = _patch_kernel(tuple(TILT.values().tolist()), tuple(mu.tolist()))
    light = np.concatenate(field.stream_modes(depths, _ORDERS), axis=-1) * weights
    kernel = kernel[: len(light)]
    E = np.einsum("mij,mndj->mndi", kernel, light, optimize=True)
    turned = np.cos(np.arange(len(light))[:, None] * TURN.values())
    return np.einsum("mndi,mt->ndit", E, turned, optimize=True)


@functools.lru_cache(maxsize=4)
def _patch_kernel(up: tuple[float, ...], mu: tuple[float, ...]) -> Array:
    """What light of each azimuthal order along mu brings to patches, (orders, i, j)."""
    around = 2.0 * math.pi * (np.arange(_AROUND) + 0.5) / _AROUND
    n, light = np.array(up)[:, None, None], np.array(mu)[:, None]
    across = np.sqrt(1.0 - n * n) * np.sqrt(1.0 - light * light)
    facing = np.maximum(n * light + across * np.cos(around), 0.0)
    orders = np.cos(np.arange(_ORDERS)[:, None] * around)
    return np.einsum("ijt,mt->mij", facing, orders) * (2.0 * math.pi / _AROUND)


def _boundary_image(field: SolvedField, mu: Array, turns: Array, rising: Array) -> Array:
    """Radiance of the surface, and of the floor where mu < 0, (n, ELEVATIONS, AZIMUTHS).

    ``rising`` is M at the surface; elevations lie evenly about the horizon.
    """
    up = np.maximum(mu, np.abs(mu).min())[:, None]
    across = np.sqrt(1.0 - up * up)
    around = turns + math.atan2(field.sun[1], field.sun[0])
    w = np.broadcast_arrays(-across * np.cos(around), -across * np.sin(around), up)
    below = rising[:, np.minimum(np.arange(ELEVATIONS), np.arange(ELEVATIONS)[::-1])]
    above = np.moveaxis(field.surface_radiance(w, np.moveaxis(below, 0, -1)), -1, 0)
    return np.where(mu[:, None] > 0, above, field.floor_radiance[:, None, None])
