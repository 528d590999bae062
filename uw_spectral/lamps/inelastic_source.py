"""Light of changed wavelength that a lamp makes in the water round it: a table to look up.

In Fourier space the light of a lamp that excites, unscattered and scattered, has the amplitudes
L'_l; what the water emits has those of the degree l of

    q_l = Σ_λ' χ_l b_I(λ', λ) L'_l(λ'),

χ_l being 1 for l = 0, and besides only that of Raman scattering for l = 2. Its own light is that of
a lamp whose waves are q (:mod:`.lamp_harmonics`): what is seen along a ray is the integral of

    S_l = q_l + b χ_l L_l.

What unscattered light excites falls as 1/r² near the lamp, and has the edges of its beam: of it q
is not in S, but looked up by the distance and the angle alone. What light does that
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
from ..water.phase_functions import PER_SPHERE
from .angular_spread import NARROW, NARROW_SCALES
from .lamp_harmonics import (
    Harmonics,
    at_distances,
    lamp_distances,
    radiance_of,
    round_axis,
    scattered_waves,
    wave_numbers,
)
from .multiple_scattering import InelasticLight
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


@functools.lru_cache(maxsize=16)
def inelastic_light(
    excited: LampExcitation, profile: LampProfile, seen: Harmonics, scale: float
) -> InelasticLight:
    """Tabulate the light of changed wavelength round a lamp.

    ``excited`` is that of its intensity; ``seen`` the water in the n bands that are seen; ``scale``
    that of the rows, 1/m.
    """
    decay = power_decay(excited, scale)
    r, half = (axis.values() for axis in NARROW_SCALES)
    left = np.exp(-r[:, None] * excited.water.extinction)
    even, raman = left @ excited.matrices
    phase = RAMAN_PHASE.per_steradian(np.sin(half) ** 2)[:, None]
    onward = even[:, None] * PER_SPHERE + raman[:, None] * phase
    onward = np.log(np.maximum(onward, _LEAST)) + decay * r[:, None, None]
    return InelasticLight(Table(onward, NARROW), _source(excited, profile, seen, scale), decay)


def power_decay(excited: LampExcitation, scale: float) -> Array:
    """How fast absorption before lets the power of each band fade where rows end, 1/m, (n,)."""
    a = excited.water.a
    left = np.exp((a.min() - a) * lamp_distances(scale).last / scale)[:, None]
    left = left * excited.matrices.sum(axis=0)
    return np.asarray(a @ left / np.maximum(left.sum(axis=0), _LEAST))


def _source(excited: LampExcitation, profile: LampProfile, seen: Harmonics, scale: float) -> Table:
    waves, rows, orders = wave_numbers(scale), [], range(int(_EMITTED[-1]) + 1)
    emitted = np.einsum("lp,pin->lin", _CHI, excited.matrices)
    for band, (c, b) in enumerate(zip(seen.extinction, seen.scattering.T, strict=True)):
        found = []
        for m in orders:
            exciting = exciting_waves(excited.water, scale, m)
            q = np.zeros((2, len(waves), len(b), len(b)))
            q[:, :, _EMITTED] = np.einsum("li,siklj->sklj", emitted[..., band], exciting)
            radiance = radiance_of(m, float(c), b, waves, q.sum(axis=0))
            found.append(b[:, None] * radiance + q[1])
        rows.append(at_distances(np.stack(found), scale))
    by_turn = round_axis(np.stack(rows, axis=-1), profile, TURNED.values())
    r = lamp_distances(scale).values()
    scaled = (r[:, None] * np.exp(power_decay(excited, scale) * r[:, None]))[:, None, None, None]
    return tabulated(in_directions(by_turn) * scaled, scale)


@functools.lru_cache(maxsize=12)
def exciting_waves(water: Harmonics, scale: float, m: int) -> Array:
    """Waves of the light that excites: unscattered and scattered, of an order, (2, i, k, l, j)."""
    waves, one, found = wave_numbers(scale), np.eye(water.degrees + 1), []
    for c, b in zip(water.extinction, water.scattering.T, strict=True):
        straight = radiance_of(m, float(c), 0.0 * b, waves, one)
        turned = scattered_waves(m, float(c), b, waves)
        found.append(np.stack([straight, turned])[:, :, _EMITTED])
    return np.stack(found, axis=1)
