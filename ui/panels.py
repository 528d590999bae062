"""The sidebar of the 3D viewport, tab Underwater."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, override

import bpy

from ..quality.methods import METHODS
from ..quality.terms import TERMS
from ..scene import stored_lamps, units
from ..scene import stored_settings as optics
from ..scene.session import is_live
from . import migration, preferences, presets, previews, property_group, sections, sun_handle

if TYPE_CHECKING:
    from ..uw_spectral.imaging.water_colour import DominantColour

_SWATCH_SCALE = 5.0
_PLOT_SCALE = 9.0
_LOOK_SCALE = 4.5
# Average width of a character of the interface's font, in pixels at scale 1.
_CHARACTER = 7.2
_MARGIN = 70


def _water(context: bpy.types.Context) -> bpy.types.PropertyGroup:
    return getattr(context.scene, optics.PROPERTY)


def _panel(context: bpy.types.Context) -> bpy.types.PropertyGroup:
    return getattr(context.scene, property_group.PROPERTY)


def _say(layout: bpy.types.UILayout, text: str, icon: str = "INFO") -> None:
    """Write a text over as many lines as it needs."""
    box = layout.box().column(align=True)
    context = bpy.context
    scale = context.preferences.system.ui_scale
    width = context.region.width if context.region is not None else 0
    longest = max(int((width / scale - _MARGIN) / _CHARACTER), 20)
    line = ""
    for word in [*text.split(), None]:
        if word is None or (line and len(line) + len(word) > longest):
            box.label(text=line.strip(), icon=icon)
            icon, line = "BLANK1", ""
        line += f"{word} "


def _plot(layout: bpy.types.UILayout, name: str) -> None:
    icon = previews.icon_id(name)
    if icon:
        layout.template_icon(icon_value=icon, scale=_PLOT_SCALE)


class _Panel:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = preferences.TAB


class MainPanel(_Panel, bpy.types.Panel):
    """Adds and removes the water."""

    bl_idname = "UNDERWATER_PT_main"
    bl_label = "Underwater"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        presets.UNDERWATER_PT_look_presets.draw_panel_header(self.layout)

    @override
    def draw(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import live

        layout, scene = self.layout, context.scene
        column = layout.column()
        column.scale_y = 1.4
        if is_live(scene):
            row = column.row(align=True)
            row.operator("underwater.remove_water", icon="X")
            row.operator("underwater.rebuild", text="", icon="FILE_REFRESH")
        else:
            column.operator("underwater.add_water", icon="MOD_OCEAN")
        layout.operator_menu_enum("underwater.add_example", "example", icon="SCENE_DATA")
        if not scene.is_editable:
            _say(layout, "This scene is linked: make it local to change its water.", "LINKED")
        if migration.is_newer(scene):
            _say(layout, "A newer version of the extension has saved this file.", "ERROR")
        unit = units.note(scene)
        if unit:
            _say(layout, unit[0].upper() + unit[1:] + ".", "ERROR")
        problem = live.problem(scene)
        if problem:
            _say(layout, problem, "ERROR")
        depth = live.camera_depth(scene)
        if depth is not None and depth <= 0:
            _say(layout, "The camera looks at the water from above.", "INFO")
            layout.operator("underwater.submerge", icon="TRIA_DOWN_BAR")
        if is_live(scene) and not _shows_water(context):
            layout.operator("underwater.show", icon="SHADING_RENDERED")


def _shows_water(context: bpy.types.Context) -> bool:
    space = context.space_data
    return space is None or space.type != "VIEW_3D" or space.shading.type == "RENDERED"


class _SubPanel(_Panel):
    layout: bpy.types.UILayout
    bl_parent_id = "UNDERWATER_PT_main"

    def column(self) -> bpy.types.UILayout:
        """Return the layout of a list of properties."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = True
        return self.layout.column()


class LooksPanel(_SubPanel, bpy.types.Panel):
    """Looks by their pictures."""

    bl_idname = "UNDERWATER_PT_looks"
    bl_label = "Looks"

    @override
    def draw(self, _: bpy.types.Context) -> None:
        grid = self.layout.grid_flow(row_major=True, columns=3, even_columns=True, align=True)
        for name, path in presets.names("look").items():
            cell = grid.column(align=True)
            picture = previews.thumbnail("look", path.stem)
            if picture:
                cell.template_icon(icon_value=picture, scale=_LOOK_SCALE)
            button = cell.operator("underwater.apply_preset", text=name)
            button.filepath = str(path)
            button.menu_idname = presets.UNDERWATER_PT_look_presets.__name__


class WaterPanel(_SubPanel, bpy.types.Panel):
    """The gallery, files, and what makes a water one's own."""

    bl_idname = "UNDERWATER_PT_water"
    bl_label = "Water"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "water")
        presets.UNDERWATER_PT_water_presets.draw_panel_header(self.layout)

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel = _water(context), _panel(context)
        pictures = previews.of_scene(context.scene)
        file = water.water.startswith("file:")
        self.layout.prop(panel, "from_constituents")
        column = self.column()
        if panel.from_constituents:
            column.prop(water, "chlorophyll", text="Chlorophyll (mg/m³)")
            column.prop(water, "cdom", text="CDOM a(440) (1/m)")
            column.prop(water, "minerals", text="Minerals (g/m³)")
            column.prop(water, "detritus", text="Detritus a(400) (1/m)")
        else:
            self._named(panel, water, file=file)
            column = self.column()
            if not file:
                column.prop(water, "water_source", text="Source")
        column.prop(water, "scattering_factor", text="Scattering ×")
        column.prop(water, "absorption_factor", text="Absorption ×")
        column.prop(panel, "second_water")
        if water.second_water:
            column.prop(water, "second_water_share", text="Share", slider=True)
        column.prop(panel, "phase")
        if panel.phase == "OTHER":
            column.prop(water, "phase", text="Written")
        self.layout.row(align=True).prop(panel, "inelastic")
        if pictures.error:
            _say(self.layout, pictures.error, "ERROR")
        else:
            for line in (pictures.visibility, pictures.source):
                if line:
                    _say(self.layout, line)
        _plot(self.layout, "water")

    def _named(
        self, panel: bpy.types.PropertyGroup, water: bpy.types.PropertyGroup, *, file: bool
    ) -> None:
        if not file:
            self.layout.template_icon_view(
                panel, "gallery", show_labels=True, scale=_SWATCH_SCALE, scale_popup=4.0
            )
        row = self.layout.row(align=True)
        row.prop(water, "water", text="")
        row.operator("underwater.open_water", text="", icon="FILEBROWSER")
        if file:
            row = self.layout.row()
            row.prop_enum(panel, "gallery", "JERLOV_IB", text="Back to Jerlov types")


class DepthPanel(_SubPanel, bpy.types.Panel):
    """Where the camera and the floor are."""

    bl_idname = "UNDERWATER_PT_depth"
    bl_label = "Depth and Floor"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "depth")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import live

        water, column = _water(context), self.column()
        depth = live.camera_depth(context.scene)
        if depth is None:
            column.label(text="No camera", icon="ERROR")
        elif depth > 0:
            column.label(text=f"Camera {depth:.4g} m under the surface", icon="CAMERA_DATA")
        else:
            column.label(text=f"Camera {-depth:.4g} m above the surface", icon="CAMERA_DATA")
        column.label(text="The surface is z = 0; 1 unit is 1 m", icon="MOD_OCEAN")
        column.operator("underwater.submerge", icon="TRIA_DOWN_BAR")
        column.prop(water, "floor_depth", text="Floor (m)")
        if water.floor_depth:
            column.prop(water, "floor_reflectance", text="Reflectance")
        else:
            column.label(text="0: no floor is added")
            column.prop(water, "scene_floor", text="Light of the scene's own seabed")


class WavesPanel(_SubPanel, bpy.types.Panel):
    """The moving surface and its caustics."""

    bl_idname = "UNDERWATER_PT_waves"
    bl_label = "Surface and Waves"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "waves")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, column = _water(context), self.column()
        column.prop(water, "surface")
        moving = column.column()
        moving.active = water.surface == "waves"
        for name, text in (
            ("wind_speed", "Wind (m/s)"),
            ("wind_direction", "To (°)"),
            ("fetch", "Fetch (km)"),
            ("caustics", "Caustics ×"),
            ("wave_time_scale", "Speed ×"),
            ("wave_loop", "Loop (s)"),
            ("wave_seed", "Seed"),
            ("wave_tile", "Repeats (m)"),
            ("wave_resolution", "Resolution"),
        ):
            moving.prop(water, name, text=text)


class ParticlesPanel(_SubPanel, bpy.types.Panel):
    """What floats in the water and is seen by itself."""

    bl_idname = "UNDERWATER_PT_particles"
    bl_label = "Snow and Bubbles"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "particles")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, column = _water(context), self.column()
        column.label(text="Larger than 0.1 mm, per litre", icon="PARTICLES")
        for name, text in (
            ("snow_of_water", "Of water ×"),
            ("snow", "Marine snow"),
            ("plankton", "Plankton"),
            ("bubbles", "Bubbles"),
            ("silt", "Silt"),
            ("drift_speed", "Drift (m/s)"),
            ("drift_direction", "To (°)"),
            ("particle_slope", "Slope of sizes"),
            ("particle_angle", "Down to mrad"),
            ("particle_seed", "Seed"),
        ):
            column.prop(water, name, text=text)


class SunPanel(_SubPanel, bpy.types.Panel):
    """The light above the water."""

    bl_idname = "UNDERWATER_PT_sun"
    bl_label = "Sun and Sky"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "sun")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel, column = _water(context), _panel(context), self.column()
        column.prop(panel, "light")
        if panel.light == "OTHER":
            column.prop(water, "illuminant", text="Written")
        column.prop(water, "sun_zenith", text="Zenith (°)")
        column.prop(water, "sun_azimuth", text="Azimuth (°)")
        if not sun_handle.driven(context.scene):
            column.operator("underwater.add_sun_handle", icon="LIGHT_SUN")
        column.prop(water, "irradiance", text="Given")
        column.prop(water, "sky")
        column.prop(water, "sky_radiance", text="Sky (1/sr)")
        column.prop(water, "refractive_index", text="Index")


class LampsPanel(_SubPanel, bpy.types.Panel):
    """Torches, strobes and lights of vehicles, and how much sun there is beside them."""

    bl_idname = "UNDERWATER_PT_lamps"
    bl_label = "Lamps"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "lamps")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        from ..scene.seen import lamps

        column = self.column()
        column.prop(_water(context), "sunlight", text="Sunlight")
        column.operator_menu_enum("underwater.add_lamps", "rig", icon="LIGHT_SPOT")
        for item, why in lamps.left_out(context.scene).items():
            row = column.row()
            row.active = False
            row.label(text=f"{item.name}: dark here", icon=f"LIGHT_{item.data.type}")
            row.prop(getattr(item.data, stored_lamps.PROPERTY), "in_water", text="Light")
            _say(column, f"{why[0].upper()}{why[1:]}.")
        for item in lamps.objects_of(context.scene):
            light = item.data
            box = column.box().column()
            box.label(text=item.name, icon=f"LIGHT_{light.type}")
            own = getattr(light, stored_lamps.PROPERTY)
            box.prop(light, "energy", text=f"Power ({own.unit if own.spectrum else 'W'})")
            box.prop(own, "spectrum")
            if own.spectrum:
                box.prop(own, "unit")
            else:
                box.prop(light, "color")
            box.prop(own, "profile")
            box.prop(item, "visible_camera", text="Itself Seen")


class SensorPanel(_SubPanel, bpy.types.Panel):
    """The camera's spectral sensitivities and the development."""

    bl_idname = "UNDERWATER_PT_sensor"
    bl_label = "Camera Sensor"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "sensor")
        presets.UNDERWATER_PT_camera_presets.draw_panel_header(self.layout)

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel = _water(context), _panel(context)
        pictures = previews.of_scene(context.scene)
        row = self.layout.row(align=True)
        row.operator("underwater.choose_sensor", text=water.sensor or "Choose", icon="VIEWZOOM")
        row.operator("underwater.open_sensor", text="", icon="FILEBROWSER")
        column = self.column()
        column.prop(water, "white_balance")
        column.prop(panel, "meter")
        if panel.meter == "FIXED":
            column.prop(panel, "stops")
        else:
            column.prop(water, "exposure_compensation", text="Brighter (EV)")
        column.prop(water, "tone")
        column.prop(water, "contrast")
        if pictures.error:
            _say(self.layout, pictures.error, "ERROR")
        elif pictures.sensor:
            _say(self.layout, pictures.sensor)
        _plot(self.layout, "sensor")


class QualityPanel(_SubPanel, bpy.types.Panel):
    """How the water is rendered."""

    bl_idname = "UNDERWATER_PT_quality"
    bl_label = "Quality"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        sections.draw_reset(self.layout, "quality")

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel = _water(context), _panel(context)
        self.layout.prop(panel, "quality", expand=True)
        row = self.layout.row(align=True)
        row.prop(panel, "target_delta_e", text="Error ΔE")
        row.operator("underwater.auto")
        column = self.column()
        column.prop(water, "bands", text="Bands")
        column.prop(water, "wavelengths", text="Or at (nm)")
        column.prop(water, "band_placement", text="Placed")
        row = column.row(align=True)
        row.prop(water, "range_start", text="Range (nm)")
        row.prop(water, "range_end", text="")
        method = METHODS[panel.quality.lower()]
        if method.traced:
            column.prop(panel, "denoise")
            column.prop(water, "forward_peak", text="Forward peak")
            column.prop(water, "share_passes", text="Share passes")
        else:
            column.prop(water, "field", text="Light field")
        for term in TERMS:
            if term.is_switch and method.engine in term.engines:
                column.prop(water, term.setting)
        if water.shafts and is_live(context.scene):
            eevee = context.scene.eevee
            column.prop(eevee, "volumetric_tile_size", text="Froxel size")
            column.prop(eevee, "volumetric_samples", text="Froxel steps")
        column.prop(water, "samples")
        column.prop(water, "layers")
        if method.traced:
            column.prop(water, "bounces")
        for line in panel.decisions.splitlines():
            _say(self.layout, line)


class OutputPanel(_SubPanel, bpy.types.Panel):
    """Renders into a folder."""

    bl_idname = "UNDERWATER_PT_output"
    bl_label = "Output"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        panel, column = _panel(context), self.column()
        column.prop(panel, "output")
        column.prop(panel, "animation")
        row = self.layout.row(align=True)
        row.scale_y = 1.3
        row.operator("underwater.render", icon="RENDER_STILL").resume = False
        row.operator("underwater.render", text="Continue", icon="PLAY").resume = True
        self.layout.operator("underwater.farm_bundle", icon="EXPORT")


class ReadoutsPanel(_SubPanel, bpy.types.Panel):
    """What the settings mean, in words and numbers."""

    bl_idname = "UNDERWATER_PT_readouts"
    bl_label = "Read-outs"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        pictures = previews.of_scene(context.scene)
        found = pictures.readouts
        if pictures.error:
            _say(self.layout, pictures.error, "ERROR")
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
        _plot(self.layout, "light")


def _metres(value: float) -> str:
    return f"{value:.3g} m" if math.isfinite(value) else "no limit"


def _colour(colour: DominantColour) -> str:
    if math.isnan(colour.wavelength):
        return colour.name
    complementary = " (complement)" if colour.wavelength < 0 else ""
    return f"{colour.name}, {abs(colour.wavelength):.0f} nm{complementary}"


CLASSES = (
    MainPanel,
    LooksPanel,
    WaterPanel,
    DepthPanel,
    WavesPanel,
    ParticlesPanel,
    SunPanel,
    LampsPanel,
    SensorPanel,
    QualityPanel,
    ReadoutsPanel,
    OutputPanel,
)


def move_to(tab: str) -> None:
    """Show the panels under another tab of the sidebar."""
    unregister()
    register(tab)


def register(tab: str | None = None) -> None:
    """Register the panels, under the tab of the preferences."""
    for cls in CLASSES:
        cls.bl_category = tab or preferences.tab()
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
