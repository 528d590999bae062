"""The lamps of a scene at a frame, and what stands for the objects that they light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.lamps.lamp import Lamp
from ...uw_spectral.lamps.layers import waters_of_lamps
from ...uw_spectral.lamps.multiple_scattering import LampWater, lamp_water
from ...uw_spectral.lamps.virtual_point_lights import LampRays, LitSurfaces, virtual_point_lights
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.reflectance import uplift_basis
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from .shown_lamps import ShownLamp


@dataclass(frozen=True, eq=False)
class SeenByLamp:
    """What lies in directions, k rays, from a lamp."""

    rays: LampRays
    distances: NDArray[np.float64]  #: m, (k,); infinite where nothing is.
    normals: NDArray[np.float64]  #: Unit vectors towards the lamp, (k, 3).
    colours: NDArray[np.float64]  #: Mean base colours, linear Rec.709, (k, 3).


@dataclass(frozen=True, eq=False)
class SceneLamps:
    """Lamps of a scene that light its water, and what of the scene they come from."""

    shown: tuple[ShownLamp, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    notes: tuple[str, ...] = ()
    seen: tuple[SeenByLamp | None, ...] = ()
    virtual: tuple[Lamp, ...] = ()  #: What stands for the objects that throw their light back.
    from_air: bool = False  #: Some shine into the water from above, or may at another frame.
    waters: tuple[LampWater, ...] = ()  #: Of each lamp, where water differs with depth.
    around: LampWater | None = None  #: The water of all of them.

    @property
    def all(self) -> tuple[Lamp, ...]:
        """The lamps, and what stands for objects."""
        return self.lamps + self.virtual

    def of_bands(self, indices: Sequence[int]) -> SceneLamps:
        """Return the lamps in some of the bands."""
        chosen = list(indices)
        lamps, virtual = (
            tuple(lamp.of_bands(chosen) for lamp in part) for part in (self.lamps, self.virtual)
        )
        return replace(self, lamps=lamps, virtual=virtual)

    def in_layers(self, column: WaterColumn, phase: BandPhase, depth: float) -> SceneLamps:
        """Return them in the layers of a water, seen by a camera at a depth in m."""
        if not column.below or not self.lamps:
            return self
        around, waters = waters_of_lamps(column, phase, self.lamps, depth)
        return replace(self, waters=waters, around=around)

    def in_water(self, column: WaterColumn, phase: BandPhase, depth: float) -> SceneLamps:
        """Return them with the water at a depth, m, or of all layers, as their light meets it."""
        if not self.lamps or self.around is not None:
            return self
        here = column.layer_at(depth, phase)
        alike = here.phase.components == phase.components
        water = lamp_water(here.absorption, here.scattering, here.phase if alike else phase)
        return replace(self, around=water)

    def with_virtual_lights(
        self, water: LampWater, bands: Bands, camera: Sequence[float]
    ) -> SceneLamps:
        """Return them with what stands for the objects they light, seen by a camera in m."""
        basis = uplift_basis(bands).T
        surfaces = [
            x and LitSurfaces(x.rays, x.distances, x.normals, np.clip(x.colours @ basis, 0.0, 1.0))
            for x in self.seen
        ]
        virtual = virtual_point_lights(self.lamps, surfaces, water, camera)
        return replace(self, virtual=virtual)
