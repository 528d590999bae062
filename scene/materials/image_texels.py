"""Pixels of images as image textures show them: Blender looks them up."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import MARK

Array = NDArray[np.float64]
_NAME = "UW Look-up"
_MISSING = 1.0, 0.0, 1.0, 1.0  # what both engines draw of a file that is not there
_NOTHING = 0.0, 0.0, 0.0, 0.0
_MOVING = {"SEQUENCE", "MOVIE"}
_MOST_FRAMES = 1_048_574


def texels(node: bpy.types.ShaderNodeTexImage, places: Array) -> Array:
    """Return what an image texture shows, scene-linear with its alpha beside it, shape (n, 4).

    Frames, tiles and colour spaces are Blender's own (``Texture.evaluate``). An image lies in 0 to
    1.
    """
    image = node.image
    if image is None:
        return np.array([_NOTHING])
    image = image.original
    u, inside = _wrapped(node, np.nan_to_num(places[:, :2]))
    texture = _texture(image)
    _put(texture, "use_interpolation", node.interpolation != "Closest")
    if image.source in _MOVING:
        _put(texture.image_user, "frame_duration", _MOST_FRAMES)
        _put(texture.image_user, "frame_current", _frame(node))
    found = np.array([texture.evaluate((x, y, 0.0)) for x, y in (2.0 * u - 1.0).tolist()])
    if not found.any() and not image.has_data:
        return np.array([_MISSING])
    if image.alpha_mode == "NONE":
        found[:, 3] = 1.0
    elif not node.outputs["Alpha"].is_linked and not _is_plain(image):
        found[:, :3] *= found[:, 3:]
    outside = _MISSING if image.source == "TILED" else _NOTHING
    return np.where(inside[:, None], found, outside)


def _is_plain(image: bpy.types.Image) -> bool:
    """Whether the alpha of an image never changes its colours."""
    return image.alpha_mode == "CHANNEL_PACKED" or image.colorspace_settings.is_data


def _texture(image: bpy.types.Image) -> bpy.types.ImageTexture:
    """Return what looks an image up; it has no users, so that files do not store it.

    Each image has its own: to change what one shows, or to remove it, updates the whole scene.
    """
    name = f"{_NAME} {image.session_uid}"
    found = bpy.data.textures.get(name)
    if found is None:
        found = bpy.data.textures.new(name, "IMAGE")
        found[MARK], found.use_clamp = True, False
    _put(found, "image", image)
    return found


def _put(owner: bpy.types.bpy_struct, name: str, value: object) -> None:
    if getattr(owner, name) != value:
        setattr(owner, name, value)


def _wrapped(node: bpy.types.ShaderNodeTexImage, u: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return places within the image, and whether it shows anything there."""
    if node.image.source == "TILED":
        tiles = [tile.number for tile in node.image.tiles]
        column, row = np.floor(u).T
        there = np.isin(1001 + column + 10 * row, tiles) & (column >= 0) & (column < 10)
        return u, there
    if node.extension == "REPEAT":
        return u % 1.0, np.ones(len(u), bool)
    inside = ((u >= 0.0) & (u <= 1.0)).all(axis=1) | (node.extension != "CLIP")
    if node.extension == "MIRROR":
        u = 1.0 - np.abs(1.0 - u % 2.0)
    edge = 0.5 / np.maximum(node.image.size, 1)  # where look-ups would mix in the other side
    return np.clip(u, edge, 1.0 - edge), inside


def _frame(node: bpy.types.ShaderNodeTexImage) -> int:
    """Return the frame of a moving image (``BKE_image_user_frame_get``)."""
    user = node.image_user
    if not user.use_auto_refresh:
        return user.frame_current
    frame, count = bpy.context.scene.frame_current - user.frame_start + 1, user.frame_duration
    if user.use_cyclic and count:
        frame = frame % count or count
    return min(max(frame, 0), count) + user.frame_offset
