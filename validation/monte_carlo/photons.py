"""The photons: elementary steps, written once, and the vectorised numpy engine.

The steps are elementwise; the numpy engine calls them on arrays, the numba
engine compiles the same functions for single photons. Axes: x, y horizontal,
z up; depth is positive down.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.surface.refraction import fresnel_reflectance

Array = NDArray[np.float64]
TWO_PI = 2.0 * math.pi
ED, EU, EOD, EOU = range(4)


class PhaseTables(NamedTuple):
    """Everything a photon needs to know; n bands, k events, p phase functions.

    The events are absorptions, then scatterings, then the j inelastic
    processes; two boundary events follow in the tallies.
    """

    c: Array  # (n,) extinction
    roulette: Array  # (k, n) cumulative probability of the events
    absorptions: int
    inelastic_from: int  # first inelastic event
    s2: Array  # (m,) edges of the inverse CDF
    cdf: Array  # (p, m); function i belongs to event absorptions + i
    density: Array  # (p, q) 1/sr on an even grid of sin(angle/2)
    seen: Array  # (p, q) the same, averaged over the cone of a radiance meter
    emission: Array  # (j, n, n) cumulative over the emission band
    energy_ratio: Array  # (n, n) photon energy after over before
    packet: Array  # (n,) power of one photon packet that starts in the band
    sun_fraction: Array  # (n,) probability that it comes from the sun
    sun: Array  # (3,) travel direction
    sky_cdf: Array  # inverse CDF of the cosine of skylight in the water
    sky_cosine: Array
    refractive_index: float  # of the water against air; 1 without a surface
    floor: float
    floor_reflectance: Array  # (n,)
    floor_planar: Array  # (d, n) fraction of the floor's light that reaches each depth, as Eu
    floor_scalar: Array  # (d, n) and as Eou
    depths: Array  # (d,) irradiance meters, increasing
    meter_depth: Array  # (v,) radiance meters
    meter_travel: Array  # (v, 3) travel direction of the light they see
    meter_low: Array  # (v,) the depths whose scattering they see directly
    meter_high: Array
    meter_mirror: Array  # (v,) reflectance of the surface for what they see mirrored; 0: nothing
    meter_floor: Array  # (v,) the same for the floor; 1: seen directly


class Tallies(NamedTuple):
    """Sums over photons; o origins: elastic, then the inelastic processes."""

    flux: Array  # (4, o, d, n): Ed, Eu, Eod, Eou
    radiance: Array  # (o, v, n)
    events: NDArray[np.int64]  # (k + 2, n) how many, by band before the event
    energy: Array  # (k + 2, n) power of the packets at the event
    deposit: Array  # (k + 2, n) power that ends there

    @classmethod
    def empty(cls, t: PhaseTables) -> Tallies:
        """Return tallies of zeros."""
        n, o = len(t.c), 1 + len(t.emission)
        events = (len(t.roulette) + 2, n)
        return cls(
            np.zeros((4, o, len(t.depths), n)),
            np.zeros((o, len(t.meter_depth), n)),
            np.zeros(events, dtype=np.int64),
            np.zeros(events),
            np.zeros(events),
        )


def turned(ux, uy, uz, s2, azimuth):  # noqa: ANN001, ANN201
    """Return the direction turned by an angle of s2 = sin²(angle/2), about itself by azimuth.

    The basis has no special case: T. Duff et al., J. Comput. Graph. Tech. 6(1), 2017.
    """
    side = np.copysign(1.0, uz)
    p = -1.0 / (side + uz)
    q = ux * uy * p
    cosine = 1.0 - 2.0 * s2
    sine = 2.0 * np.sqrt(s2 * (1.0 - s2))
    s, t = sine * np.cos(azimuth), sine * np.sin(azimuth)
    x = s * (1.0 + side * ux * ux * p) + t * q + cosine * ux
    y = s * side * q + t * (side + uy * uy * p) + cosine * uy
    z = -s * side * ux - t * uy + cosine * uz
    length = np.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def between(low, high, fraction):  # noqa: ANN001, ANN201
    """Interpolate linearly."""
    return low + (high - low) * fraction


def fraction_of(x, low, high):  # noqa: ANN001, ANN201
    """Where x lies between low and high, 0 to 1; 0 in an empty interval."""
    return (x - low) / np.maximum(high - low, 1e-300)


def half_sine(ux, uy, uz, dx, dy, dz):  # noqa: ANN001, ANN201
    """Sine of half the angle between two directions."""
    x, y, z = ux - dx, uy - dy, uz - dz
    return np.minimum(0.5 * np.sqrt(x * x + y * y + z * z), 1.0)


def survival(c, height, cosine):  # noqa: ANN001, ANN201
    """Probability to cross a height at a slant without an event."""
    return np.exp(-c * height / np.maximum(cosine, 1e-12))


def shared(p):  # noqa: ANN001, ANN201
    """Balance heuristic: weight of a direction drawn by p, 1/sr, or evenly from a hemisphere.

    The same number for both: p/(p + q) is the weight of the first, and q/(p + q)
    times p/q what the second counts.
    """
    return p / (p + 1.0 / TWO_PI)


def free_path(xi, c):  # noqa: ANN001, ANN201
    """Sample a distance, m; xi in [0, 1)."""
    return -np.log1p(-xi) / np.maximum(c, 1e-300)


def trace(rng: np.random.Generator, per_band: int, t: PhaseTables, out: Tallies) -> None:
    """Follow ``per_band`` photons of each band until all have ended; add to the tallies."""
    n = len(t.c)
    band = np.repeat(np.arange(n), per_band)
    ux, uy, uz = _enter(rng, band, t)
    y, energy, weight = np.zeros(len(band)), t.packet[band], np.ones(len(band))
    origin = np.zeros(len(band), dtype=np.int64)
    surface, floor = len(t.roulette), len(t.roulette) + 1
    while len(band):
        _tally_flights(y, uz, band, origin, energy * weight, t, out)
        weight[:] = 1.0
        end = y - uz * free_path(rng.random(len(band)), t.c[band])
        alive = np.ones(len(band), dtype=bool)

        top = np.flatnonzero(end < 0)
        if len(top):
            back = rng.random(len(top)) < fresnel_reflectance(
                np.abs(uz[top]), 1.0 / t.refractive_index
            )
            uz[top[back]] *= -1.0
            gone = top[~back]
            _tally_event(surface, band[gone], energy[gone], energy[gone], out)
            alive[gone] = False

        low = np.flatnonzero(end > t.floor)
        if len(low):
            r = t.floor_reflectance[band[low]]
            for v in range(len(t.meter_depth)):
                L = energy[low] * r / math.pi * _from_floor(v, t.c[band[low]], t)
                _tally_radiance(v, origin[low], band[low], L, out)
            _tally_floor(origin[low], band[low], energy[low] * r, t, out)
            back = rng.random(len(low)) < r
            gone, low = low[~back], low[back]
            _tally_event(floor, band[gone], energy[gone], energy[gone], out)
            alive[gone] = False
            weight[low] = 0.0  # the flight is in the tally already
            uz[low] = np.sqrt(1.0 - rng.random(len(low)))
            across, azimuth = np.sqrt(1.0 - uz[low] ** 2), TWO_PI * rng.random(len(low))
            ux[low], uy[low] = across * np.cos(azimuth), across * np.sin(azimuth)

        y = np.clip(end, 0.0, t.floor)
        inside = np.flatnonzero((end >= 0) & (end <= t.floor))
        chance = rng.random(len(inside))
        event = (chance >= t.roulette[:, band[inside]]).sum(axis=0)
        event = np.minimum(event, len(t.roulette) - 1)
        absorbed = event < t.absorptions
        gone = inside[absorbed]
        _tally_event(event[absorbed], band[gone], energy[gone], energy[gone], out)
        alive[gone] = False
        at, event = inside[~absorbed], event[~absorbed]

        elastic = event < t.inelastic_from
        scattered = at[elastic]
        nothing = np.zeros(len(scattered))
        _tally_event(event[elastic], band[scattered], energy[scattered], nothing, out)
        shifted, kind = at[~elastic], event[~elastic] - t.inelastic_from
        before, power = band[shifted], energy[shifted]
        cumulative = t.emission[kind, before]
        after = (rng.random(len(shifted))[:, None] >= cumulative).sum(axis=1)
        emitted = after < n
        after = np.minimum(after, n - 1)
        left = power * t.energy_ratio[before, after] * emitted
        _tally_event(event[~elastic], before, power, power - left, out)
        alive[shifted[~emitted]] = False
        band[shifted], energy[shifted], origin[shifted] = after, left, kind + 1

        going = alive[at]
        at, which = at[going], event[going] - t.absorptions
        for v in range(len(t.meter_depth)):
            p = _seen_by_meter(v, y[at], ux[at], uy[at], uz[at], which, t.c[band[at]], t)
            _tally_radiance(v, origin[at], band[at], energy[at] * p, out)
        before = ux[at], uy[at], uz[at]
        away = -np.copysign(rng.random(len(at)), before[2])
        across, azimuth = np.sqrt(1.0 - away * away), TWO_PI * rng.random(len(at))
        sine = half_sine(*before, across * np.cos(azimuth), across * np.sin(azimuth), away)
        back = energy[at] * shared(_phase(sine, which, t.density))
        _tally_flights(y[at], away, band[at], origin[at], back, t, out)
        s2 = _sample_s2(rng.random(len(at)), which, t)
        azimuth = TWO_PI * rng.random(len(at))
        ux[at], uy[at], uz[at] = turned(*before, s2, azimuth)
        turns_back = uz[at] * before[2] < 0
        weight[at] = np.where(turns_back, shared(_phase(np.sqrt(s2), which, t.density)), 1.0)

        if not alive.all():
            y, ux, uy, uz = y[alive], ux[alive], uy[alive], uz[alive]
            band, origin = band[alive], origin[alive]
            energy, weight = energy[alive], weight[alive]


def _enter(rng: np.random.Generator, band: NDArray, t: PhaseTables) -> tuple[Array, Array, Array]:
    xi, azimuth = rng.random(len(band)), TWO_PI * rng.random(len(band))
    sky = rng.random(len(band)) >= t.sun_fraction[band]
    cosine = np.interp(xi, t.sky_cdf, t.sky_cosine)
    across = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    return (
        np.where(sky, across * np.cos(azimuth), t.sun[0]),
        np.where(sky, across * np.sin(azimuth), t.sun[1]),
        np.where(sky, -cosine, t.sun[2]),
    )


def _sample_s2(xi: Array, which: NDArray, t: PhaseTables) -> Array:
    s2 = np.empty(len(xi))
    for i, cdf in enumerate(t.cdf):
        mine = which == i
        s2[mine] = np.interp(xi[mine], cdf, t.s2)
    return s2


def _tally_flights(
    y: Array, uz: Array, band: NDArray, origin: NDArray, energy: Array, t: PhaseTables, out: Tallies
) -> None:
    """Add the expected crossings of every meter by a flight from y up to the boundary."""
    n, o = len(t.c), out.flux.shape[1]
    cosine = np.abs(uz)
    for d, depth in enumerate(t.depths):
        for planar, scalar, crosses in (
            (ED, EOD, (uz < 0) & (y <= depth)),
            (EU, EOU, (uz > 0) & (y >= depth)),
        ):
            chosen = np.flatnonzero(crosses)
            if not len(chosen):
                continue
            where = origin[chosen] * n + band[chosen]
            reach = energy[chosen] * survival(
                t.c[band[chosen]], np.abs(depth - y[chosen]), cosine[chosen]
            )
            out.flux[planar, :, d] += np.bincount(where, reach, o * n).reshape(o, n)
            weight = reach / np.maximum(cosine[chosen], 1e-12)
            out.flux[scalar, :, d] += np.bincount(where, weight, o * n).reshape(o, n)


def _from_floor(v: int, c: Array, t: PhaseTables) -> Array:
    """Fraction of the floor's radiance that reaches meter v; coming down, by way of the surface."""
    dz = t.meter_travel[v, 2]
    way = t.floor - np.copysign(t.meter_depth[v], dz)
    return t.meter_floor[v] * survival(c, way, abs(dz))


def _tally_floor(
    origin: NDArray, band: NDArray, power: Array, t: PhaseTables, out: Tallies
) -> None:
    """Add the expected crossings of every meter by light from the floor."""
    _, o, _, n = out.flux.shape
    sent = np.bincount(origin * n + band, power, o * n).reshape(o, 1, n)
    out.flux[EU] += sent * t.floor_planar
    out.flux[EOU] += sent * t.floor_scalar


def _seen_by_meter(
    v: int, y: Array, ux: Array, uy: Array, uz: Array, which: NDArray, c: Array, t: PhaseTables
) -> Array:
    """Radiance per power at meter v of light scattered at y."""
    dx, dy, dz = t.meter_travel[v]
    height = t.meter_depth[v] - y
    cosine = abs(dz)
    ahead = (t.meter_low[v] <= y) & (y <= t.meter_high[v])
    direct = _phase(half_sine(ux, uy, uz, dx, dy, dz), which, t.seen)
    seen = np.where(ahead, direct * survival(c, np.abs(height), cosine), 0.0)
    if t.meter_mirror[v] > 0:
        mirrored = _phase(half_sine(ux, uy, uz, dx, dy, cosine), which, t.seen)
        seen += t.meter_mirror[v] * mirrored * survival(c, y + t.meter_depth[v], cosine)
    return seen / cosine


def _phase(sine: Array, which: NDArray, tables: Array) -> Array:
    x = sine * (tables.shape[1] - 1)
    cell = np.minimum(x.astype(np.int64), tables.shape[1] - 2)
    return between(tables[which, cell], tables[which, cell + 1], x - cell)


def _tally_event(
    event: NDArray | int, band: NDArray, energy: Array, deposit: Array, out: Tallies
) -> None:
    rows, n = out.events.shape
    where = event * n + band
    out.events[...] += np.bincount(where, minlength=rows * n).reshape(rows, n)
    out.energy[...] += np.bincount(where, energy, rows * n).reshape(rows, n)
    out.deposit[...] += np.bincount(where, deposit, rows * n).reshape(rows, n)


def _tally_radiance(v: int, origin: NDArray, band: NDArray, value: Array, out: Tallies) -> None:
    o, _, n = out.radiance.shape
    out.radiance[:, v] += np.bincount(origin * n + band, value, o * n).reshape(o, n)
