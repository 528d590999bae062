"""Translates a phase function into the lobes that Cycles can scatter with."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes
from ...node_groups.water_volume import ScatteringLobe
from ...settings.render_plan import RenderPlan
from ...settings.scene_settings import BOUNDED
from ...uw_spectral.errors import InputError
from ...uw_spectral.water.bounded_peak import bound_forward_peak
from ...uw_spectral.water.bubbles import BubblePhase
from ...uw_spectral.water.phase import BandPhase, PhaseFunction
from ...uw_spectral.water.phase_functions import (
    EinsteinSmoluchowski,
    FournierForand,
    HenyeyGreenstein,
    Isotropic,
    PetzoldAverage,
    TwoTermHenyeyGreenstein,
)
from ...uw_spectral.water.shared_phase import with_mean_of

_PETZOLD_NOTE = (
    "Cycles has no tabulated phase function: petzold is rendered as Fournier-Forand 1.10, 0.0183, "
    "its closest match (Mobley 2002); --forward-peak bounded fits petzold itself"
)
_SHARP_NOTE = (
    "the forward peak of this phase function is too sharp to be bounded; Cycles draws it exactly, "
    "with much noise"
)
LARGEST_ERROR = 0.25
"""Error of a bounded phase function up to which it is drawn."""


@dataclass(frozen=True, eq=False)
class CyclesPhase:
    """A phase function as Cycles scatters it: by at most two lobes, for which it has room.

    The fractions, shape (n,), are those of each lobe in the scattering of each band; where the
    forward peak is bounded they add up to less than 1, see :class:`.BoundedPhase`. Cycles picks
    among lobes by the average over its three channels, so bands share a pass only where they share
    the phase function, see :mod:`.shared_phase`. The shapes are anisotropy and alpha, shape (n,),
    of each lobe that has its own in each band; else none.
    """

    lobes: tuple[ScatteringLobe, ...]
    fractions: tuple[NDArray[np.float64], ...]
    notes: tuple[str, ...] = ()
    shapes: tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...] = ()

    def values(
        self, layer: int | str, absorption: NDArray[np.float64], scattering: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64]]:
        """Return what a layer of water, or a cloud, has in each band, by attribute."""
        found = {attributes.absorption(layer): absorption}
        for index, fraction in enumerate(self.fractions):
            found[attributes.scattering(layer, index)] = scattering * fraction
        for index, (asymmetry, alpha) in enumerate(self.shapes):
            found[attributes.asymmetry(layer, index)] = asymmetry
            found[attributes.alpha(layer, index)] = alpha
        return found


def cycles_phase(phase: BandPhase, *, bounded: bool = False) -> CyclesPhase:
    """Split a phase function into lobes.

    ``bounded`` is whether to bound the forward peak of sea particles, see
    :func:`.bound_forward_peak`; a peak that lobes cannot follow stays exact, and a note says so.
    InputError if Cycles has nothing for one of its components.
    """
    notes = []
    peaked = [c for c in phase.components if isinstance(c, FournierForand | PetzoldAverage)]
    if bounded and peaked:
        # Whether lobes will do must not depend on what may be animated.
        if all(_can_be_bounded(component) for component in peaked):
            fit = bound_forward_peak(phase)
            return CyclesPhase(
                (ScatteringLobe("DRAINE", by_band=True),) * 2,
                tuple(fit.fractions),
                shapes=tuple(zip(fit.asymmetries, fit.alphas, strict=True)),
            )
        notes.append(_SHARP_NOTE)
    if any(isinstance(c, PetzoldAverage) for c in peaked):
        notes.append(_PETZOLD_NOTE)
    parts = [
        (lobe, fraction * weights)
        for component, weights in zip(phase.components, phase.weights, strict=True)
        for lobe, fraction in _lobes(component)
    ]
    lobes, fractions = zip(*parts, strict=True)
    return CyclesPhase(lobes, fractions, tuple(notes))


@functools.lru_cache(maxsize=8)
def cycles_phases(plan: RenderPlan) -> tuple[CyclesPhase, ...]:
    """Return how Cycles draws the phase function of each layer of a plan, from the surface down."""
    bounded = plan.settings.forward_peak == BOUNDED
    return tuple(
        cycles_phase(with_mean_of(phase, plan.passes), bounded=bounded) for phase in plan.phases
    )


@functools.lru_cache(maxsize=32)
def _can_be_bounded(phase: PhaseFunction) -> bool:
    return bool(bound_forward_peak(phase.for_bands(1.0)).error.max() <= LARGEST_ERROR)


def _lobes(phase: PhaseFunction) -> list[tuple[ScatteringLobe, float]]:
    if isinstance(phase, Isotropic):
        return [(_henyey_greenstein(0.0), 1.0)]
    if isinstance(phase, HenyeyGreenstein):
        return [(_henyey_greenstein(phase.asymmetry), 1.0)]
    if isinstance(phase, BubblePhase):
        return [(_henyey_greenstein(phase.g), 1.0)]
    if isinstance(phase, TwoTermHenyeyGreenstein):
        return [
            (_henyey_greenstein(phase.g1), phase.fraction),
            (_henyey_greenstein(phase.g2), 1.0 - phase.fraction),
        ]
    if isinstance(phase, EinsteinSmoluchowski):
        # One lobe: Cycles counts 32 closures for each, and warns above 64.
        return [(ScatteringLobe("DRAINE", alpha=phase.anisotropy), 1.0)]
    if isinstance(phase, PetzoldAverage):
        phase = FournierForand()
    if isinstance(phase, FournierForand):
        lobe = ScatteringLobe(
            "FOURNIER_FORAND", index=phase.refractive_index, backscatter=phase.backscatter
        )
        return [(lobe, 1.0)]
    raise InputError(f"Cycles cannot scatter with {type(phase).__name__}; choose another --phase")


def _henyey_greenstein(g: float) -> ScatteringLobe:
    return ScatteringLobe("HENYEY_GREENSTEIN", anisotropy=g)
