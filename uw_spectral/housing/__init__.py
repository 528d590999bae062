"""A camera in a housing under water: ports, lenses, and pictures through both."""

from .camera import PIXEL_CENTRE, LensCamera
from .description import (
    HousingDescription,
    MeasuredHousing,
    parse_lens,
    read_housing,
    record_of,
)
from .housing import Housing
from .lens import BrownConrady, KannalaBrandt, LateralColour, Lens
from .media import GLASSES, Glass, SeaWater, find_glass
from .port import DomePort, FlatPort, NoPort, Port
from .ray_fit import RayFit, fit_rays
from .view import PinholeView, field_needed, intrinsics_in_water, viewpoint, water_begins
from .virtual_image import defocus_factor, focus_distance
from .warp import SeenPlaces, effective_wavelength, sample, seen_places, warped, warped_flow

__all__ = [
    "GLASSES",
    "PIXEL_CENTRE",
    "BrownConrady",
    "DomePort",
    "FlatPort",
    "Glass",
    "Housing",
    "HousingDescription",
    "KannalaBrandt",
    "LateralColour",
    "Lens",
    "LensCamera",
    "MeasuredHousing",
    "NoPort",
    "PinholeView",
    "Port",
    "RayFit",
    "SeaWater",
    "SeenPlaces",
    "defocus_factor",
    "effective_wavelength",
    "field_needed",
    "find_glass",
    "fit_rays",
    "focus_distance",
    "intrinsics_in_water",
    "parse_lens",
    "read_housing",
    "record_of",
    "sample",
    "seen_places",
    "viewpoint",
    "warped",
    "warped_flow",
    "water_begins",
]
