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
from ..datasets.exporting import needed_layers
from ..datasets.formats import FORMATS
from ..datasets.grouping import ViewJob, group_views
from ..datasets.index import (
    NAME,
    Index,
    SceneObject,
    indexed,
    job_folder,
    read_index,
    write_index,
)
from ..datasets.pose_sets import ScenePath
from ..datasets.specification import DataSetCamera, DataSetSpec
from ..datasets.trajectory_files import TimedPoses
from ..quality.methods import method_of
from ..scene.as_rendered import as_rendered
from ..scene.readers.cameras import camera_of
from ..scene.readers.pinhole import pose_of
from ..scene.readers.room import Room
from ..scene.rendered import in_rendered_collections, rendered_layer
from ..settings.former_names import in_present_names
from ..settings.render_plan import quiet
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError, unknown_name
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.imaging.layers import parse_layers
from . import job_files
from .band_passes import make_folder
from .frame_plans import FramePlans
from .job import Job
from .manifest import Manifest
from .manifest_files import read_manifest, write_manifest
from .picture_layers import missing_layers
from .planning import plan_job
from .render_job import JOB_FILE
from .stage import Place, Stage, StageCamera, StageLamp

_IN_AIR = {
    "absorption_factor": 0.0,
    "scattering_factor": 0.0,
    "refractive_index": 1.0,
    "surface": "none",
    "inelastic": "",
    "second_water": "",
    "second_water_fraction": 0.0,
}
"""Water that neither absorbs nor scatters nor refracts."""
_MOST_OBJECTS = 65535  # of 16 bits
_CATEGORY, _CATEGORY_ID = "category", "category_id"  # custom properties of an object
_COPY = re.compile(r"\.\d{3,}$")


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
    _check(spec, seeded=seeded)
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
    views = enumerate_views(with_scene_paths(spec, scene), _room(scene, held))
    make_folder(job.out)
    path = job.out / NAME
    rendered = _rendered(job, settings_now(), held)
    digest = job_files.scene_digest(blend)
    earlier = read_index(path) if path.is_file() else None
    if earlier is not None:
        _require_same(earlier, digest, rendered, job.out)
    known = earlier.views if earlier else {}
    new, places = group_views(
        spec,
        unfinished(views, known),
        seeded=seeded,
        taken=earlier.jobs if earlier else (),
    )
    layers = ",".join(needed_layers(spec))
    if earlier is not None:
        for name in earlier.jobs:
            _add_layers(earlier.manifest(name), layers)
    for item in new:
        manifest = _plan_one(scene, item, settings_now, job, held, layers)
        job_files.require_all(manifest.files)
        _require_formats(spec, item.camera, manifest)
        make_folder(manifest.out)
        write_manifest(manifest.out / JOB_FILE, manifest)
    found = {view.name: _placed(view, known, places) for view in views}
    names = (*(earlier.jobs if earlier else ()), *(item.name for item in new))
    index = Index(
        job.out.absolute(), spec_path.absolute(), blend.absolute(), digest, rendered, names, found,
        objects,
    )  # fmt: skip
    write_index(path, index)
    return index


def _placed(view: PlannedView, known: Mapping[str, Any], places: Mapping[str, Any]) -> Any:  # noqa: ANN401
    if view.name in known:
        return replace(known[view.name], split=view.split, record=view.record())
    return indexed(view, places[view.name])


def _check(spec: DataSetSpec, *, seeded: bool) -> None:
    if spec.repeats > 1 and not seeded and spec.raw is None:
        raise InputError(
            "repeats: the noise of EEVEE has no seed, so the pictures would be the same; give a "
            "[detector], or render with --engine cycles"
        )


def _require_formats(spec: DataSetSpec, camera: DataSetCamera, manifest: Manifest) -> None:
    """Refuse formats that could not be written in the end, before anything is rendered."""
    settings = manifest.settings_of(manifest.frames[0])
    of_scene = settings.housing != NONE or (settings.lens and not camera.coefficients)
    for name in spec.outputs.formats if of_scene else ():
        FORMATS[name].require_lens(name, camera.name, 5)
    plan = FramePlans(manifest).of(manifest.frames[0])
    method = method_of(manifest.output.engine, manifest.output.mode)
    for name in spec.outputs.formats:
        missing = missing_layers(plan, FORMATS[name].layers, traced=method.traced)
        if missing:
            raise InputError(
                f"{name} is made of the layer {', '.join(missing)}, which Cycles gives in water "
                "that is the same at every depth only; render with engine = 'eevee', or leave "
                f"{name} out"
            )


def with_scene_paths(spec: DataSetSpec, scene: bpy.types.Scene) -> DataSetSpec:
    """Return a specification with the ways of the scene's cameras, pose by pose."""
    poses = [x.along(_way(x, scene)) if isinstance(x, ScenePath) else x for x in spec.poses]
    return replace(spec, poses=tuple(poses))


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


def _room(scene: bpy.types.Scene, held: int) -> Room:
    with as_rendered(scene):
        scene.frame_set(held)
        return Room(bpy.context.evaluated_depsgraph_get())


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


def _add_layers(path: Path, layers: str) -> None:
    """Let a job that was planned before have more layers; its passes are then of another key."""
    manifest = read_manifest(path)
    known = parse_layers(manifest.settings["layers"])
    wanted = dict.fromkeys((*known, *parse_layers(layers)))
    if len(wanted) > len(known):
        settings = {**manifest.settings, "layers": ",".join(wanted)}
        write_manifest(path, replace(manifest, settings=settings))


def _plan_one(
    scene: bpy.types.Scene,
    item: ViewJob,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    held: int,
    layers: str,
) -> Manifest:
    camera = item.camera

    def settings_of_frame() -> SceneSettings:
        chosen = settings_now()
        view = item.frames[scene.frame_current]
        values: dict[str, Any] = {
            "sensor": camera.sensor,
            "white_balance": camera.white_balance,
            "exposure": camera.exposure,
            "layers": layers,
            **camera.settings,
            **view.settings,
        }
        if item.in_air:
            values = {**values, **_IN_AIR, "water": chosen.water}
        if chosen.floor_depth:
            values["floor_depth"] = chosen.floor_depth + view.lowered
        return replace(chosen, **values)

    with quiet():
        return plan_job(
            scene,
            settings_of_frame,
            replace(
                job,
                frames=tuple(item.frames),
                camera=camera.name,
                cameras=(),
                seed=item.seed,
                out=job_folder(job.out, item.name).absolute(),
                stage=stage_of_views(item, held),
            ),
        )


def stage_of_views(item: ViewJob, held: int) -> Stage:
    """Return what the views of a job add to their scene."""
    optics = item.camera.optics
    camera = StageCamera(
        item.camera.name, optics.width, optics.height, optics.fx, optics.fy, optics.cx, optics.cy
    )
    lamps = [StageLamp(**asdict(lamp)) for lamp in item.rig.lamps]
    lamps = [replace(x, sha256=job_files.digest_of(Path(x.file))) if x.file else x for x in lamps]
    places = {
        frame: Place(tuple(map(tuple, view.camera_to_world.tolist())), view.lowered)
        for frame, view in item.frames.items()
    }
    return Stage(camera, held, tuple(lamps), places)


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


_UNSEEN = {"CAMERA", "LIGHT", "LIGHT_PROBE", "SPEAKER", "EMPTY", "LATTICE", "ARMATURE"}


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
