"""Settings as descriptions of the optics: of water, light, sea, housing and camera."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from ..uw_spectral.errors import InputError
from ..uw_spectral.housing import HousingDescription
from ..uw_spectral.imaging.description import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from ..uw_spectral.surface.raised_waves import NO_SWELL, Swell
from ..uw_spectral.surface.wave_patterns import Sea
from ..uw_spectral.transfer.water_column import WAVES
from ..uw_spectral.water.bio_optics import Constituents
from .scene_settings import BANDS, BY_PICTURE, OPTIMISED, SETTINGS, SceneSettings
from .water_settings import AUTO, CONSTITUENTS, DEFAULT_PHASE, WORLD

_MOST_STOPS = 60  # pictures of 32 bits reach no further


def sea_of(settings: SceneSettings) -> Sea:
    """Return the sea that settings describe."""
    return Sea(
        settings.wind_speed,
        settings.wind_direction,
        1e3 * settings.fetch,
        settings.floor_depth or math.inf,
        settings.wave_seed,
        settings.wave_tile,
        settings.wave_resolution,
        settings.wave_loop or None,
        settings.raised_waves,
        Swell(settings.swell_height, settings.swell_length, settings.swell_direction)
        if settings.raised_waves
        else NO_SWELL,
        settings.raised_waves and settings.whitecaps,
    )


def housing_of(settings: SceneSettings) -> HousingDescription:
    """Return the housing that settings describe."""
    return HousingDescription(
        settings.housing,
        settings.port_distance,
        settings.port_thickness,
        settings.port_glass,
        settings.port_tilt,
        settings.port_tilt_towards,
        settings.dome_radius,
        settings.dome_forward,
        settings.lens,
        settings.salinity,
        settings.temperature,
    )


def description_of(settings: SceneSettings) -> Description:
    """Return the description that settings are.

    Raises InputError if wavelengths or exposure are no numbers, or the sky is a scene's world that
    nobody has drawn yet.
    """
    if settings.sky_picture == WORLD:
        raise InputError(
            f"--sky-picture {WORLD}: the light of a world is known once the water is in its scene; "
            "press Add Water or Refresh Water"
        )
    constituents = Constituents(
        settings.chlorophyll, settings.cdom, settings.minerals, settings.detritus
    )
    return Description(
        _described(
            WaterDescription,
            settings,
            water=constituents if settings.water == CONSTITUENTS else settings.water,
            source=settings.water_source,
            second=settings.second_water,
            second_fraction=settings.second_water_fraction,
            phase=None if settings.phase == DEFAULT_PHASE else settings.phase,
        ),
        _described(
            SunAndSky,
            settings,
            zenith=settings.sun_zenith,
            azimuth=settings.sun_azimuth,
            above_surface={"above": True, "below": False}.get(settings.irradiance),
            strength=settings.sunlight,
        ),
        _described(
            SurfaceDescription,
            settings,
            kind=settings.surface,
            slope_variance=sea_of(settings).spectrum.mean_square_slope
            if settings.surface == WAVES
            else 0.0,
        ),
        FloorDescription(settings.floor_depth or math.inf, settings.floor_reflectance),
        _described(
            CameraDescription,
            settings,
            exposure_stops=_stops(settings.exposure),
            compensation=settings.exposure_compensation,
        ),
        BandsDescription(
            settings.in_mode(BANDS).bands,
            settings.range_start,
            settings.range_end,
            _wavelengths(settings.wavelengths),
            settings.band_placement == OPTIMISED,
        ),
    )


def _described[Part: (WaterDescription, SunAndSky, SurfaceDescription, CameraDescription)](
    part: type[Part],
    settings: SceneSettings,
    /,
    **others: Any,  # noqa: ANN401
) -> Part:
    """Return a part of the description: others as given, fields of a setting's name as it is."""
    names = {field.name for field in dataclasses.fields(part)} & set(SETTINGS)
    return part(**{name: getattr(settings, name) for name in names} | others)


def _wavelengths(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError as error:
        raise InputError(
            f"--wavelengths: {text!r} is not a list of numbers like 450,550,650"
        ) from error


def _stops(text: str) -> float | None:
    """Read an exposure; None is automatic."""
    if text in (AUTO, BY_PICTURE):
        return None
    try:
        stops = float(text)
    except ValueError:
        stops = math.nan
    if not math.isfinite(stops):
        raise InputError(
            f"--exposure: {text!r} is neither {AUTO!r}, {BY_PICTURE!r} nor a number of stops"
        )
    if abs(stops) > _MOST_STOPS:
        raise InputError(f"--exposure: {stops:g} is outside -{_MOST_STOPS} to {_MOST_STOPS} stops")
    return stops
