"""Plans a data set: views of a specification in a scene become jobs, each with its manifest."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import bpy

from ..datasets.enumeration import unfinished
from ..datasets.files import make_folder
from ..datasets.grouping import group_views
from ..datasets.index import NAME, Index, IndexedView, read_index, write_index
from ..datasets.specification import DataSetSpec
from ..quality.methods import method_of
from ..settings.scene_settings import SceneSettings
from ..settings.setting import in_present_names
from ..uw_spectral.errors import InputError, unknown_name
from . import job_files
from .job import Job
from .scene_objects import objects_of
from .scene_views import views_in
from .view_jobs import add_layers, write_job

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
    views = views_in(scene, spec, held)
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
