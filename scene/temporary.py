"""Settings of Blender that hold while a block runs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import Any

import bpy

from .rendered import rendered_layer

# The writer of the image sets these; restored in the reverse of this order.
_IMAGE_SETTINGS = ("exr_codec", "color_depth", "color_mode", "file_format", "media_type")


@contextlib.contextmanager
def render_settings(
    scene: bpy.types.Scene, wanted: Iterable[tuple[Any, str, Any]]
) -> Iterator[bpy.types.ViewLayer]:
    """Apply settings, render one view layer, and restore everything afterwards.

    Parameters
    ----------
    scene : Scene
        The scene.
    wanted : iterable of (owner, name, value)
        Attributes to set.

    Yields
    ------
    ViewLayer
        The one layer that is rendered.
    """
    rendered = rendered_layer(scene)
    layers: list[tuple[Any, str, Any]] = [
        *((layer, "use", layer == rendered) for layer in scene.view_layers),
        # The water is the world, and a light in materials.
        (rendered, "use_sky", True),
        *((rendered, name, None) for name in ("material_override", "world_override")),
        (rendered, "samples", 0),
        (scene.render, "use_freestyle", False),
    ]
    with contextlib.ExitStack() as stack:
        for owner, name, value in [*wanted, *layers]:
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)
        for owner, names in (
            (scene.render, ("filepath", "use_file_extension")),
            (scene.render.image_settings, _IMAGE_SETTINGS),
        ):
            for name in names:
                stack.callback(setattr, owner, name, getattr(owner, name))
        yield rendered
