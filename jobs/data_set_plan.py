"""Plans a data set: views of a specification in a scene become jobs, each with its manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import bpy

from ..datasets.enumeration import PlannedView, enumerate_views, unfinished
from ..datasets.exporting import needed_layers
from ..datasets.grouping import group_views
from ..datasets.index import NAME, Index, indexed, read_index, write_index
from ..datasets.specification import DataSetSpec
from ..quality.methods import method_of
from ..scene.as_rendered import as_rendered
from ..scene.readers.room import Room
from ..settings.former_names import in_present_names
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError, unknown_name
from ..uw_spectral.imaging.layers import parse_layers
from . import job_files
from .band_passes import make_folder
from .camera_ways import with_scene_paths
from .job import Job
from .manifest_files import read_manifest, write_manifest
from .render_job import JOB_FILE
from .scene_objects import objects_of
from .view_jobs import plan_views, require_formats

_MOST_OBJECTS = 65535  # of 16 bits


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
        manifest = plan_views(scene, item, settings_now, job, held, layers)
        job_files.require_all(manifest.files)
        require_formats(spec, item.camera, manifest)
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
