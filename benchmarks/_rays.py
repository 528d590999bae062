"""What a camera's rays meet in a Blender scene, for formulas that are drawn in numpy."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..scene.engines.cycles_settings import reference_settings
from ..uw_spectral.spectra.spectral_image import read_exr
from ..uw_spectral.transfer.water_column import WaterColumn
from .grey_scene import Hits

_OFFSET = 1e-3  # m off a surface, where shadow rays start


def blender_hits(
    scene: bpy.types.Scene, camera: bpy.types.Object, column: WaterColumn, oversampling: int
) -> Hits:
    """Cast the rays of a camera into a scene without water.

    Parameters
    ----------
    scene : Scene
        Its objects, whose colours are taken from Cycles' pass of the diffuse colour.
    camera : Object
        The camera.
    column : WaterColumn
        Has the sun and the floor, which the scene itself does not show.
    oversampling : int
        Rays per pixel and axis.
    """
    width, height = scene.render.resolution_x, scene.render.resolution_y
    depsgraph = bpy.context.evaluated_depsgraph_get()
    origin, direction = camera_rays(camera, width * oversampling, height * oversampling)
    distance = np.full(direction.shape[:2], np.inf)
    normal = np.zeros_like(direction)
    normal[..., 2] = 1.0
    sunlit = np.ones_like(distance)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_floor = (column.floor_depth + origin[2]) / -direction[..., 2]
    to_floor = np.where(direction[..., 2] < 0, to_floor, np.inf)
    towards_sun = Vector([-float(x) for x in column.sun_direction])
    start = Vector(origin)
    on_floor = np.zeros(distance.shape, dtype=bool)
    for index in np.ndindex(distance.shape):
        w = Vector(direction[index])
        hit, point, n, *_ = scene.ray_cast(depsgraph, start, w)
        length = (point - start).length if hit else math.inf
        if to_floor[index] <= length:
            on_floor[index] = True
            length, n = float(to_floor[index]), Vector((0.0, 0.0, 1.0))
            point = start + length * w
        if not math.isfinite(length):
            continue
        n = -n if n.dot(w) > 0 else n
        distance[index], normal[index] = length, n
        sunlit[index] = not scene.ray_cast(depsgraph, point + _OFFSET * n, towards_sun)[0]
    colour = _diffuse_colour(scene, camera)
    reflectance = np.repeat(np.repeat(colour, oversampling, axis=0), oversampling, axis=1)
    reflectance[on_floor] = column.floor_reflectance.mean()
    return Hits(distance, direction, normal, reflectance, sunlit)


def camera_rays(
    camera: bpy.types.Object, columns: int, rows: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origin, shape (3,), and unit directions, shape (rows, columns, 3)."""
    corners = camera.data.view_frame(scene=bpy.context.scene)
    top_right, _, bottom_left, top_left = (np.array(c) for c in corners)
    u, v = ((np.arange(n) + 0.5) / n for n in (columns, rows))
    local = (
        top_left
        + u[None, :, None] * (top_right - top_left)
        + v[:, None, None] * (bottom_left - top_left)
    )
    matrix = np.array(camera.matrix_world)
    direction = local @ matrix[:3, :3].T
    return matrix[:3, 3], direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def _diffuse_colour(scene: bpy.types.Scene, camera: bpy.types.Object) -> NDArray[np.float64]:
    """Diffuse colour of what each pixel shows, linear RGB, shape (h, w, 3)."""
    settings = {"samples": 4, "seed": 0}
    with (
        tempfile.TemporaryDirectory() as folder,
        reference_settings(scene, camera, **settings) as layer,
    ):
        path = Path(folder) / "passes.exr"
        layer.use_pass_diffuse_color = True
        scene.render.use_file_extension = False
        image = scene.render.image_settings
        image.media_type = "MULTI_LAYER_IMAGE"
        image.color_depth = "32"
        image.use_exr_interleave = True
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True, scene=scene.name)
        layer.use_pass_diffuse_color = False
        pixels, names = read_exr(path)
    chosen = [
        next(i for i, name in enumerate(names) if name.endswith(f"Diffuse Color.{channel}"))
        for channel in "RGB"
    ]
    return np.clip(pixels[..., chosen].astype(np.float64), 0.0, 1.0)
