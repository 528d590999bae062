"""The column of water of a description, on bands, and the light that enters it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..spectra.bands import Bands
from ..spectra.illuminant import RELATIVE, Illuminant, full_sun
from ..spectra.sky_colours import sky_basis
from ..surface.refraction import in_water_cosine, sun_travel_direction
from ..transfer.rough_surface import WaterSurface
from ..transfer.sky import UNIFORM
from ..transfer.sky_picture import SkyPicture
from ..transfer.water_column import WAVES, DeeperWater, WaterColumn
from ..water.phase import BandPhase
from ..water.profile import DepthProfile
from .description import Description, SunAndSky, SurfaceDescription
from .mixed_water import Mixture, phase_of


def column_of(
    description: Description,
    mixtures: DepthProfile[Mixture],
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
    picture: SkyPicture | None = None,
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
