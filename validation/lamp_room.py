"""Monte Carlo of lamps in a room of simple objects: floor, ellipsoids and boxes in endless water.

Paths start at the camera, at the origin. Each straight part of one is lit by the lamps as a ray of
the camera is: what they send into it by one scattering more is sought where it is likely, along
the whole part, and a surface at its end has their unscattered light. Nothing is blurred.

A phase function that rises to its peak as a power makes rare paths bring most of the light. Its
peak is cut off at a small angle (:func:`cut`): what is scattered by less goes straight on, which
blurs the picture by about that.
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
from .lamp_photons import PhaseTables

type Array = NDArray[np.float64]

BATCHES = 10
_FAR, _NEAR = 1e9, 1e-7  # m
_NEAREST = 1e-4  # of a ray to the lamp, m
_FAINT = 0.05  # weight below which half of the paths go on
_MOST = 400  # scatterings
_GUIDED = 0.3  # of the directions are sought about a lamp


@dataclass(frozen=True, eq=False)
class Room:
    """Objects, seen from the camera; z is up, and the floor at that height, m.

    ``ellipsoids`` and ``boxes``, shape (k, 6), are middles and half axes, m; ``colours``, shape (1
    + k, 3), are of the floor, the ellipsoids and the boxes.
    """

    floor: float
    ellipsoids: Array
    boxes: Array
    colours: Array


@dataclass(frozen=True, eq=False)
class View:
    """The blocks of a picture of a camera at the origin that looks along y.

    ``size`` is that of a block, at a distance of 1.
    """

    rows: int
    columns: int
    size: float


def cut(phase: PhaseTables, angle: float) -> tuple[PhaseTables, float]:
    """Return a phase function as high up to an angle (rad) as there, and its part of the light.

    An angle of 0 leaves it as it is.
    """
    s2 = math.sin(angle / 2.0) ** 2
    if s2 == 0.0:
        return phase, 1.0
    highest = float(phase.per_steradian(np.array([s2]))[0])
    fraction, edges = np.copy(phase.fraction), np.union1d(phase.edges, s2)
    fraction = np.interp(edges, phase.edges, fraction)
    level = 4.0 * math.pi * highest
    kept = np.where(
        edges < s2, level * edges, fraction - np.interp(s2, edges, fraction) + level * s2
    )
    whole = float(kept[-1])
    log_p = np.minimum(phase.log_p, math.log(highest)) - math.log(whole)
    return PhaseTables(phase.log_s2, log_p, kept / whole, edges), whole


def traced(
    view: View,
    lamps: Sequence[Lamp],
    water: tuple[float, float],
    phase: PhaseTables,
    room: Room,
    reflectance: Array,
    seed: int,
    paths: int,
) -> Array:
    """Radiance over the lamps' intensity, shape (rows, columns, BATCHES).

    Lamps are spots of one intensity, at places as seen from the camera; the water is its absorption
    and scattering, 1/m; the reflectance, shape (1 + k,), that of the objects in the one band;
    paths are those of each block, in all batches.
    """
    rows = np.array([(*lamp.position, *lamp.axis, *_cone(lamp)) for lamp in lamps])
    tables = phase.log_s2, phase.log_p, phase.fraction, phase.edges
    objects = room.floor, room.ellipsoids, room.boxes
    seen = view.rows, view.columns, view.size
    return _traced(seen, rows, *water, tables, objects, reflectance, seed, paths)


def seen_first(view: View, room: Room) -> NDArray[np.int64]:
    """Number of what the middle of each block shows, as of :attr:`Room.colours`; -1 is water."""
    objects = room.floor, room.ellipsoids, room.boxes
    found = np.empty((view.rows, view.columns), np.int64)
    for i, j in np.ndindex(found.shape):
        w = np.array([j + 0.5 - view.columns / 2.0, 1.0 / view.size, view.rows / 2.0 - i - 0.5])
        x, y, z = w / np.linalg.norm(w)
        found[i, j] = _first(0.0, 0.0, 0.0, x, y, z, objects)[1]
    return found


def _cone(lamp: Lamp) -> tuple[float, float]:
    assert isinstance(lamp.profile, SpotProfile)
    edge = lamp.profile.edge
    return edge, 1.0 / ((1.0 - edge) * lamp.profile.blend)


@njit(cache=True)
def _first(x, y, z, wx, wy, wz, objects):
    """Distance, number and normal of what a ray meets first; number -1 without."""
    floor, ellipsoids, boxes = objects
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
    fraction = (value - places[i]) / (places[i + 1] - places[i])
    return values[i] + fraction * (values[i + 1] - values[i])


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
def _shines(lamp, cosine):
    place = min(max((cosine - lamp[6]) * lamp[7], 0.0), 1.0)
    return place * place * (3.0 - 2.0 * place)


@njit(cache=True)
def _half_angle(s, h):
    small = math.atan2(h, math.hypot(s, h) + abs(s))
    return small if s < 0.0 else math.pi / 2.0 - small


@njit(cache=True)
def _once(x, y, z, wx, wy, wz, P, lamp, water, objects):
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
    if _first(lamp[0], lamp[1], lamp[2], px, py, pz, objects)[0] < r - 1e-6:
        return 0.0
    path = max(t0 + h * math.tan(angle), 0.0)
    p = _per_steradian(math.sin(angle) ** 2, log_s2, log_p)
    return 6.0 * q * q * (end - start) / h * p * light * math.exp(-c * path)


@njit(cache=True)
def _irradiance(x, y, z, nx, ny, nz, lamp, c, objects):
    """Unscattered light of a lamp on a patch."""
    lx, ly, lz, r = _towards(lamp, x, y, z)
    cosine = lx * nx + ly * ny + lz * nz
    light = _shines(lamp, -(lx * lamp[3] + ly * lamp[4] + lz * lamp[5]))
    if cosine <= 0.0 or light == 0.0:
        return 0.0
    if _first(x, y, z, lx, ly, lz, objects)[0] < r:
        return 0.0
    return light * cosine * math.exp(-c * r) / (r * r)


@njit(parallel=True, cache=True)
def _traced(view, lamps, a, b, tables, objects, reflectance, seed, paths):
    log_s2, log_p, fraction, edges = tables
    c = a + b
    water = c, log_s2, log_p
    rows, columns, size = view
    found = np.zeros((rows * columns, BATCHES))
    for i in prange(rows * columns):
        np.random.seed(seed * 100003 + i)
        for k in range(paths):
            wx = (i % columns + np.random.random() - columns / 2.0) * size
            wz = (rows / 2.0 - i // columns - np.random.random()) * size
            wy = 1.0 / math.sqrt(wx * wx + 1.0 + wz * wz)
            wx, wz = wx * wy, wz * wy
            x, y, z = 0.0, 0.0, 0.0
            weight, light = 1.0, 0.0
            for _ in range(_MOST):
                P, item, nx, ny, nz = _first(x, y, z, wx, wy, wz, objects)
                for j in range(len(lamps)):
                    into = _once(x, y, z, wx, wy, wz, P, lamps[j], water, objects)
                    light += weight * b * into
                t = -math.log(1.0 - np.random.random()) / c
                if t < P:
                    weight *= b / c
                    x, y, z = x + t * wx, y + t * wy, z + t * wz
                    nx, ny, nz, s2 = wx, wy, wz, _looked_up(np.random.random(), fraction, edges)
                elif item < 0:
                    break
                else:
                    weight *= reflectance[item]
                    x, y, z = (
                        x + P * wx + _NEAR * nx,
                        y + P * wy + _NEAR * ny,
                        z + P * wz + _NEAR * nz,
                    )
                    for j in range(len(lamps)):
                        lit = _irradiance(x, y, z, nx, ny, nz, lamps[j], c, objects)
                        light += weight / math.pi * lit
                    s2 = (1.0 - math.sqrt(np.random.random())) / 2.0
                # Some paths go on towards a lamp, for near one there is most light.
                wx, wy, wz = nx, ny, nz
                if np.random.random() < _GUIDED:
                    wx, wy, wz, _ = _towards(lamps[np.random.randint(len(lamps))], x, y, z)
                    s2 = math.sin(0.5 * math.pi * np.random.random()) ** 2
                wx, wy, wz = _turned(wx, wy, wz, s2)
                cosine = wx * nx + wy * ny + wz * nz
                wanted = max(cosine, 0.0) / math.pi
                if t < P:
                    wanted = _per_steradian((1.0 - cosine) / 2.0, log_s2, log_p)
                guided = 0.0
                for j in range(len(lamps)):
                    lx, ly, lz, _ = _towards(lamps[j], x, y, z)
                    sine = math.sqrt(max(1.0 - (wx * lx + wy * ly + wz * lz) ** 2, 1e-14))
                    guided += 0.5 / (math.pi * math.pi * sine * len(lamps))
                weight *= wanted / (wanted + _GUIDED * (guided - wanted))
                if weight < _FAINT:
                    if weight == 0.0 or np.random.random() < 0.5:
                        break
                    weight *= 2.0
            found[i, k % BATCHES] += light
    return found.reshape(rows, columns, BATCHES) * (BATCHES / paths)
