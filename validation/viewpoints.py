"""A camera in a water in one call, for those who try many."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from ..uw_spectral.imaging import (
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    Viewpoint,
    WaterDescription,
    resolve,
)
from ..uw_spectral.spectra import Bands, Illuminant, Sensor
from ..uw_spectral.water import Water
from ..uw_spectral.water.phase import PhaseModel
from ..uw_spectral.water.profile import WaterProfile

# What records call otherwise, where one name must do for all.
_NAMES = {
    "sun_zenith": "zenith", "sun_azimuth": "azimuth", "surface": "kind",
    "floor_reflectance": "reflectance",
}  # fmt: skip


def make_viewpoint(
    water: Water | WaterProfile,
    illuminant: Illuminant,
    sensor: Sensor,
    depth: float,
    bands: Bands,
    phase: PhaseModel | str | None = None,
    **how: Any,  # noqa: ANN401
) -> Viewpoint:
    """Put a camera into a water.

    ``how`` are fields of :class:`.SunAndSky`, :class:`.SurfaceDescription`,
    :class:`.FloorDescription` and :class:`.CameraDescription`: ``sun_zenith``, ``sun_azimuth``,
    ``surface``, ``floor_depth``, ``floor_reflectance``, others by their names.
    """
    floor = {"depth": how.pop("floor_depth")} if "floor_depth" in how else {}
    given = {_NAMES.get(name, name): value for name, value in how.items()}

    def of(record: type) -> dict[str, Any]:
        names = {field.name for field in fields(record)} & set(given)
        return {name: given.pop(name) for name in names}

    description = Description(
        WaterDescription(water, phase=phase),
        SunAndSky(illuminant, **of(SunAndSky)),
        SurfaceDescription(**of(SurfaceDescription)),
        FloorDescription(**floor, **of(FloorDescription)),
        CameraDescription(sensor, **of(CameraDescription)),
        bands,
    )
    if given:
        raise TypeError(f"make_viewpoint() got unexpected {', '.join(given)}")
    return resolve(description).viewpoint(depth)
