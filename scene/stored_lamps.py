"""What a lamp stores besides Blender's own properties: ``light.underwater``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..settings.known_words import suggestions
from ..uw_spectral.lamps.emission import CANDELAS, LUMENS, WATTS

PROPERTY = "underwater"
ROV = "rov"
"""Profile of a measured lamp."""


@dataclass(frozen=True)
class LampSettings:
    """Spectrum, unit of the power, angular profile of a lamp, and its part in the water."""

    spectrum: str = ""
    unit: str = WATTS
    profile: str = ""
    in_water: bool = True
    behind_port: bool = False
    from_above: bool = False


def properties() -> dict[str, Any]:
    """What ``light.underwater`` has."""
    return {
        "spectrum": bpy.props.StringProperty(
            name="Spectrum",
            description="Light that the lamp emits: led, led-warm, halogen, hid, blackbody:5600, "
            "another light source by name, or file:PATH with wavelength_nm, power. Empty: the "
            "lamp's colour",
            search=suggestions("emissions"),
        ),
        "unit": bpy.props.EnumProperty(
            name="Power in",
            description="Unit of the lamp's power, where it has a spectrum",
            items=[
                (WATTS, "Watt", "Radiant power of the whole spectrum"),
                (LUMENS, "Lumen", "Luminous flux"),
                (CANDELAS, "Candela", "Luminous intensity on the lamp's axis"),
            ],
        ),
        "profile": bpy.props.StringProperty(
            name="Profile",
            description="Directions that the lamp shines in: rov (measured), an IES file, or a "
            "table angle_deg, intensity. Empty: as Blender has it",
            subtype="FILE_PATH",
            options={"ANIMATABLE", "PATH_SUPPORTS_BLEND_RELATIVE"},
        ),
        "behind_port": bpy.props.BoolProperty(
            name="Measured in Air",
            description="Whether the profile or the cone was measured in air, and the lamp shines "
            "through a flat port: in water it is narrower by the refractive index, and brighter",
            default=False,
        ),
        "from_above": bpy.props.BoolProperty(
            name="Shines In from Above",
            description="Whether the lamp lights the water while it is above it, as on a boat; "
            "without, it is dark there, as what lights a dry scene is",
            default=False,
        ),
        "in_water": bpy.props.BoolProperty(
            name="Lights the water",
            description="Whether the lamp lights the water; without, it is dark while there is "
            "water, as the lamps of a dry scene are beside the sun",
            default=True,
        ),
    }


def stored_lamp(light: bpy.types.Light) -> LampSettings:
    """Return what a lamp stores."""
    group = getattr(light, PROPERTY, None)
    if group is None:
        return LampSettings()
    spectrum, profile = group.spectrum.strip(), group.profile.strip()
    return LampSettings(
        spectrum, group.unit, profile, group.in_water, group.behind_port, group.from_above
    )
