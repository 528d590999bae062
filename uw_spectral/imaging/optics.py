"""From a description to optics: every text read, every quantity on the bands."""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent
from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.barrier_filter import check as check_filter
from ..spectra.colour_rendering import WhiteBalance
from ..spectra.illuminant import Illuminant, parse_illuminant
from ..spectra.reflectance import parse_reflectance
from ..spectra.sensor import Sensor, parse_sensor, standard_observer
from ..spectra.spectrum import Spectrum
from ..surface.refraction import in_water_cosine, sun_travel_direction
from ..transfer.discrete_ordinates import STREAMS, Emission
from ..transfer.inelastic_emission import inelastic_emission
from ..transfer.rough_surface import WaterSurface
from ..transfer.sky import UNIFORM
from ..transfer.solved_field import SolvedField
from ..transfer.water_column import WAVES, DeeperWater, WaterColumn
from ..water.bio_optics import Constituents
from ..water.inelastic_processes import (
    EXCITATION,
    InelasticProcess,
    inelastic_processes,
    parse_processes,
)
from ..water.named import parse_uniform_water, parse_water
from ..water.named_waters import constituents_of
from ..water.optical_properties import Water
from ..water.phase import BandPhase, PhaseModel
from ..water.phase_functions import parse_phase
from ..water.profile import DepthProfile, WaterProfile
from ..water.pure_water import molecular_scattering
from .band_selection import FittedViewpoint, optimised_bands
from .description import (
    REFERENCE_BANDS,
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from .viewpoint import Viewpoint

_optimised_bands = functools.lru_cache(maxsize=32)(optimised_bands)


@dataclass(frozen=True, eq=False)
class Excitation:
    """Processes that change the wavelength of light, and the water in the bands they start from."""

    processes: tuple[InelasticProcess, ...]
    column: WaterColumn
    phase: BandPhase

    def emission(self, bands: Bands, streams: int = STREAMS) -> Emission:
        """Return what is emitted in bands, by the solved field of the exciting light."""
        exciting = self.column.solved_field(self.phase, streams, modes=1)
        return inelastic_emission(self.processes, exciting, EXCITATION, bands)


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
    mixtures = _mixtures(description.water)
    light = description.light
    illuminant = light.illuminant
    if isinstance(illuminant, str):
        illuminant = parse_illuminant(illuminant, light.zenith)
    floor = description.floor.reflectance
    if isinstance(floor, str):
        floor = parse_reflectance(floor)

    def column_and_phase(
        bands: Bands, floor_reflectance: NDArray[np.float64]
    ) -> tuple[WaterColumn, BandPhase]:
        phases = mixtures.map(lambda mixture: _phase(description.water, mixture, bands))
        waters = mixtures.map(lambda mixture: mixture.water)
        column = _column(description, waters, phases, illuminant, bands, floor_reflectance)
        return column, phases.layers[0]

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
        excitation = Excitation(
            _processes(description.water, mixtures.layers[0], switched_on, bands),
            *column_and_phase(EXCITATION, floor.at(known)),
        )
    sensor = description.camera.sensor
    if isinstance(sensor, str):
        sensor = parse_sensor(sensor)
    check_filter(description.camera.filter)
    return ResolvedOptics(
        description,
        mixtures.map(lambda mixture: mixture.water),
        illuminant, sensor, floor, bands, phase, column, excitation, reference,
    )  # fmt: skip


def make_viewpoint(
    water: Water | WaterProfile,
    illuminant: Illuminant,
    sensor: Sensor,
    depth: float,
    bands: Bands,
    phase: PhaseModel | str | None = None,
    *,
    sun_zenith: float = 30.0,
    sun_azimuth: float = 0.0,
    floor_depth: float = math.inf,
    floor_reflectance: Spectrum | str = "0.2",
    surface: str = "none",
    sky_radiance: float = 0.0,
    sky: str = UNIFORM,
    refractive_index: float = 1.34,
    slope_variance: float = 0.0,
    above_surface: bool | None = None,
    white_balance: WhiteBalance = "daylight",
    exposure_stops: float | None = None,
) -> Viewpoint:
    """Put a camera into a water: a :class:`.Description` in one call.

    Parameters
    ----------
    water, phase
        See :class:`.WaterDescription`.
    illuminant, sun_zenith, sun_azimuth, sky_radiance, above_surface, sky
        See :class:`.SunAndSky`.
    sensor, white_balance, exposure_stops
        See :class:`.CameraDescription`.
    depth : float
        Depth of the camera, m.
    floor_depth, floor_reflectance
        See :class:`.FloorDescription`.
    surface, refractive_index, slope_variance
        See :class:`.SurfaceDescription`.

    Raises
    ------
    InputError
        If an argument is out of its domain or a table does not reach the bands.

    Examples
    --------
    >>> from .visibility import euphotic_depth, horizontal_visibility
    >>> camera = make_viewpoint(Water.jerlov("IB"), parse_illuminant("d65"),
    ...                         parse_sensor("cie1931"), 5.0, Bands.uniform(60))
    >>> round(horizontal_visibility(camera)), round(euphotic_depth(camera.column, camera.phase))
    (39, 103)
    """
    description = Description(
        WaterDescription(water, phase=phase),
        SunAndSky(illuminant, sun_zenith, sun_azimuth, sky_radiance, above_surface, sky),
        SurfaceDescription(surface, refractive_index, slope_variance),
        FloorDescription(floor_depth, floor_reflectance),
        CameraDescription(sensor, white_balance, exposure_stops),
        bands,
    )
    return resolve(description).viewpoint(depth)


@dataclass(frozen=True)
class _Mixture:
    """The water of a layer, and what it is made of if it is one bio-optical water."""

    water: Water
    constituents: Constituents | None


def _mixtures(described: WaterDescription) -> DepthProfile[_Mixture]:
    water, second, known = described.water, described.second, None
    if isinstance(water, str):
        water, known = parse_water(water, described.source), constituents_of(water)
    if isinstance(second, str) and second:
        second = parse_uniform_water(second, described.source)

    def mixture(layer: Water | Constituents) -> _Mixture:
        constituents = known
        if isinstance(layer, Constituents):
            layer, constituents = layer.water(), layer
        if second:
            layer, constituents = layer.mixed(second, described.second_fraction), None
        layer = layer.concentrated(described.concentration)
        scaled = layer.scaled(described.absorption_factor, described.scattering_factor)
        return _Mixture(scaled, constituents)

    return (water if isinstance(water, DepthProfile) else DepthProfile.uniform(water)).map(mixture)


def _phase(described: WaterDescription, mixture: _Mixture, bands: Bands) -> BandPhase:
    if described.phase is None and mixture.constituents is not None:
        if mixture.constituents is described.water:
            return mixture.constituents.phase_of_fixed_parts(bands.centres)
        return mixture.constituents.phase(bands.centres)
    model = mixture.water.phase_model if described.phase is None else described.phase
    if isinstance(model, str):
        model = parse_phase(model)
    return model.for_bands(mixture.water.b(bands.centres), molecular_scattering(bands.centres))


def _column(
    description: Description,
    waters: DepthProfile[Water],
    phases: DepthProfile[BandPhase],
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
) -> WaterColumn:
    light, surface = description.light, description.surface
    index, zenith = surface.refractive_index, light.zenith
    direct, diffuse = (
        part(bands) * light.strength for part in (illuminant.direct_in, illuminant.diffuse_in)
    )
    transmitted = 1.0
    above = illuminant.above_surface if light.above_surface is None else light.above_surface
    waves = surface.slope_variance if surface.kind == WAVES else 0.0
    sun_cosine, in_air = float(in_water_cosine(zenith, index)), None
    sun = sun_travel_direction(zenith, light.azimuth, index)
    if waves:
        in_air = sun_travel_direction(zenith, light.azimuth, 1.0)
        sun = WaterSurface(index, waves).beam_below(in_air.tolist())
        sun_cosine = -float(sun[2])
    if above:
        cosine = math.cos(math.radians(zenith))
        transmitted -= float(WaterSurface(index, waves).reflectance(cosine))
    first, *deeper = (
        DeeperWater(top, water.a(bands.centres), water.b(bands.centres), phase)
        for top, water, phase in zip(waters.tops, waters.layers, phases.layers, strict=True)
    )
    return WaterColumn(
        bands=bands,
        absorption=first.absorption,
        scattering=first.scattering,
        sun_irradiance=direct * transmitted,
        sun_cosine=sun_cosine,
        sun_direction=sun,
        sky_radiance=diffuse / math.pi + light.sky_radiance * direct,
        floor_depth=description.floor.depth,
        floor_reflectance=floor_reflectance,
        surface=surface.kind,
        refractive_index=index,
        below=tuple(deeper),
        sky=light.sky,
        slope_variance=waves,
        sun_in_air=in_air,
    )


def _listed_or_equal(described: BandsDescription) -> Bands:
    if described.wavelengths:
        return Bands.at_wavelengths(described.wavelengths)
    return Bands.uniform(described.count, described.start, described.end)


def _processes(
    described: WaterDescription, mixture: _Mixture, switched_on: tuple[str, ...], bands: Bands
) -> tuple[InelasticProcess, ...]:
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
