"""The photons one by one, compiled by numba from the same steps; imported only when chosen."""

from __future__ import annotations

import hashlib
import inspect
import math
from collections import namedtuple
from typing import TYPE_CHECKING

import numba
import numpy as np

from ...uw_spectral.mathematics import Operand
from ...uw_spectral.surface import refraction as sun
from . import photons

if TYPE_CHECKING:
    from .photons import PhaseTables, Tallies

_TWO_PI = photons.TWO_PI
_ED, _EU, _EOD, _EOU = photons.ED, photons.EU, photons.EOD, photons.EOU

_compiled = numba.njit(nogil=True, error_model="numpy")
_turned = _compiled(photons.turned)
_between = _compiled(photons.between)
_fraction_of = _compiled(photons.fraction_of)
_half_sine = _compiled(photons.half_sine)
_survival = _compiled(photons.survival)
_free_path = _compiled(photons.free_path)
_shared = _compiled(photons.shared)
_fresnel_reflectance = _compiled(sun.fresnel_reflectance)

# The elementary functions of the Fresnel formula as numba knows them.
_MATH: Operand = namedtuple("Functions", ("clamp", "maximum", "sqrt"))(
    numba.njit(lambda x, low, high: min(max(x, low), high)),
    numba.njit(lambda x, y: max(x, y)),
    numba.njit(lambda x: math.sqrt(x)),
)


@_compiled
def _inverse(xi, cdf, values):  # noqa: ANN001, ANN202
    i = min(max(np.searchsorted(cdf, xi, side="right"), 1), len(cdf) - 1)
    return _between(values[i - 1], values[i], _fraction_of(xi, cdf[i - 1], cdf[i]))


@_compiled
def _phase(table, sine):  # noqa: ANN001, ANN202
    x = sine * (len(table) - 1)
    cell = min(int(x), len(table) - 2)
    return _between(table[cell], table[cell + 1], x - cell)


@_compiled
def _tally_flight(y, uz, band, origin, energy, t, out):  # noqa: ANN001, ANN202
    cosine = max(abs(uz), 1e-12)
    for d in range(len(t.depths)):
        height = t.depths[d] - y
        if uz < 0 and height >= 0:
            planar, scalar = _ED, _EOD
        elif uz > 0 and height <= 0:
            planar, scalar = _EU, _EOU
        else:
            continue
        reach = energy * _survival(t.c[band], abs(height), cosine)
        out.flux[planar, origin, d, band] += reach
        out.flux[scalar, origin, d, band] += reach / cosine


@_compiled
def _tally_meters(y, ux, uy, uz, band, origin, energy, which, t, out):  # noqa: ANN001, ANN202
    c = t.c[band]
    for v in range(len(t.meter_depth)):
        table = t.seen[which]
        dx, dy, dz = t.meter_travel[v]
        height, cosine, seen = t.meter_depth[v] - y, abs(dz), 0.0
        if t.meter_low[v] <= y <= t.meter_high[v]:
            direct = _phase(table, _half_sine(ux, uy, uz, dx, dy, dz))
            seen += direct * _survival(c, abs(height), cosine)
        if t.meter_mirror[v] > 0:
            mirrored = _phase(table, _half_sine(ux, uy, uz, dx, dy, cosine))
            seen += t.meter_mirror[v] * mirrored * _survival(c, y + t.meter_depth[v], cosine)
        out.radiance[origin, v, band] += energy * seen / cosine


@_compiled
def _tally_floor(band, origin, power, t, out):  # noqa: ANN001, ANN202
    for d in range(len(t.depths)):
        out.flux[_EU, origin, d, band] += power * t.floor_planar[d, band]
        out.flux[_EOU, origin, d, band] += power * t.floor_scalar[d, band]
    for v in range(len(t.meter_depth)):
        if t.meter_floor[v] == 0:
            continue
        dz = t.meter_travel[v, 2]
        way = t.floor - math.copysign(t.meter_depth[v], dz)
        seen = t.meter_floor[v] * _survival(t.c[band], way, abs(dz))
        out.radiance[origin, v, band] += power / math.pi * seen


@_compiled
def _tally_event(event, band, energy, deposit, out):  # noqa: ANN001, ANN202
    out.events[event, band] += 1
    out.energy[event, band] += energy
    out.deposit[event, band] += deposit


@_compiled
def _follow(rng, band, t, out):  # noqa: ANN001, ANN202
    n, events = len(t.c), len(t.roulette)
    y, energy, weight, origin = 0.0, t.packet[band], 1.0, 0
    if rng.random() < t.sun_fraction[band]:
        ux, uy, uz = t.sun
    else:
        cosine = _inverse(rng.random(), t.sky_cdf, t.sky_cosine)
        across, azimuth = math.sqrt(max(1.0 - cosine * cosine, 0.0)), _TWO_PI * rng.random()
        ux, uy, uz = across * math.cos(azimuth), across * math.sin(azimuth), -cosine
    while True:
        _tally_flight(y, uz, band, origin, energy * weight, t, out)
        weight = 1.0
        y -= uz * _free_path(rng.random(), t.c[band])
        if y < 0:
            y = 0.0
            if rng.random() >= _fresnel_reflectance(abs(uz), 1.0 / t.refractive_index, _MATH):
                _tally_event(events, band, energy, energy, out)
                return
            uz = -uz
            continue
        if y > t.floor:
            y, r = t.floor, t.floor_reflectance[band]
            _tally_floor(band, origin, energy * r, t, out)
            if rng.random() >= r:
                _tally_event(events + 1, band, energy, energy, out)
                return
            weight = 0.0  # the flight is in the tally already
            uz = math.sqrt(1.0 - rng.random())
            across, azimuth = math.sqrt(1.0 - uz * uz), _TWO_PI * rng.random()
            ux, uy = across * math.cos(azimuth), across * math.sin(azimuth)
            continue
        chance, event = rng.random(), 0
        while event < events - 1 and chance >= t.roulette[event, band]:
            event += 1
        if event < t.absorptions:
            _tally_event(event, band, energy, energy, out)
            return
        if event >= t.inelastic_from:
            kind = event - t.inelastic_from
            chance, after = rng.random(), 0
            while after < n and chance >= t.emission[kind, band, after]:
                after += 1
            left = energy * t.energy_ratio[band, after] if after < n else 0.0
            _tally_event(event, band, energy, energy - left, out)
            if after == n:
                return
            band, energy, origin = after, left, kind + 1
        else:
            _tally_event(event, band, energy, 0.0, out)
        which = event - t.absorptions
        _tally_meters(y, ux, uy, uz, band, origin, energy, which, t, out)
        away = -math.copysign(rng.random(), uz)
        across, azimuth = math.sqrt(1.0 - away * away), _TWO_PI * rng.random()
        sine = _half_sine(ux, uy, uz, across * math.cos(azimuth), across * math.sin(azimuth), away)
        back = energy * _shared(_phase(t.density[which], sine))
        _tally_flight(y, away, band, origin, back, t, out)
        s2, before = _inverse(rng.random(), t.cdf[which], t.s2), uz
        ux, uy, uz = _turned(ux, uy, uz, s2, _TWO_PI * rng.random())
        if uz * before < 0:
            weight = _shared(_phase(t.density[which], math.sqrt(s2)))


def _trace(rng, per_band, t, out):  # noqa: ANN001, ANN202
    for band in range(len(t.c)):
        for _ in range(per_band):
            _follow(rng, band, t, out)


# The cache of compiled code knows neither the name of the package nor the sources of the steps.
_SOURCES = "".join(inspect.getsource(module) for module in (photons, sun)) + str(__package__)
_trace.__qualname__ = f"_trace_{hashlib.sha256(_SOURCES.encode()).hexdigest()[:12]}"
_trace = numba.njit(nogil=True, error_model="numpy", cache=True)(_trace)


def trace(rng: np.random.Generator, per_band: int, t: PhaseTables, out: Tallies) -> None:
    """Follow ``per_band`` photons of each band to their end, like :func:`.photons.trace`."""
    _trace(rng, per_band, t, out)
