"""Eyes for what the water surface shows a camera below it, and whether they see objects.

One is the camera at its own mirror image in the surface, for what that mirrors; the other is the
camera itself, for what the surface lets through.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...datasets.camera import PinholeCamera
from ...uw_spectral.surface.refraction import apparent_height, direction_in_air, is_in_window
from ...uw_spectral.surface.surface_views import ReflectedView
from .. import contents, marks
from ..temporary import held
from . import shown_lamps
from .cameras import clip_range, stand_in
from .pinhole import of_size, pinhole_of, pose_of, set_pinhole
from .ray_casting import Meshes

_SPREAD = math.radians(15.0)  # beyond the picture, from where waves still mirror light into it
_EDGES = 97  # of a grid over the picture by which the part is chosen that is drawn
_RAYS = 96, 54  # that look for objects
_UNDER = 1e-3  # m, how far under the surface they begin
_LEVEL = 1e-4
_NEAREST = 0.05  # m, of what is mirrored
_FEWEST = 4  # pixels along a side
_CLIP_START = 1e-3  # m
_FARTHEST = 1e4  # m, in the air
RISES = -3.0
"""Height in m: what is higher may come out of the water in a job."""
_SOLID = ("MESH", "CURVE", "SURFACE", "FONT", "META", "CURVES")
_DEFORMING = (
    "ARMATURE", "CLOTH", "FLUID", "HOOK", "LATTICE", "MESH_CACHE", "MESH_DEFORM",
    "MESH_SEQUENCE_CACHE", "NODES", "OCEAN", "SOFT_BODY", "WAVE",
)  # fmt: skip

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MirroredEye:
    """A pinhole that sees what the surface mirrors to a camera below, or lets through to it."""

    pose: Array  #: Blender's axes to the world, (4, 4).
    #: Of the part of the picture in which the surface mirrors, or lets light through.
    camera: PinholeCamera
    index: float | None = None  #: Of the water against air, for what the surface lets through.

    @property
    def height(self) -> float:
        """Over the water, or under it where the eye looks through the surface, m."""
        return abs(float(self.pose[2, 3]))

    @property
    def towards_surface(self) -> float:
        """Upward component of the straight way to the surface."""
        return -1.0 if self.index is None else 1.0

    def to_surface(self, w: Array) -> Array:
        """Distance of the surface along directions, m; very long where none is ahead."""
        return self.height / np.maximum(self.towards_surface * w[..., 2], _LEVEL)

    @property
    def view(self) -> ReflectedView:
        """Where its picture shows what."""
        x, y, z = self.pose[:3, :3].T
        of = self.camera
        right = of.fx * x - of.cx * z
        up = of.fy * y - (of.height - of.cy) * z
        eye, right, up, ahead = (tuple(v.tolist()) for v in (self.pose[:3, 3], right, up, -z))
        return ReflectedView(eye, right, up, ahead, float(of.width), float(of.height))

    def directions(self, across: Array, down: Array) -> Array:
        """Unit directions at image coordinates, pixels, shape (..., 3)."""
        of = self.camera
        seen = [(across - of.cx) / of.fx, (of.cy - down) / of.fy, -np.ones_like(across)]
        w = np.stack(seen, axis=-1) @ self.pose[:3, :3].T
        return w / np.linalg.norm(w, axis=-1, keepdims=True)

    def nearness(self, depth: Array) -> NDArray[np.float32]:
        """One over the distance of what is seen from the surface, 1/m.

        The depth, shape (h, w), is along the axis, m, infinite where nothing is seen.
        """
        h, w = depth.shape
        across, down = np.meshgrid(np.arange(w) + 0.5, np.arange(h) + 0.5)
        d = self.directions(across, down)
        along = d @ -self.pose[:3, 2]
        beyond = depth / along - self.to_surface(d)
        if self.index is not None:
            beyond = beyond / self.index  # the straight line is as much longer than the bent one
        return (1.0 / np.maximum(beyond, _NEAREST)).astype(np.float32)


def mirrored_eye(
    scene: bpy.types.Scene, camera: bpy.types.Object, reach: float, *, waves: bool
) -> MirroredEye | None:
    """Return the mirrored eye of a camera at this frame.

    None if the camera is no pinhole in the water, or no ray reaches the surface. Light goes at most
    the ``reach`` by the surface, m; with ``waves`` more is mirrored than a flat one would.
    """
    below = _pinhole_below(scene, camera)
    if below is None:
        return None
    pose, of = below
    pose[2] *= -1.0
    pose[:3, 1] *= -1.0
    turned = PinholeCamera(of.width, of.height, of.fx, of.fy, of.cx, of.height - of.cy)
    return _part(MirroredEye(pose, turned), reach, _SPREAD if waves else 0.0)


def window_eye(
    scene: bpy.types.Scene, camera: bpy.types.Object, reach: float, index: float, *, waves: bool
) -> MirroredEye | None:
    """Return the eye of a camera at this frame for what is seen through the surface.

    As :func:`mirrored_eye`; None too if the camera does not look through the surface. The index is
    that of the water against air.
    """
    below = _pinhole_below(scene, camera)
    if below is None:
        return None
    eye = MirroredEye(*below, index)
    # Whatever waves do to a ray, a flat surface shows the air within the window alone.
    return _part(
        eye, reach, _SPREAD if waves else 0.0, lambda w: is_in_window(w[..., 2], index) > 0.0
    )


def _pinhole_below(
    scene: bpy.types.Scene, camera: bpy.types.Object
) -> tuple[Array, PinholeCamera] | None:
    if camera.data.type != "PERSP" or camera.matrix_world.is_negative:
        return None
    pose = pose_of(camera)
    return None if pose[2, 3] >= 0.0 else (pose, pinhole_of(scene, camera))


def _part(
    eye: MirroredEye,
    reach: float,
    spread: float,
    shows: Callable[[Array], NDArray[np.bool_]] = lambda w: np.ones(w.shape[:-1], dtype=bool),
) -> MirroredEye | None:
    """Return the eye with the part of its picture in which light by the surface arrives."""
    of = eye.camera
    across = _edges(of.cx, of.fx, of.width, spread)
    down = _edges(of.cy, of.fy, of.height, spread)
    w = eye.directions(*np.meshgrid(across, down))
    arrives = (eye.to_surface(w) < reach) & shows(w)
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
    return replace(eye, camera=part)


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


def sees_objects(scene: bpy.types.Scene, eye: MirroredEye, reach: float) -> bool:
    """Whether anything of the scene's own is mirrored, or seen in the air, within a reach, m.

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
    middle = _middles(eye, low, high)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    in_picture = np.asarray(eye.view.place(tuple(middle.T))[2]) > 0.0
    w = np.concatenate([w, middle[in_picture]])
    if eye.index is not None:
        w = w[is_in_window(w[:, 2], eye.index) > 0.0]
    to_surface = eye.to_surface(w)
    w, to_surface = w[to_surface < reach], to_surface[to_surface < reach]
    place = eye.pose[:3, 3] + w * to_surface[:, None]
    place[:, 2] = eye.towards_surface * _UNDER
    far = reach - to_surface
    if eye.index is not None:
        w = np.stack(direction_in_air(tuple(w.T), (0.0, 0.0, 1.0), eye.index), axis=1)
        far = np.full(len(w), _FARTHEST)
    return any(hit is not None for hit in meshes.first(place, w, far))


def _middles(eye: MirroredEye, low: Array, high: Array) -> Array:
    """Ways from the eye to where the middles of boxes seem to be, of their part that it sees."""
    if eye.index is None:
        high[:, 2] = np.minimum(high[:, 2], 0.0)
        return (low + high)[low[:, 2] < 0.0] / 2.0 - eye.pose[:3, 3]
    low[:, 2] = np.maximum(low[:, 2], 0.0)
    way = (low + high)[high[:, 2] > _UNDER] / 2.0 - eye.pose[:3, 3]
    height = way[:, 2] - eye.height
    distance = np.hypot(way[:, 0], way[:, 1])
    way[:, 2] = eye.height + apparent_height(distance, height, eye.height, eye.index)
    return way


def materials_above(scene: bpy.types.Scene, height: float) -> set[bpy.types.Material]:
    """Materials of objects that reach above a height, m."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, marks.objects(scene), "camera")
    return {
        material.original
        for shown in meshes.instances
        if shown.high[2] > height
        for material in shown.materials
        if material is not None
    }


def may_rise(scene: bpy.types.Scene, frames: int) -> bool:
    """Whether objects may stand out of the water in a job of some frames, of which it is the first.

    What moves and is less than some metres deep may come out later.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = Meshes(depsgraph, marks.objects(scene), "camera")
    if any(shown.high[2] > 0.0 for shown in meshes.instances):
        return True
    return frames > 1 and any(
        item.type in _SOLID and _changes(item) and _top(item) > RISES
        for item in contents.objects(scene)
        if item not in marks.objects(scene)
    )


def _changes(item: bpy.types.Object) -> bool:
    """Whether an object may come to another place or be deformed."""
    keys = getattr(item.data, "shape_keys", None)
    deformed = any(modifier.type in _DEFORMING for modifier in item.modifiers)
    keyed = keys is not None and keys.animation_data is not None
    return keyed or deformed or shown_lamps.moves(item)


def _top(item: bpy.types.Object) -> float:
    return max((item.matrix_world @ Vector(corner)).z for corner in item.bound_box)


@contextlib.contextmanager
def looking(
    scene: bpy.types.Scene, eye: MirroredEye, camera: bpy.types.Object
) -> Iterator[bpy.types.Object]:
    """Let a scene be seen by an eye while the block runs; through the surface, objects alone."""
    of, render = eye.camera, scene.render
    with stand_in(scene, camera, "mirrored") as found:
        data = found.data
        set_pinhole(data, (of.width, of.height), (of.fx, of.fy), (of.cx, of.cy))
        # The main picture blurs what is on the surface as what is far away.
        data.dof.use_dof = False
        near = max(min(camera.data.clip_start, eye.height), _CLIP_START)
        data.clip_start, data.clip_end = clip_range(near, data.clip_end)
        found.matrix_world = Matrix(eye.pose.tolist())
        wanted = [*of_size(render, of.width, of.height), (scene, "camera", found)]
        if eye.index is not None:
            wanted += [(render, "film_transparent", True)]
            shown = (x for x in marks.objects(scene) if x.type != "LIGHT")
            wanted += [(item, "hide_render", True) for item in shown]
        with held(wanted):
            bpy.context.view_layer.update()
            yield found
