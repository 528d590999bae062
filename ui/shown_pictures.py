"""Shows finished pictures in the Image Editor, as they are in their files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import bpy

from ..scene.session import PICTURE


def load(path: Path, name: str) -> bpy.types.Image:
    """Return a developed picture as an image; one that is there already is read again.

    Tone and contrast are in the PNG, so no view transform of the scene may be added. ``name`` says
    what it is of: camera and frame.
    """
    image = next((i for i in bpy.data.images if i.get(PICTURE) == name), None)
    if image is None:
        image = bpy.data.images.load(str(path))
        image[PICTURE] = image.name = name
    else:
        image.filepath = str(path)
        image.reload()
    image.use_view_as_render = False
    return image


def show(window_manager: bpy.types.WindowManager, image: bpy.types.Image) -> None:
    """Show an image in an open Image Editor, or in one that opens as for Blender's own Render."""
    space = editor(window_manager.windows)
    if space is None and window_manager.windows and not bpy.app.background:
        bpy.ops.render.view_show("INVOKE_DEFAULT")
        space = editor(window_manager.windows)
    if space is not None:
        space.image = image


def editor(windows: Iterable[bpy.types.Window]) -> bpy.types.SpaceImageEditor | None:
    """Return an Image Editor in which pictures are looked at; one that shows such rather."""
    found = [
        space
        for window in windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR" and area.ui_type == "IMAGE_EDITOR"
        for space in area.spaces[:1]
        if space.mode == "VIEW" and not space.use_image_pin
    ]
    showing = [space for space in found if _is_picture(space.image)]
    return next(iter(showing or found), None)


def _is_picture(image: bpy.types.Image | None) -> bool:
    return image is not None and (PICTURE in image or image.type == "RENDER_RESULT")
