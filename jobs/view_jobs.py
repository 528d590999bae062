"""A job of a data set: views that differ by pose alone, as frames of a scene with a stage."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import bpy

from ..datasets.cameras_and_rigs import DataSetCamera
from ..datasets.exporting import needed_layers
from ..datasets.files import make_folder
from ..datasets.formats import FORMATS
from ..datasets.grouping import ViewJob
from ..datasets.index import job_folder
from ..datasets.specification import DataSetSpec
from ..settings.render_plan import plan_of, quiet
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.housing.description import NONE
from ..uw_spectral.imaging.layers import parse_layers
from . import job_files
from .job import Job
from .manifest import Manifest
from .manifest_files import JOB_FILE, read_manifest, write_manifest
from .picture_layers import missing_layers
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
    _require_formats(spec, camera, manifest)
    make_folder(manifest.out)
    write_manifest(manifest.out / JOB_FILE, manifest)


def _require_formats(spec: DataSetSpec, camera: DataSetCamera, manifest: Manifest) -> None:
    """Refuse formats that could not be written of a job in the end."""
    settings = manifest.settings_of(manifest.frames[0])
    of_scene = settings.housing != NONE or (settings.lens and not camera.coefficients)
    for name in spec.outputs.formats if of_scene else ():
        FORMATS[name].require_lens(name, camera.name, 5)
    plan = plan_of(settings)
    for name in spec.outputs.formats:
        missing = missing_layers(plan, FORMATS[name].layers, traced=manifest.method.traced)
        if missing:
            raise InputError(
                f"{name} is made of the layer {', '.join(missing)}, which Cycles gives in water "
                "that is the same at every depth only; render with engine = 'eevee', or leave "
                f"{name} out"
            )


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
