"""A job of a data set: views that differ by pose alone, as frames of a scene with a stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import bpy

from ..datasets.exporting import needed_layers
from ..datasets.files import make_folder
from ..datasets.grouping import ViewJob
from ..datasets.index import job_folder
from ..datasets.specification import DataSetSpec
from ..settings.render_plan import quiet
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.imaging.layers import parse_layers
from . import job_files
from .format_checks import require_formats
from .job import Job
from .manifest_files import JOB_FILE, read_manifest, write_manifest
from .planning import plan_job
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


def write_job(
    scene: bpy.types.Scene,
    spec: DataSetSpec,
    item: ViewJob,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    held: int,
) -> None:
    """Plan views that are rendered together; the animation is held at a frame."""
    camera, layers = item.camera, ",".join(needed_layers(spec))

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

    wanted = replace(
        job,
        frames=tuple(item.frames),
        camera=camera.name,
        cameras=(),
        seed=item.seed,
        out=job_folder(job.out, item.name).absolute(),
        stage=_stage(item, held),
    )
    with quiet():
        manifest = plan_job(scene, settings_of_frame, wanted)
    job_files.require_all(manifest.files)
    require_formats(spec, camera, manifest)
    make_folder(manifest.out)
    write_manifest(manifest.out / JOB_FILE, manifest)


def add_layers(path: Path, spec: DataSetSpec) -> None:
    """Let a job that was planned before have more layers; its passes are then of another key."""
    manifest = read_manifest(path)
    known = parse_layers(manifest.settings["layers"])
    wanted = dict.fromkeys((*known, *parse_layers(",".join(needed_layers(spec)))))
    if len(wanted) > len(known):
        settings = {**manifest.settings, "layers": ",".join(wanted)}
        write_manifest(path, replace(manifest, settings=settings))


def _stage(item: ViewJob, held: int) -> Stage:
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
