"""A whole render, pass by pass: every frame of a job into pictures, spectra and records."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import bpy

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import (
    read_exr,
    replacing,
    write_png,
    write_rgb_exr,
    write_spectral_exr,
)
from ..uw_spectral.spectra.spectrum import split_location
from . import band_passes, cameras, development, engines, picture_size, settings, units
from .render_plan import RenderPlan, make_plan
from .scene_water import has_water
from .settings import Job, SceneSettings
from .water_body import WaterExtent, water_extent

_JOB_FILE = "job.json"
# Settings that only the development reads: bands can be developed again without rendering.
_DEVELOPMENT = {"sensor", "white_balance", "exposure"}


@dataclass(frozen=True)
class Step:
    """One pass that is on disk: the ``number``-th of ``total`` passes of the job."""

    frame: int
    rendered: band_passes.RenderedPass
    number: int
    total: int


@dataclass(frozen=True, eq=False)
class _Frame:
    """A frame that is to be rendered, and what it has given so far."""

    number: int
    plan: RenderPlan
    depth: float
    rendered: list[band_passes.RenderedPass] = field(default_factory=list)


def render(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    report_note: Callable[[str], None],
) -> Iterator[Step]:
    """Render a job; each step of the iteration renders one pass.

    The scene holds water only while the iteration lasts; closing it early
    takes the water out and keeps the passes that are done.

    Parameters
    ----------
    scene : Scene
        The scene.
    settings_now : callable
        Returns the settings at the scene's current frame.
    job : Job
        Frames, engine, camera and folder.
    report_note : callable
        Receives what could not be treated, a line each.

    Yields
    ------
    Step
        The pass that was just written, or found when resuming.

    Raises
    ------
    InputError
        If the scene, the settings or the output folder cannot be used.
    """
    if has_water(scene):
        raise InputError(
            f"scene {scene.name!r} holds water already; remove it and save, the batch adds its own"
        )
    camera = cameras.find_camera(scene, job.camera)
    frames = _frames(scene, camera, settings_now, job)
    plan, size = frames[0].plan, _size(scene)
    picture_size.check_memory(size, len(plan.bands) if job.mode == settings.BANDS else 3)
    _claim_folder(job, _fingerprint(scene, camera, plan.settings, job))
    with _engine(scene, camera, frames, job) as engine:
        notes = [note for note in (units.note(scene), *engine.notes) if note]
        for note in notes:
            report_note(note)
        total, number = len(frames) * len(engine.passes), 0
        for frame in frames:
            scene.frame_set(frame.number)
            passes = band_passes.render_passes(
                engine.frame(frame.plan, frame.depth),
                engine.passes,
                job.out / "passes" / f"{frame.number:04d}",
                size,
                resume=job.resume,
            )
            for item in passes:
                frame.rendered.append(item)
                number += 1
                if len(frame.rendered) == len(engine.passes):
                    _finish(frame, job, {"camera": camera.name, "notes": notes})
                yield Step(frame.number, item, number, total)


def _frames(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    settings_now: Callable[[], SceneSettings],
    job: Job,
) -> list[_Frame]:
    """Resolve every frame before the first is rendered, so that errors come early."""
    plans: dict[SceneSettings, RenderPlan] = {}
    frames = []
    for number in job.frames or (scene.frame_current,):
        scene.frame_set(number)
        chosen = settings_now()
        if frames:  # optimised bands stay while animated water changes
            chosen = frames[0].plan.fixed_bands(chosen)
        depth = cameras.camera_depth(camera, chosen.floor_depth or math.inf)
        if chosen not in plans:
            plans[chosen] = make_plan(chosen)
        frames.append(_Frame(number, plans[chosen], depth))
    first = frames[0].plan.column
    for frame in frames:
        if math.isfinite(frame.plan.column.floor_depth) != math.isfinite(first.floor_depth):
            raise InputError(
                f"--floor-depth is 0 (no floor) in some frames only, such as {frame.number} or "
                f"{frames[0].number}; keyframe it between depths above 0"
            )
    return frames


def _engine(
    scene: bpy.types.Scene, camera: bpy.types.Object, frames: list[_Frame], job: Job
) -> contextlib.AbstractContextManager[engines.BandEngine]:
    """Choose the engine; its water is as wide as the clearest frame needs."""
    extents = [water_extent(scene, frame.plan.column, frame.depth) for frame in frames]
    extent = WaterExtent(
        max(extent.half_width for extent in extents), max(extent.bottom for extent in extents)
    )
    first = frames[0]
    if job.engine == "cycles":
        return engines.cycles_bands(
            scene, camera, first.plan, extent, seed=job.seed, denoise=job.denoise
        )
    make = engines.eevee_realtime if job.mode == settings.REALTIME else engines.eevee_bands
    return make(scene, camera, first.plan, extent, first.depth, froxels=job.froxels)


def _size(scene: bpy.types.Scene) -> tuple[int, int]:
    render = scene.render
    scale = render.resolution_percentage / 100
    return int(render.resolution_x * scale), int(render.resolution_y * scale)


def _finish(frame: _Frame, job: Job, facts: dict[str, Any]) -> None:
    """Write the pictures of a frame, and its record last."""
    picture = job.out / f"{frame.number:04d}.exr"
    if job.mode == settings.REALTIME:
        write_rgb_exr(picture, sum(read_exr(item.path)[0] for item in frame.rendered))
    else:
        _develop(frame, picture)
    write_png(picture.with_suffix(".png"), read_exr(picture)[0])
    _write_json(picture.with_suffix(".json"), _record(frame, job, facts))


def _develop(frame: _Frame, picture: Path) -> None:
    """Combine the bands of a frame through the sensor, and store them as a spectral image."""
    plan = frame.plan
    paths = [item.path for item in frame.rendered]
    passes = [item.bands for item in frame.rendered]
    development.develop(paths, plan.reduction(frame.depth).weights, passes, picture)
    write_spectral_exr(
        picture.with_name(f"{frame.number:04d}_spectral.exr"),
        band_passes.gather(frame.rendered),
        plan.bands,
        {
            "frame": frame.number,
            "illuminant": plan.illuminant.name,
            "water": "; ".join(dict.fromkeys(water.name for water in plan.waters.layers)),
        },
        plan.radiance_units,
    )


def _record(frame: _Frame, job: Job, facts: dict[str, Any]) -> dict[str, Any]:
    plan, reduction = frame.plan, frame.plan.reduction(frame.depth)
    drawn = plan.cycles_notes if job.engine == "cycles" else ()
    return {
        "frame": frame.number,
        "camera_depth_m": frame.depth,
        "settings": asdict(plan.settings),
        "job": {**asdict(job), "blend": bpy.data.filepath, "camera": facts["camera"]},
        "notes": [*plan.notes, *drawn, *facts["notes"]],
        **plan.record(),
        "development": {
            "description": reduction.description,
            "weights": reduction.weights.tolist(),
        },
        "passes": [
            {
                "file": str(item.path.relative_to(job.out)),
                "bands_nm": [float(plan.bands.centres[i]) for i in item.bands],
                "seconds": item.seconds,
            }
            for item in frame.rendered
        ],
    }


def _fingerprint(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    chosen: settings.SceneSettings,
    job: settings.Job,
) -> dict[str, Any]:
    """Return everything that a band pass depends on."""
    # A real-time pass is developed as it is rendered.
    developed = job.mode == settings.REALTIME
    optics = {k: v for k, v in asdict(chosen).items() if developed or k not in _DEVELOPMENT}
    blend = Path(bpy.data.filepath)
    return {
        "scene_sha256": _sha256(blend) if blend.is_file() else "unsaved",
        "camera": camera.name,
        "resolution": [
            scene.render.resolution_x,
            scene.render.resolution_y,
            scene.render.resolution_percentage,
        ],
        "engine": job.engine,
        "mode": job.mode,
        "froxels": job.froxels,
        "seed": job.seed,
        "denoise": job.denoise,
        **optics,
        **_tables(optics),
    }


def _tables(optics: dict[str, Any]) -> dict[str, str]:
    """Return the content of each file that a setting names."""
    files = {
        name: split_location(value.removeprefix("file:"))[0]
        for name, value in optics.items()
        if isinstance(value, str) and value.startswith("file:")
    }
    return {
        f"the table {path} ({settings.flag(name)})": _sha256(path) for name, path in files.items()
    }


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _claim_folder(job: settings.Job, fingerprint: dict[str, Any]) -> None:
    """Make the output folder ours; on resume, check that its passes fit."""
    path = job.out / _JOB_FILE
    try:
        job.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write to {job.out}: {error.strerror}; choose another --out"
        ) from error
    if job.resume and path.exists():
        try:
            earlier = dict(json.loads(path.read_text()))
        except (OSError, ValueError, TypeError) as error:
            raise InputError(f"{path} is damaged; delete it to render without --resume") from error
        changed = [k for k, v in fingerprint.items() if earlier.get(k) != v]
        if changed:
            raise InputError(
                f"--resume: {job.out} was rendered with other values of {', '.join(changed)}; "
                "use the same ones, or another --out"
            )
    _write_json(path, fingerprint)


def _write_json(path: Path, value: dict[str, Any]) -> None:
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(value, indent=1, default=str) + "\n", encoding="utf-8")
