"""Monte Carlo of lamps in a room of simple things: floor, ellipsoids and boxes in endless water.

Paths begin at the camera, at the origin. From each place where one is scattered or thrown back, the
lamps' light scattered once into the rest of its way is estimated as in :mod:`._lamp_photons`;
a tenth of the new directions are drawn about the lamps as well, or rare paths that come straight
to a lamp and are bent twice by little would bring most of the light.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.profile import SpotProfile
from ._lamp_photons import PhaseTables

type Array = NDArray[np.float64]

BATCHES = 10
KINDS = ("water alone", "a thing, seen", "a thing, scattered", "thrown back more than once")
"""What the light met: the last two of things that are seen through bent paths, and of several."""
_FAR, _NEAR = 1e9, 1e-7  # m
_NEAREST = 1e-4  # of a ray to the lamp, m
_ABOUT, _ABOUT_FROM_THINGS = 0.1, 0.3  # of the directions are drawn about lamps
_FAINT = 0.05  # weight below which half of the paths go on
_MOST = 400  # scatterings
_DECADES = 16.0
_NARROWEST = math.pi * math.exp(-_DECADES)


@dataclass(frozen=True, eq=False)
class Room:
    """Things, seen from the camera; z is up.

    Attributes
    ----------
    floor : float
        Height, m.
    ellipsoids, boxes : array, shape (k, 6)
        Middles and half axes, m.
    colours : array, shape (1 + k, 3)
        Of the floor, the ellipsoids and the boxes.
    """

    floor: float
    ellipsoids: Array
    boxes: Array
    colours: Array


def traced(
    directions: Array,
    lamps: Sequence[Lamp],
    water: tuple[float, float],
    phase: PhaseTables,
    room: Room,
    reflectance: Array,
    seed: int,
) -> Array:
    """Radiance over the lamps' intensity by what the light met, shape (n, 4, BATCHES).

    Parameters
    ----------
    directions : array, shape (n, photons, 3)
        Unit vectors; their mean is returned.
    lamps : sequence of Lamp
        Spots, of one intensity; places as seen from the camera.
    water : tuple of float
        Absorption and scattering, 1/m.
    phase : PhaseTables
    room : Room
    reflectance : array, shape (1 + k,)
        Of its things, in the one band.
    seed : int
    """
    rows = [(*lamp.position, *lamp.axis, *_cone(lamp)) for lamp in lamps]
    tables = phase.log_s2, phase.log_p, phase.share, phase.edges
    things = room.floor, room.ellipsoids, room.boxes
    return _trace(directions, np.array(rows), *water, tables, things, reflectance, seed)


def _cone(lamp: Lamp) -> tuple[float, float]:
    assert isinstance(lamp.profile, SpotProfile)
    edge = lamp.profile.edge
    return edge, 1.0 / ((1.0 - edge) * lamp.profile.blend)


@njit(cache=True)
def _first(x, y, z, wx, wy, wz, things):
    """Distance, number and normal of what a ray meets first; number -1 without."""
    floor, ellipsoids, boxes = things
    best, found, nx, ny, nz = _FAR, -1, 0.0, 0.0, 0.0
    if wz < 0.0 and z > floor:
        best, found, nz = (floor - z) / wz, 0, 1.0
    for i in range(len(ellipsoids)):
        mx, my, mz, rx, ry, rz = ellipsoids[i]
        px, py, pz, ux, uy, uz = (
            (x - mx) / rx,
            (y - my) / ry,
            (z - mz) / rz,
            wx / rx,
            wy / ry,
            wz / rz,
        )
        a, b = ux * ux + uy * uy + uz * uz, px * ux + py * uy + pz * uz
        d = b * b - a * (px * px + py * py + pz * pz - 1.0)
        if d > 0.0:
            t = (-b - math.sqrt(d)) / a
            if _NEAR < t < best:
                best, found = t, 1 + i
                nx, ny, nz = (px + t * ux) / rx, (py + t * uy) / ry, (pz + t * uz) / rz
                size = math.sqrt(nx * nx + ny * ny + nz * nz)
                nx, ny, nz = nx / size, ny / size, nz / size
    for i in range(len(boxes)):
        low, high, axis = -_FAR, _FAR, 0
        for k in range(3):
            p, w = (x, y, z)[k], (wx, wy, wz)[k]
            w = w if abs(w) > 1e-14 else 1e-14
            one, other = (
                (boxes[i, k] - boxes[i, 3 + k] - p) / w,
                (boxes[i, k] + boxes[i, 3 + k] - p) / w,
            )
            if min(one, other) > low:
                low, axis = min(one, other), k
            high = min(high, max(one, other))
        if _NEAR < low < min(high, best):
            best, found = low, 1 + len(ellipsoids) + i
            sign = -1.0 if (wx, wy, wz)[axis] > 0 else 1.0
            nx, ny, nz = sign * (axis == 0), sign * (axis == 1), sign * (axis == 2)
    return best, found, nx, ny, nz


@njit(cache=True)
def _looked_up(value, places, values):
    if value <= places[0]:
        return values[0]
    if value >= places[-1]:
        return values[-1]
    i = np.searchsorted(places, value, side="right") - 1
    share = (value - places[i]) / (places[i + 1] - places[i])
    return values[i] + share * (values[i + 1] - values[i])


@njit(cache=True)
def _per_steradian(s2, log_s2, log_p):
    return math.exp(_looked_up(math.log(max(s2, 1e-14)), log_s2, log_p))


@njit(cache=True)
def _turned(wx, wy, wz, s2):
    azimuth = 2.0 * math.pi * np.random.random()
    cosine, sine = 1.0 - 2.0 * s2, 2.0 * math.sqrt(max(s2 * (1.0 - s2), 0.0))
    sign = 1.0 if wz >= 0.0 else -1.0
    a = -1.0 / (sign + wz)
    b = wx * wy * a
    c, s = sine * math.cos(azimuth), sine * math.sin(azimuth)
    x = cosine * wx + c * (1.0 + sign * wx * wx * a) + s * b
    y = cosine * wy + c * sign * b + s * (sign + wy * wy * a)
    z = cosine * wz - c * sign * wx - s * wy
    size = math.sqrt(x * x + y * y + z * z)
    return x / size, y / size, z / size


@njit(cache=True)
def _towards(lamp, x, y, z):
    dx, dy, dz = lamp[0] - x, lamp[1] - y, lamp[2] - z
    r = max(math.sqrt(dx * dx + dy * dy + dz * dz), 1e-9)
    return dx / r, dy / r, dz / r, r


@njit(cache=True)
def _about(lx, ly, lz):
    angle = math.pi * np.random.random()
    if np.random.random() < 0.5:
        angle = math.pi * math.exp(-_DECADES * np.random.random())
    return _turned(lx, ly, lz, math.sin(angle / 2.0) ** 2)


@njit(cache=True)
def _density_about(wx, wy, wz, lx, ly, lz):
    half = math.sqrt((wx - lx) ** 2 + (wy - ly) ** 2 + (wz - lz) ** 2) / 2.0
    angle = 2.0 * math.asin(min(half, 1.0))
    density = 1.0 / math.pi
    if angle > _NARROWEST:
        density += 1.0 / (_DECADES * angle)
    return density / (4.0 * math.pi * max(math.sin(angle), 1e-12))


@njit(cache=True)
def _shines(lamp, cosine):
    place = min(max((cosine - lamp[6]) * lamp[7], 0.0), 1.0)
    return place * place * (3.0 - 2.0 * place)


@njit(cache=True)
def _half_angle(s, h):
    small = math.atan2(h, math.hypot(s, h) + abs(s))
    return small if s < 0.0 else math.pi / 2.0 - small


@njit(cache=True)
def _once(x, y, z, wx, wy, wz, P, lamp, water, things):
    """Light of a lamp scattered once into a ray, over b, from a random place of it."""
    c, log_s2, log_p = water
    lx, ly, lz, r = _towards(lamp, x, y, z)
    t0 = r * (lx * wx + ly * wy + lz * wz)
    nx, ny, nz = wx * t0 - r * lx, wy * t0 - r * ly, wz * t0 - r * lz
    h = max(math.sqrt(nx * nx + ny * ny + nz * nz), _NEAREST)
    start = _half_angle(-t0, h) ** (1.0 / 3.0)
    end = min(_half_angle(P - t0, h), math.pi / 2.0 - 1e-9) ** (1.0 / 3.0)
    q = start + (end - start) * np.random.random()
    angle = q**3
    s = -h / math.tan(2.0 * angle)
    px, py, pz = nx + s * wx, ny + s * wy, nz + s * wz
    r = max(math.sqrt(px * px + py * py + pz * pz), 1e-9)
    px, py, pz = px / r, py / r, pz / r
    light = _shines(lamp, px * lamp[3] + py * lamp[4] + pz * lamp[5])
    if light == 0.0:
        return 0.0
    if _first(lamp[0], lamp[1], lamp[2], px, py, pz, things)[0] < r - 1e-6:
        return 0.0
    path = max(t0 + h * math.tan(angle), 0.0)
    p = _per_steradian(math.sin(angle) ** 2, log_s2, log_p)
    return 6.0 * q * q * (end - start) / h * p * light * math.exp(-c * path)


@njit(cache=True)
def _irradiance(x, y, z, nx, ny, nz, lamp, c, things):
    """Unscattered light of a lamp on a patch."""
    lx, ly, lz, r = _towards(lamp, x, y, z)
    cosine = lx * nx + ly * ny + lz * nz
    light = _shines(lamp, -(lx * lamp[3] + ly * lamp[4] + lz * lamp[5]))
    if cosine <= 0.0 or light == 0.0:
        return 0.0
    if _first(x, y, z, lx, ly, lz, things)[0] < r:
        return 0.0
    return light * cosine * math.exp(-c * r) / (r * r)


@njit(parallel=True, cache=True)
def _trace(directions, lamps, a, b, tables, things, reflectance, seed):
    log_s2, log_p, share, edges = tables
    water = a + b, log_s2, log_p
    n, photons = directions.shape[:2]
    c = a + b
    found = np.zeros((n, 4, BATCHES))
    for i in prange(n):
        np.random.seed(seed * 100003 + i)
        for k in range(photons):
            batch = k % BATCHES
            x, y, z = 0.0, 0.0, 0.0
            wx, wy, wz = directions[i, k]
            weight, thrown, bent = 1.0, 0, False
            for order in range(_MOST):
                P, thing, nx, ny, nz = _first(x, y, z, wx, wy, wz, things)
                if order == 0:
                    for j in range(len(lamps)):
                        found[i, 0, batch] += b * _once(
                            x, y, z, wx, wy, wz, P, lamps[j], water, things
                        )
                t = -math.log(1.0 - np.random.random()) / c
                on_thing = t >= P
                if on_thing:
                    if thing < 0:
                        break
                    weight *= reflectance[thing]
                    thrown += 1
                    x, y, z = (
                        x + P * wx + _NEAR * nx,
                        y + P * wy + _NEAR * ny,
                        z + P * wz + _NEAR * nz,
                    )
                    before_x, before_y, before_z = nx, ny, nz
                else:
                    weight *= b / c
                    bent = bent or thrown == 0
                    x, y, z = x + t * wx, y + t * wy, z + t * wz
                    before_x, before_y, before_z = wx, wy, wz
                if weight == 0.0:
                    break
                kind = 0 if thrown == 0 else 3 if thrown > 1 else 2 if bent else 1
                if on_thing:
                    for j in range(len(lamps)):
                        found[i, kind, batch] += (
                            weight / math.pi * _irradiance(x, y, z, nx, ny, nz, lamps[j], c, things)
                        )
                    s2 = (1.0 - math.sqrt(np.random.random())) / 2.0
                else:
                    s2 = _looked_up(np.random.random(), share, edges)
                # Where to look for light that is scattered once: half about the lamp.
                for j in range(len(lamps)):
                    lx, ly, lz, _ = _towards(lamps[j], x, y, z)
                    if np.random.random() < 0.5:
                        sx, sy, sz = _turned(before_x, before_y, before_z, s2)
                    else:
                        sx, sy, sz = _about(lx, ly, lz)
                    if on_thing:
                        p = max(sx * nx + sy * ny + sz * nz, 0.0) / math.pi
                    else:
                        half = (sx - before_x) ** 2 + (sy - before_y) ** 2 + (sz - before_z) ** 2
                        p = _per_steradian(half / 4.0, log_s2, log_p)
                    if p > 0.0:
                        P = _first(x, y, z, sx, sy, sz, things)[0]
                        chosen = 2.0 * p / (p + _density_about(sx, sy, sz, lx, ly, lz))
                        found[i, kind, batch] += (
                            weight
                            * chosen
                            * b
                            * _once(x, y, z, sx, sy, sz, P, lamps[j], water, things)
                        )
                # Where to go on.
                towards = _ABOUT_FROM_THINGS if on_thing else _ABOUT
                if np.random.random() >= towards:
                    wx, wy, wz = _turned(before_x, before_y, before_z, s2)
                else:
                    lx, ly, lz, _ = _towards(lamps[np.random.randint(len(lamps))], x, y, z)
                    wx, wy, wz = _about(lx, ly, lz)
                density = 0.0
                for j in range(len(lamps)):
                    lx, ly, lz, _ = _towards(lamps[j], x, y, z)
                    density += _density_about(wx, wy, wz, lx, ly, lz) / len(lamps)
                if on_thing:
                    p = max(wx * nx + wy * ny + wz * nz, 0.0) / math.pi
                else:
                    half = (wx - before_x) ** 2 + (wy - before_y) ** 2 + (wz - before_z) ** 2
                    p = _per_steradian(half / 4.0, log_s2, log_p)
                weight *= p / ((1.0 - towards) * p + towards * density)
                if weight < _FAINT:
                    if np.random.random() < 0.5:
                        break
                    weight *= 2.0
    return found * (BATCHES / photons)
