"""Translates a phase function into the lobes that Cycles can scatter with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..node_groups.water_volume import ScatteringLobe
from ..uw_spectral.errors import InputError
from ..uw_spectral.water.phase import (
    BandPhase,
    EinsteinSmoluchowski,
    FournierForand,
    HenyeyGreenstein,
    Isotropic,
    PetzoldAverage,
    PhaseFunction,
    TwoTermHenyeyGreenstein,
)

_PETZOLD_NOTE = (
    "Cycles has no tabulated phase function: petzold is rendered as Fournier-Forand 1.10, 0.0183, "
    "its closest match (Mobley 2002)"
)


@dataclass(frozen=True, eq=False)
class CyclesPhase:
    """A phase function as Cycles scatters it.

    ``shares[i]``, shape (n,), is the share of ``lobes[i]`` in the scattering of
    each band. Cycles picks among lobes by the average over its three channels,
    so three bands fit one pass only where the shares are the same in each.
    """

    lobes: tuple[ScatteringLobe, ...]
    shares: tuple[NDArray[np.float64], ...]
    bands_per_pass: int
    notes: tuple[str, ...]


def cycles_phase(phase: BandPhase) -> CyclesPhase:
    """Split a phase function into lobes.

    Raises
    ------
    InputError
        If Cycles has nothing for one of its components.
    """
    parts = [
        (lobe, share * weights)
        for component, weights in zip(phase.components, phase.weights, strict=True)
        for lobe, share in _lobes(component)
    ]
    notes = (_PETZOLD_NOTE,) if any(isinstance(c, PetzoldAverage) for c in phase.components) else ()
    return CyclesPhase(
        tuple(lobe for lobe, _ in parts),
        tuple(shares for _, shares in parts),
        3 if phase.same_in_all_bands else 1,
        notes,
    )


def _lobes(phase: PhaseFunction) -> list[tuple[ScatteringLobe, float]]:
    if isinstance(phase, Isotropic):
        return [(_henyey_greenstein(0.0), 1.0)]
    if isinstance(phase, HenyeyGreenstein):
        return [(_henyey_greenstein(phase.asymmetry), 1.0)]
    if isinstance(phase, TwoTermHenyeyGreenstein):
        return [
            (_henyey_greenstein(phase.g1), phase.share),
            (_henyey_greenstein(phase.g2), 1.0 - phase.share),
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
