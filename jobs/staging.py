"""A scene as jobs plan and render it: on the stage of the job, which is cleared afterwards."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..datasets.cameras_and_rigs import LAMP_BLEND, LAMP_RADIUS
from ..scene import colour_space, contents
from ..scene.animation import curves_of
from ..scene.as_rendered import as_rendered
from ..scene.marks import require_no_water
from ..scene.materials import own_water
from ..scene.readers import stereo
from ..scene.readers.pinhole import set_pinhole
from ..scene.stored_lamps import PROPERTY
from ..scene.temporary import render_settings
from ..uw_spectral.errors import InputError
from . import job_files
from .stage import Place, Stage, StageCamera, StageLamp

_NEAR, _FAR = 1e-3, 1e4  # m


def require_usable(scene: bpy.types.Scene) -> None:
    """Refuse a scene with live water, another colour space, or parts that cannot be changed."""
    require_no_water(scene)
    if not bpy.app.background:  # there a worker makes them local
        contents.require_local(scene)
    colour_space.require_rec709()


@contextlib.contextmanager
def prepared(scene: bpy.types.Scene, hidden: Sequence[str], stage: Stage | None) -> Iterator[None]:
    """Show a scene as it is rendered while the block runs, on its stage.

    ``hidden`` names objects of water of its own that are left out.
    """
    with (
        own_water.hidden(scene, hidden),
        as_rendered(scene),
        stereo.two_eyes(scene),
        staged(scene, stage),
    ):
        yield


@contextlib.contextmanager
def staged(scene: bpy.types.Scene, stage: Stage | None) -> Iterator[None]:
    """Give a scene the camera and lamps of a stage while the block runs; none change nothing.

    Its frames are then those of the stage; what was animated stands still as it is at the frame
    where the stage holds it. Raises InputError if the scene cannot be lowered, or a lamp's table
    has changed.
    """
    if stage is None:
        yield
        return
    with contextlib.ExitStack() as stack:
        stack.enter_context(_still(scene, stage.held))
        stack.enter_context(render_settings(scene, _picture(scene, stage.camera)))
        if any(place.lowered for place in stage.places.values()):
            stack.enter_context(_lowered(scene, stage))
        stack.enter_context(_camera(scene, stage))
        scene.frame_set(min(stage.places))
        yield


def notes(scene: bpy.types.Scene, stage: Stage | None) -> list[str]:
    """Return what a scene asks for that is not supported with a stage."""
    if stage is None:
        return []
    render = scene.render
    asked = {"render region": render.use_border, "transparent film": render.film_transparent}
    said = "is not supported: pictures of a data set are whole and opaque"
    return [f"the {name} {said}" for name, is_on in asked.items() if is_on]


def _picture(
    scene: bpy.types.Scene, camera: StageCamera
) -> list[tuple[bpy.types.bpy_struct, str, object]]:
    wide = camera.fy / camera.fx  # of a pixel, for its height
    render = scene.render
    return [
        (render, "resolution_x", camera.width),
        (render, "resolution_y", camera.height),
        (render, "resolution_percentage", 100),
        (render, "pixel_aspect_x", max(wide, 1.0)),
        (render, "pixel_aspect_y", max(1.0 / wide, 1.0)),
        (render, "use_border", False),
        (render, "frame_map_old", 100),
        (render, "frame_map_new", 100),
    ]


@contextlib.contextmanager
def _still(scene: bpy.types.Scene, frame: int) -> Iterator[None]:
    """Hold the animation of the file at a frame."""
    now = scene.frame_current
    scene.frame_set(frame)
    curves = [curve for curve in _curves() if not curve.mute]
    tracks = [data for data in _animations() if data.use_nla]
    for curve in curves:
        curve.mute = True
    for data in tracks:
        data.use_nla = False
    try:
        yield
    finally:
        for data in tracks:
            data.use_nla = True
        for curve in curves:
            curve.mute = False
        scene.frame_set(now)


def _animations() -> Iterator[bpy.types.AnimData]:
    for block in bpy.data.user_map():
        for owner in (block, getattr(block, "node_tree", None)):
            data = getattr(owner, "animation_data", None)
            if data is not None:
                yield data


def _curves() -> Iterator[bpy.types.FCurve]:
    for action in bpy.data.actions:
        yield from curves_of(action)
    for data in _animations():
        yield from data.drivers


@contextlib.contextmanager
def _lowered(scene: bpy.types.Scene, stage: Stage) -> Iterator[None]:
    """Let everything hang on an object that goes down."""
    roots = [item for item in scene.objects if item.parent is None]
    linked = next((item.name for item in roots if not item.is_editable), None)
    if linked is not None:
        raise InputError(
            f"object {linked!r} is linked and cannot be lowered; make it local, or leave out "
            "scene.depth and move the poses instead"
        )
    anchor = bpy.data.objects.new("Lowered", None)
    scene.collection.objects.link(anchor)
    before = [item.matrix_parent_inverse.copy() for item in roots]
    for item in roots:
        item.parent, item.matrix_parent_inverse = anchor, Matrix()
    _animate(anchor, "location", 2, {n: -place.lowered for n, place in stage.places.items()})
    try:
        yield
    finally:
        for item, inverse in zip(roots, before, strict=True):
            item.parent, item.matrix_parent_inverse = None, inverse
        _remove(anchor)


@contextlib.contextmanager
def _camera(scene: bpy.types.Scene, stage: Stage) -> Iterator[None]:
    chosen = stage.camera
    data = bpy.data.cameras.new(chosen.name)
    set_pinhole(data, (chosen.width, chosen.height), (chosen.fx, chosen.fy), (chosen.cx, chosen.cy))
    data.clip_start, data.clip_end = _NEAR, _FAR
    camera = bpy.data.objects.new(chosen.name, data)
    if camera.name != chosen.name:
        bpy.data.objects.remove(camera)
        raise InputError(
            f"camera {chosen.name!r}: the scene has an object of that name; name the camera anew"
        )
    scene.collection.objects.link(camera)
    before, scene.camera = scene.camera, camera
    try:
        for number, lamp in enumerate(stage.lamps):
            _lamp(scene, camera, number, lamp)
        _place(camera, stage.places)
        yield
    finally:
        scene.camera = before
        for item in (*camera.children, camera):
            _remove(item)


def _place(camera: bpy.types.Object, places: Mapping[int, Place]) -> None:
    camera.rotation_mode = "QUATERNION"
    poses = {n: Matrix(place.camera_to_world) for n, place in places.items()}
    turns = {n: pose.to_quaternion() for n, pose in poses.items()}
    for axis in range(3):
        _animate(camera, "location", axis, {n: pose[axis][3] for n, pose in poses.items()})
    for axis in range(4):
        path = "rotation_quaternion"
        _animate(camera, path, axis, {n: turn[axis] for n, turn in turns.items()})


def _animate(item: bpy.types.Object, path: str, index: int, values: dict[int, float]) -> None:
    """Let a property have a value at each frame, and no others between."""
    item.keyframe_insert(path, index=index, frame=min(values))
    action = item.animation_data.action
    curves = action.layers[0].strips[0].channelbag(item.animation_data.action_slot).fcurves
    points = curves.find(path, index=index).keyframe_points
    points.add(len(values) - len(points))
    points.foreach_set("co", np.array(sorted(values.items()), dtype=np.float32).ravel())
    points.foreach_set("interpolation", [_CONSTANT] * len(points))
    curves.find(path, index=index).update()


_CONSTANT = 0  # of the enumeration of interpolations


def _lamp(scene: bpy.types.Scene, camera: bpy.types.Object, number: int, lamp: StageLamp) -> None:
    if lamp.file and lamp.sha256 != job_files.digest_of(Path(lamp.file)):
        raise InputError(
            f"the table {lamp.file} of a lamp has changed or is missing; bring it back"
        )
    light = bpy.data.lights.new(f"{camera.name} lamp {number}", "SPOT" if lamp.size else "POINT")
    if light.type == "SPOT":
        light.spot_size, light.spot_blend = math.radians(lamp.size), LAMP_BLEND
    light.energy, light.shadow_soft_size = lamp.power, LAMP_RADIUS
    chosen = getattr(light, PROPERTY)
    chosen.spectrum, chosen.unit = lamp.emission, lamp.unit
    item = bpy.data.objects.new(light.name, light)
    scene.collection.objects.link(item)
    item.parent = camera
    turn = Vector(lamp.axis).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    item.matrix_local = Matrix.Translation(lamp.position) @ turn


def _remove(item: bpy.types.Object) -> None:
    """Remove an object, its data and its animation."""
    data, animation = item.data, item.animation_data
    action = animation.action if animation else None
    bpy.data.objects.remove(item)
    blocks = [block for block in (data, action) if block is not None and not block.users]
    bpy.data.batch_remove(blocks)
