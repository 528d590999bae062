"""What a description stands for: every quantity on the bands."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..spectra.bands import Bands
from ..spectra.illuminant import Illuminant
from ..spectra.sensor import Sensor
from ..spectra.spectrum import Spectrum
from ..transfer.discrete_ordinates import STREAMS, Emission
from ..transfer.solved_field import SolvedField
from ..transfer.water_column import WaterColumn
from ..water.optical_properties import Water
from ..water.phase import BandPhase
from ..water.profile import DepthProfile
from .band_selection import FittedViewpoint
from .description import Description
from .excitation import Excitation
from .viewpoint import Viewpoint


@dataclass(frozen=True, eq=False)
class ResolvedOptics(ComparedByContent):
    """What a description stands for; make it with :func:`.resolve`."""

    description: Description
    #: The layers of the water; one, where it does not differ with depth.
    waters: DepthProfile[Water]
    illuminant: Illuminant
    sensor: Sensor
    floor: Spectrum  #: Reflectance of the floor.
    bands: Bands
    phase: BandPhase  #: Phase function on the bands, of the first layer.
    column: WaterColumn
    #: What changes the wavelength of light, if anything does.
    excitation: Excitation | None = dataclasses.field(default=None, compare=False)
    #: The same on many bands, to which the weights of few are fitted.
    reference: tuple[WaterColumn, BandPhase] | None = None

    @property
    def water(self) -> Water:
        """The water, or its first layer."""
        return self.waters.layers[0]

    def emission(self, streams: int = STREAMS) -> Emission | None:
        """Return the light of changed wavelength where it is emitted; None if nothing does."""
        if self.excitation is None:
            return None
        return self.excitation.emission(self.bands, streams)

    def solved_field(self, streams: int = STREAMS) -> SolvedField:
        """Return the light field by discrete ordinates, light of changed wavelength included."""
        return self.column.solved_field(self.phase, streams, self.emission(streams))

    def viewpoint(
        self,
        depth: float,
        stops: float | None = None,
        lamplight: NDArray[np.float64] | None = None,
    ) -> Viewpoint:
        """Return the camera at a depth in m.

        ``stops`` are those of another camera, say, instead of the description's; ``lamplight`` (n,)
        is the irradiance that lamps put on objects before this one.

        Raises
        ------
        InputError
            If it is not between surface and floor.
        """
        chosen = self.description.camera
        camera = (
            self.illuminant,
            self.sensor,
            depth,
            chosen.white_balance,
            chosen.exposure_stops if stops is None else stops,
        )
        more = chosen.compensation, chosen.filter
        if self.reference is None:
            return Viewpoint(self.column, self.phase, *camera, lamplight, *more)
        fine = lamplight
        if lamplight is not None:
            fine = np.interp(self.reference[0].bands.centres, self.bands.centres, lamplight)
        reference = Viewpoint(*self.reference, *camera, fine, *more)
        view = self.column, self.phase, *camera, lamplight, *more
        return FittedViewpoint(*view, reference=reference)
