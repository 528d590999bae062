"""Lamp of the sun: irradiance per band on a plane normal to the in-water rays."""

from __future__ import annotations

import bpy

from . import attributes
from .data_blocks import new_emission

NAME = "UW Sun"


def build(
    angular_diameter: float, irradiance: str = attributes.SUN_IRRADIANCE, gain: float = 1.0
) -> bpy.types.SunLight:
    """Build the lamp of a sun whose disc is seen under a diameter in radians.

    It brings the attribute ``irradiance`` times ``gain`` on a plane across its light.
    """
    light = bpy.data.lights.new(NAME, "SUN")
    light.energy = 1.0
    light.angle = angular_diameter
    _, emission = new_emission(light, irradiance)
    emission.inputs["Strength"].default_value = gain
    return light
