"""What an object that is a cloud stores besides Blender's own properties: ``object.underwater``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy

from ..uw_spectral.clouds.matter import BUBBLES, MINERALS, PHYTOPLANKTON, UNITS

PROPERTY = "underwater"
NO_CLOUD = "none"

WORDS = {
    MINERALS: ("Minerals", "Silt and clay that was stirred up or flows in"),
    PHYTOPLANKTON: ("Phytoplankton", "A bloom, by its chlorophyll"),
    BUBBLES: ("Bubbles", "Air below a breaker, in a wake or from divers; all colours alike"),
}
"""Name of a constituent, and what it is."""


@dataclass(frozen=True)
class CloudSettings:
    """Constituent of a cloud, empty without one, and its concentration in that one's unit."""

    constituent: str = ""
    concentration: float = 0.0


def properties() -> dict[str, Any]:
    """What ``object.underwater`` has."""
    items = [(NO_CLOUD, "No Cloud", "An ordinary object")]
    items += [(name, *WORDS[name]) for name in UNITS]
    return {
        "constituent": bpy.props.EnumProperty(
            name="Cloud of",
            description="What floats in the water where the object is: about an empty, densest in "
            "its middle and down to a seventh at the outline that its size and scale draw; of a "
            "volume object, where its density is",
            items=items,
        ),
        "concentration": bpy.props.FloatProperty(
            name="Concentration",
            description="How much there is where the density is 1, besides what the water holds "
            "everywhere: g/m³ of minerals, mg/m³ of chlorophyll, litres of air per m³. A diver's "
            "fins stir up some tens of g/m³, rivers in flood bring hundreds; a fresh breaker holds "
            "tens of l/m³, its plume seconds later one",
            default=10.0,
            min=0.0,
            soft_max=200.0,
            max=10000.0,
        ),
    }


def stored_cloud(item: bpy.types.Object) -> CloudSettings:
    """Return what an object stores."""
    group = getattr(item, PROPERTY, None)
    if group is None or group.constituent == NO_CLOUD:
        return CloudSettings()
    # Properties are float32.
    return CloudSettings(group.constituent, float(f"{group.concentration:.7g}"))
