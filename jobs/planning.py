"""Plans a job: looks at every frame through every camera, and decides everything once."""

from __future__ import annotations

import functools
import hashlib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..datasets.quantities import LARGEST_SEED
from ..quality.methods import Device
from ..quality.sampling import parts_of
from ..scene import colour_space, contents, scripts, view_transform
from ..scene.as_rendered import as_rendered
from ..scene.engines import cycles_settings, housed, transparent_film
from ..scene.engines.band_engine import Engine
from ..scene.engines.engines import engine_of
from ..scene.marks import require_no_water
from ..scene.materials import own_water
from ..scene.readers import cameras, clouds, lamps, picture_size, stereo
from ..scene.readers.pinhole import require_pinhole
from ..scene.water import metering
from ..scene.water.water_body import SceneReach, WaterExtent, extent_around, reach_of, scene_reach
from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.imaging.layers import parse_layers
from . import job_files, raw_pictures, render_region, staging
from .exposures import developments
from .job import Job
from .manifest import (
    Development,
    Exposed,
    ExternalFile,
    Manifest,
    Output,
    Pass,
    View,
    folders,
)


@dataclass(frozen=True, eq=False)
class _Frame:
    number: int
    plan: RenderPlan
    depths: tuple[float, ...]
    lamplight: tuple[NDArray[np.float64] | None, ...]
    stops: float | None
    eyes: tuple[tuple[float, ...], ...]
    lamps: tuple[Mapping[str, Any], ...]
    clouds: tuple[Mapping[str, Any], ...]
    reach: SceneReach


def plan_job(
    scene: bpy.types.Scene, settings_now: Callable[[], SceneSettings], job: Job
) -> Manifest:
    """Plan a job; the current frame of the scene moves.

    ``settings_now`` returns the settings at the scene's current frame. Raises InputError if the
    scene or the settings cannot be used.
    """
    require_no_water(scene)
    if not bpy.app.background:  # a worker in the background makes it local
        contents.require_local(scene)
    colour_space.require_rec709()
    files = job_files.scene_files()  # those of the stage are its own
    hides = settings_now().hide_own_water
    hidden = tuple(item.name for item, _ in own_water.found(scene)) if hides else ()
    with (
        own_water.hidden(scene, hidden),
        as_rendered(scene),
        stereo.two_eyes(scene),
        staging.staged(scene, job.stage),
    ):
        planned = _plan(scene, settings_now, job, files)
    return replace(planned, output=replace(planned.output, hidden=hidden))


def _plan(
    scene: bpy.types.Scene,
    settings_now: Callable[[], SceneSettings],
    job: Job,
    files: tuple[ExternalFile, ...],
) -> Manifest:
    seen_by = [eye for camera in find_cameras(scene, job) for eye in stereo.eyes_of(scene, camera)]
    engine = engine_of(job.engine, job.mode)
    device = _device(scene, engine, job.device)
    with _ReachNow(scene) as reach_now:
        frames = _frames(scene, seen_by, settings_now, job, reach_now)
    reach = functools.reduce(SceneReach.and_of, (frame.reach for frame in frames))
    extents = {
        extent_around(reach, frame.plan.column, depth)
        for frame in frames
        for depth in (min(frame.depths), max(frame.depths))
    }
    first = frames[0].plan
    view_transform.require_shown(first.settings.tone, first.settings.contrast)
    render = scene.render
    blend = job_files.open_blend()
    output = Output(
        engine=job.engine,
        mode=job.mode,
        device=device,
        resolution=(render.resolution_x, render.resolution_y, render.resolution_percentage),
        seed=job.seed,
        denoise=job.denoise,
        froxels=job.froxels,
        extent=(max(e.half_width for e in extents), max(e.bottom for e in extents)),
        decisions=job.decisions,
        scripts=scripts.scripts_run(),
        scene_name=scene.name,
        region=render_region.region_of(scene),
        crop=render.use_border and render.use_crop_to_border,
        transparent=render.film_transparent
        and job.stage is None
        and not any(
            transparent_film.why_opaque(camera, frame.plan.settings, frame.eyes)
            for frame in frames
            for camera in seen_by
        ),
    )
    picture_size.check_memory(output.size, 3 if engine.method.draws_colours else len(first.bands))
    base = asdict(first.settings)
    developments, views = _views(frames, seen_by)
    return Manifest(
        scene=blend,
        out=job.out,
        scene_sha256=job_files.scene_digest(blend),
        versions=job_files.versions(),
        output=output,
        settings=base,
        changes=_changes(frames),
        frames=tuple(frame.number for frame in frames),
        cameras=folders([camera.name for camera in seen_by]),
        passes=_passes(engine, first, job),
        bands_nm=tuple(first.bands.centres.tolist()),
        widths_nm=tuple(first.bands.widths.tolist()),
        developments=developments,
        views=views,
        files=(*job_files.setting_files(base), *files),
        lamps=_changed((frame.number, frame.lamps) for frame in frames),
        clouds=_changed((frame.number, frame.clouds) for frame in frames),
        exposed=_exposed(frames),
        stage=job.stage,
    )


def find_cameras(scene: bpy.types.Scene, job: Job) -> list[bpy.types.Object]:
    """Return the cameras of a job; raise InputError if there is no such camera."""
    return [cameras.find_camera(scene, name) for name in job.cameras or (job.camera,)]


def extent_of(manifest: Manifest) -> WaterExtent:
    """Return the size of the water of a job."""
    return WaterExtent(*manifest.output.extent)


def _device(scene: bpy.types.Scene, engine: Engine, wanted: Device | None) -> Device:
    if wanted is not None and not engine.method.traced:
        raise InputError(
            f"--device: {engine.method.engine} cannot be told what to render on; leave it out"
        )
    if wanted is None and engine.method.traced:
        return cycles_settings.device_of(scene)
    return wanted or "cpu"


def _frames(
    scene: bpy.types.Scene,
    seen_by: list[bpy.types.Object],
    settings_now: Callable[[], SceneSettings],
    job: Job,
    reach_now: Callable[[], SceneReach],
) -> list[_Frame]:
    """Resolve every frame, so that errors come early."""
    plans: dict[SceneSettings, RenderPlan] = {}
    frames: list[_Frame] = []
    for number in job.frames or (scene.frame_current,):
        scene.frame_set(number)
        chosen = settings_now().in_mode(job.mode)
        if frames:  # optimised bands stay while animated water changes
            chosen = frames[0].plan.fixed_bands(chosen)
        floor = chosen.floor_depth or math.inf
        if parse_layers(chosen.layers):
            for camera in seen_by:
                require_pinhole(camera)
        depths = tuple(cameras.camera_depth(camera, floor) for camera in seen_by)
        if chosen not in plans:
            plans[chosen] = make_plan(chosen)
            if not frames:
                # From here on the bands are listed, for this frame too.
                fixed = plans[chosen].fixed_bands(chosen)
                if fixed != chosen:
                    plans = {fixed: make_plan(fixed)}
                    chosen = fixed
        plan = plans[chosen]
        raw_pictures.require_raw(plan)
        for camera, depth in zip(seen_by, depths, strict=True):
            housed.look_of(scene, camera, plan, depth)
        lit = tuple(lamps.lamplight(scene, camera, plan) for camera in seen_by)
        eyes = tuple(cameras.eye_of(camera) for camera in seen_by)
        stops = metering.metered(scene, seen_by[0], plan, depths[0], lit[0])
        shining, floating = lamps.records(scene), clouds.records(scene)
        clouds.clouds_of(scene, plan.bands.centres)
        reach = reach_now().and_of(reach_of(eyes))
        frames.append(_Frame(number, plan, depths, lit, stops, eyes, shining, floating, reach))
    first = frames[0].plan.column
    for frame in frames:
        if math.isfinite(frame.plan.column.floor_depth) != math.isfinite(first.floor_depth):
            raise InputError(
                f"--floor-depth is 0 (no floor) in some frames only, such as {frame.number} or "
                f"{frames[0].number}; keyframe it between depths above 0"
            )
    return frames


class _ReachNow:
    """How far the objects of a scene reach, computed again where a frame has changed one."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        self._known: SceneReach | None = None

    def __enter__(self) -> Callable[[], SceneReach]:
        # After the frame is set, Blender no longer tells what it has changed.
        bpy.app.handlers.frame_change_post.append(self._look)
        return self._reach

    def __exit__(self, *_: object) -> None:
        bpy.app.handlers.frame_change_post.remove(self._look)

    def _look(self, scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        if scene == self._scene and any(
            isinstance(update.id, bpy.types.Object) and update.id.type not in ("CAMERA", "LIGHT")
            for update in depsgraph.updates
        ):
            self._known = None

    def _reach(self) -> SceneReach:
        self._known = self._known or scene_reach(self._scene)
        return self._known


def _changes(frames: Iterable[_Frame]) -> dict[int, dict[str, object]]:
    """Return the settings of each frame that are not those of the first."""
    found, base = {}, None
    for frame in frames:
        values = vars(frame.plan.settings)
        base = base or values
        other = {name: value for name, value in values.items() if value != base[name]}
        if other:
            found[frame.number] = other
    return found


def _changed(
    frames: Iterable[tuple[int, tuple[Mapping[str, Any], ...]]],
) -> dict[int, tuple[Mapping[str, Any], ...]]:
    """Return the records of each frame that are not those of the frame before."""
    found, before = {}, ()
    for number, now in frames:
        if now != before:
            found[number] = before = now
    return found


def _exposed(frames: Iterable[_Frame]) -> dict[int, Exposed]:
    """Return what each frame is exposed by besides the water, where it is not as before."""
    found, before = {}, Exposed()
    for frame in frames:
        lit = tuple(None if x is None else tuple(x.tolist()) for x in frame.lamplight)
        now = Exposed(frame.stops, lit if any(lit) else ())
        if now != before:
            found[frame.number] = before = now
    return found


def _passes(engine: Engine, plan: RenderPlan, job: Job) -> tuple[Pass, ...]:
    samples, parts = plan.settings.samples, job.parts
    if parts > 1 and not engine.method.traced:
        raise InputError(
            f"--parts: the noise of {engine.method.engine} has no seed; use --engine cycles"
        )
    if plan.settings.noise and engine.method.traced:
        if parts > 1:
            raise InputError("--parts: --noise has parts of its own; leave one of them out")
        parts, fraction = parts_of(samples)
        return _parts(engine, plan, job.seed, parts, fraction)
    if parts > samples:
        raise InputError(
            f"--parts: {parts} parts of {samples} samples; take fewer, or more samples"
        )
    # The same for every part: Cycles, keeping its data, draws other numbers after a change of it.
    return _parts(engine, plan, job.seed, parts, math.ceil(samples / parts))


def _parts(
    engine: Engine, plan: RenderPlan, seed: int, parts: int, samples: int
) -> tuple[Pass, ...]:
    return tuple(
        Pass(bands, part, part_seed(seed, part), samples)
        for bands in engine.passes(plan)
        for part in range(parts)
    )


def part_seed(seed: int, part: int) -> int:
    """Return the seed of a part; that of the job for the first.

    Parts of jobs with neighbouring seeds share none.
    """
    if part == 0:
        return seed
    digest = hashlib.sha256(f"{seed} {part}".encode()).digest()
    return int.from_bytes(digest[:4], "big") % LARGEST_SEED


def _views(
    frames: list[_Frame], seen_by: list[bpy.types.Object]
) -> tuple[tuple[Development, ...], tuple[View, ...]]:
    """Return how each frame is developed; its cameras share the exposure of the first."""
    found: dict[Development, int] = {}
    rows: dict[tuple[str, int], View] = {}
    for frame in frames:
        chosen = developments(frame.plan, frame.depths, frame.lamplight, frame.stops)
        for camera, depth, eye, development in zip(
            seen_by, frame.depths, frame.eyes, chosen, strict=True
        ):
            place = found.setdefault(development, len(found))
            rows[camera.name, frame.number] = View(frame.number, camera.name, depth, place, eye)
    views = [rows[camera.name, frame.number] for camera in seen_by for frame in frames]
    return tuple(found), tuple(views)
