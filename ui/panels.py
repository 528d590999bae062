"""The panels: in the sidebar of the 3D viewport, and in the Properties editor."""

from __future__ import annotations

from typing import Any, override

import bpy

from . import presets, previews
from .main_panel import MainPanel
from .object_panels import LampsPanel, MaterialPanel, ParticlesPanel
from .panel_parts import LOOK_SCALE, TAB, SubPanel, panel_settings
from .reporting import water_settings
from .section_panels import (
    DepthPanel,
    HousingPanel,
    QualityPanel,
    ReadoutsPanel,
    SensorPanel,
    SunPanel,
    WaterPanel,
    WavesPanel,
    draw_depth,
    draw_water,
)


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
        draw_water(self.layout, context)
        column = self.column()
        row = column.row()
        row.active = panel.visibility > 0.0  # else it is not known, as from above the water
        row.prop(panel, "visibility")
        draw_depth(column, context)
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
    for cls in (*CLASSES, *PROPERTIES, MaterialPanel):
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Unregister the panels."""
    for cls in reversed((*CLASSES, *PROPERTIES, MaterialPanel)):
        bpy.utils.unregister_class(cls)
