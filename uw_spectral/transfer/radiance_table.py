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

from ..look_up import multilinear
from ..mathematics import NUMPY, Mathematics, Operand
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
_ANGLE = (ANGLES - 1) / math.log(WIDEST / SUN_DISC)
_ORDERS, _AROUND = 12, 256  # azimuthal orders of the light on patches, and of what brings it

Array = NDArray[np.float64]


def elevation(w_z: Operand, m: Mathematics = NUMPY) -> Operand:
    """Position of a direction's upward component among the elevations.

    Examples
    --------
    >>> elevation(np.array([-1.0, 0.0, 1.0]))
    array([ 0. , 23.5, 47. ])
    """
    from_horizon = _from_horizon(w_z, m)
    warped = from_horizon * (1.0 + _HORIZON) / (from_horizon + _HORIZON)
    return _signed(warped, w_z, ELEVATIONS, m)


def tilt(n_z: Operand, m: Mathematics = NUMPY) -> Operand:
    """Position of a normal's upward component among the tilts of patches.

    What lies below is dim, and brightens fast as a patch is tilted: tilts are as dense there.
    """
    return _signed(_from_horizon(n_z, m), n_z, TILTS, m)


def _from_horizon(up: Operand, m: Mathematics) -> Operand:
    """Fraction of the way from the horizon to the zenith or the nadir in a stereographic map."""
    size = m.minimum(m.absolute(up), 1.0)
    across = m.sqrt(m.maximum(1.0 - size * size, 0.0))
    return 1.0 - across / (1.0 + size)


def _signed(fraction: Operand, up: Operand, count: int, m: Mathematics) -> Operand:
    half = (count - 1) / 2
    return half + half * (2.0 * m.less(0.0, up) - 1.0) * fraction


def azimuth(
    w: Sequence[Operand],
    sun: Sequence[Operand],
    count: int = AZIMUTHS,
    m: Mathematics = NUMPY,
) -> Operand:
    """Position of a direction among so many azimuths: 0 towards the sun.

    ``w`` is a unit view direction, z up, or the normal of a patch; ``sun`` the direction of
    sunlight.
    """
    size = (w[0] * w[0] + w[1] * w[1]) * (sun[0] * sun[0] + sun[1] * sun[1])
    away = (w[0] * sun[0] + w[1] * sun[1]) / m.sqrt(m.maximum(size, _SLANT**4))
    return (count - 1.0) * m.sqrt(m.clamp(0.5 + 0.5 * away, 0.0, 1.0))


def sun_angle(s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Position of an angle to the sun, by the squared sine of its half, among ``ANGLES``."""
    return _ANGLE * m.log(m.clamp(s2, SUN_DISC, WIDEST) / SUN_DISC)


def table_unit(scale: Operand, decay: Operand, y: Operand, m: Mathematics = NUMPY) -> Operand:
    """What the tables are divided by at depth y."""
    return scale * m.exp(-decay * y)


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
        y, *w = np.broadcast_arrays(y, *w)
        place = self.depth_scale.slice(y), elevation(w[2]), azimuth(w, sun)
        return interpolate(self.radiance, place) * table_unit(self.scale, self.decay, y[..., None])

    def patch_irradiance(self, y: Array, normal: Sequence[Array], sun: Sequence[float]) -> Array:
        """Irradiance on a patch at depth y, without the direct sun, shape (..., n)."""
        y, *n = np.broadcast_arrays(y, *normal)
        place = self.depth_scale.slice(y), tilt(n[2]), azimuth(n, sun, TURNS)
        found = interpolate(self.irradiance, place)
        return found * table_unit(self.scale, self.decay, y[..., None])

    def boundary_image(self, w: Sequence[Array], sun: Sequence[float]) -> Array:
        """Radiance of the surface from just below, or of the floor, along w, (..., n)."""
        w = np.broadcast_arrays(*w)
        place = elevation(w[2]), azimuth(w, sun)
        return interpolate(self.image, place) * self.scale


@functools.lru_cache(maxsize=8)
def tabulate(field: SolvedField) -> RadianceTable:
    """Tabulate a solved field, once."""
    # Beyond it the light falls off as it does there.
    deepest = _deepest(field)
    depth_scale = _depth_scale(field, deepest)
    depths = depth_scale.depths()
    decay = decay_rate(depths, field.scalar_irradiance(depths))
    grown = np.exp(np.minimum(decay[:, None] * depths, _LARGEST_EXPONENT))[..., None, None]
    mu, turns = elevations(), azimuths(AZIMUTHS)
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
        field.aureole(depths, angles()),
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


def elevations() -> Array:
    """Upward components of directions: what :func:`elevation` inverts."""
    return _upward(ELEVATIONS, _HORIZON)


def tilts() -> Array:
    """Upward components of normals: what :func:`tilt` inverts."""
    return _upward(TILTS)


def angles() -> Array:
    """Squared sines of half the angles to the sun: what :func:`sun_angle` inverts."""
    return SUN_DISC * np.exp(np.arange(ANGLES) / _ANGLE)


def _upward(count: int, horizon: float = math.inf) -> Array:
    half = (count - 1) / 2
    warped = (np.arange(count) - half) / half
    size = np.abs(warped)
    t = 1.0 - size / (1.0 + (1.0 - size) / horizon)
    return np.sign(warped) * (1.0 - t * t) / (1.0 + t * t)


def azimuths(count: int) -> Array:
    """Angles to the sun's azimuth: what :func:`azimuth` inverts."""
    return 2.0 * np.arcsin(np.arange(count) / (count - 1))


def _on_patches(field: SolvedField, depths: Array) -> Array:
    """Irradiance on patches at depths, shape (n, d, TILTS, TURNS)."""
    mu = np.concatenate([field.mu, -field.mu])
    weights = np.concatenate([field.weights, field.weights])
    kernel = _patch_kernel(tuple(tilts().tolist()), tuple(mu.tolist()))
    light = np.concatenate(field.stream_modes(depths, _ORDERS), axis=-1) * weights
    kernel = kernel[: len(light)]
    E = np.einsum("mij,mndj->mndi", kernel, light, optimize=True)
    turned = np.cos(np.arange(len(light))[:, None] * azimuths(TURNS))
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


def interpolate(table: Array, place: Sequence[Array]) -> Array:
    """Interpolate linearly along the axes after the bands, shape (..., n)."""
    return multilinear(np.moveaxis(table, 0, -1), place)
