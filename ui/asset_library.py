"""One click that adds the extension's assets to Blender's asset libraries."""

from __future__ import annotations

from pathlib import Path
from typing import override

import bpy

from ..uw_spectral.errors import InputError
from .reporting import ReportingOperator

NAME = "Underwater Spectral"
FOLDER = Path(__file__).resolve().parent.parent / "assets"
FILE = "underwater_spectral.blend"


def library() -> bpy.types.UserAssetLibrary | None:
    """Return the library in Blender's preferences, if it was added."""
    found = bpy.context.preferences.filepaths.asset_libraries
    return next((item for item in found if item.name == NAME), None)


class AddAssets(ReportingOperator):
    """Show the waters, looks, node groups, lamps and particles of the extension in the asset
    browser.
    """

    bl_idname = "underwater.add_assets"
    bl_label = "Add Asset Library"
    bl_options = set()  # noqa: RUF012 - as Blender wants it

    @override
    def run(self, context: bpy.types.Context) -> None:
        if not (FOLDER / FILE).is_file():
            raise InputError(
                f"{FOLDER / FILE} is missing: install the extension from its zip, or in a "
                "checkout run python3 dev.py run tools/build_assets.py"
            )
        found = library()
        if found is None:
            libraries = context.preferences.filepaths.asset_libraries
            found = libraries.new(name=NAME, directory=str(FOLDER))
        found.path, found.import_method = str(FOLDER), "APPEND"
        self.report({"INFO"}, f"the asset browser has the library {NAME}")


register, unregister = bpy.utils.register_classes_factory((AddAssets,))
