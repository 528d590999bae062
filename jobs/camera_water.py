"""The water of a camera's passes: put into the scene when the first of them is rendered."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ..scene import contents
from ..scene.engines import housed, transparent_film
from ..scene.engines.band_engine import BandEngine, Opening, RenderPass
from ..scene.engines.engines import engine_of
from ..scene.readers import cameras, unusable_places
from ..scene.readers.own_seabed import floor_note
from ..scene.readers.surroundings import has_objects
from ..scene.unsupported import unsupported_of_camera
from ..scene.water.occlusion import Cache
from ..scene.water.water_body import WaterExtent
from ..uw_spectral.errors import InputError
from . import band_passes, render_region
from .frame_plans import FramePlans
from .manifest import Manifest
from .tasks import Rendered, Task


@dataclass(frozen=True)
class SceneJob:
    """What passes are of; ``said`` are the notes of its scene."""

    scene: bpy.types.Scene
    manifest: Manifest
    plans: FramePlans
    report_note: Callable[[str], None]
    said: tuple[str, ...]


class CameraWater:
    """The water as a camera sees it, opened anew where the number of lamps changes."""

    def __init__(self, job: SceneJob, camera: str, stack: contextlib.ExitStack) -> None:
        self._job, self._camera, self._stack = job, camera, stack
        self._engine: BandEngine | None = None
        self._lamps = 0
        self._notes: tuple[str, ...] = ()
        self._frame: tuple[int, RenderPass] | None = None

    def render(self, task: Task) -> Rendered:
        """Render a pass into its file."""
        scene, manifest, view = self._job.scene, self._job.manifest, task.view
        item = manifest.passes[task.number]
        path = manifest.pass_path(view, task.number)
        engine = self._opened(len(manifest.lamps_of(view.frame)))
        if self._frame is None or self._frame[0] != view.frame:
            scene.frame_set(view.frame)
            plan = self._job.plans.of(view.frame)
            self._frame = view.frame, engine.frame(plan, view.depth, manifest.weights(view))
        engine.draw(item.seed, item.samples)
        key, draw = manifest.key(view, task.number), self._frame[1]
        if manifest.output.transparent and task.number == 0:
            draw = transparent_film.with_alpha(draw, scene)
        seconds = band_passes.render_pass(draw, item.bands, path, key, self._notes)
        return Rendered(task, band_passes.RenderedPass(path, item.bands, seconds), self._notes)

    def _opened(self, count: int) -> BandEngine:
        """Return the engine as it is at the first frame of the job with a number of lamps.

        Whatever is rendered of it: nodes are there for as many, and instances come and go.
        """
        if self._engine is not None and self._lamps == count:
            return self._engine
        self._stack.close()
        self._frame, self._lamps = None, count
        scene, manifest = self._job.scene, self._job.manifest
        output = manifest.output
        of_camera = [view for view in manifest.views if view.camera == self._camera]
        first = next(x for x in of_camera if len(manifest.lamps_of(x.frame)) == count)
        camera = cameras.find_camera(scene, self._camera)
        self._stack.enter_context(
            render_region.rendered_region(scene, output.resolution, output.region)
        )
        self._stack.enter_context(contents.drawn_by(scene, output.engine.upper()))
        scene.frame_set(first.frame)
        opening = Opening(
            plan=self._job.plans.of(first.frame),
            extent=WaterExtent(*output.extent),
            depth=first.depth,
            weights=manifest.weights(first),
            seed=output.seed,
            guides=output.denoise,
            froxels=output.froxels,
            device=output.device,
            eyes=tuple(view.eye for view in of_camera if view.eye),
            cache=Cache(of_job=True),
        )
        said = (*self._job.said, *_notes_of_camera(scene, camera, opening, manifest))
        chosen = engine_of(output.engine, output.mode)
        engine = self._stack.enter_context(housed.opened(chosen, scene, camera, opening))
        if engine.passes != [item.bands for item in manifest.passes if item.part == 0]:
            raise InputError(
                "the passes of the manifest are not those of its settings; write it again with "
                "--plan"
            )
        known, self._notes = self._notes, tuple(note for note in (*said, *engine.notes) if note)
        for note in dict.fromkeys(self._notes):
            if note not in known:
                self._job.report_note(note)
        self._engine = engine
        return engine


def _notes_of_camera(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening, manifest: Manifest
) -> tuple[str, ...]:
    """Return what to know of a camera at the first frame of a job, before the water is there."""
    plan, eyes, ground = opening.plan, opening.eyes, None
    if math.isfinite(plan.column.floor_depth) and has_objects(scene) and opening.cache is not None:
        ground = opening.cache.look(scene, camera, plan.column, eyes).ground
    opaque = not manifest.output.transparent
    said = (
        *unsupported_of_camera(scene, camera, traced=manifest.method.traced),
        transparent_film.note(scene, camera, plan.settings, eyes) if opaque else "",
        floor_note(plan, ground),
        *unusable_places.notes(),
    )
    return tuple(filter(None, said))
