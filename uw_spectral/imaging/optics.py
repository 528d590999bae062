"""From a description to optics: every text read, every quantity on the bands."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.barrier_filter import parse_filter
from ..spectra.illuminant import RELATIVE, Illuminant, full_sun, parse_illuminant
from ..spectra.reflectance import parse_reflectance
from ..spectra.sensor import parse_sensor, standard_observer
from ..spectra.sky_colours import sky_basis
from ..surface.refraction import in_water_cosine, sun_travel_direction
from ..transfer.rough_surface import WaterSurface
from ..transfer.sky import UNIFORM
from ..transfer.sky_picture import SkyPicture
from ..transfer.water_column import WAVES, DeeperWater, WaterColumn
from ..water.phase import BandPhase
from ..water.profile import DepthProfile
from .band_selection import optimised_bands
from .description import (
    REFERENCE_BANDS,
    BandsDescription,
    Description,
    SunAndSky,
    SurfaceDescription,
)
from .excitation import excitation_of
from .mixed_water import Mixture, mixtures_of, phase_of
from .resolved_optics import ResolvedOptics
from .viewpoint import Viewpoint

_optimised_bands = functools.lru_cache(maxsize=32)(optimised_bands)


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

    >>> import dataclasses
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

    column_and_phase = functools.partial(
        _column_of, description, mixtures, illuminant, picture=picture
    )
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
    excitation = excitation_of(
        description.water, mixtures.layers[0], column, floor, column_and_phase
    )
    sensor = description.camera.sensor
    if isinstance(sensor, str):
        sensor = parse_sensor(sensor)
    parse_filter(description.camera.filter)
    return ResolvedOptics(
        description,
        mixtures.map(lambda mixture: mixture.water),
        illuminant, sensor, floor, bands, phase, column, excitation, reference,
    )  # fmt: skip


def _listed_or_equal(described: BandsDescription) -> Bands:
    if described.wavelengths:
        return Bands.at_wavelengths(described.wavelengths)
    return Bands.uniform(described.count, described.start, described.end)


def _column_of(
    description: Description,
    mixtures: DepthProfile[Mixture],
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
    picture: SkyPicture | None,
) -> tuple[WaterColumn, BandPhase]:
    """Return the column of water in bands, and the phase function of its first layer.

    ``picture`` is that of the sky, if one lights the water.
    """
    light, surface = description.light, description.surface
    phases = mixtures.map(lambda mixture: phase_of(description.water, mixture, bands))
    first, *deeper = (
        DeeperWater(top, mixture.water.a(bands.centres), mixture.water.b(bands.centres), phase)
        for top, mixture, phase in zip(mixtures.tops, mixtures.layers, phases.layers, strict=True)
    )
    column = WaterColumn(
        bands=bands,
        absorption=first.absorption,
        scattering=first.scattering,
        floor_depth=description.floor.depth,
        floor_reflectance=floor_reflectance,
        surface=surface.kind,
        refractive_index=surface.refractive_index,
        below=tuple(deeper),
        sky=light.sky if picture is None else UNIFORM,
        sky_picture=None if picture is None else picture.without_sun,
        **_incident_light(light, surface, illuminant, bands, picture),
    )
    return column, phases.layers[0]


def _incident_light(
    light: SunAndSky, surface: SurfaceDescription, illuminant: Illuminant, bands: Bands,
    picture: SkyPicture | None,
) -> dict[str, Any]:  # fmt: skip
    """Return sun and sky as fields of :class:`.WaterColumn`."""
    above = illuminant.above_surface if light.above_surface is None else light.above_surface
    zenith, azimuth, more, basis = light.zenith, light.azimuth, light.sky_radiance, None
    if picture is None:
        direct, diffuse = illuminant.direct_in(bands), illuminant.diffuse_in(bands)
    else:
        above, more, (x, y, z) = True, 0.0, picture.sun
        zenith, azimuth = math.degrees(math.acos(-z)), math.degrees(math.atan2(y, x))
        unit = 1.0 if illuminant.unit == RELATIVE else full_sun()
        basis = sky_basis(bands, picture.saturation) * unit
        # Rounding may leave less than nothing.
        direct, diffuse = (
            np.maximum(basis @ rgb, 0.0)
            for rgb in (picture.sun_irradiance, picture.without_sun.irradiance)
        )
        basis = basis * light.strength
    direct, diffuse = direct * light.strength, diffuse * light.strength
    index, waves = surface.refractive_index, surface.slope_variance * (surface.kind == WAVES)
    sun_cosine, in_air = float(in_water_cosine(zenith, index)), None
    sun = sun_travel_direction(zenith, azimuth, index)
    if waves:
        in_air = sun_travel_direction(zenith, azimuth, 1.0)
        sun = WaterSurface(index, waves).beam_below(in_air.tolist())
        sun_cosine = -float(sun[2])
    transmitted = 1.0
    if above:
        cosine = math.cos(math.radians(zenith))
        transmitted -= float(WaterSurface(index, waves).reflectance(cosine))
    sky = diffuse / math.pi + more * direct
    return {
        "sun_irradiance": direct * transmitted,
        "sun_cosine": sun_cosine,
        "sun_direction": sun,
        "sky_radiance": sky,
        "slope_variance": waves,
        "sun_in_air": in_air,
        "sky_basis": basis,
    }
