"""The panels: in the sidebar of the 3D viewport, and in the Properties editor."""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING, Any, ClassVar, override

import bpy

from ..quality.methods import METHODS
from ..scene import stored_clouds, stored_lamps, stored_materials
from ..scene import stored_settings as optics
from ..scene.raised_limits import raised_limits
from ..scene.session import is_live
from ..scene.unsupported import unsupported, unsupported_of_camera
from ..settings.scene_settings import SETTINGS
from ..settings.setting import SECTIONS
from ..uw_spectral.clouds.matter import UNITS
from ..uw_spectral.errors import InputError
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.spectra.fluorophore import parse_fluorophore
from ..uw_spectral.transfer.water_column import WAVES
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
        from ..scene.engines import transparent_film
        from ..scene.materials import own_water
        from ..scene.readers.cameras import camera_of
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
        notes = unsupported(scene)
        camera = camera_of(scene)
        if camera is not None:
            notes += unsupported_of_camera(scene, camera, traced=not is_live(scene))
            if not is_live(scene):  # there the film is Blender's own
                with contextlib.suppress(InputError):  # which a render tells
                    stored = optics.stored_settings(scene)
                    notes += tuple(filter(None, [transparent_film.note(scene, camera, stored)]))
        for note in (*notes, *live.standing_notes(scene)):
            _say(layout, f"{note[:1].upper()}{note[1:]}.", "ERROR")
        if any(own_water.ADVICE in note for note in notes):
            layout.prop(_water(context), "hide_own_water")
        problem = live.problem(scene)
        if problem:
            _say(layout, problem, "ERROR")
        depth = live.camera_depth(scene)
        # Add Water lowers a dry scene itself.
        if is_live(scene) and depth is not None and depth <= 0:
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


class EssentialsPanel(_SubPanel, bpy.types.Panel):
    """Enough for a picture: water, depth, sun, and no symbol."""

    bl_idname = "UNDERWATER_PT_essentials"
    bl_label = "Essentials"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel = _water(context), _panel(context)
        _draw_water(self.layout, context)
        column = self.column()
        row = column.row()
        row.active = panel.visibility > 0.0  # else it is not known, as from above the water
        row.prop(panel, "visibility")
        _draw_depth(column, context)
        column.prop(water, "floor_depth")
        column.prop(water, "surface")
        column.prop(panel, "elevation")
        column.prop(panel, "bearing")
        column.prop(water, "sunlight")
        column.prop(water, "white_balance")
        if panel.meter != "FIXED":
            column.prop(water, "exposure_compensation")


class RenderPanel(_SubPanel, bpy.types.Panel):
    """Renders into a folder."""

    bl_idname = "UNDERWATER_PT_render"
    bl_label = "Render"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        panel = _panel(context)
        self.layout.prop(panel, "quality", expand=True)
        column = self.column()
        column.prop(panel, "output")
        column.prop(panel, "animation")
        row = self.layout.row(align=True)
        row.scale_y = 1.3
        row.operator("underwater.render", icon="RENDER_STILL").resume = False
        row.operator("underwater.render", text="Continue", icon="PLAY").resume = True
        self.layout.operator("underwater.render_reference", icon="SHADING_RENDERED")
        self.layout.operator("underwater.farm_bundle", icon="EXPORT")


class AdvancedPanel(_SubPanel, bpy.types.Panel):
    """Every setting."""

    bl_idname = "UNDERWATER_PT_advanced"
    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw(self, context: bpy.types.Context) -> None:
        pass


class _SectionPanel(_SubPanel):
    """The settings of a section; what is drawn otherwise stands before them or behind."""

    bl_parent_id = "UNDERWATER_PT_advanced"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it
    section: str
    apart: tuple[str, ...] = ()
    popover: type[presets.PresetPanel] | None = None

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

    bl_idname = "UNDERWATER_PT_water"
    bl_label = SECTIONS["water"].title
    section = "water"
    apart = ("water", "inelastic")
    popover = presets.UNDERWATER_PT_water_presets

    @override
    def before(self, context: bpy.types.Context) -> None:
        self.layout.prop(_panel(context), "from_constituents")
        _draw_water(self.layout, context)

    @override
    def after(self, context: bpy.types.Context) -> None:
        self.layout.row(align=True).prop(_panel(context), "inelastic")
        pictures = previews.of_scene(context.scene)
        if pictures.error:
            _say(self.layout, pictures.error, "ERROR")
        else:
            for line in (pictures.visibility, pictures.source):
                if line:
                    _say(self.layout, line)
        _plot(self.layout, "water")


class DepthPanel(_SectionPanel, bpy.types.Panel):
    """Where the camera and the floor are."""

    bl_idname = "UNDERWATER_PT_depth"
    bl_label = SECTIONS["depth"].title
    section = "depth"

    @override
    def before(self, context: bpy.types.Context) -> None:
        column = self.column()
        _draw_depth(column, context)
        column.label(text="The surface is z = 0; 1 unit is 1 m", icon="MOD_OCEAN")


class WavesPanel(_SectionPanel, bpy.types.Panel):
    """The moving surface and its caustics."""

    bl_idname = "UNDERWATER_PT_waves"
    bl_label = SECTIONS["waves"].title
    section = "waves"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = _water(context)
        if water.surface == WAVES and water.raised_waves:
            for said in raised_limits(water.wave_tile, eevee=True, live=True):
                _say(self.layout, f"{said[0].upper()}{said[1:]}.")


class ParticlesPanel(_SectionPanel, bpy.types.Panel):
    """What floats in the water and is seen by itself."""

    bl_idname = "UNDERWATER_PT_particles"
    bl_label = SECTIONS["particles"].title
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
        water = _water(context)
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
                _say(box, f"{said[0].upper()}{said[1:]}.")


class SunPanel(_SectionPanel, bpy.types.Panel):
    """The light above the water."""

    bl_idname = "UNDERWATER_PT_sun"
    bl_label = SECTIONS["sun"].title
    section = "sun"

    @override
    def before(self, context: bpy.types.Context) -> None:
        if not sun_handle.driven(context.scene):
            self.layout.operator("underwater.add_sun_handle", icon="LIGHT_SUN")


class LampsPanel(_SectionPanel, bpy.types.Panel):
    """Torches, strobes and lights of vehicles, and how much sun there is beside them."""

    bl_idname = "UNDERWATER_PT_lamps"
    bl_label = SECTIONS["lamps"].title
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
            _say(column, f"{why[0].upper()}{why[1:]}.")
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
                _say(box, f"{said[0].upper()}{said[1:]}.")


class HousingPanel(_SectionPanel, bpy.types.Panel):
    """The port and the lens that the camera looks through."""

    bl_idname = "UNDERWATER_PT_housing"
    bl_label = SECTIONS["housing"].title
    section = "housing"

    @override
    def after(self, context: bpy.types.Context) -> None:
        water = _water(context)
        if water.housing != NONE or water.lens:
            _say(self.layout, "The viewport shows what there is without; renders have it.")


class SensorPanel(_SectionPanel, bpy.types.Panel):
    """The camera's spectral sensitivities and the development."""

    bl_idname = "UNDERWATER_PT_sensor"
    bl_label = SECTIONS["sensor"].title
    section = "sensor"
    apart = ("sensor", "exposure")
    popover = presets.UNDERWATER_PT_camera_presets

    @override
    def before(self, context: bpy.types.Context) -> None:
        panel, row = _panel(context), self.layout.row(align=True)
        row.prop(_water(context), "sensor", text="")
        row.operator("underwater.open_sensor", text="", icon="FILEBROWSER")
        column = self.column()
        column.prop(panel, "meter")
        if panel.meter == "FIXED":
            column.prop(panel, "stops")

    @override
    def after(self, context: bpy.types.Context) -> None:
        pictures = previews.of_scene(context.scene)
        if pictures.error:
            _say(self.layout, pictures.error, "ERROR")
        elif pictures.sensor:
            _say(self.layout, pictures.sensor)
        _plot(self.layout, "sensor")


class QualityPanel(_SectionPanel, bpy.types.Panel):
    """How the water is rendered."""

    bl_idname = "UNDERWATER_PT_quality"
    bl_label = SECTIONS["quality"].title
    section = "quality"
    apart = ("layers",)

    @override
    def before(self, context: bpy.types.Context) -> None:
        panel = _panel(context)
        row = self.layout.row(align=True)
        row.prop(panel, "target_delta_e", text="Error ΔE")
        row.operator("underwater.auto")
        if METHODS[panel.quality.lower()].traced:
            self.column().prop(panel, "denoise")

    @override
    def after(self, context: bpy.types.Context) -> None:
        panel = _panel(context)
        if _water(context).shafts and is_live(context.scene):
            eevee, column = context.scene.eevee, self.column()
            column.prop(eevee, "volumetric_tile_size", text="Froxel size")
            column.prop(eevee, "volumetric_samples", text="Froxel steps")
        self.layout.label(text=SETTINGS["layers"].label)
        grid = self.layout.grid_flow(row_major=True, columns=2, even_columns=True, align=True)
        grid.use_property_split = False
        for item in panel.bl_rna.properties["layers"].enum_items:
            grid.prop_enum(panel, "layers", item.identifier)
        for line in panel.decisions.splitlines():
            _say(self.layout, line)


def _draw_water(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw which water it is: a gallery, a name, a file."""
    water, panel = _water(context), _panel(context)
    if panel.from_constituents:
        return
    file = water.water.startswith("file:")
    if not file:
        layout.template_icon_view(
            panel, "gallery", show_labels=True, scale=_SWATCH_SCALE, scale_popup=4.0
        )
    row = layout.row(align=True)
    row.prop(water, "water", text="")
    row.operator("underwater.open_water", text="", icon="FILEBROWSER")
    if file:
        layout.row().prop_enum(panel, "gallery", "JERLOV_IB", text="Back to Jerlov types")


def _draw_depth(column: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """Draw where the camera is."""
    from ..scene.viewport import live

    depth = live.camera_depth(context.scene)
    if depth is None:
        column.label(text="No camera", icon="ERROR")
    elif depth > 0:
        column.label(text=f"Camera {depth:.4g} m under the surface", icon="CAMERA_DATA")
    else:
        column.label(text=f"Camera {-depth:.4g} m above the surface", icon="CAMERA_DATA")
    column.operator("underwater.submerge", icon="TRIA_DOWN_BAR")


class ReadoutsPanel(_SubPanel, bpy.types.Panel):
    """What the settings mean, in words and numbers."""

    bl_parent_id = "UNDERWATER_PT_advanced"
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


class MaterialPanel(bpy.types.Panel):
    """What a material stores: in the Properties editor, tab Material."""

    bl_idname = "UNDERWATER_PT_material"
    bl_label = "Underwater"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    @override
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.material is not None

    @override
    def draw(self, context: bpy.types.Context) -> None:
        own = getattr(context.material, stored_materials.PROPERTY)
        self.layout.use_property_split = True
        self.layout.prop(own, "filled_with_air")
        self.layout.prop(own, "porous")
        self.layout.prop(own, "fluorophore")
        if not own.fluorophore.strip():
            return
        self.layout.prop(own, "fluorescence")
        _say(self.layout, "Real time and bands draw it; the reference of Cycles leaves it out.")
        try:
            fluorescence = stored_materials.fluorescence_of(context.material)
            assert fluorescence is not None
            parse_fluorophore(fluorescence.fluorophore)
        except InputError as error:
            _say(self.layout, str(error), "ERROR")


CLASSES = (
    MainPanel,
    LooksPanel,
    EssentialsPanel,
    RenderPanel,
    AdvancedPanel,
    WaterPanel,
    DepthPanel,
    WavesPanel,
    ParticlesPanel,
    SunPanel,
    LampsPanel,
    HousingPanel,
    SensorPanel,
    QualityPanel,
    ReadoutsPanel,
)
"""The panels of the sidebar."""


_OF_A_CLASS = ("__dict__", "__weakref__")


def _in_properties(cls: Any) -> type[bpy.types.Panel]:  # noqa: ANN401 - its facts are Blender's
    """Return a panel of the sidebar as one of the Properties editor, tab Scene."""
    options = set(getattr(cls, "bl_options", ()))
    facts: dict[str, object] = {
        "bl_idname": cls.bl_idname.replace("_PT_", "_PT_scene_"),
        "bl_space_type": "PROPERTIES",
        "bl_region_type": "WINDOW",
        "bl_context": "scene",
        "bl_category": "",
        "bl_options": options | {"DEFAULT_CLOSED"} if cls is MainPanel else options,
    }
    if issubclass(cls, _SubPanel):
        facts["bl_parent_id"] = cls.bl_parent_id.replace("_PT_", "_PT_scene_")
    # Not a subclass: Blender takes no class whose parent is registered itself.
    own = {name: value for name, value in vars(cls).items() if name not in _OF_A_CLASS}
    made: Any = type(f"{cls.__name__}OfScene", cls.__bases__, own | facts)
    return made


PROPERTIES = tuple(_in_properties(cls) for cls in CLASSES)
"""The same panels in the Properties editor."""


def move_to(tab: str) -> None:
    """Show the panels under another tab of the sidebar."""
    unregister()
    register(tab)


def register(tab: str | None = None) -> None:
    """Register the panels, under the tab of the preferences."""
    for cls in CLASSES:
        cls.bl_category = tab or preferences.tab()
    for cls in (*CLASSES, *PROPERTIES, MaterialPanel):
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed((*CLASSES, *PROPERTIES, MaterialPanel)):
        bpy.utils.unregister_class(cls)
