"""Photons in a blob, one by one: its light without the closed forms of uw_spectral/clouds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.matter import BluntPhase, blunt_phase
from ..uw_spectral.water.phase import PhaseFunction

Array = NDArray[np.float64]

_AROUND = 4.4  # standard deviations: radius of the disc that photons start from
_ORDERS = 60
_FAINT = 1e-4
_ANGLES, _PLACES = 4001, 4001


@dataclass(frozen=True, eq=False)
class GreyBlob:
    """A sphere of Gaussian density in empty space, in one band.

    ``sigma`` is the standard deviation, m; absorption and scattering are those in the middle, 1/m.
    """

    sigma: float
    absorption: float
    scattering: float
    phase: PhaseFunction


def radiance(
    blob: GreyBlob,
    beam: Sequence[float],
    views: Mapping[str, Sequence[float]],
    *,
    isotropic: bool = False,
    lamp: Sequence[float] | None = None,
    count: int = 100_000,
    radius: float = 0.5,
    seed: int = 1,
) -> dict[str, float]:
    """Return the mean radiance about the middle of a blob, seen from far away.

    The forward peak of its phase function counts as unscattered, as :class:`.BluntPhase` says.
    ``beam`` is the unit direction that light of the normal irradiance 1 travels to; instead there
    may be light of the scalar irradiance 1 from all sides, or a lamp of the radiant intensity 1 at
    a place outside the blob, from its middle, m. ``views`` are unit view directions, away from the
    camera; ``radius`` is that of the disc about the middle that is seen, standard deviations.
    """
    rng = np.random.default_rng(seed)
    blunt = blunt_phase(blob.phase)
    b = blob.scattering * (1.0 - blunt.peak)
    c = (blob.absorption + b) * blob.sigma
    angles, p = _phase(blob.phase, blunt)
    turned = np.cumsum(p * np.sin(angles))
    if lamp is None:
        x, d = _in_beam(beam, count, rng, isotropic=isotropic)
        first = math.pi * _AROUND**2 / count
    else:
        x, d, solid_angle = _from_lamp(np.asarray(lamp, np.float64) / blob.sigma, count, rng)
        # Intensity to flux; areas are in squares of the standard deviation.
        first = solid_angle / blob.sigma**2 / count
    weight = np.full(count, first)
    found = dict.fromkeys(views, 0.0)
    for _ in range(_ORDERS):
        x, met = _next_place(x, d, c, rng)
        weight = weight * met * (b / (blob.absorption + b))
        for name, view in views.items():
            v = np.asarray(view, dtype=np.float64)
            seen = np.linalg.norm(x - (x @ v)[:, None] * v, axis=1) < radius
            turn = np.arccos(np.clip(-d[seen] @ v, -1.0, 1.0))
            transmittance = np.exp(-c * _beyond(x[seen], -v))
            fraction = np.interp(turn, angles, p) * weight[seen] * transmittance
            found[name] += float(fraction.sum()) / (math.pi * radius**2)
        cosines = np.cos(np.interp(rng.random(len(d)), turned / turned[-1], angles))
        d = _turned(d, cosines, rng)
        bright = weight > _FAINT * first
        x, d, weight = x[bright], d[bright], weight[bright]
        if not len(x):
            break
    return found


def _in_beam(
    beam: Sequence[float], count: int, rng: np.random.Generator, *, isotropic: bool
) -> tuple[Array, Array]:
    d = np.tile(np.asarray(beam, dtype=np.float64), (count, 1))
    if isotropic:
        d = _turned(d, 2.0 * rng.random(count) - 1.0, rng)
    around = _turned(d, np.zeros(count), rng)
    return around * (_AROUND * np.sqrt(rng.random(count)))[:, None] - 10.0 * d, d


def _from_lamp(place: Array, count: int, rng: np.random.Generator) -> tuple[Array, Array, float]:
    """Start photons within the cone about the sphere that matter is in; its solid angle, sr."""
    away = float(np.linalg.norm(place))
    edge = math.sqrt(1.0 - (_AROUND / away) ** 2) if away > _AROUND else -1.0
    axis = np.tile(-place / away, (count, 1))
    d = _turned(axis, edge + (1.0 - edge) * rng.random(count), rng)
    return np.tile(place, (count, 1)), d, 2.0 * math.pi * (1.0 - edge)


def _phase(phase: PhaseFunction, blunt: BluntPhase) -> tuple[Array, Array]:
    angles = np.linspace(0.0, math.pi, _ANGLES)
    s2 = np.maximum(np.sin(angles / 2.0) ** 2, 1e-9)
    return angles, np.minimum(phase.per_steradian(s2) / (1.0 - blunt.peak), blunt.ceiling)


def _turned(d: Array, cosines: Array, rng: np.random.Generator) -> Array:
    """Turn directions by angles about them."""
    upright = np.abs(d[:, 2:3]) < 0.9
    other = np.where(upright, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    u = np.cross(other, d)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v, turn = np.cross(d, u), 2.0 * math.pi * rng.random(len(d))
    sines = np.sqrt(1.0 - cosines**2)[:, None]
    sideways = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    return cosines[:, None] * d + sines * sideways


_STEPS = np.linspace(-6.0, 6.0, _PLACES)
_TABLE = np.concatenate(
    [
        [0.0],
        np.cumsum(
            0.5
            * np.diff(_STEPS)
            * (np.exp(-0.5 * _STEPS[1:] ** 2) + np.exp(-0.5 * _STEPS[:-1] ** 2))
        ),
    ]
)
"""Integral of a Gaussian by the trapezoidal rule: no closed form is taken for it."""


def _beyond(x: Array, d: Array) -> Array:
    """Integral of the density from places along a direction, standard deviations."""
    along = x @ d if d.ndim == 1 else np.sum(x * d, axis=1)
    near = np.sum(x * x, axis=1) - along**2
    return np.exp(-0.5 * near) * (_TABLE[-1] - np.interp(along, _STEPS, _TABLE))


def _next_place(x: Array, d: Array, c: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return where photons meet matter next, and the chance that they do."""
    along = np.sum(x * d, axis=1)
    near = np.exp(-0.5 * (np.sum(x * x, axis=1) - along**2))
    met = 1.0 - np.exp(-c * _beyond(x, d))
    depth = -np.log1p(-rng.random(len(x)) * met) / c
    at = np.interp(
        np.interp(along, _STEPS, _TABLE) + depth / np.maximum(near, 1e-300), _TABLE, _STEPS
    )
    return x + (at - along)[:, None] * d, met
