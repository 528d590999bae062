"""Radiative transfer: the light in the water, and what a pixel sees of it."""

from .inelastic_light import InelasticLight, solve_inelastic
from .light_field import LightField, solve_light_field
from .path_radiance import PathRadiance, solve_path_radiance
from .water_column import WaterColumn

__all__ = [
    "InelasticLight",
    "LightField",
    "PathRadiance",
    "WaterColumn",
    "solve_inelastic",
    "solve_light_field",
    "solve_path_radiance",
]
