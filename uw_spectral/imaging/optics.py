"""From a description to optics: every text read, every quantity on the bands."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.barrier_filter import check as check_filter
from ..spectra.illuminant import Illuminant, parse_illuminant
from ..spectra.reflectance import parse_reflectance
from ..spectra.sensor import Sensor, parse_sensor, standard_observer
from ..spectra.spectrum import Spectrum
from ..transfer.discrete_ordinates import STREAMS, Emission
from ..transfer.inelastic_emission import inelastic_emission
from ..transfer.sky_picture import SkyPicture
from ..transfer.solved_field import SolvedField
from ..transfer.water_column import WaterColumn
from ..water.inelastic_processes import (
    EXCITATION,
    InelasticProcess,
    parse_processes,
)
from ..water.optical_properties import Water
from ..water.phase import BandPhase
from ..water.profile import DepthProfile
from .band_selection import FittedViewpoint, optimised_bands
from .described_water import column_of, mixtures_of, processes_of
from .description import (
    REFERENCE_BANDS,
    BandsDescription,
    Description,
)
from .viewpoint import Viewpoint

_optimised_bands = functools.lru_cache(maxsize=32)(optimised_bands)


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


@dataclass(frozen=True, eq=False)
class ResolvedOptics(ComparedByContent):
    """What a description stands for; make it with :func:`resolve`."""

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


def resolve(description: Description) -> ResolvedOptics:
    """Read every text and file of a description and compute the optics.

    Raises
    ------
    InputError
        If a name is unknown, a file cannot be used, or a table does not
        reach the bands.

    Examples
    --------
    A camera in coastal water, over sand at 9 m, and what a diver sees there:

    >>> from .description import Description, FloorDescription, WaterDescription
    >>> from .summary import readouts
    >>> from .visibility import horizontal_visibility
    >>> reef = Description(WaterDescription("jerlov:3C"), floor=FloorDescription(9.0, "0.4"))
    >>> camera = resolve(reef).viewpoint(depth=5.0)
    >>> round(horizontal_visibility(camera), 1)
    3.3
    >>> many = dataclasses.replace(reef, bands=BandsDescription(REFERENCE_BANDS))
    >>> seen = readouts(camera, resolve(many).viewpoint(depth=5.0))
    >>> seen.colour.name
    'green'
    """
    mixtures = mixtures_of(description.water)
    light = description.light
    illuminant = light.illuminant
    if isinstance(illuminant, str):
        illuminant = parse_illuminant(illuminant, light.zenith)
    picture = light.sky_picture or None
    if isinstance(picture, str):
        picture = SkyPicture.read(picture.removeprefix("file:"))
    floor = description.floor.reflectance
    if isinstance(floor, str):
        floor = parse_reflectance(floor)

    def column_and_phase(
        bands: Bands, floor_reflectance: NDArray[np.float64]
    ) -> tuple[WaterColumn, BandPhase]:
        return column_of(description, mixtures, illuminant, bands, floor_reflectance, picture)

    bands, reference = description.bands, None
    if isinstance(bands, BandsDescription):
        chosen, bands = bands, _listed_or_equal(bands)
        if chosen.optimised and len(bands) < REFERENCE_BANDS:
            if light.strength == 0:
                raise InputError(
                    "optimised bands are fitted to daylight, and the sunlight is 0: take equal "
                    "bands, or a sunlight of 0.0001, which is night to the eye"
                )
            fine = Bands.uniform(REFERENCE_BANDS, chosen.start, chosen.end)
            reference = column_and_phase(fine, floor.at(fine.centres))
            reference[0].require_one_layer("optimised bands know")
            if not chosen.wavelengths:
                eye = Viewpoint(*reference, illuminant, standard_observer(), depth=0.0)
                bands = _optimised_bands(chosen.count, eye).bands
    column, phase = column_and_phase(bands, floor.at(bands.centres))
    excitation = None
    switched_on = parse_processes(description.water.inelastic)
    if switched_on:
        column.require_one_layer("inelastic light knows")
        # A measured floor need not reach the ultraviolet, which only excites.
        known = np.clip(EXCITATION.centres, *floor.range)
        first, second = (
            processes_of(description.water, mixtures.layers[0], switched_on, of)
            for of in (bands, EXCITATION)
        )
        excitation = Excitation(first, *column_and_phase(EXCITATION, floor.at(known)), second)
    sensor = description.camera.sensor
    if isinstance(sensor, str):
        sensor = parse_sensor(sensor)
    check_filter(description.camera.filter)
    return ResolvedOptics(
        description,
        mixtures.map(lambda mixture: mixture.water),
        illuminant, sensor, floor, bands, phase, column, excitation, reference,
    )  # fmt: skip


def _listed_or_equal(described: BandsDescription) -> Bands:
    if described.wavelengths:
        return Bands.at_wavelengths(described.wavelengths)
    return Bands.uniform(described.count, described.start, described.end)
