"""The batch render: command line in, pictures, spectra and records out."""

from __future__ import annotations

import argparse
import contextlib
import functools
import hashlib
import json
import math
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import bpy

from ..uw_spectral.errors import DataWarning, InputError
from ..uw_spectral.sensor import list_sensors
from ..uw_spectral.spectral_image import (
    read_exr,
    replacing,
    write_png,
    write_rgb_exr,
    write_spectral_exr,
)
from ..uw_spectral.water import list_waters
from . import band_passes, cameras, development, engines, property_group, settings
from .realtime import has_realtime
from .render_plan import RenderPlan, make_plan
from .water_body import has_water, water_extent

_JOB_FILE = "job.json"
# Settings that only the development reads: bands can be developed again without rendering.
_DEVELOPMENT = {"sensor", "white_balance", "exposure"}


def main(arguments: Sequence[str], *, inside_blender: bool) -> int:
    """Run a batch and report errors in one line each.

    Parameters
    ----------
    arguments : sequence of str
        The command line, without the program's name.
    inside_blender : bool
        Whether Blender has opened the scene already.

    Returns
    -------
    int
        0 if everything was written, 2 if the input cannot be used.
    """
    try:
        with _notes_to_stderr():
            run(settings.parse(arguments), inside_blender=inside_blender)
    except InputError as error:
        print(f"render_bands.py: {error}", file=sys.stderr)
        return 2
    except SystemExit as stop:  # argparse, after --help
        return int(stop.code or 0)
    return 0


def run(options: argparse.Namespace, *, inside_blender: bool) -> None:
    """Render what the options ask for.

    Raises
    ------
    InputError
        If the scene, the settings or the output folder cannot be used.
    """
    if options.list_sensors:
        print("\n".join(list_sensors()))
        return
    if options.list_waters:
        for source, names in list_waters().items():
            print(f"{source}: {', '.join(names)}")
        return
    job = settings.job(options)
    if not hasattr(bpy.types.Scene, property_group.PROPERTY):
        property_group.register()
    _open(job.blend, inside_blender)
    scene = bpy.context.scene
    _render(scene, settings.merge(property_group.stored_settings(scene), options), job)


def _open(blend: Path | None, inside_blender: bool) -> None:
    if inside_blender:
        if blend is not None:
            raise InputError(f"{blend}: inside Blender, name the scene before -P, not after --")
        return
    if blend is None:
        raise InputError("name a scene: python render_bands.py scene.blend OPTIONS")
    if not blend.is_file():
        raise InputError(f"cannot open {blend}: there is no such file")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(blend.resolve()))
    except RuntimeError as error:
        raise InputError(f"cannot open {blend}: {str(error).strip()}") from error


def _render(scene: bpy.types.Scene, chosen: settings.SceneSettings, job: settings.Job) -> None:
    if has_water(scene) or has_realtime(scene):
        raise InputError(
            f"scene {scene.name!r} holds water already; remove it and save, the batch adds its own"
        )
    camera = cameras.find_camera(scene, job.camera)
    frames = job.frames or (scene.frame_current,)
    if job.resolution is not None:
        scene.render.resolution_x, scene.render.resolution_y = job.resolution
        scene.render.resolution_percentage = 100
    floor_depth = chosen.floor_depth or math.inf
    depths = {}
    for frame in frames:
        scene.frame_set(frame)
        depths[frame] = cameras.camera_depth(camera, floor_depth)
    plan = make_plan(chosen)
    _claim_folder(job, _fingerprint(scene, camera, chosen, job))
    with _engine(scene, camera, plan, job, depths) as engine:
        for note in engine.notes:
            print(f"note: {note}")
        record = {
            "settings": asdict(chosen),
            "job": {**asdict(job), "blend": bpy.data.filepath, "camera": camera.name},
            "notes": [*plan.notes, *engine.notes],
            **plan.record(),
        }
        progress = _Progress(len(frames) * len(engine.passes))
        for frame in frames:
            scene.frame_set(frame)
            rendered = band_passes.render_passes(
                engine.frame(depths[frame]),
                engine.passes,
                job.out / "passes" / f"{frame:04d}",
                _size(scene),
                resume=job.resume,
                report=functools.partial(progress.report, frame),
            )
            if job.mode == settings.REALTIME:
                _finish_realtime(plan, rendered, depths[frame], frame, job.out, record)
            else:
                _develop(plan, rendered, depths[frame], frame, job.out, record)
    print(f"done: {len(frames)} frame(s) in {job.out}")


def _engine(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    plan: RenderPlan,
    job: settings.Job,
    depths: dict[int, float],
) -> contextlib.AbstractContextManager[engines.BandEngine]:
    """Choose the engine; its water is as wide as the deepest camera needs."""
    extent = water_extent(scene, plan.column, max(depths.values()))
    if job.engine == "cycles":
        return engines.cycles_bands(scene, camera, plan, extent, seed=job.seed, denoise=job.denoise)
    make = engines.eevee_realtime if job.mode == settings.REALTIME else engines.eevee_bands
    first = next(iter(depths.values()))
    return make(scene, camera, plan, extent, first, shafts=job.shafts)


def _size(scene: bpy.types.Scene) -> tuple[int, int]:
    render = scene.render
    scale = render.resolution_percentage / 100
    return int(render.resolution_x * scale), int(render.resolution_y * scale)


def _develop(
    plan: RenderPlan,
    rendered: list[band_passes.RenderedPass],
    depth: float,
    frame: int,
    out: Path,
    record: dict[str, Any],
) -> None:
    """Write the pictures and the record of a frame of bands; the record comes last."""
    reduction = plan.reduction(depth)
    rgb_path = out / f"{frame:04d}.exr"
    paths, passes = [item.path for item in rendered], [item.bands for item in rendered]
    development.develop(paths, reduction.weights, passes, rgb_path)
    write_png(out / f"{frame:04d}.png", read_exr(rgb_path)[0])
    spectral = {"frame": frame, "illuminant": plan.illuminant.name, "water": plan.water.name}
    write_spectral_exr(
        out / f"{frame:04d}_spectral.exr",
        band_passes.gather(rendered),
        plan.bands,
        spectral,
        plan.radiance_units,
    )
    _write_record(plan, rendered, depth, frame, out, record)


def _finish_realtime(
    plan: RenderPlan,
    rendered: list[band_passes.RenderedPass],
    depth: float,
    frame: int,
    out: Path,
    record: dict[str, Any],
) -> None:
    """Write picture and record of a frame that one pass has developed already."""
    picture = read_exr(rendered[0].path)[0]
    write_rgb_exr(out / f"{frame:04d}.exr", picture)
    write_png(out / f"{frame:04d}.png", picture)
    _write_record(plan, rendered, depth, frame, out, record)


def _write_record(
    plan: RenderPlan,
    rendered: list[band_passes.RenderedPass],
    depth: float,
    frame: int,
    out: Path,
    record: dict[str, Any],
) -> None:
    reduction = plan.reduction(depth)
    frame_record = {
        "frame": frame,
        "camera_depth_m": depth,
        **record,
        "development": {
            "description": reduction.description,
            "weights": reduction.weights.tolist(),
        },
        "passes": [
            {
                "file": str(item.path.relative_to(out)),
                "bands_nm": [float(plan.bands.centres[i]) for i in item.bands],
                "seconds": item.seconds,
            }
            for item in rendered
        ],
    }
    _write_json(out / f"{frame:04d}.json", frame_record)


def _fingerprint(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    chosen: settings.SceneSettings,
    job: settings.Job,
) -> dict[str, Any]:
    """Return everything that a band pass depends on."""
    blend = Path(bpy.data.filepath)
    content = hashlib.sha256(blend.read_bytes()).hexdigest() if blend.is_file() else "unsaved"
    return {
        "scene_sha256": content,
        "camera": camera.name,
        "resolution": [
            scene.render.resolution_x,
            scene.render.resolution_y,
            scene.render.resolution_percentage,
        ],
        "engine": job.engine,
        "mode": job.mode,
        "shafts": job.shafts,
        "seed": job.seed,
        "denoise": job.denoise,
        # A real-time pass is developed as it is rendered.
        **{
            k: v
            for k, v in asdict(chosen).items()
            if job.mode == settings.REALTIME or k not in _DEVELOPMENT
        },
    }


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
            earlier = json.loads(path.read_text())
        except ValueError as error:
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


@contextlib.contextmanager
def _notes_to_stderr() -> Iterator[None]:
    """Print caveats of the data as notes, other warnings as usual."""
    plain = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *rest: Any) -> None:  # noqa: ANN401
        if issubclass(category, DataWarning):
            print(f"note: {message}", file=sys.stderr)
        else:
            plain(message, category, *rest)

    with warnings.catch_warnings():
        warnings.simplefilter("always", DataWarning)
        warnings.showwarning = show
        yield


@dataclass
class _Progress:
    """Prints one line per pass with the time that is left."""

    total: int
    done: int = 0
    rendered: int = 0
    seconds: float = 0.0

    def report(self, frame: int, item: band_passes.RenderedPass) -> None:
        """Count a pass and print where the batch stands."""
        self.done += 1
        took = "kept"
        if item.seconds is not None:
            self.rendered += 1
            self.seconds += item.seconds
            took = f"{item.seconds:.1f} s"
        left = (self.total - self.done) * self.seconds / max(self.rendered, 1)
        print(
            f"frame {frame}: {item.path.name} {took}, pass {self.done} of {self.total}, "
            f"{left:.0f} s left",
            flush=True,
        )
