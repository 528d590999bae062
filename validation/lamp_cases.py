"""The cases that the light of lamps is judged by, solved by photons (:mod:`.lamp_photons`).

Lengths are in units of 1/c. The camera is at the origin and looks along z.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.profile import IsotropicProfile, LampProfile, SpotProfile, rov_lamp
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import HenyeyGreenstein, seawater_mixture
from . import lamp_photons

ORDERS, BATCHES = 60, 10
KINDS = ("beside", "in view", "across", "patch")
PROFILES: dict[str, LampProfile] = {
    "isotropic": IsotropicProfile(),
    "ROV lamp": rov_lamp(),
    "spot 60°": SpotProfile(math.radians(60.0), 0.3),
}
RADIUS = 1e-3
_FACING = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Case:
    """A camera ray, or a patch at the origin that faces the lamp.

    ``kind`` is ``"beside"``: the lamp beside the camera, shining as it looks; ``"in view"``: the
    lamp faces the camera; ``"across"``: it shines across the view; or ``"patch"``. ``function`` is
    the phase function of one band.
    """

    kind: str
    function: BandPhase
    profile: LampProfile
    position: NDArray[np.float64]
    axis: NDArray[np.float64]
    P: float

    def lamp(self) -> Lamp:
        """The lamp, of intensity 1."""
        return Lamp(tuple(self.position), tuple(self.axis), np.ones(1), self.profile, RADIUS)


def unseen(count: int, seed: int = 1) -> Iterator[Case]:
    """Random cases: c r from 0.1 to 6, HG 0.8 to 0.924 or sea water of 1 to 10 % molecules."""
    rng = np.random.default_rng(seed)

    def even(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    for index in range(count):
        sea = rng.random() < 0.5
        function = (
            seawater_mixture([1.0], [even(0.01, 0.1)])
            if sea
            else BandPhase((HenyeyGreenstein(rng.uniform(0.8, 0.924)),), np.ones((1, 1)))
        )
        profile = list(PROFILES.values())[int(rng.integers(len(PROFILES)))]
        kind = KINDS[index % len(KINDS)]
        P, D = math.inf, even(0.1, 6.0)
        at, axis = _seen_at(D, rng.uniform(1.0, 70.0)), np.array([-1.0, 0.0, 0.0])
        if kind == "beside":
            at, axis = np.array([even(0.03, 3.0), 0.0, 0.0]), _FACING
            P = even(0.3, 10.0)
        elif kind == "in view":
            axis = -at / D
        elif kind == "patch":
            at, axis = D * _FACING, -_FACING
        yield Case(kind, function, profile, at, axis, P)


def _seen_at(distance: float, angle: float) -> NDArray[np.float64]:
    theta = math.radians(angle)
    return distance * np.array([math.sin(theta), 0.0, math.cos(theta)])


def traced(case: Case, photons: int, seed: int) -> NDArray[np.float64]:
    """Light by order, shape (BATCHES, ORDERS): radiance, or for a patch the irradiance."""
    rng = np.random.default_rng(seed)
    phase = lamp_photons.tables_of(case.function)
    x, w = np.zeros((photons, 3)), np.tile(_FACING, (photons, 1))
    weight: NDArray[np.float64] | float = 1.0
    if case.kind == "patch":
        w, weight = lamp_photons.onto_patch(w, case.position, rng)
    return lamp_photons.orders(
        x, w, case.P, case.position, case.profile.value, case.axis, phase, rng,
        ORDERS, BATCHES, weight,
    )  # fmt: skip
