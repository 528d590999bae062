"""Light of changed wavelength round a lamp as the water emits it, place by place.

The source q of :mod:`.inelastic_source`, before anything scatters it. What unscattered light
excites has the phase functions of its processes. What scattered light excites is taken for
isotropic: its degree 2, which Raman scattering has, is left out.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..table import Axis, Lookup, Scale, Table, root
from ..water.inelastic_processes import RAMAN_PHASE
from ..water.phase_functions import PER_SPHERE
from .inelastic_source import LampExcitation, exciting_waves, power_decay
from .lamp import Lamp
from .lamp_harmonics import at_distances, lamp_distances, round_axis
from .profile import LampProfile
from .scattered_source import BEYOND_ROWS, TURNED

Array = NDArray[np.float64]

EVEN, RAMAN, SCATTERED = 0, 1, 2
"""Columns of the table of a lamp; from the last on by the angle from its axis."""
_ROWS = 256
_LEAST, _DARKEST = 1e-30, 1e-9


@dataclass(frozen=True, eq=False)
class ExcitedPower:
    """What a lamp makes the water emit; make it with :func:`excited_power`."""

    #: Power that light excites at a distance, times that squared: unscattered light on the lamp's
    #: axis, isotropic and as Raman scattering is, and scattered light by the angle. Of places on
    #: the axes of :func:`power_axes`.
    table: Lookup

    def radiance(
        self,
        lamp: Lamp,
        place: Sequence[Operand],
        onward: Sequence[Operand],
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance per metre that is emitted at a place, m, in a direction, a unit vector.

        The lamp's intensity is not read; objects keep its light away as :meth:`.Lamp.lit` says.
        """
        r, away = lamp.towards(place, m)
        turned = dot(lamp.axis, away)
        seen = [place[i] - lamp.position[i] for i in range(3)]
        even, raman = (self.table.at(distance=r, column=float(x)) for x in (EVEN, RAMAN))
        scattered = self.table.at(distance=r, column=TURNED.place(turned, m) + float(SCATTERED))
        # Raman scattering is the same forth and back.
        phase = RAMAN_PHASE.per_steradian(0.5 - 0.5 * dot(away, onward), m)
        shining = lamp.profile.value(turned, m) * lamp.lit(seen, m)
        straight = (even * PER_SPHERE + raman * phase) * shining
        scattered = scattered * (lamp.scattered_lit(seen, m) * PER_SPHERE)
        return (straight + scattered) * (1.0 / (r * r))


def power_axes(reach: float) -> tuple[Axis, Axis]:
    """Return the axes of a table up to a distance, m: fine near the lamp."""
    return _rows(reach).axis("distance"), Axis("column", SCATTERED + TURNED.count)


@functools.lru_cache(maxsize=16)
def excited_power(excited: LampExcitation, profile: LampProfile, reach: float) -> ExcitedPower:
    """Tabulate what a lamp makes the water emit up to a distance, m.

    ``excited`` is that of its intensity.
    """
    r = _rows(reach).values()
    straight = np.exp(-r[:, None] * excited.water.extinction) @ excited.matrices
    scattered = _scattered(excited, profile, r) * r[:, None, None]
    values = np.concatenate([np.moveaxis(straight, 0, 1), scattered], axis=1)
    return ExcitedPower(Table(values, power_axes(reach)))


def _rows(reach: float) -> Scale:
    return Scale(_ROWS, 0.0, reach, root(2.0))


def _scattered(excited: LampExcitation, profile: LampProfile, r: Array) -> Array:
    """Power that scattered light excites at distances, times these, (r, turns, n)."""
    water, scale = excited.water, excited.water.scale
    exciting = exciting_waves(water, scale, 0)[1, :, :, :1]
    rows = [
        at_distances(np.einsum("i,iklj->klj", by, exciting)[None], scale)
        for by in excited.matrices.sum(axis=0).T
    ]
    by_turn = round_axis(np.stack(rows, axis=-1), profile, TURNED.values())[:, :, 0, 0]
    there, decay = lamp_distances(scale, BEYOND_ROWS), power_decay(excited, scale)
    known = there.values()[:, None, None]
    # Of degree 0, whose harmonic is 1/√4π.
    found = math.sqrt(4.0 * math.pi) * by_turn * known
    least = np.maximum(_DARKEST * found.max(axis=1, keepdims=True), _LEAST)
    logarithms = np.log(np.maximum(found, least)) + decay * known
    table = Table(logarithms.reshape(len(known), -1), (there.axis("distance"),))
    at = table.at(distance=r[:, None]).reshape(len(r), *found.shape[1:])
    return np.exp(at - decay * r[:, None, None])
