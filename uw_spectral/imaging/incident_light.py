"""The light of a description, as it enters the water."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..spectra.bands import Bands
from ..spectra.illuminant import RELATIVE, Illuminant, full_sun
from ..spectra.sky_colours import sky_basis
from ..surface.refraction import in_water_cosine, sun_travel_direction
from ..transfer.rough_surface import WaterSurface
from ..transfer.sky_picture import SkyPicture
from ..transfer.water_column import WAVES
from .description import SunAndSky, SurfaceDescription

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class IncidentLight:
    """Sun and sky; names and units are those of :class:`.WaterColumn`."""

    sun_irradiance: Array
    sun_cosine: float
    sun_direction: Array
    sky_radiance: Array
    slope_variance: float
    sun_in_air: Array | None = None
    sky_basis: Array | None = None


def incident_light(
    light: SunAndSky, surface: SurfaceDescription, illuminant: Illuminant, bands: Bands,
    picture: SkyPicture | None = None,
) -> IncidentLight:  # fmt: skip
    """Return it in bands; ``picture`` is that of the sky, if one lights the water."""
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
    return IncidentLight(direct * transmitted, sun_cosine, sun, sky, waves, in_air, basis)
