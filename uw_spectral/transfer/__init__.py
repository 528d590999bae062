"""Radiative transfer: the light in the water, and what a pixel sees of it."""

from .closed_form import ClosedForm, solve_closed_form
from .inelastic_light import InelasticLight, solve_inelastic
from .light_field import LightField, solve_light_field
from .water_column import DeeperWater, WaterColumn

__all__ = [
    "ClosedForm",
    "DeeperWater",
    "InelasticLight",
    "LightField",
    "WaterColumn",
    "solve_closed_form",
    "solve_inelastic",
    "solve_light_field",
]
