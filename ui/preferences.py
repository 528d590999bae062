"""Preferences of the extension: what a new scene starts with, and the name of the tab."""

from __future__ import annotations

import bpy

from ..quality.methods import METHODS
from . import panels
from .panel_parts import TAB

ADDON = (__package__ or "").rpartition(".")[0]
FOLDER = "//underwater"


def _rename_tab(_: bpy.types.AddonPreferences, __: bpy.types.Context) -> None:
    panels.move_to(tab())


class UnderwaterPreferences(bpy.types.AddonPreferences):
    """What Blender stores for the extension."""

    bl_idname = ADDON

    folder: bpy.props.StringProperty(
        name="Output folder",
        description="Folder that new scenes render into; // is the file's folder",
        default=FOLDER,
        subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    quality: bpy.props.EnumProperty(
        name="Quality",
        description="How new scenes are rendered",
        items=[(name.upper(), m.label, m.text) for name, m in METHODS.items()],
    )
    tab: bpy.props.StringProperty(
        name="Tab",
        description="Name of the tab of the sidebar that holds the panel",
        default=TAB,
        update=_rename_tab,
    )

    def draw(self, _: bpy.types.Context) -> None:
        """Draw them."""
        column = self.layout.column()
        column.use_property_split = True
        for name in ("folder", "quality", "tab"):
            column.prop(self, name)
        column.operator("underwater.add_assets", icon="ASSET_MANAGER")
        column.operator("underwater.save_start_file", icon="FILE_NEW")


def stored() -> UnderwaterPreferences | None:
    """Return the preferences; None where the extension is not enabled through Blender."""
    addon = bpy.context.preferences.addons.get(ADDON)
    return None if addon is None else addon.preferences


def tab() -> str:
    """Return the name of the tab."""
    chosen = stored()
    return (chosen.tab.strip() if chosen is not None else "") or TAB


def register() -> None:
    """Register the preferences, and give the panels the tab that they name."""
    bpy.utils.register_class(UnderwaterPreferences)
    if tab() != TAB:
        panels.move_to(tab())


def unregister() -> None:
    """Unregister the preferences; Blender keeps their values."""
    bpy.utils.unregister_class(UnderwaterPreferences)
