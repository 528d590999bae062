"""Light of changed wavelength that a lamp makes in the water round it: a table to look up.

In Fourier space the light of a lamp that excites, unscattered and scattered, has the amplitudes
L'_l; what the water emits has those of the degree l of

    q_l = Σ_λ' χ_l b_I(λ', λ) L'_l(λ'),

χ_l being 1 for l = 0, and besides only that of Raman scattering for l = 2. Its own light is that of
a lamp whose waves are q (:mod:`.lamp_harmonics`): what is seen along a ray is the integral of

    S_l = q_l + b χ_l L_l.

What unscattered light excites falls as 1/r² near the lamp, and has the edges of its beam: of it q
is not in S, but a function of the distance alone (:func:`straight_emission`). What light does that
has changed its wavelength twice is left out, and what the events take from the light that excites.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..spectra.bands import Bands
from ..table import Table
from ..water.inelastic_processes import RAMAN_PHASE, InelasticProcess, energy_matrix
from .lamp_harmonics import (
    Harmonics,
    at_distances,
    lamp_distances,
    radiance_of,
    round_axis,
    scattered_waves,
    wave_numbers,
)
from .profile import LampProfile
from .scattered_source import TURNED, in_directions, tabulated

Array = NDArray[np.float64]

_EMITTED = np.array([0, 2])
"""Degrees of what is emitted; orders go up to the higher."""
_CHI = np.array([[1.0, 1.0], [0.0, RAMAN_PHASE.moments(2)[-1]]])
"""Moments of these, of what is isotropic and of Raman scattering."""
_LEAST = 1e-30


@dataclass(frozen=True, eq=False)
class LampExcitation(ComparedByContent):
    """What lamps excite in a water; make it with :func:`lamp_excitation`."""

    water: Harmonics  #: In the m bands that excite.
    #: Power emitted per scalar irradiance, isotropic and as Raman scattering is, 1/m, (2, m, n).
    matrices: Array

    def of_bands(self, indices: ArrayLike) -> LampExcitation:
        """Return it in some of the bands that are seen."""
        return replace(self, matrices=constant(self.matrices[..., np.asarray(indices, dtype=int)]))

    def by(self, intensity: Array) -> LampExcitation:
        """Return what a lamp excites, of a spectral intensity (m,) in the bands that excite."""
        return replace(self, matrices=constant(intensity[:, None] * self.matrices))


def lamp_excitation(
    processes: Sequence[InelasticProcess], excitation: Bands, emission: Bands, water: Harmonics
) -> LampExcitation:
    """Return what processes do to the light of lamps in a water of the bands that excite.

    Raises
    ------
    InputError
        If a process is on other bands.
    """
    raman = [one for one in processes if one.phase == RAMAN_PHASE]
    even = [one for one in processes if one.phase != RAMAN_PHASE]
    matrices = [energy_matrix(kind, excitation, emission) for kind in (even, raman)]
    return LampExcitation(water, constant(np.array(matrices)))


def straight_emission(excited: LampExcitation, r: Array) -> Array:
    """Power that unscattered light makes at distances (k,), times r², over the profile, (2, k, n).

    That of what is isotropic, and of Raman scattering.
    """
    left = np.exp(-r[:, None] * excited.water.extinction)
    return np.asarray(left @ excited.matrices)


def absorption_left(excited: LampExcitation, r: Array) -> Array:
    """Fraction of the power of each band that absorption before leaves at distances, (k, n)."""
    made = excited.matrices.sum(axis=0)
    left = np.exp(-r[:, None] * excited.water.a) @ made
    return np.maximum(left / np.maximum(made.sum(axis=0), _LEAST), _LEAST)


@functools.lru_cache(maxsize=16)
def inelastic_source(
    excited: LampExcitation, profile: LampProfile, seen: Harmonics, scale: float
) -> Table:
    """Tabulate the logarithm of S times r, over :func:`absorption_left`, round a lamp.

    ``excited`` is that of its intensity; ``seen`` the water in the n bands that are seen; ``scale``
    that of the rows, 1/m.
    """
    waves, rows = wave_numbers(scale), []
    emitted = np.einsum("lp,pin->lin", _CHI, excited.matrices)
    for band, (c, b) in enumerate(zip(seen.extinction, seen.scattering.T, strict=True)):
        found = []
        for m, exciting in enumerate(_exciting(excited.water, scale)):
            q = np.zeros((2, len(waves), len(b), len(b)))
            q[:, :, _EMITTED] = np.einsum("li,siklj->sklj", emitted[..., band], exciting)
            radiance = radiance_of(m, float(c), b, waves, q.sum(axis=0))
            found.append(b[:, None] * radiance + q[1])
        rows.append(at_distances(np.stack(found), scale))
    by_turn = round_axis(np.stack(rows, axis=-1), profile, TURNED.values())
    r = lamp_distances(scale).values()
    scaled = (r[:, None] / absorption_left(excited, r))[:, None, None, None]
    return tabulated(in_directions(by_turn) * scaled, scale)


@functools.lru_cache(maxsize=4)
def _exciting(water: Harmonics, scale: float) -> tuple[Array, ...]:
    """Waves of the light that excites: unscattered and scattered, by order m, (2, i, k, l, j)."""
    waves, one = wave_numbers(scale), np.eye(water.degrees + 1)

    def of_m(m: int) -> Array:
        found = []
        for c, b in zip(water.extinction, water.scattering.T, strict=True):
            straight = radiance_of(m, float(c), 0.0 * b, waves, one)
            turned = scattered_waves(m, float(c), b, waves)
            found.append(np.stack([straight, turned])[:, :, _EMITTED])
        return np.stack(found, axis=1)

    return tuple(of_m(m) for m in range(int(_EMITTED[-1]) + 1))
