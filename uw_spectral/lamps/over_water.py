"""A lamp in the air that shines into the water: what stands for it as seen from below.

Its rays are refracted at the surface, by Snell and Fresnel, and followed to a usual depth.
Where its axis enters the water they seem to come from an apparent place above: halfway between the
foci across and along the plane of incidence, n H cos θ_w / cos θ at the vertical of the lamp and
H n cos² θ_w / cos³ θ back along the ray. About the refracted axis the power between two angles from
it is that of the rays that arrive there: the mean over the azimuth, which loses nothing. Waves turn
the rays by facets of normal slopes, on average: no caustics of the lamp and no glitter.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np
from numpy.typing import NDArray

from ..content import constant
from ..surface.refraction import seen_from_air
from ..transfer.radiance_field import surface_normal
from ..transfer.rough_surface import WaterSurface, facet_slopes
from .lamp import Lamp
from .profile import IsotropicProfile, LampProfile, TableProfile

Array = NDArray[np.float64]

TYPICAL_DEPTH = 3.0
"""Of what the lamp shines on, m: there irradiance on level ground is right, on the whole."""
_FLATTEST = 0.35
"""Cosine of an axis to the vertical from which on it is that straight down."""
_WIDE = 0.3  # cosine of the beam of lamps that have no axis to speak of
_ANGLES, _AROUND = 1024, 64  # rays of a flat surface
_FEWER = (256, 32)  # of each facet
_RINGS, _FACETS = 5, 12
_POINTS = 96  # of the profile
_LEAST = 1e-6


def through_surface(lamp: Lamp, surface: WaterSurface) -> Lamp:
    """Return what lights the water, z < 0, for a lamp in the air; a lamp in the water as it is.

    The surface has the index 1 where there is none.
    """
    height = float(lamp.position[2])
    if height <= 0.0:
        return lamp
    axis = tuple(float(x) for x in lamp.axis)
    (x, y, z), axis, profile, gain = _seen(lamp.profile, axis, height, surface)
    return dataclasses.replace(
        lamp,
        position=(float(lamp.position[0]) + x, float(lamp.position[1]) + y, z),
        axis=axis,
        intensity=np.asarray(lamp.intensity) * gain,
        profile=profile,
        seen=0.0,
        dry=z,
        stands=tuple(float(x) for x in lamp.position),
    )


@functools.lru_cache(maxsize=64)
def _seen(
    profile: LampProfile, axis: tuple[float, ...], height: float, surface: WaterSurface
) -> tuple[tuple[float, ...], tuple[float, ...], TableProfile, float]:
    """Apparent place beside a lamp and over the water, axis, profile, and factor on intensity."""
    n = surface.refractive_index
    wide = isinstance(profile, IsotropicProfile) or float(profile.beam) < _WIDE
    along = np.array((0.0, 0.0, -1.0) if wide or -axis[2] < _FLATTEST else axis)
    cosine = -along[2]
    _, refracted, _ = seen_from_air(tuple(along), (0.0, 0.0, 1.0), n)
    inside = -refracted[2]
    back = height * n / cosine * (1.0 + (inside / cosine) ** 2) / 2.0
    entry = height / cosine * along[:2]
    place = np.array([*entry, 0.0]) - back * np.array(refracted)
    points, power = _arriving(profile, np.array(axis), along, height, surface)
    found = TableProfile(*_profile(points - place, power, np.array(refracted)))
    gain = float(found.values.max())
    found = TableProfile(found.cosines, constant(found.values / max(gain, _LEAST)))
    return tuple(map(float, place)), tuple(map(float, refracted)), found, gain


def _profile(places: Array, power: Array, axis: Array) -> tuple[Array, Array]:
    """Radiant intensity by the cosine from an axis of power that arrives at places, by rings."""
    r = np.linalg.norm(places, axis=-1)
    fraction = np.clip(0.5 - 0.5 * (places @ axis) / r, 0.0, 1.0)
    # Even in the sine of half the angle; at the last of them there is no light.
    widest = (
        math.sqrt(max(float(fraction.max(initial=0.0)), _LEAST)) * (_POINTS - 1.0) / (_POINTS - 2.0)
    )
    at = np.sqrt(fraction) / widest * (_POINTS - 1.0)
    low = np.minimum(at.astype(int), _POINTS - 2)
    edges = (widest * np.arange(_POINTS) / (_POINTS - 1.0)) ** 2
    # Linear between the points: each ray is shared by its two neighbours.
    upper = (fraction - edges[low]) / (edges[low + 1] - edges[low])
    found = np.bincount(low, power * (1.0 - upper), _POINTS)
    found += np.bincount(low + 1, power * upper, _POINTS)
    width = np.diff(edges)
    held = np.concatenate([[0.0], width]) / 2.0 + np.concatenate([width, [0.0]]) / 2.0
    values = found / (4.0 * math.pi * held)
    return constant((1.0 - 2.0 * edges)[::-1]), constant(values[::-1])


def _arriving(
    profile: LampProfile, axis: Array, middle: Array, height: float, surface: WaterSurface
) -> tuple[Array, Array]:
    """Where rays of a lamp arrive at the usual depth, (k, 3), and their power over the intensity.

    They are even in angle about a middle one: the lamp's axis, or straight down. Places are seen
    from the point straight below the lamp, at the surface.
    """
    count, around = _FEWER if surface.slope_variance else (_ANGLES, _AROUND)
    widest = math.pi / 2.0
    if profile.edge is not None and np.array_equal(middle, axis):
        widest = math.acos(float(profile.edge))
    theta = (np.arange(count) + 0.5) * (widest / count)
    turns = 2.0 * math.pi * (np.arange(around) + 0.5) / around
    across = np.cross(middle, np.eye(3)[int(np.argmin(np.abs(middle)))])
    across /= np.linalg.norm(across)
    other = np.cross(middle, across)
    circle = np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * other
    v = np.cos(theta)[:, None, None] * middle + np.sin(theta)[:, None, None] * circle
    area = np.repeat(np.sin(theta) * (widest / count * 2.0 * math.pi / around), around)
    v = v.reshape(-1, 3)
    power = np.asarray(profile.value(v @ axis)) * area
    falling = (v[:, 2] < -_LEAST) & (power > 0)
    v, power = v[falling], power[falling]
    if surface.slope_variance:
        x, y, part = facet_slopes(surface.slope_variance, _RINGS, _FACETS)
    else:
        x, y, part = np.zeros(1), np.zeros(1), np.ones(1)
    normal = np.stack(surface_normal(x, y), axis=-1)
    # A ray meets facets in proportion to the area that they turn to it.
    turned = np.maximum(-(v @ normal.T), 0.0) / normal[:, 2] * part
    turned /= np.maximum(turned.sum(axis=1, keepdims=True), _LEAST)
    entry = v[:, :2] * (height / -v[:, 2])[:, None]
    places, arriving = [], []
    for facet, fraction in zip(normal, turned.T, strict=True):
        R, w, _ = seen_from_air(tuple(v.T), tuple(facet), surface.refractive_index)
        w = np.stack(np.broadcast_arrays(*w), axis=-1)
        goes = (w[:, 2] < -_LEAST) & (fraction > 0)
        down = w[goes]
        to = entry[goes] + down[:, :2] * (TYPICAL_DEPTH / -down[:, 2])[:, None]
        places.append(np.column_stack([to, np.full(len(to), -TYPICAL_DEPTH)]))
        arriving.append((power * fraction * (1.0 - R))[goes])
    return np.concatenate(places), np.concatenate(arriving)
