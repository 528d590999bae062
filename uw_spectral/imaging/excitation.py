"""Light that changes its wavelength in the water, and the light that excites it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.spectrum import Spectrum
from ..transfer.discrete_ordinates import STREAMS, Emission
from ..transfer.inelastic_emission import inelastic_emission
from ..transfer.water_column import WaterColumn
from ..water.bio_optics import Constituents
from ..water.inelastic_processes import (
    EXCITATION,
    InelasticProcess,
    inelastic_processes,
    parse_processes,
)
from ..water.phase import BandPhase
from .description import WaterDescription
from .mixed_water import Mixture

ColumnOf = Callable[[Bands, NDArray[np.float64]], tuple[WaterColumn, BandPhase]]
"""Of bands, and of the reflectance of the floor in them."""


@dataclass(frozen=True, eq=False)
class Excitation:
    """Processes that change the wavelength of light, and the water in the bands they start from."""

    processes: tuple[InelasticProcess, ...]
    column: WaterColumn
    phase: BandPhase
    #: The same within these bands, so that what is emitted excites in turn; none for once alone.
    within: tuple[InelasticProcess, ...] = ()

    def emission(self, bands: Bands, streams: int = STREAMS) -> Emission:
        """Return what is emitted in bands, by the solved field of the exciting light.

        Light may change its wavelength twice: of what is red at 60 m in clear water, a tenth did.
        """
        own = self.column.bands
        exciting = self.column.solved_field(self.phase, streams, modes=1)
        if self.within:
            once = inelastic_emission(self.within, exciting, own, own)
            exciting = self.column.solved_field(self.phase, streams, once, modes=1)
        return inelastic_emission(self.processes, exciting, own, bands)


def excitation_of(
    described: WaterDescription,
    mixture: Mixture,
    column: WaterColumn,
    floor: Spectrum,
    column_of: ColumnOf,
) -> Excitation | None:
    """Return what changes the wavelength of light in a column; None if nothing does.

    Raises
    ------
    InputError
        If the water differs with depth, or its constituents are not known and would be needed.
    """
    switched_on = parse_processes(described.inelastic)
    if not switched_on:
        return None
    column.require_one_layer("inelastic light knows")
    # A measured floor need not reach the ultraviolet, which only excites.
    known = np.clip(EXCITATION.centres, *floor.range)
    first, second = (
        _processes_of(described, mixture, switched_on, bands)
        for bands in (column.bands, EXCITATION)
    )
    return Excitation(first, *column_of(EXCITATION, floor.at(known)), second)


def _processes_of(
    described: WaterDescription, mixture: Mixture, switched_on: tuple[str, ...], bands: Bands
) -> tuple[InelasticProcess, ...]:
    """Return what changes the wavelength of light in a water."""
    constituents = mixture.constituents
    if constituents is None:
        fluorescent = [name for name in switched_on if name != "raman"]
        if fluorescent:
            raise InputError(
                f"inelastic light: {', '.join(fluorescent)} needs one water of known "
                f"constituents, bio: or case: or its amounts, not {mixture.water.name}"
                + ("; leave the second water out" if described.second else "")
            )
        constituents = Constituents()
    factor = described.absorption_factor * described.concentration
    found = inelastic_processes(constituents, EXCITATION, bands, switched_on)
    return tuple(
        process
        if process.name == "raman"
        else dataclasses.replace(process, coefficient=process.coefficient * factor)
        for process in found
    )
