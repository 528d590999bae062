"""Lamps in the water: torches, strobes, lights of vehicles."""

from .emission import intensity_of_colour, parse_emission, radiant_intensity
from .ies import read_ies
from .lamp import Lamp, lamp_disc, ray_past_lamp
from .lamp_channels import LampChannels
from .lamp_path import single_scattering
from .lamp_projection import project_lamps
from .lamp_surface import patch_past_lamp, surface_irradiance
from .multiple_scattering import LampWater, lamp_light, lamp_water
from .port import BehindFlatPort
from .profile import (
    IsotropicProfile,
    LampProfile,
    SpotProfile,
    SpreadProfile,
    TableProfile,
    rov_lamp,
)

__all__ = [
    "BehindFlatPort",
    "IsotropicProfile",
    "Lamp",
    "LampChannels",
    "LampProfile",
    "LampWater",
    "SpotProfile",
    "SpreadProfile",
    "TableProfile",
    "intensity_of_colour",
    "lamp_disc",
    "lamp_light",
    "lamp_water",
    "parse_emission",
    "patch_past_lamp",
    "project_lamps",
    "radiant_intensity",
    "ray_past_lamp",
    "read_ies",
    "rov_lamp",
    "single_scattering",
    "surface_irradiance",
]
