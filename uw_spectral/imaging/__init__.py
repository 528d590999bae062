"""A camera in the water: its description, its optics, its colours, and what a diver reads off."""

from .band_selection import fitted_reduction, optimised_bands
from .description import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from .optics import ResolvedOptics, make_viewpoint, resolve
from .summary import Readouts, readouts
from .viewpoint import Viewpoint

__all__ = [
    "BandsDescription",
    "CameraDescription",
    "Description",
    "FloorDescription",
    "Readouts",
    "ResolvedOptics",
    "SunAndSky",
    "SurfaceDescription",
    "Viewpoint",
    "WaterDescription",
    "fitted_reduction",
    "make_viewpoint",
    "optimised_bands",
    "readouts",
    "resolve",
]
