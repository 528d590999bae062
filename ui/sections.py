"""Which settings each section of the panel shows, and their reset."""

from __future__ import annotations

# pyright: reportInvalidTypeForm=false
# Blender declares properties as annotations that are calls.
from typing import override

import bpy

from ..scene import stored_settings
from .live_updates import transaction

SECTIONS: dict[str, tuple[str, ...]] = {
    "water": (
        "water", "water_source", "chlorophyll", "cdom", "minerals", "detritus",
        "scattering_factor", "absorption_factor", "second_water", "second_water_share", "phase",
        "inelastic",
    ),
    "depth": ("floor_depth", "floor_reflectance", "scene_floor"),
    "waves": (
        "surface", "wind_speed", "wind_direction", "fetch", "caustics", "wave_time_scale",
        "wave_loop", "wave_seed", "wave_tile", "wave_resolution",
    ),
    "particles": (
        "snow", "snow_of_water", "plankton", "bubbles", "silt", "particle_slope", "particle_angle",
        "particle_seed", "drift_speed", "drift_direction",
    ),
    "sun": (
        "illuminant", "sun_zenith", "sun_azimuth", "irradiance", "sky", "sky_radiance",
        "refractive_index",
    ),
    "lamps": ("sunlight",),
    "sensor": (
        "sensor", "white_balance", "exposure", "exposure_compensation", "tone", "contrast",
    ),
    "quality": (
        "bands", "wavelengths", "band_placement", "range_start", "range_end", "forward_peak",
        "share_passes", "field", "shafts", "diffuse_shadows", "layers", "samples", "bounces",
    ),
}  # fmt: skip


class ResetSection(bpy.types.Operator):
    """Gives the settings of a section their defaults."""

    bl_idname = "underwater.reset_section"
    bl_label = "Reset Section"
    bl_description = "Give every setting of this section its default"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender wants it

    section: bpy.props.EnumProperty(
        name="Section",
        description="Which",
        items=[(name, name.capitalize(), "") for name in SECTIONS],
        options={"HIDDEN"},
    )

    @override
    def execute(self, context: bpy.types.Context) -> set[str]:
        group = getattr(context.scene, stored_settings.PROPERTY)
        defaults = group.bl_rna.properties
        with transaction():
            for name in SECTIONS[self.section]:
                # Setting lets live water follow, which unsetting alone would not.
                setattr(group, name, defaults[name].default)
                group.property_unset(name)
        return {"FINISHED"}


def draw_reset(layout: bpy.types.UILayout, section: str) -> None:
    """Draw the button of a section's header."""
    button = layout.operator(ResetSection.bl_idname, text="", icon="LOOP_BACK", emboss=False)
    button.section = section


def register() -> None:
    """Register the operator."""
    bpy.utils.register_class(ResetSection)


def unregister() -> None:
    """Unregister the operator."""
    bpy.utils.unregister_class(ResetSection)
