"""The scene's own world as a picture of the sky, drawn once for each look that it has."""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...settings.scene_settings import SceneSettings
from ...settings.water_settings import WORLD
from ...uw_spectral.errors import InputError
from ...uw_spectral.spectra.spectral_image import read_exr, temporary_name, write_rgb_exr
from ...uw_spectral.transfer.sky_picture import SkyPicture
from .. import stored_settings
from ..readers.world_state import fixed, own_world, state_of
from .exr_output import write_float_exr

_ROWS, _COLUMNS, _SAMPLES = 512, 1024, 4
_FINER = 8  # times as many pixels about the brightest
_BRIGHT = 3.0  # times the mean: less is no sun
_LETTERS = 40  # of a world's name in that of its picture
_ABOUT = 3  # of the others to each side


def drawn(
    scene: bpy.types.Scene, settings: SceneSettings, folder: Path | None = None
) -> SceneSettings:
    """Return settings whose picture of the sky is a file, if it is to be the scene's world.

    It is drawn into a folder, or for as long as Blender runs, as the world is at the current frame,
    unless it is there already. InputError if there is no world, or it cannot light water.
    """
    if settings.sky_picture != WORLD:
        return settings
    world, path = _place(scene, folder)
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        pixels = _draw(scene, world, path)
        SkyPicture.checked(pixels, f"the sky of world {world.name!r}")
        write_rgb_exr(path, pixels)
    return replace(settings, sky_picture=f"file:{path}")


def known(scene: bpy.types.Scene, settings: SceneSettings) -> SceneSettings | None:
    """Return the same if it has been drawn since Blender runs, else None."""
    if settings.sky_picture != WORLD:
        return settings
    path = _place(scene, None)[1]
    return replace(settings, sky_picture=f"file:{path}") if path.is_file() else None


def shown(scene: bpy.types.Scene, settings: SceneSettings) -> SceneSettings:
    """Return the same, or those of sun and sky where it is not: nothing may be drawn for panels."""
    return known(scene, settings) or replace(settings, sky_picture="")


def forget(scene: bpy.types.Scene) -> None:
    """Let the world be drawn again: what it shows may have been painted over."""
    if getattr(scene, stored_settings.PROPERTY).sky_picture == WORLD and own_world(scene):
        _place(scene, None)[1].unlink(missing_ok=True)


def _place(scene: bpy.types.Scene, folder: Path | None) -> tuple[bpy.types.World, Path]:
    """Return the world of a scene, and where the picture of what it looks like now is."""
    world = own_world(scene)
    if world is None:
        raise InputError(
            f"--sky-picture {WORLD}: scene {scene.name!r} has no world; give it one, or leave the "
            "picture empty"
        )
    state = repr((state_of(world, scene.frame_current), bpy.app.version_string))
    digest = hashlib.sha256(state.encode()).hexdigest()[:12]
    name = f"sky_{bpy.path.clean_name(world.name)[:_LETTERS]}_{digest}.exr"
    return world, (folder or Path(bpy.app.tempdir)).absolute() / name


def _draw(scene: bpy.types.Scene, world: bpy.types.World, path: Path) -> NDArray[np.float32]:
    """Render all directions of a world, and what is about its brightest point finely."""
    with _alone(scene, world) as studio:
        pixels = _rendered(studio, path)
        upper = pixels[: _ROWS // 2].sum(axis=2)
        if upper.max() < _BRIGHT * upper.mean():
            return pixels
        row, column = (int(i) for i in np.unravel_index(np.argmax(upper), upper.shape))
        top, bottom = max(row - _ABOUT, 0), row + _ABOUT + 1
        # Towards the zenith columns are narrow; the picture goes on at its other side.
        across = math.ceil(_ABOUT / max(math.sin((row + 0.5) * math.pi / _ROWS), 1e-3))
        across = min(across, _COLUMNS // 2)
        studio.render.resolution_percentage = 100 * _FINER
        studio.render.use_border = studio.render.use_crop_to_border = True
        for shift in (-_COLUMNS, 0, _COLUMNS):
            left = max(column - across + shift, 0)
            right = min(column + across + 1 + shift, _COLUMNS)
            if left < right:
                pixels[top:bottom, left:right] = _finely(studio, path, (top, bottom, left, right))
    return pixels


def _finely(
    studio: bpy.types.Scene, path: Path, box: tuple[int, int, int, int]
) -> NDArray[np.float32]:
    top, bottom, left, right = box
    render = studio.render
    render.border_min_x, render.border_max_x = (x / _COLUMNS for x in (left, right))
    render.border_min_y, render.border_max_y = (1.0 - y / _ROWS for y in (bottom, top))
    fine = _rendered(studio, path)
    rows, columns = bottom - top, right - left
    return fine.reshape(rows, _FINER, columns, _FINER, 3).mean(axis=(1, 3))


def _rendered(studio: bpy.types.Scene, path: Path) -> NDArray[np.float32]:
    part = temporary_name(path, "world")
    try:
        write_float_exr(studio, part)
        pixels, names = read_exr(part)
    finally:
        part.unlink(missing_ok=True)
    return pixels[..., [names.index(name) for name in "RGB"]]


@contextlib.contextmanager
def _alone(scene: bpy.types.Scene, world: bpy.types.World) -> Iterator[bpy.types.Scene]:
    """Give a scene that holds nothing but a world and a camera that sees all directions."""
    studio = bpy.data.scenes.new("UW World")
    camera = bpy.data.cameras.new("UW World")
    camera.type, camera.panorama_type = "PANO", "EQUIRECTANGULAR"
    eye, shown = bpy.data.objects.new("UW World", camera), fixed(world)
    try:
        studio.collection.objects.link(eye)
        shown.cycles_visibility.camera, shown.cycles.sampling_method = True, "NONE"
        output = shown.node_tree.get_output_node("CYCLES") if shown.node_tree else None
        if output is not None:
            for link in output.inputs["Volume"].links:
                shown.node_tree.links.remove(link)
        eye.rotation_euler = math.pi / 2.0, 0.0, -math.pi / 2.0  # towards +x
        studio.world, studio.camera = shown, eye
        studio.frame_current, studio.frame_subframe = scene.frame_current, scene.frame_subframe
        render, cycles = studio.render, studio.cycles
        render.engine, render.film_transparent = "CYCLES", False
        render.resolution_x, render.resolution_y = _COLUMNS, _ROWS
        render.resolution_percentage = 100
        cycles.device, cycles.samples = "CPU", _SAMPLES
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.pixel_filter_type = "BOX"
        yield studio
    finally:
        bpy.data.objects.remove(eye)
        bpy.data.cameras.remove(camera)
        bpy.data.scenes.remove(studio)
        bpy.data.worlds.remove(shown)
