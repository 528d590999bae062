"""Plans a data set: views of a specification in a scene become jobs, each with its manifest."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import bpy

from ..datasets.enumeration import PlannedView, enumerate_views, unfinished
from ..datasets.files import make_folder
from ..datasets.grouping import group_views
from ..datasets.index import NAME, Index, IndexedView, SceneObject, read_index, write_index
from ..datasets.pose_sets import GivenPoses, ScenePath
from ..datasets.specification import DataSetSpec
from ..datasets.trajectory_files import TimedPoses
from ..quality.methods import method_of
from ..scene.as_rendered import as_rendered
from ..scene.readers.cameras import camera_of
from ..scene.readers.pinhole import pose_of
from ..scene.readers.room import Room
from ..scene.rendered import in_rendered_collections, rendered_layer
from ..settings.scene_settings import SceneSettings
from ..settings.setting import in_present_names
from ..uw_spectral.errors import InputError, unknown_name
from . import job_files
from .job import Job
from .view_jobs import add_layers, write_job

_MOST_OBJECTS = 65535  # of 16 bits
_CATEGORY, _CATEGORY_ID = "category", "category_id"  # custom properties of an object
_COPY = re.compile(r"\.\d{3,}$")
_UNSEEN = {"CAMERA", "LIGHT", "LIGHT_PROBE", "SPEAKER", "EMPTY", "LATTICE", "ARMATURE"}


def plan_data_set(
    scene: bpy.types.Scene,
    spec: DataSetSpec,
    spec_path: Path,
    settings_now: Callable[[], SceneSettings],
    job: Job,
) -> Index:
    """Plan a data set into a folder, or go on with one; nothing is rendered.

    Views that a plan in the folder has already keep their jobs; jobs are added for the others.
    ``settings_now`` returns the settings of the scene, of which the views change some. Raises
    InputError if the specification, the scene (which must be saved) or the folder cannot be used.
    """
    blend = job_files.open_blend()
    if blend is None:
        raise InputError("--dataset: the scene was never saved; save it")
    held = scene.frame_current if spec.frame is None else spec.frame
    seeded = method_of(job.engine, job.mode).traced
    if spec.repeats > 1 and not seeded and spec.raw is None:
        raise InputError(
            "repeats: the noise of EEVEE has no seed, so the pictures would be the same; give a "
            "[detector], or render with --engine cycles"
        )
    if seeded and settings_now().noise:
        raise InputError(
            "--noise: the views of a data set have the same samples; set it to 0 and give --samples"
        )
    objects = tuple(objects_of(scene, held))
    categories = sorted({scene_object.category for scene_object in objects})
    for name in spec.outputs.leave_out:
        if name not in categories:
            raise unknown_name("category of output.leave_out", name, categories)
    if len(objects) > _MOST_OBJECTS:
        raise InputError(
            f"the scene shows {len(objects)} objects, and pictures of instances number no more "
            f"than {_MOST_OBJECTS}; hide some in renders, or join them"
        )
    views = _views_in(scene, spec, held)
    make_folder(job.out)
    path = job.out / NAME
    rendered = _rendered(job, settings_now(), held)
    digest = job_files.scene_digest(blend)
    earlier = read_index(path) if path.is_file() else None
    known: Mapping[str, IndexedView] = earlier.views if earlier else {}
    taken = earlier.jobs if earlier else ()
    if earlier is not None:
        _require_same(earlier, digest, rendered, job.out)
        for name in taken:
            add_layers(earlier.manifest(name), spec)
    new, added = group_views(spec, unfinished(views, known), seeded=seeded, taken=taken)
    for item in new:
        write_job(scene, spec, item, settings_now, job, held)
    found = {
        view.name: replace(known[view.name], split=view.split, record=view.record())
        if view.name in known
        else added[view.name]
        for view in views
    }
    names = (*taken, *(item.name for item in new))
    index = Index(
        job.out.absolute(), spec_path.absolute(), blend.absolute(), digest, rendered, names, found,
        objects,
    )  # fmt: skip
    write_index(path, index)
    return index


def _rendered(job: Job, settings: SceneSettings, held: int) -> dict[str, Any]:
    """What all jobs of a set share, as JSON holds it."""
    return {
        "engine": job.engine,
        "mode": job.mode,
        "denoise": job.denoise,
        "parts": job.parts,
        "held": held,
        **asdict(settings),
    }


def _require_same(earlier: Index, digest: str, rendered: Mapping[str, Any], out: Path) -> None:
    changed = [] if earlier.scene_sha256 == digest else ["the scene"]
    before = in_present_names(earlier.rendered)
    changed += [n for n, value in rendered.items() if before.get(n) != value]
    if changed:
        raise InputError(
            f"{out} holds a data set with other values of {', '.join(changed)}; use the same ones, "
            "or another --out; nothing was overwritten"
        )


def _views_in(scene: bpy.types.Scene, spec: DataSetSpec, held: int) -> list[PlannedView]:
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


def objects_of(scene: bpy.types.Scene, held: int) -> list[SceneObject]:
    """Return the objects of a scene that can be seen, at a frame.

    Their category is their custom property ``category``, else the name of their collection (their
    own where all are in the same one), else that of their data; its number in COCO is the custom
    property ``category_id``, as BlenderProc has it.
    """
    scene.frame_set(held)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    names = set[str]()
    models: dict[object, int] = {}
    found = []
    shown = [
        item
        for item in in_rendered_collections(rendered_layer(scene))
        if item.type not in _UNSEEN and not item.hide_render
    ]
    categories = _categories(scene, shown)
    for item in sorted(shown, key=lambda item: item.name):
        if item.name in names:
            raise InputError(
                f"two objects are named {item.name!r}, of different files, and an instance is told "
                "by its name; rename one of them"
            )
        names.add(item.name)
        place, turn, scale = item.evaluated_get(depsgraph).matrix_world.decompose()
        size = tuple(round(x, 4) for x in scale)
        key = (item.data.name_full if item.data else item.name_full, size)
        pose = turn.to_matrix().to_4x4()
        pose.translation = place
        rows = tuple(tuple(float(x) for x in row) for row in pose)
        number = models.setdefault(key, len(models) + 1)
        found.append(SceneObject(item.name, *categories[item], number, rows))
    return found


def _categories(
    scene: bpy.types.Scene, shown: Sequence[bpy.types.Object]
) -> dict[bpy.types.Object, tuple[str, int | None]]:
    """Name and number of each object's category; a number that several names have names it."""
    owners = {
        item: [c.name for c in item.users_collection if c != scene.collection] for item in shown
    }
    one = len({tuple(names[:1]) for names in owners.values()}) == 1

    def name_of(item: bpy.types.Object) -> str:
        if item.get(_CATEGORY):
            return str(item[_CATEGORY])
        if owners[item]:
            return _COPY.sub("", item.name) if one else owners[item][0]
        return str(item.data.name if item.data else item.name)

    found = {item: (name_of(item), _number(item)) for item in shown}
    names: dict[int, set[str]] = {}
    for name, number in found.values():
        if number is not None:
            names.setdefault(number, set()).add(name)
    several = {number for number, known in names.items() if len(known) > 1}
    found = {
        item: (f"category {number}" if number in several else name, number)
        for item, (name, number) in found.items()
    }
    numbers: dict[str, int | None] = {}
    for item, (name, number) in found.items():
        if numbers.setdefault(name, number) != number:
            raise InputError(
                f"object {item.name!r}: others of category {name!r} have another {_CATEGORY_ID}, "
                "or none; give all objects of a category the same"
            )
    return found


def _number(item: bpy.types.Object) -> int | None:
    number = item.get(_CATEGORY_ID)
    if number is None:
        return None
    if not isinstance(number, int) or number < 0:
        raise InputError(
            f"object {item.name!r}: its custom property {_CATEGORY_ID!r} is {number!r}; give a "
            "whole number, 0 or more"
        )
    return number
