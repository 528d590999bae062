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
from .formation_fit import Formation, FormationFit, fit_formation
from .image_formation import (
    FormationCurves,
    ImageFormation,
    compute_image_formation,
    remove_water,
)
from .optics import resolve
from .resolved_optics import ResolvedOptics
from .summary import Readouts, readouts
from .viewpoint import Viewpoint

__all__ = [
    "BandsDescription",
    "CameraDescription",
    "Description",
    "FloorDescription",
    "Formation",
    "FormationCurves",
    "FormationFit",
    "ImageFormation",
    "Readouts",
    "ResolvedOptics",
    "SunAndSky",
    "SurfaceDescription",
    "Viewpoint",
    "WaterDescription",
    "compute_image_formation",
    "fit_formation",
    "fitted_reduction",
    "optimised_bands",
    "readouts",
    "remove_water",
    "resolve",
]
