"""Pictures and read-outs of the panel: computed from the optics, shortly after a change.

Drawing a panel must be quick, so it shows what is there and asks for what is
missing; a timer computes it and draws the sidebar again.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

from ..scene import stored_settings
from ..settings.known_words import JERLOV_TEXTS
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.water.optical_properties import JERLOV_TYPES
from .panel_job import method

if TYPE_CHECKING:
    from ..uw_spectral.imaging.summary import Readouts

_DELAY = 0.15
_THUMBNAILS = Path(__file__).resolve().parent / "thumbnails"


@dataclass
class Pictures:
    """What the panel shows of one scene; ``key`` is what it belongs to: settings and depth.

    ``readouts`` are None until computed, or where they cannot be. ``inelastic`` is the fraction of
    inelastic light in the luminance of the open water, None without any; ``source`` where the
    water's data come from; ``error`` why nothing is shown; ``visibility`` what each publication of
    a Jerlov type says; ``sensor`` what is to be known of the sensor.
    """

    key: tuple[SceneSettings, float] | None = None
    readouts: Readouts | None = None
    inelastic: float | None = None
    source: str = ""
    error: str = ""
    visibility: str = ""
    sensor: str = ""


@dataclass
class _State:
    """Everything of this module that lives from register to unregister."""

    images: bpy.utils.previews.ImagePreviewCollection
    scenes: dict[int, Pictures] = field(default_factory=dict)
    wanted: set[int] = field(default_factory=set)
    items: list[tuple[str, str, str, int, int]] = field(default_factory=list)


_states: list[_State] = []


def swatch_items(
    _: bpy.types.PropertyGroup, __: bpy.types.Context | None
) -> list[tuple[str, str, str, int, int]]:
    """Items of the gallery: the ten types with their swatches, as far as they are computed."""
    state = _states[-1]
    # Blender keeps no copy of the strings: the list must live on.
    state.items[:] = [
        (f"JERLOV_{name}", f"Jerlov {name}", JERLOV_TEXTS[name], icon_id(f"swatch {name}"), index)
        for index, name in enumerate(JERLOV_TYPES)
    ]
    return state.items


def icon_id(name: str) -> int:
    """Identifier of a picture for ``icon_value``; 0 while there is none."""
    images = _states[-1].images
    return images[name].icon_id if name in images else 0


def thumbnail(kind: str, stem: str) -> int:
    """Identifier of the shipped picture of a factory preset; 0 if there is none."""
    images, name = _states[-1].images, f"{kind} {stem}"
    if name not in images:
        path = _THUMBNAILS / kind / f"{stem}.png"
        if not path.is_file():
            return 0
        images.load(name, str(path), "IMAGE")
    return images[name].icon_id


def of_scene(scene: bpy.types.Scene) -> Pictures:
    """Return what is known of a scene; ask for what is not.

    Cheap enough to be called while a panel is drawn.
    """
    state = _states[-1]
    pictures = state.scenes.setdefault(scene.session_uid, Pictures())
    if _key(scene)[0] != pictures.key:
        state.wanted.add(scene.session_uid)
        if not bpy.app.timers.is_registered(_compute_wanted):
            bpy.app.timers.register(_compute_wanted, first_interval=_DELAY)
    return pictures


def compute(scene: bpy.types.Scene) -> Pictures:
    """Compute pictures and read-outs of a scene now."""
    from . import preview_optics

    state = _states[-1]
    key, error = _key(scene)
    pictures = Pictures(key, error=error)
    state.scenes[scene.session_uid] = pictures
    if key is None:
        return pictures
    try:
        preview_optics.fill(pictures, *key, functools.partial(_show, state))
    except InputError as unusable:
        pictures.error = str(unusable)
    return pictures


def concentration_for(scene: bpy.types.Scene, visibility: float) -> float:
    """Return the concentration at which one sees as far in a scene's water, in m.

    Raises InputError if the settings cannot be used, or no light is left at the camera.
    """
    from . import preview_optics

    key, error = _key(scene)
    if key is None:
        raise InputError(error)
    return preview_optics.concentration_for(*key, visibility)


def _show(state: _State, name: str, picture: NDArray[np.float32]) -> None:
    """Put an RGBA picture, sRGB, top row first, behind a name."""
    preview = state.images[name] if name in state.images else state.images.new(name)
    size = max(picture.shape[:2])
    square = np.zeros((size, size, 4), dtype=np.float32)
    top = (size - picture.shape[0]) // 2
    left = (size - picture.shape[1]) // 2
    square[top : top + picture.shape[0], left : left + picture.shape[1]] = picture
    if tuple(preview.image_size) != (size, size):
        preview.image_size = (size, size)
    preview.image_pixels_float.foreach_set(np.ascontiguousarray(square[::-1]).ravel())
    preview.icon_size = (32, 32)
    step = np.arange(32) * size // 32
    small = np.ascontiguousarray(square[::-1][step][:, step])
    preview.icon_pixels_float.foreach_set(small.ravel())


def _key(scene: bpy.types.Scene) -> tuple[tuple[SceneSettings, float] | None, str]:
    """Settings and depth of what is shown; or None, and what is wrong with the settings."""
    from ..scene.engines import world_picture
    from ..scene.viewport import preview_depths

    try:
        chosen = world_picture.shown(scene, stored_settings.stored_settings(scene))
        chosen = chosen.in_mode(method(scene).mode)
        return (chosen, preview_depths.preview_depth(scene, chosen)), ""
    except InputError as error:
        return None, str(error)


def _compute_wanted() -> None:
    state = _states[-1]
    for scene in bpy.data.scenes:
        if scene.session_uid in state.wanted:
            compute(scene)
    state.wanted.clear()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def register() -> None:
    """Make room for the pictures."""
    _states.append(_State(bpy.utils.previews.new()))


def unregister() -> None:
    """Drop the pictures."""
    if bpy.app.timers.is_registered(_compute_wanted):
        bpy.app.timers.unregister(_compute_wanted)
    bpy.utils.previews.remove(_states.pop().images)
