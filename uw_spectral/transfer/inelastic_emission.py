"""Emission of light that has changed its wavelength, from the solved light that excites it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..spectra.bands import Bands
from ..water.inelastic_processes import InelasticProcess, energy_matrix
from .discrete_ordinates import Emission
from .radiance_field import FARTHEST
from .solved_field import SolvedField
from .solved_layer import Array

_DEPTHS, _RATES, _KEPT = 96, 48, 12
_FAINT = 1e-5  # fraction of the largest power below which depths count less and less
_STEEPEST, _FLATTEST = 5.0, 0.2  # rates: times the steepest slope, over the deepest depth
_ALIKE = 1e-5  # fraction of an exponential that those kept before do not contain


def inelastic_emission(
    processes: Sequence[InelasticProcess], exciting: SolvedField, excitation: Bands, emission: Bands
) -> Emission:
    """Return what the processes emit in a homogeneous column, as exponentials of depth.

    Of the exciting field, per nm, the mean over azimuth is enough; what is emitted is per volume
    and nm.

    The scalar irradiance is a sum of very many exponentials. A few stand for them: each is
    the one of many rates that takes most off the squared relative error which those before
    it left. Neglected: the small anisotropy of Raman scattering, and what the events take from
    the excitation.

    Raises
    ------
    InputError
        If a process is on other bands.
    """
    matrix = energy_matrix(processes, excitation, emission)
    floor, steps = exciting.floor_depth, np.linspace(0.0, 1.0, _DEPTHS)

    def power(y: Array) -> Array:
        return exciting.scalar_irradiance(y) @ matrix

    # Dense near the surface, where light of strongly absorbed bands is made, and at the floor.
    if math.isinf(floor):
        reach, surface = 1.0, power(np.zeros(1))
        while np.any(power(np.array([reach])) > _FAINT * surface) and reach < FARTHEST:
            reach *= 1.5
        y = reach * steps**4
    else:
        y = floor / 2 * np.where(steps < 0.5, (2 * steps) ** 4, 2 - (2 - 2 * steps) ** 4)
    return _fitted(y, power(y), rising=not math.isinf(floor))


def _fitted(y: Array, power: Array, *, rising: bool) -> Emission:
    """Exponentials that fall, or also rise to the last of depths y (d,), for powers (d, n)."""
    largest = np.maximum(power.max(axis=0), np.finfo(float).tiny)
    wanted = np.maximum(power / largest, _FAINT)
    slope = np.abs(np.diff(np.log(wanted), axis=0) / np.diff(y)[:, None])
    low, high = _FLATTEST / y[-1], _STEEPEST * np.maximum(slope.max(axis=0), 1.0 / y[-1])
    if not rising:
        # Nothing in deep water falls slower than all does in its depths.
        last = np.count_nonzero(wanted > _FAINT, axis=0)[None] - 2
        low = np.maximum(np.take_along_axis(slope, np.maximum(last, 0), axis=0)[0], low)
    rates = low * (high / low) ** np.linspace(0.0, 1.0, _RATES)[:, None]
    exponents = -y[:, None, None] * rates
    if rising:
        exponents = np.concatenate([exponents, (y - y[-1])[:, None, None] * rates], axis=1)
        rates = np.concatenate([rates, -rates])
    weighted = np.moveaxis(np.exp(exponents) / wanted[:, None], 2, 0)
    aim = (power / largest / wanted).T[..., None]
    apart, left = weighted / np.linalg.norm(weighted, axis=1, keepdims=True), aim
    kept = np.zeros((len(aim), 1, _KEPT), dtype=int)
    for place in range(_KEPT):
        size = np.linalg.norm(apart, axis=1, keepdims=True)
        gain = np.abs(left.mT @ apart) / np.maximum(size, _ALIKE)
        kept[..., place] = gain.argmax(axis=2)
        best = np.take_along_axis(apart, kept[..., place : place + 1], axis=2)
        best = best / np.maximum(np.linalg.norm(best, axis=1, keepdims=True), _ALIKE)
        apart, left = (part - best @ (best.mT @ part) for part in (apart, left))
    factors = np.linalg.pinv(np.take_along_axis(weighted, kept, axis=2)) @ aim
    return Emission(np.take_along_axis(rates, kept[:, 0].T, axis=0), factors[..., 0].T * largest)
