"""Writes a render as a float EXR: whole under its name, or not at all; and reads its passes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.errors import InputError
from ...uw_spectral.spectra.spectral_image import read_passes, replacing
from ..blender_prints import without_file_lines
from ..interruption import interrupted_afterwards
from ..temporary import held

Passes = dict[str, NDArray[np.float32]]
"""Passes by name, shape (height, width, k)."""


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


@contextlib.contextmanager
def switched_on(
    layer: bpy.types.ViewLayer, switches: Iterable[str], outputs: Iterable[str] = ()
) -> Iterator[None]:
    """Have a view layer write passes, and colours that shaders output, while the block runs.

    Switches are properties such as ``use_pass_z`` or ``cycles.use_pass_volume_direct``.
    """
    parts = (switch.rpartition(".") for switch in switches)
    wanted = [
        (getattr(layer, engine) if engine else layer, name, True) for engine, _, name in parts
    ]
    with held(wanted):
        for name in outputs:
            made = layer.aovs.add()
            made.name = name
        try:
            yield
        finally:
            ours = set(outputs)
            for made in [item for item in layer.aovs if item.name in ours]:
                layer.aovs.remove(made)


def render_passes(scene: bpy.types.Scene, beside: Path) -> Passes:
    """Render a scene, whose image format stays changed, and return its passes.

    A file lies beside a path for the moment. InputError if nothing was written.
    """
    raw = beside.with_name(f"{beside.stem}.passes{beside.suffix}")
    try:
        write_float_exr(scene, raw, passes=True)
        return read_passes(raw)
    finally:
        raw.unlink(missing_ok=True)
