"""How a picture is shown: Blender's own colour management, set by the tone and the contrast.

Viewport and written picture go the same way, so they look the same.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import replacing, write_png
from ..uw_spectral.spectra.tone import AGX, CAMERA_CURVES, MEDIUM, STANDARD, camera_curve
from .blender_prints import without_file_lines

# Blender's own names, and those of the ACES configurations that come with OpenColorIO.
_PLAIN_VIEWS, _DISPLAYS = ("Standard", "Un-tone-mapped"), ("sRGB", "sRGB - Display")
_KEPT = ("view_transform", "look", "exposure", "gamma", "use_white_balance")
_NODES = 32
_CURVE, _POINTS, _HANDLES = "curve", "points", "handles"
_LEVELS = ("black_level", "white_level")
_NAME = "UW Picture"
_COMBINED = 3  # the curve of all channels


def is_plain(tone: str, contrast: str) -> bool:
    """Whether linear light is only encoded for the display."""
    return tone == STANDARD and contrast == MEDIUM


def show(view: bpy.types.ColorManagedViewSettings, tone: str, contrast: str) -> None:
    """Set how a scene is shown: one of :data:`.TONES`, and Blender's look of a contrast's name."""
    with contextlib.suppress(TypeError):
        view.look = "None"
    _take(view, "view_transform", ("AgX",) if tone == AGX else _PLAIN_VIEWS, f"--tone {tone}")
    if contrast != MEDIUM:
        _take(view, "look", (_look(tone, contrast),), f"--contrast {contrast}")
    view.exposure, view.gamma = 0.0, 1.0
    view.use_white_balance = False
    view.use_curve_mapping = tone in CAMERA_CURVES
    if tone in CAMERA_CURVES:
        _draw_curve(view.curve_mapping, tone)


def require_shown(tone: str, contrast: str) -> None:
    """Refuse a tone or contrast that the colour configuration does not have."""
    if not is_plain(tone, contrast):
        with _display(tone, contrast):
            pass


def saved_view(view: bpy.types.ColorManagedViewSettings) -> dict[str, Any]:
    """Return what :func:`show` changes, as a scene can store it."""
    names = (*_KEPT, "use_curve_mapping")
    kept: dict[str, Any] = {name: getattr(view, name) for name in names}
    if view.curve_mapping is not None:
        mapping = view.curve_mapping
        points = mapping.curves[_COMBINED].points
        kept[_CURVE] = {
            **{name: list(getattr(mapping, name)) for name in _LEVELS},
            _POINTS: [x for point in points for x in point.location],
            _HANDLES: " ".join(point.handle_type for point in points),
        }
    return kept


def give_back(view: bpy.types.ColorManagedViewSettings, kept: Mapping[str, Any]) -> None:
    """Undo :func:`show`."""
    with contextlib.suppress(TypeError):
        view.look = "None"  # a look exists only under its view transform
    for name in _KEPT:
        # Files of before know fewer, and another colour configuration has other views.
        if name in kept:
            with contextlib.suppress(TypeError):
                setattr(view, name, kept[name])
    if _CURVE in kept:
        mapping, curve = view.curve_mapping, kept[_CURVE]
        for name in _LEVELS:
            setattr(mapping, name, curve[name])
        _set_points(mapping, np.reshape(curve[_POINTS], (-1, 2)), curve[_HANDLES].split())
    view.use_curve_mapping = bool(kept["use_curve_mapping"])


def write_shown(path: Path, rgb: NDArray[np.float32], tone: str, contrast: str) -> None:
    """Write scene-linear Rec.709, shape (height, width, 3 or 4), as an 8-bit PNG as it is shown.

    A fourth channel is alpha, which the colours hold already. InputError if it cannot be written.
    """
    if is_plain(tone, contrast):
        write_png(path, rgb)
        return
    height, width, channels = rgb.shape
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[..., :channels] = np.nan_to_num(rgb)[::-1]
    with _display(tone, contrast) as scene, contextlib.ExitStack() as stack:
        image = bpy.data.images.new(_NAME, width, height, float_buffer=True)
        stack.callback(bpy.data.images.remove, image)
        settings = scene.render.image_settings
        settings.media_type, settings.file_format = "IMAGE", "PNG"
        settings.color_mode, settings.color_depth = "RGBA"[:channels], "8"
        image.pixels.foreach_set(pixels.ravel())
        with replacing(path) as temporary:
            try:
                with without_file_lines():
                    image.save_render(str(temporary), scene=scene)
            except RuntimeError as error:
                raise InputError(f"cannot write {path}: {str(error).strip()}") from error


@contextlib.contextmanager
def _display(tone: str, contrast: str) -> Iterator[bpy.types.Scene]:
    """A scene that is shown so on an sRGB display, while the block runs."""
    scene = bpy.data.scenes.new(_NAME)
    try:
        _take(scene.display_settings, "display_device", _DISPLAYS, "the PNG")
        show(scene.view_settings, tone, contrast)
        yield scene
    finally:
        bpy.data.scenes.remove(scene)


def _take(owner: bpy.types.bpy_struct, name: str, words: Sequence[str], what: str) -> None:
    """Give a property the first of some words that the colour configuration knows."""
    for word in words:
        try:
            setattr(owner, name, word)
        except TypeError:
            continue
        return
    raise InputError(
        f"{what}: the colour configuration that Blender runs with has no {' or '.join(words)}; "
        "choose another, or unset OCIO"
    )


def _look(tone: str, contrast: str) -> str:
    words = f"{contrast.replace('-', ' ').title()} Contrast"
    return f"AgX - {words}" if tone == AGX else words


def _draw_curve(mapping: bpy.types.CurveMapping, tone: str) -> None:
    """Let a curve mapping follow a camera's curve, by nodes that lie closer in the dark."""
    curve = camera_curve(tone)
    mapping.black_level = (0.0, 0.0, 0.0)
    mapping.white_level = (curve.white,) * 3
    place = np.linspace(0.0, 1.0, _NODES) ** 2
    points = np.stack([place, curve(place * curve.white)], axis=-1)
    mapping.extend = "HORIZONTAL"
    _set_points(mapping, points, ["AUTO_CLAMPED"] * len(points))


def _set_points(
    mapping: bpy.types.CurveMapping, points: NDArray[np.float64], handles: list[str]
) -> None:
    held = mapping.curves[_COMBINED].points
    while len(held) > 2:
        held.remove(held[1])
    while len(held) < len(points):
        held.new(0.5, 0.5)
    for point, location, handle in zip(held, points.tolist(), handles, strict=True):
        point.location, point.handle_type = location, handle
    mapping.update()
