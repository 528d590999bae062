"""Panels of the sections of settings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, override

import bpy

from ..scene.raised_limits import raised_limits
from ..scene.session import is_live
from ..settings.scene_settings import SETTINGS
from ..settings.water_settings import WORLD
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.transfer.water_column import WAVES
from . import added_objects, panel_job, presets, previews
from .panel_parts import SWATCH_SCALE, SubPanel, panel_settings, plot, say
from .reporting import sentence, water_settings
from .sections import SectionPanel

if TYPE_CHECKING:
    from ..uw_spectral.imaging.water_colour import DominantColour


class WaterPanel(SectionPanel, bpy.types.Panel):
    """What makes a water one's own."""

    section = "water"
    apart = ("water", "inelastic")
    popover = presets.KINDS["water"].panel

    @override
    def before(self, context: bpy.types.Context) -> None:
        self.layout.prop(panel_settings(context), "from_constituents")
        draw_water(self.layout, context)

    @override
    def after(self, context: bpy.types.Context) -> None:
        self.layout.row(align=True).prop(panel_settings(context), "inelastic")
        pictures = previews.of_scene(context.scene)
        if pictures.error:
            say(self.layout, pictures.error, "ERROR")
        else:
            for line in (pictures.visibility, pictures.source):
                if line:
                    say(self.layout, line)
        plot(self.layout, "water")


class DepthPanel(SectionPanel, bpy.types.Panel):
    """Where the camera and the floor are."""

    section = "depth"

    @override
    def before(self, context: bpy.types.Context) -> None:
        column = self.column()
        draw_depth(column, context)
        column.label(text="The surface is z = 0; 1 unit is 1 m", icon="MOD_OCEAN")

    @override
    def after(self, context: bpy.types.Context) -> None:
        self.column().operator("underwater.distribute", icon="STICKY_UVS_DISABLE")


class WavesPanel(SectionPanel, bpy.types.Panel):
    """The moving surface and its caustics."""

    section = "waves"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = water_settings(context)
        if water.surface == WAVES and water.raised_waves:
            for said in raised_limits(water.wave_tile, eevee=True, live=True):
                say(self.layout, sentence(said))


class SunPanel(SectionPanel, bpy.types.Panel):
    """The light above the water."""

    section = "sun"

    @override
    def before(self, context: bpy.types.Context) -> None:
        if not added_objects.driven(context.scene):
            self.layout.operator("underwater.add_sun_handle", icon="LIGHT_SUN")

    @override
    def after(self, context: bpy.types.Context) -> None:
        if water_settings(context).sky_picture == WORLD and not is_live(context.scene):
            say(self.layout, "Plots show the light of sun and sky until the water is added.")


class HousingPanel(SectionPanel, bpy.types.Panel):
    """The port and the lens that the camera looks through."""

    section = "housing"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = water_settings(context)
        if water.housing != NONE or water.lens:
            say(self.layout, "The viewport shows what there is without; renders have it.")


class SensorPanel(SectionPanel, bpy.types.Panel):
    """The camera's spectral sensitivities and the development."""

    section = "sensor"
    apart = ("sensor", "exposure")
    popover = presets.KINDS["camera"].panel

    @override
    def before(self, context: bpy.types.Context) -> None:
        panel, row = panel_settings(context), self.layout.row(align=True)
        row.prop(water_settings(context), "sensor", text="")
        row.operator("underwater.open_sensor", text="", icon="FILEBROWSER")
        column = self.column()
        column.prop(panel, "meter")
        if panel.meter == "FIXED":
            column.prop(panel, "stops")

    @override
    def after(self, context: bpy.types.Context) -> None:
        pictures = previews.of_scene(context.scene)
        if pictures.error:
            say(self.layout, pictures.error, "ERROR")
        elif pictures.sensor:
            say(self.layout, pictures.sensor)
        plot(self.layout, "sensor")


class QualityPanel(SectionPanel, bpy.types.Panel):
    """How the water is rendered."""

    section = "quality"
    apart = ("layers",)

    @override
    def before(self, context: bpy.types.Context) -> None:
        panel = panel_settings(context)
        row = self.layout.row(align=True)
        row.prop(panel, "target_delta_e", text="Error ΔE")
        row.operator("underwater.auto")
        if panel_job.method(context.scene).traced:
            self.column().prop(panel, "denoise")

    @override
    def after(self, context: bpy.types.Context) -> None:
        panel = panel_settings(context)
        if water_settings(context).shafts and is_live(context.scene):
            eevee, column = context.scene.eevee, self.column()
            column.prop(eevee, "volumetric_tile_size", text="Froxel size")
            column.prop(eevee, "volumetric_samples", text="Froxel steps")
        self.layout.label(text=SETTINGS["layers"].label)
        grid = self.layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        grid.use_property_split = False
        for item in panel.bl_rna.properties["layers"].enum_items:
            grid.prop_enum(panel, "layers", item.identifier)
        for line in panel.decisions.splitlines():
            say(self.layout, line)


class ReadoutsPanel(SubPanel, bpy.types.Panel):
    """What the settings mean, in words and numbers."""

    bl_parent_id = "UNDERWATER_PT_advanced"
    bl_idname = "UNDERWATER_PT_readouts"
    bl_label = "Read-outs"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        pictures = previews.of_scene(context.scene)
        found = pictures.readouts
        if pictures.error:
            say(self.layout, pictures.error, "ERROR")
        if found is None:
            if not pictures.error:
                self.layout.label(text="Computing…", icon="TIME")
            return
        self.layout.template_icon(icon_value=previews.icon_id("open water"), scale=2.0)
        rows = {
            "Visibility": f"{_metres(found.visibility)} (contrast 2 %)",
            "1 % light": f"at {_metres(found.euphotic_depth)}",
            "Colour": _colour(found.colour),
            "Colour error": f"ΔE {found.colour_error.mean:.2f}, "
            f"max {found.colour_error.maximum:.2f}",
        }
        if pictures.inelastic is not None:
            rows["Inelastic"] = f"{100 * pictures.inelastic:.2g} % of the water's luminance"
        grid = self.layout.column(align=True)
        for name, value in rows.items():
            split = grid.split(factor=0.38)
            split.label(text=name)
            split.label(text=value)
        self.layout.label(text="Light left at the camera")
        plot(self.layout, "light")


def _metres(value: float) -> str:
    return f"{value:.3g} m" if math.isfinite(value) else "no limit"


def _colour(colour: DominantColour) -> str:
    if math.isnan(colour.wavelength):
        return colour.name
    complementary = " (complement)" if colour.wavelength < 0 else ""
    return f"{colour.name}, {abs(colour.wavelength):.0f} nm{complementary}"


def draw_water(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw which water it is: a gallery, a name, a file."""
    water, panel = water_settings(context), panel_settings(context)
    if panel.from_constituents:
        return
    file = water.water.startswith("file:")
    if not file:
        layout.template_icon_view(
            panel, "gallery", show_labels=True, scale=SWATCH_SCALE, scale_popup=4.0
        )
    row = layout.row(align=True)
    row.prop(water, "water", text="")
    row.operator("underwater.open_water", text="", icon="FILEBROWSER")
    if file:
        layout.row().prop_enum(panel, "gallery", "JERLOV_IB", text="Back to Jerlov types")


def draw_depth(column: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where the camera is."""
    from ..scene.viewport import preview_depths

    depth = preview_depths.camera_depth(context.scene)
    if depth is None:
        column.label(text="No camera", icon="ERROR")
    elif depth > 0:
        column.label(text=f"Camera {depth:.4g} m under the surface", icon="CAMERA_DATA")
    else:
        column.label(text=f"Camera {-depth:.4g} m above the surface", icon="CAMERA_DATA")
    column.operator("underwater.submerge", icon="TRIA_DOWN_BAR")
