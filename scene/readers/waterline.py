"""A camera at the surface: where it looks through air, and where through water."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.realtime_refraction import WATERLINE
from ...uw_spectral.imaging.waterline import split_picture
from ...uw_spectral.surface.raised_waves import RaisedWaves
from .cameras import before_water, eye_of

PORT = WATERLINE
"""Distance in m between the camera and the glass that the water stands at."""
NO_LAYERS = (
    "layers are only known in the water, and the camera is above it or at its surface; "
    "lower the camera, or render without --layers"
)
_COARSE = (64, 64)  # places on the glass that decide whether a picture is split
_RISE = 0.004  # m above the water to which the meniscus still shows


def above(
    camera: bpy.types.Object, eyes: Sequence[tuple[float, ...]] = (), trough: float = 0.0
) -> bool:
    """Whether a camera may have air before its glass, now or where it is at frames of a job.

    The surface may fall by ``trough`` below its mean level, m.
    """
    return any(eye[2] > -PORT - trough for eye in (eye_of(camera), *eyes))


def glass_heights(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    shape: tuple[int, int],
    waves: RaisedWaves | None = None,
) -> NDArray[np.float64] | None:
    """Heights of the pixels' places on the glass over the surface, level without waves; (h, w).

    None if all are in the air, or all in the water, and for cameras without a pinhole.
    """
    if camera.data.type != "PERSP":
        return None
    depsgraph = bpy.context.evaluated_depsgraph_get()
    place = np.array(camera.evaluated_get(depsgraph).matrix_world)
    frame = np.array([corner[:] for corner in camera.data.view_frame(scene=scene)])
    corner, _, opposite, left = frame * (PORT / -frame[0, 2])
    h, w = shape
    across = ((np.arange(w) + 0.5) / w)[None, :, None]
    down = ((np.arange(h) + 0.5) / h)[:, None, None]
    at = left + (corner - left) * across + (opposite - left) * down
    turn = place[:3, :3] / np.linalg.norm(place[:3, :3], axis=0)
    x, y, heights = (at @ turn[i] + place[i, 3] for i in range(3))
    if waves is not None:
        heights = heights - waves.elevation(x, y)
    return heights if heights.min() < _RISE and heights.max() > 0.0 else None


def splits(
    scene: bpy.types.Scene, camera: bpy.types.Object, waves: RaisedWaves | None = None
) -> bool:
    """Whether the waterline is in a camera's picture, on waves with heights or a level surface."""
    return glass_heights(scene, camera, _COARSE, waves) is not None


def first_distance(camera: bpy.types.Object, clip_start: float, *, split: bool) -> float:
    """Distance from a camera at which its rays begin in Cycles, m: at the glass, or at its port."""
    return PORT if split else max(clip_start, before_water(camera))


def is_in_air(eye: Sequence[float], waves: RaisedWaves | None = None) -> bool:
    """Whether a place in m is over the surface."""
    return eye[2] > (0.0 if waves is None else float(waves.elevation(eye[0], eye[1])))


def joined(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    air: NDArray[np.float32],
    water: NDArray[np.float32],
    refractive_index: float,
    waves: RaisedWaves | None = None,
) -> NDArray[np.float32]:
    """Join the pictures, shape (h, w, c), of a camera in the air and in the water at the waterline.

    The camera is at the surface: it has :func:`glass_heights`.
    """
    heights = glass_heights(scene, camera, air.shape[:2], waves)
    assert heights is not None, "the camera is at the surface"
    falls = -np.array([gradient.mean() for gradient in np.gradient(heights)])
    falls /= max(float(np.linalg.norm(falls)), 1e-12)
    frame = np.array([corner[:] for corner in camera.data.view_frame(scene=scene)])
    width = float(np.linalg.norm(frame[0] - frame[3]) / -frame[0, 2])
    down = float(falls[0]), float(falls[1])
    return split_picture(air, water, heights, down, air.shape[1] / width, refractive_index)
