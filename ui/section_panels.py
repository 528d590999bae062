"""Panels of the sections of settings."""

from __future__ import annotations

from typing import override

import bpy

from ..scene import stored_clouds, stored_lamps
from ..scene.raised_limits import raised_limits
from ..scene.session import is_live
from ..settings.scene_settings import SETTINGS
from ..settings.setting import SECTIONS
from ..uw_spectral.clouds.matter import UNITS
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.transfer.water_column import WAVES
from . import panel_job, presets, previews, sections, sun_handle
from .panel_parts import SWATCH_SCALE, SubPanel, panel_settings, plot, say
from .reporting import sentence, water_settings


class _SectionPanel(SubPanel):
    """The settings of a section; what is drawn otherwise stands before them or behind."""

    bl_parent_id = "UNDERWATER_PT_advanced"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it
    section: str
    apart: tuple[str, ...] = ()
    popover: type[presets.PresetPanel] | None = None

    def __init_subclass__(cls) -> None:
        if "bl_idname" not in vars(cls):
            cls.bl_idname = f"UNDERWATER_PT_{cls.section}"
            cls.bl_label = SECTIONS[cls.section].title

    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, self.section)
        if self.popover is not None:
            self.popover.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        self.before(context)
        sections.draw(self.column(), context.scene, self.section, self.apart)
        self.after(context)

    def before(self, context: bpy.types.Context) -> None:
        """Draw what stands before the settings."""

    def after(self, context: bpy.types.Context) -> None:
        """Draw what stands behind them."""


class WaterPanel(_SectionPanel, bpy.types.Panel):
    """What makes a water one's own."""

    section = "water"
    apart = ("water", "inelastic")
    popover = presets.UNDERWATER_PT_water_presets

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


class DepthPanel(_SectionPanel, bpy.types.Panel):
    """Where the camera and the floor are."""

    section = "depth"

    @override
    def before(self, context: bpy.types.Context) -> None:
        column = self.column()
        draw_depth(column, context)
        column.label(text="The surface is z = 0; 1 unit is 1 m", icon="MOD_OCEAN")


class WavesPanel(_SectionPanel, bpy.types.Panel):
    """The moving surface and its caustics."""

    section = "waves"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = water_settings(context)
        if water.surface == WAVES and water.raised_waves:
            for said in raised_limits(water.wave_tile, eevee=True, live=True):
                say(self.layout, sentence(said))


class ParticlesPanel(_SectionPanel, bpy.types.Panel):
    """What floats in the water and is seen by itself."""

    section = "particles"

    @override
    def before(self, context: bpy.types.Context) -> None:
        self.column().label(text="Larger than 0.1 mm, per litre", icon="PARTICLES")

    @override
    def after(self, context: bpy.types.Context) -> None:
        from ..scene.readers import clouds

        column = self.column()
        column.separator()
        column.operator_menu_enum("underwater.add_cloud", "constituent", icon="OUTLINER_OB_VOLUME")
        water = water_settings(context)
        if water.surface == WAVES and water.raised_waves and water.whitecaps:
            column.operator("underwater.add_plumes", icon="MOD_OCEAN")
        found, active = clouds.marked(context.scene), context.object
        if active is not None and active not in found and active.type in (clouds.BLOB, clouds.GRID):
            own = getattr(active, stored_clouds.PROPERTY)
            column.prop(own, "constituent", text=active.name)
        for item in found:
            box = column.box().column()
            box.label(text=item.name, icon="OUTLINER_OB_VOLUME")
            own = getattr(item, stored_clouds.PROPERTY)
            box.prop(own, "constituent")
            box.prop(own, "concentration", text=f"Concentration ({UNITS[own.constituent]})")
            for said in clouds.diagnostics(item):
                say(box, sentence(said))


class SunPanel(_SectionPanel, bpy.types.Panel):
    """The light above the water."""

    section = "sun"

    @override
    def before(self, context: bpy.types.Context) -> None:
        if not sun_handle.driven(context.scene):
            self.layout.operator("underwater.add_sun_handle", icon="LIGHT_SUN")


class LampsPanel(_SectionPanel, bpy.types.Panel):
    """Torches, strobes and lights of vehicles, and how much sun there is beside them."""

    section = "lamps"

    @override
    def after(self, context: bpy.types.Context) -> None:
        from ..scene.readers import lamps

        column = self.column()
        column.operator_menu_enum("underwater.add_lamps", "rig", icon="LIGHT_SPOT")
        for item, why in lamps.left_out(context.scene).items():
            row = column.row()
            row.active = False
            row.label(text=f"{item.name}: dark here", icon=f"LIGHT_{item.data.type}")
            row.prop(getattr(item.data, stored_lamps.PROPERTY), "in_water", text="Light")
            say(column, sentence(why))
        for item in lamps.objects_of(context.scene):
            light = item.data
            box = column.box().column()
            box.label(text=item.name, icon=f"LIGHT_{light.type}")
            own = getattr(light, stored_lamps.PROPERTY)
            box.prop(light, "energy", text=f"Power ({own.unit if own.spectrum else 'W'})")
            row = box.row(align=True)
            row.prop(own, "spectrum")
            chosen = row.operator_menu_enum(
                "underwater.choose_spectrum", "spectrum", text="", icon="COLLAPSEMENU"
            )
            chosen.lamp = light.name
            if own.spectrum:
                box.prop(own, "unit")
            else:
                box.prop(light, "color")
            box.prop(own, "profile")
            if own.profile or light.type == "SPOT":
                box.prop(own, "behind_port")
            box.prop(own, "from_above")
            box.prop(item, "visible_camera", text="Itself Seen")
            for said in lamps.diagnostics(item):
                say(box, sentence(said))


class HousingPanel(_SectionPanel, bpy.types.Panel):
    """The port and the lens that the camera looks through."""

    section = "housing"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = water_settings(context)
        if water.housing != NONE or water.lens:
            say(self.layout, "The viewport shows what there is without; renders have it.")


class SensorPanel(_SectionPanel, bpy.types.Panel):
    """The camera's spectral sensitivities and the development."""

    section = "sensor"
    apart = ("sensor", "exposure")
    popover = presets.UNDERWATER_PT_camera_presets

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


class QualityPanel(_SectionPanel, bpy.types.Panel):
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
