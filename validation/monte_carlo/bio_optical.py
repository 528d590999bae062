"""A bio-optical water as the Monte Carlo takes it: its ten kinds of events."""

from __future__ import annotations

from collections.abc import Sequence

from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.water.bio_optics import Constituents
from ...uw_spectral.water.inelastic_processes import PROCESSES, inelastic_processes
from ...uw_spectral.water.phase_functions import Isotropic
from .medium import Constituent, InelasticInteraction

_ABSORBERS = {"chlorophyll": "phytoplankton", "cdom": "cdom"}


def bio_optical_medium(
    constituents: Constituents,
    bands: Bands,
    switched_on: Sequence[str] = PROCESSES,
) -> tuple[list[Constituent], list[InelasticInteraction]]:
    """Return constituents and inelastic processes for :func:`.simulate`.

    The bands carry excitation and emission: let them reach down to 300 nm. ``switched_on`` are any
    of :data:`.PROCESSES`, which keep these names with "light" added. Raises InputError if a process
    is unknown or a band lies outside the tables.
    """
    nm = bands.centres
    absorption, scattering = constituents.absorptions(nm), constituents.scatterings(nm)
    phases = constituents.phases
    parts = [
        Constituent(name, a, scattering.get(name, 0.0), phases.get(name, Isotropic()))
        for name, a in absorption.items()
    ]
    processes = [
        InelasticInteraction(
            f"{p.name} light", p.coefficient, p.photons, p.phase, absorber=_ABSORBERS.get(p.name)
        )
        for p in inelastic_processes(constituents, bands, bands, switched_on)
    ]
    return parts, processes
