"""A camera in a housing under water: ports, lenses, and pictures through both."""

from .camera import PIXEL_CENTRE, LensCamera
from .housing import Housing
from .lens import BrownConrady, KannalaBrandt, LateralColour, Lens
from .media import GLASSES, Glass, SeaWater, find_glass
from .port import DomePort, FlatPort, Port
from .view import PinholeView, field_needed, intrinsics_in_water, viewpoint
from .virtual_image import focus_distance
from .warp import SeenPlaces, effective_wavelength, sample, seen_places, warped, warped_flow

__all__ = [
    "GLASSES",
    "PIXEL_CENTRE",
    "BrownConrady",
    "DomePort",
    "FlatPort",
    "Glass",
    "Housing",
    "KannalaBrandt",
    "LateralColour",
    "Lens",
    "LensCamera",
    "PinholeView",
    "Port",
    "SeaWater",
    "SeenPlaces",
    "effective_wavelength",
    "field_needed",
    "find_glass",
    "focus_distance",
    "intrinsics_in_water",
    "sample",
    "seen_places",
    "viewpoint",
    "warped",
    "warped_flow",
]
