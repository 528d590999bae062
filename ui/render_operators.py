"""Buttons that decide how and render: Auto, pictures, the reference, bundles for farms."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Generator, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, override

import bpy

from ..scene import stored_settings as optics
from ..scene.session import PICTURE
from ..uw_spectral.errors import InputError
from . import migration, panel_job
from .reporting import Described, ReportingOperator

if TYPE_CHECKING:
    from ..jobs.job import Job


_STEP_SECONDS = 0.05


class Auto(ReportingOperator):
    """Look at the scene through its camera, and choose bands, terms, shafts and samples: the
    cheapest that keep the colour error. A stricter error brings back what was left out.
    """

    bl_idname = "underwater.auto"
    bl_label = "Auto"

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..jobs import scene_requirements
        from ..scene.readers import cameras

        scene = context.scene
        panel = getattr(scene, panel_job.PROPERTY)
        earlier = panel_job.before_auto(scene)
        choice = scene_requirements.choose(
            scene,
            cameras.find_camera(scene, None),
            lambda: replace(optics.stored_settings(scene), **earlier),
            panel_job.job(scene),
            target=panel.target_delta_e,
        )
        panel_job.write_choice(scene, earlier, choice)
        for line in choice.lines:
            self.report({"INFO"}, line)


class _RenderOperator(Described, bpy.types.Operator):
    """Renders pass by pass, while the window answers in between, and shows what is finished."""

    bl_options = {"REGISTER"}  # noqa: RUF012 - as Blender wants it

    stopped: str  #: What is left where it was stopped.
    _steps: Generator
    _timer: bpy.types.Timer
    _began: float
    _done: int

    def job(self, scene: bpy.types.Scene) -> Job:
        """Return what is rendered."""
        raise NotImplementedError

    @override
    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            for _ in self._passes(context):
                pass
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    @override
    def invoke(self, context: bpy.types.Context, _: bpy.types.Event) -> set[str]:
        self._steps = self._passes(context)
        self._began, self._done = time.monotonic(), 0
        manager = context.window_manager
        self._timer = manager.event_timer_add(_STEP_SECONDS, window=context.window)
        manager.modal_handler_add(self)
        manager.progress_begin(0, 1)
        context.workspace.status_text_set("Underwater: first pass; Esc stops")
        return {"RUNNING_MODAL"}

    @override
    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "ESC":
            return self._stop(context)
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        from ..jobs.progress import time_left

        try:
            step = next(self._steps)
        except KeyboardInterrupt:  # Esc within a pass
            return self._stop(context)
        except StopIteration:
            self._end(context)
            return {"FINISHED"}
        except InputError as error:
            self._end(context)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.window_manager.progress_update(step.number / step.total)
        self._done += 1
        spent = time.monotonic() - self._began
        left = time_left(spent, self._done, step.total - step.number)
        context.workspace.status_text_set(
            f"Underwater: frame {step.frame}, pass {step.number} of {step.total}; {left}; Esc stops"
        )
        return {"RUNNING_MODAL"}

    @override
    def cancel(self, context: bpy.types.Context) -> None:
        self._end(context)

    def _passes(self, context: bpy.types.Context) -> Generator:
        """Yield each pass that is on disk; the live water makes way meanwhile."""
        from ..jobs import render_job
        from ..scene.engines import world_picture
        from ..scene.viewport import live_scenes
        from ..settings import render_plan

        scene = context.scene
        # Water that cannot be computed could not come back after the render.
        render_plan.plan_of(world_picture.drawn(scene, optics.stored_settings(scene)))
        panel_job.require_folder(scene)
        job = self.job(scene)
        migration.stamp(scene)
        frame = scene.frame_current
        notes: list[str] = []
        with live_scenes.suspended(scene):
            try:
                with contextlib.closing(
                    render_job.render(
                        scene, lambda: optics.stored_settings(scene), job, notes.append
                    )
                ) as steps:
                    for step in steps:
                        if step.picture is not None:
                            name = f"{job.out.name} {step.camera}"
                            if len(job.frames) == 1:  # else one image that goes with the frames
                                name += f" {step.frame:04d}"
                            picture = load_picture(step.picture, name)
                            show_picture(context.window_manager, picture)
                        yield step
            finally:
                scene.frame_set(frame)
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, f"{len(job.frames)} frame(s) in {job.out}")

    def _stop(self, context: bpy.types.Context) -> set[str]:
        self._end(context)
        self.report({"WARNING"}, self.stopped)
        return {"CANCELLED"}

    def _end(self, context: bpy.types.Context) -> None:
        self._steps.close()
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class Render(_RenderOperator):
    """Render into the output folder. Esc stops after the current pass; finished passes stay, and
    Continue goes on with them.
    """

    bl_idname = "underwater.render"
    bl_label = "Render"
    stopped = "Stopped; Continue goes on with the finished passes"

    resume: bpy.props.BoolProperty(
        name="Continue",
        description="Keep the passes that are in the folder already",
        options={"SKIP_SAVE"},
    )

    @override
    def job(self, scene: bpy.types.Scene) -> Job:
        return panel_job.job(scene, resume=self.resume)


class RenderReference(_RenderOperator):
    """Render the current frame with Cycles, band by band, into the folder reference of the output
    folder, and show it. Esc stops after the current pass.
    """

    bl_idname = "underwater.render_reference"
    bl_label = "Render Reference"
    stopped = "Stopped; there is no reference of this frame"

    @override
    def job(self, scene: bpy.types.Scene) -> Job:
        return panel_job.reference_job(scene)


class FarmBundle(ReportingOperator):
    """Plan the render and write it as a folder for a render farm: a job of Open Job Description,
    which AWS Deadline Cloud and openjd run. The file must be saved.
    """

    bl_idname = "underwater.farm_bundle"
    bl_label = "Farm Bundle…"
    bl_options = {"REGISTER"}  # noqa: RUF012 - as Blender wants it

    directory: bpy.props.StringProperty(
        name="Folder",
        description="Folder to create; an earlier bundle in it is replaced",
        subtype="DIR_PATH",
        options={"SKIP_SAVE"},
    )
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})

    @override
    def invoke(self, context: bpy.types.Context, _: bpy.types.Event) -> set[str]:
        blend = Path(bpy.data.filepath)
        if bpy.data.filepath:
            self.directory = str(blend.with_name(f"{blend.stem}_farm"))
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..jobs.farm import farm_bundle
        from ..scene.viewport import live_scenes

        scene = context.scene
        if not self.directory:
            raise InputError("the bundle has no folder; choose one")
        job = panel_job.job(scene)
        farm_bundle.check_saved()
        frame = scene.frame_current
        with live_scenes.suspended(scene):
            try:
                made = farm_bundle.bundle_job(
                    Path(bpy.path.abspath(self.directory)),
                    scene,
                    lambda: optics.stored_settings(scene),
                    job,
                )
            finally:
                scene.frame_set(frame)
        self.report(
            {"INFO"}, f"{len(made.frames)} frame(s) of {made.passes} pass(es) in {self.directory}"
        )


def load_picture(path: Path, name: str) -> bpy.types.Image:
    """Return a developed picture as an image; one that is there already is read again.

    Tone and contrast are in the PNG, so no view transform of the scene may be added. ``name`` says
    what it is of: camera and frame.
    """
    image = next((i for i in bpy.data.images if i.get(PICTURE) == name), None)
    if image is None:
        image = bpy.data.images.load(str(path))
        image[PICTURE] = image.name = name
    else:
        image.filepath = str(path)
        image.reload()
    image.use_view_as_render = False
    return image


def show_picture(window_manager: bpy.types.WindowManager, image: bpy.types.Image) -> None:
    """Show an image in an open Image Editor, or in one that opens as for Blender's own Render."""
    space = picture_editor(window_manager.windows)
    if space is None and window_manager.windows and not bpy.app.background:
        bpy.ops.render.view_show("INVOKE_DEFAULT")
        space = picture_editor(window_manager.windows)
    if space is not None:
        space.image = image


def picture_editor(windows: Iterable[bpy.types.Window]) -> bpy.types.SpaceImageEditor | None:
    """Return an Image Editor in which pictures are looked at; one that shows such rather."""
    found = [
        space
        for window in windows
        for area in window.screen.areas
        if area.type == "IMAGE_EDITOR" and area.ui_type == "IMAGE_EDITOR"
        for space in area.spaces[:1]
        if space.mode == "VIEW" and not space.use_image_pin
    ]
    showing = [space for space in found if _is_picture(space.image)]
    return next(iter(showing or found), None)


def _is_picture(image: bpy.types.Image | None) -> bool:
    return image is not None and (PICTURE in image or image.type == "RENDER_RESULT")
