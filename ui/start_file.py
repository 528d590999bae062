"""The open file as what File, New, Underwater begins with."""

from __future__ import annotations

from pathlib import Path
from typing import override

import bpy

from ..uw_spectral.errors import InputError
from .reporting import ReportingOperator

NAME = "Underwater"


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
        whole = Path(templates, NAME, "startup.blend")
        try:
            whole.parent.mkdir(parents=True, exist_ok=True)
            with replacing(whole) as partial:
                bpy.ops.wm.save_as_mainfile(filepath=str(partial), copy=True, compress=True)
        except (OSError, RuntimeError) as error:
            raise InputError(f"cannot write {whole}: {error}") from error
        self.report({"INFO"}, f"File, New, {NAME} begins with this file")


register, unregister = bpy.utils.register_classes_factory((SaveStartFile,))
