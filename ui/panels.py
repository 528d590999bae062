"""The panels: in the sidebar of the 3D viewport, and in the Properties editor."""

from __future__ import annotations

import contextlib
from typing import Any, override

import bpy

from ..scene import stored_settings
from ..scene.session import is_live
from ..scene.unsupported import unsupported, unsupported_of_camera
from ..uw_spectral.errors import InputError
from . import migration, object_panels, presets, previews, section_panels
from .panel_parts import LOOK_SCALE, TAB, Panel, SubPanel, panel_settings, say, shows_water
from .reporting import sentence, water_settings


class MainPanel(Panel, bpy.types.Panel):
    """Adds and removes the water."""

    bl_idname = "UNDERWATER_PT_main"
    bl_label = "Underwater"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        presets.KINDS["look"].panel.draw_panel_header(self.layout)

    @override
    def draw(self, context: bpy.types.Context) -> None:
        from ..scene.engines import transparent_film
        from ..scene.materials import own_water
        from ..scene.readers.cameras import camera_of
        from ..scene.viewport import preview_depths, problems

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
            say(layout, "This scene is linked: make it local to change its water.", "LINKED")
        if migration.is_newer(scene):
            say(layout, "A newer version of the extension has saved this file.", "ERROR")
        notes = unsupported(scene, water_settings(context).sky_picture)
        camera = camera_of(scene)
        if camera is not None:
            notes += unsupported_of_camera(scene, camera, traced=not is_live(scene))
            if not is_live(scene):  # there the film is Blender's own
                with contextlib.suppress(InputError):  # which a render tells
                    stored = stored_settings.stored_settings(scene)
                    notes += tuple(filter(None, [transparent_film.note(scene, camera, stored)]))
        for note in (*notes, *problems.standing_notes(scene)):
            say(layout, sentence(note), "ERROR")
        if any(own_water.ADVICE in note for note in notes):
            layout.prop(water_settings(context), "hide_own_water")
        problem = problems.problem(scene)
        if problem:
            say(layout, problem, "ERROR")
        depth = preview_depths.camera_depth(scene)
        # Add Water lowers a dry scene itself.
        if is_live(scene) and depth is not None and depth <= 0:
            say(layout, "The camera looks at the water from above.", "INFO")
            layout.operator("underwater.submerge", icon="TRIA_DOWN_BAR")
        if is_live(scene) and not shows_water(context):
            layout.operator("underwater.show", icon="SHADING_RENDERED")


class LooksPanel(SubPanel, bpy.types.Panel):
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
                cell.template_icon(icon_value=picture, scale=LOOK_SCALE)
            button = cell.operator("underwater.apply_preset", text=name)
            button.filepath = str(path)
            button.menu_idname = presets.KINDS["look"].panel.__name__


class EssentialsPanel(SubPanel, bpy.types.Panel):
    """Enough for a picture: water, depth, sun, and no symbol."""

    bl_idname = "UNDERWATER_PT_essentials"
    bl_label = "Essentials"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        water, panel = water_settings(context), panel_settings(context)
        section_panels.draw_water(self.layout, context)
        column = self.column()
        row = column.row()
        row.active = panel.visibility > 0.0  # else it is not known, as from above the water
        row.prop(panel, "visibility")
        section_panels.draw_depth(column, context)
        column.prop(water, "floor_depth")
        column.prop(water, "surface")
        column.prop(panel, "elevation")
        column.prop(panel, "bearing")
        column.prop(water, "sunlight")
        column.prop(water, "white_balance")
        if panel.meter != "FIXED":
            column.prop(water, "exposure_compensation")


class RenderPanel(SubPanel, bpy.types.Panel):
    """Renders into a folder."""

    bl_idname = "UNDERWATER_PT_render"
    bl_label = "Render"

    @override
    def draw(self, context: bpy.types.Context) -> None:
        panel = panel_settings(context)
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


class AdvancedPanel(SubPanel, bpy.types.Panel):
    """Every setting."""

    bl_idname = "UNDERWATER_PT_advanced"
    bl_label = "Advanced"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it

    @override
    def draw(self, context: bpy.types.Context) -> None:
        pass


CLASSES = (
    MainPanel,
    LooksPanel,
    EssentialsPanel,
    RenderPanel,
    AdvancedPanel,
    section_panels.WaterPanel,
    section_panels.DepthPanel,
    section_panels.WavesPanel,
    object_panels.ParticlesPanel,
    section_panels.SunPanel,
    object_panels.LampsPanel,
    section_panels.HousingPanel,
    section_panels.SensorPanel,
    section_panels.QualityPanel,
    section_panels.ReadoutsPanel,
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
    if issubclass(cls, SubPanel):
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


def register(tab: str = TAB) -> None:
    """Register the panels."""
    for cls in CLASSES:
        cls.bl_category = tab
    for cls in (*CLASSES, *PROPERTIES, object_panels.MaterialPanel):
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed((*CLASSES, *PROPERTIES, object_panels.MaterialPanel)):
        bpy.utils.unregister_class(cls)
