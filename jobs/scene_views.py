"""The views of a data set in its scene: where its own cameras go, and where others fit."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import bpy

from ..datasets.enumeration import PlannedView, enumerate_views
from ..datasets.pose_sets import GivenPoses, ScenePath
from ..datasets.specification import DataSetSpec
from ..datasets.trajectory_files import TimedPoses
from ..scene.as_rendered import as_rendered
from ..scene.readers.cameras import camera_of
from ..scene.readers.pinhole import pose_of
from ..scene.readers.room import Room
from ..uw_spectral.errors import InputError


def views_in(scene: bpy.types.Scene, spec: DataSetSpec, held: int) -> list[PlannedView]:
    """Return the views of a specification in a scene, whose animation is held at a frame."""
    poses = [
        GivenPoses(x.name, _way(x, scene)) if isinstance(x, ScenePath) else x for x in spec.poses
    ]
    with as_rendered(scene):
        scene.frame_set(held)
        room = Room(bpy.context.evaluated_depsgraph_get())
    return enumerate_views(replace(spec, poses=tuple(poses)), room)


def _way(path: ScenePath, scene: bpy.types.Scene) -> TimedPoses:
    """Ask a camera of the scene where it is at each frame."""
    cameras = [item for item in scene.objects if item.type == "CAMERA"]
    named = {item.name: item for item in cameras}
    camera = named.get(path.camera) if path.camera else camera_of(scene)
    if camera is None:
        wanted = repr(path.camera) if path.camera else "of its own"
        raise InputError(
            f"{path.name}: the scene has no camera {wanted}, but "
            f"{', '.join(sorted(named)) or 'none at all'}; name one of them, or add one"
        )
    if camera.matrix_world.is_negative:
        raise InputError(
            f"{path.name}: camera {camera.name!r} is mirrored by a negative scale, which no pose "
            "tells; apply its scale (Object, Apply, Scale)"
        )
    first = scene.frame_start if path.first is None else path.first
    last = scene.frame_end if path.last is None else path.last
    frames, now = range(first, last + 1, path.step), scene.frame_current
    if not frames:
        raise InputError(f"{path.name}: frames run from {first} to {last}; give first and last")
    seconds = scene.render.fps_base / scene.render.fps
    poses = []
    for frame in frames:
        scene.frame_set(frame)
        poses.append(pose_of(camera))
    scene.frame_set(now)
    return TimedPoses(tuple(poses), tuple(Fraction((frame - first) * seconds) for frame in frames))
