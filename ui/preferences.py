"""Preferences of the extension: what new scenes and files start with, assets, the panel's tab."""

from __future__ import annotations

from pathlib import Path
from typing import override

import bpy

from ..quality.methods import METHODS
from ..uw_spectral.errors import InputError
from . import panels
from .panel_parts import TAB
from .reporting import ReportingOperator

ADDON = (__package__ or "").rpartition(".")[0]
FOLDER = "//underwater"
LIBRARY = "Underwater Spectral"
ASSETS = Path(__file__).resolve().parent.parent / "assets"
ASSET_FILE = "underwater_spectral.blend"
START_FILE = "Underwater"


def library() -> bpy.types.UserAssetLibrary | None:
    """Return the library in Blender's preferences, if it was added."""
    found = bpy.context.preferences.filepaths.asset_libraries
    return next((item for item in found if item.name == LIBRARY), None)


class AddAssets(ReportingOperator):
    """Show the waters, looks, node groups, lamps and particles of the extension in the asset
    browser.
    """

    bl_idname = "underwater.add_assets"
    bl_label = "Add Asset Library"
    bl_options = set()  # noqa: RUF012 - as Blender wants it

    @override
    def run(self, context: bpy.types.Context) -> None:
        if not (ASSETS / ASSET_FILE).is_file():
            raise InputError(
                f"{ASSETS / ASSET_FILE} is missing: install the extension from its zip, or in a "
                "checkout run python3 dev.py run tools/build_assets.py"
            )
        found = library()
        if found is None:
            libraries = context.preferences.filepaths.asset_libraries
            found = libraries.new(name=LIBRARY, directory=str(ASSETS))
        found.path, found.import_method = str(ASSETS), "APPEND"
        self.report({"INFO"}, f"the asset browser has the library {LIBRARY}")


class SaveStartFile(ReportingOperator):
    """Let File, New, Underwater begin with this file: its water, looks, lamps, cameras."""

    bl_idname = "underwater.save_start_file"
    bl_label = "Use for New Files"
    bl_options = set()  # noqa: RUF012 - as Blender wants it

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..uw_spectral.spectra.spectral_image import replacing

        relative = [path for path in bpy.utils.blend_paths() if path.startswith("//")]
        if relative:
            raise InputError(
                f"{len(relative)} files are looked for beside this one, such as {relative[0]}, "
                "where new ones would not find them: File, External Data, Pack Resources, or Make "
                "Paths Absolute"
            )
        templates = bpy.utils.user_resource("SCRIPTS", path="startup/bl_app_templates_user")
        whole = Path(templates, START_FILE, "startup.blend")
        try:
            whole.parent.mkdir(parents=True, exist_ok=True)
            with replacing(whole) as partial:
                bpy.ops.wm.save_as_mainfile(filepath=str(partial), copy=True, compress=True)
        except (OSError, RuntimeError) as error:
            raise InputError(f"cannot write {whole}: {error}") from error
        self.report({"INFO"}, f"File, New, {START_FILE} begins with this file")


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
