"""Writes a render as a float EXR: whole under its name, or not at all."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...uw_spectral.errors import InputError
from ...uw_spectral.spectra.spectral_image import replacing
from ..blender_prints import without_file_lines
from ..interruption import interrupted_afterwards


def write_float_exr(
    scene: bpy.types.Scene, destination: Path, *, passes: bool = False, alpha: bool = False
) -> None:
    """Render a scene, whose image format stays changed, into a 32-bit EXR.

    It holds every pass of the view layer, or the picture's RGB, with alpha if wanted. InputError if
    nothing was written (folder gone, disk full); KeyboardInterrupt if it was asked for meanwhile,
    or the render was cancelled: in Blender, Ctrl+C or Esc.
    """
    render = scene.render
    image = render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE" if passes else "IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER" if passes else "OPEN_EXR"
    if not passes:
        image.color_mode = "RGBA" if alpha else "RGB"
    image.color_depth = "32"
    image.exr_codec = "ZIP"
    render.use_file_extension = False
    with replacing(destination) as temporary:
        # Blender fills in what stands in braces.
        render.filepath = str(temporary).replace("{", "{{").replace("}", "}}")
        cancelled: list[object] = []

        def stop(*_: object) -> None:
            cancelled.append(True)

        bpy.app.handlers.render_cancel.append(stop)
        try:
            with interrupted_afterwards(), without_file_lines():
                bpy.ops.render.render(write_still=True, scene=scene.name)
        except RuntimeError as error:
            raise InputError(f"rendering {destination} failed: {str(error).strip()}") from error
        finally:
            bpy.app.handlers.render_cancel.remove(stop)
        if cancelled:
            raise KeyboardInterrupt
        if not temporary.exists():
            raise InputError(
                f"{destination} was not written; is the folder writable and the disk free?"
            )
