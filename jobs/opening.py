"""The scene of a batch: opened, unless Blender has opened one already."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..scene import colour_space, scripts
from ..scene.blender_prints import without_file_lines
from ..scene.session import is_live, select_scene
from ..scene.viewport import live
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectrum import is_file


@dataclass(frozen=True)
class SceneOpener:
    """Opens the scene of a batch; live water makes way for that of the batch.

    ``inside_blender`` is whether Blender may have opened a scene already.
    """

    report_note: Callable[[str], None]
    scene_name: str | None
    trust_scripts: bool
    inside_blender: bool

    @property
    def is_open(self) -> bool:
        """Whether Blender has opened a file."""
        return self.inside_blender and bool(bpy.data.filepath)

    def take(self, blend: Path | None = None) -> None:
        """Take the scene that Blender has opened; raise InputError where another is named."""
        if blend is not None:
            raise InputError(
                f"{blend}: Blender has opened a scene; name one, before -P or --command"
            )
        if self.trust_scripts and bpy.app.autoexec_fail:
            raise InputError(
                f"{scripts.TRUST}: Blender has opened the scene without its Python; start it with "
                "blender -y, or name the scene as an option"
            )
        self._prepare()

    def read(self, blend: Path | None) -> None:
        """Open a file; raise InputError if there is none."""
        if blend is None:
            raise InputError("name a scene before the options: scene.blend OPTIONS")
        if not is_file(blend):
            raise InputError(f"cannot open {blend}: there is no such file; check the path")
        try:
            with without_file_lines():
                bpy.ops.wm.open_mainfile(
                    filepath=str(blend.resolve()), use_scripts=_runs_scripts(self.trust_scripts)
                )
        except RuntimeError as error:
            raise InputError(f"cannot open {blend}: {str(error).strip()}") from error
        self._prepare()

    def _prepare(self) -> None:
        if self.scene_name is not None:
            select_scene(self.scene_name)
        if self.trust_scripts:
            self.report_note(
                f"{scripts.TRUST}: Python of {bpy.data.filepath} runs, drivers and scripts"
            )
        # What is not saved may be converted; a window shows the user's file.
        if bpy.app.background:
            for note in (colour_space.bring_to_rec709(), colour_space.bring_images()):
                if note:
                    self.report_note(note)
        for scene in bpy.data.scenes:
            if is_live(scene):
                live.remove(scene)


def _runs_scripts(trusted: bool) -> bool:
    """Whether Blender runs Python of a file that it opens: as -y, -Y or preferences say."""
    default = bpy.app.autoexec_override
    if default is None:
        default = bpy.context.preferences.filepaths.use_scripts_auto_execute
    return trusted or default
