"""The camera at the mirror image of another in the water surface, and whether it sees things."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ...datasets.camera import PinholeCamera
from ...uw_spectral.surface.mirrored_view import MirroredView
from .. import marks
from ..temporary import held
from .cameras import stand_in
from .pinhole import pinhole_of, pose_of, set_pinhole
from .ray_casting import Meshes

_SPREAD = math.radians(15.0)  # beyond the picture, from where waves still mirror light into it
_EDGES = 97  # of a grid over the picture by which the part is chosen that is drawn
_RAYS = 96, 54  # that look for things
_UNDER = 1e-3  # m, how far under the surface they begin
_LEVEL = 1e-4
_NEAREST = 0.05  # m, of what is mirrored
_FEWEST = 4  # pixels along a side
_CLIP_START = 1e-3  # m

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MirroredEye:
    """A pinhole over the water that sees what the surface mirrors to a camera below.

    Attributes
    ----------
    pose : array, shape (4, 4)
        Blender's axes to the world.
    camera : PinholeCamera
        That of the part of the picture in which the surface mirrors.
    """

    pose: Array
    camera: PinholeCamera

    @property
    def height(self) -> float:
        """Over the water, m."""
        return float(self.pose[2, 3])

    @property
    def view(self) -> MirroredView:
        """Where its picture shows what."""
        x, y, z = self.pose[:3, :3].T
        of = self.camera
        right = of.fx * x - of.cx * z
        up = of.fy * y - (of.height - of.cy) * z
        eye, right, up, ahead = (tuple(v.tolist()) for v in (self.pose[:3, 3], right, up, -z))
        return MirroredView(eye, right, up, ahead, float(of.width), float(of.height))

    def directions(self, across: Array, down: Array) -> Array:
        """Unit directions at image coordinates, pixels, shape (..., 3)."""
        of = self.camera
        seen = [(across - of.cx) / of.fx, (of.cy - down) / of.fy, -np.ones_like(across)]
        w = np.stack(seen, axis=-1) @ self.pose[:3, :3].T
        return w / np.linalg.norm(w, axis=-1, keepdims=True)

    def nearness(self, depth: Array) -> NDArray[np.float32]:
        """One over the distance of what is seen from the surface, 1/m.

        Parameters
        ----------
        depth : array, shape (h, w)
            Along the axis, m, infinite where nothing is seen.
        """
        h, w = depth.shape
        across, down = np.meshgrid(np.arange(w) + 0.5, np.arange(h) + 0.5)
        d = self.directions(across, down)
        along = d @ -self.pose[:3, 2]
        beyond = depth / along - self.height / np.maximum(-d[..., 2], _LEVEL)
        return (1.0 / np.maximum(beyond, _NEAREST)).astype(np.float32)


def mirrored_eye(
    scene: bpy.types.Scene, camera: bpy.types.Object, reach: float, *, waves: bool
) -> MirroredEye | None:
    """Return the mirrored eye of a camera at this frame.

    Parameters
    ----------
    scene : Scene
    camera : Object
    reach : float
        Longest way of light by the surface that is looked at, m.
    waves : bool
        Whether more is mirrored than a flat surface would.

    Returns
    -------
    MirroredEye or None
        None if the camera is no pinhole in the water, or no ray reaches the surface.
    """
    if camera.data.type != "PERSP" or camera.matrix_world.is_negative:
        return None
    pose, of = pose_of(camera), pinhole_of(scene, camera)
    if pose[2, 3] >= 0.0:
        return None
    pose[2] *= -1.0
    pose[:3, 1] *= -1.0
    turned = PinholeCamera(of.width, of.height, of.fx, of.fy, of.cx, of.height - of.cy)
    return _part(MirroredEye(pose, turned), reach, _SPREAD if waves else 0.0)


def _part(eye: MirroredEye, reach: float, spread: float) -> MirroredEye | None:
    """Return the eye with the part of its picture in which light by the surface arrives."""
    of = eye.camera
    across = _edges(of.cx, of.fx, of.width, spread)
    down = _edges(of.cy, of.fy, of.height, spread)
    w = eye.directions(*np.meshgrid(across, down))
    arrives = eye.height / np.maximum(-w[..., 2], _LEVEL) < reach
    if not arrives.any():
        return None
    left, right = _span(across, arrives.any(axis=0))
    top, bottom = _span(down, arrives.any(axis=1))
    # What waves mirror is not sharp: a wider picture has no more pixels than the camera's.
    finer = min(1.0, math.sqrt(of.width * of.height / ((right - left) * (bottom - top))))
    width, height = (max(round(n * finer), _FEWEST) for n in (right - left, bottom - top))
    fx, fy = of.fx * finer, of.fy * finer
    cx, cy = (of.cx - left) * finer, (of.cy - top) * finer
    part = PinholeCamera(width, height, fx, fy, cx, cy)
    return MirroredEye(eye.pose, part)


def _edges(centre: float, focal: float, size: int, spread: float) -> Array:
    first, last = (math.atan((x - centre) / focal) for x in (0.0, float(size)))
    most = math.radians(80.0)
    first, last = max(first - spread, -most), min(last + spread, most)
    return centre + focal * np.linspace(math.tan(first), math.tan(last), _EDGES)


def _span(edges: Array, wanted: NDArray[np.bool_]) -> tuple[int, int]:
    """Whole pixels around the wanted edges and their neighbours."""
    found = np.flatnonzero(wanted)
    low, high = max(found[0] - 1, 0), min(found[-1] + 1, len(edges) - 1)
    return math.floor(edges[low] + _LEVEL), math.ceil(edges[high] - _LEVEL)


def sees_things(scene: bpy.types.Scene, eye: MirroredEye, reach: float) -> bool:
    """Whether anything of the scene's own is mirrored within a reach, m.

    Looked for along rays over the picture, and towards the middle of every mesh.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, marks.objects(scene), "camera")
    if not meshes.instances:
        return False
    of = eye.camera
    across, down = ((np.arange(n) + 0.5) / n for n in _RAYS)
    w = eye.directions(*np.meshgrid(across * of.width, down * of.height)).reshape(-1, 3)
    low = np.array([shown.low for shown in meshes.instances])
    high = np.array([shown.high for shown in meshes.instances])
    high[:, 2] = np.minimum(high[:, 2], 0.0)
    middle = (low + high)[low[:, 2] < 0.0] / 2.0 - eye.pose[:3, 3]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    w = np.concatenate([w, middle[_is_in(eye, middle)]])
    to_surface = eye.height / np.maximum(-w[:, 2], _LEVEL)
    w, to_surface = w[to_surface < reach], to_surface[to_surface < reach]
    place = eye.pose[:3, 3] + w * to_surface[:, None]
    place[:, 2] = -_UNDER
    return any(hit is not None for hit in meshes.first(place, w, reach - to_surface))


def _is_in(eye: MirroredEye, w: Array) -> NDArray[np.bool_]:
    return np.asarray(eye.view.place(tuple(w.T))[2]) > 0.0


def materials_above(scene: bpy.types.Scene, height: float) -> set[bpy.types.Material]:
    """Materials of things that reach above a height, m."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, marks.objects(scene), "camera")
    return {
        material.original
        for shown in meshes.instances
        if shown.high[2] > height
        for material in shown.materials
        if material is not None
    }


@contextlib.contextmanager
def looking(
    scene: bpy.types.Scene, eye: MirroredEye, camera: bpy.types.Object
) -> Iterator[bpy.types.Object]:
    """Let a scene be seen by a mirrored eye while the block runs."""
    of, render = eye.camera, scene.render
    with stand_in(scene, camera, "mirrored") as found:
        data = found.data
        set_pinhole(data, (of.width, of.height), (of.fx, of.fy), (of.cx, of.cy))
        # The main picture blurs what is on the surface as what is far away.
        data.dof.use_dof = False
        data.clip_start = max(min(camera.data.clip_start, eye.height), _CLIP_START)
        found.matrix_world = Matrix(eye.pose.tolist())
        wanted = [
            (render, "resolution_x", of.width),
            (render, "resolution_y", of.height),
            (render, "resolution_percentage", 100),
            (scene, "camera", found),
        ]
        with held(wanted):
            bpy.context.view_layer.update()
            yield found
