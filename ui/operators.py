"""What the buttons do, with undo; each is a thin call of what a script would call."""

from __future__ import annotations

from typing import override

import bpy

from ..scene.session import is_live
from . import added_objects, example_scenes, live_updates, migration, panel_job, preferences
from .dropped_files import OpenSensor, OpenWater
from .render_operators import Auto, FarmBundle, Render, RenderReference
from .reporting import CameraOperator, ReportingOperator
from .sections import ResetSection

_DEFAULT_DEPTH = 5.0
_START_DEPTH = 3.0


class AddWater(ReportingOperator):
    """Fill the scene with water. Its surface is z = 0; sun and sky take the place of lamps and
    world until the water is removed.
    """

    bl_idname = "underwater.add_water"
    bl_label = "Add Water"

    start: bpy.props.BoolProperty(
        name="Start settings",
        description="In a scene without settings of the water: waves, a floor under its objects, "
        "colours balanced at the camera's depth, exposure by the picture",
        default=True,
    )
    submerge: bpy.props.BoolProperty(
        name="Lower the scene",
        description="With the start settings: a scene that stands above the water is lowered "
        "into it, and its lamps are left to the air",
        default=True,
    )
    depth: bpy.props.FloatProperty(
        name="Camera depth", description="Depth of the camera in a scene that is lowered",
        default=_START_DEPTH, min=0.01, soft_max=50.0, subtype="DISTANCE",
    )  # fmt: skip

    @classmethod
    @override
    def poll(cls, context: bpy.types.Context) -> bool:
        return not is_live(context.scene)

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import first_settings, live, problems

        first = self.start and not migration.is_used(context.scene)
        if first:
            context.view_layer.update()
            self.tell(first_settings.start(context.scene, self.depth if self.submerge else None))
            chosen, panel = preferences.stored(), getattr(context.scene, panel_job.PROPERTY)
            if chosen is not None:
                panel.output, panel.quality = chosen.folder, chosen.quality
        self.tell(live.add(context.scene))
        migration.stamp(context.scene)
        problem = problems.problem(context.scene)
        if problem:
            self.report({"WARNING"}, problem)
        elif first:
            _show_water(context)


def _show_water(context: bpy.types.Context) -> None:
    """Let the viewport of the context show the water as the camera sees it."""
    space = context.space_data
    if not isinstance(space, bpy.types.SpaceView3D):
        return
    space.shading.type = "RENDERED"
    if context.scene.camera is not None and space.region_3d is not None:
        space.region_3d.view_perspective = "CAMERA"


class AddExample(ReportingOperator):
    """Build an example as a scene of its own in this file, and fill it with water."""

    bl_idname = "underwater.add_example"
    bl_label = "Add Example"

    example: bpy.props.EnumProperty(
        name="Example",
        description="What to build",
        items=[(name, e.label, e.text) for name, e in example_scenes.EXAMPLES.items()],
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import live

        scene = example_scenes.build(context, self.example)
        with context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            self.tell(live.add(scene))
        migration.stamp(scene)
        _show_water(context)


class _LiveOperator(ReportingOperator):
    """Needs water in the scene."""

    @classmethod
    @override
    def poll(cls, context: bpy.types.Context) -> bool:
        return is_live(context.scene)


class RemoveWater(_LiveOperator):
    """Take the water out: lamps, world, materials and render settings are as before. The water's
    settings stay in the file.
    """

    bl_idname = "underwater.remove_water"
    bl_label = "Remove Water"

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import live_scenes

        self.tell(live_scenes.take_out(context.scene))


class Show(_LiveOperator):
    """Look through the camera, with the viewport set to Rendered."""

    bl_idname = "underwater.show"
    bl_label = "Show the Water"
    bl_options = {"REGISTER"}  # noqa: RUF012 - as Blender wants it

    @override
    def run(self, context: bpy.types.Context) -> None:
        _show_water(context)


class Rebuild(_LiveOperator):
    """Build the water anew; data files are read again."""

    bl_idname = "underwater.rebuild"
    bl_label = "Refresh Water"

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import live_scenes

        self.tell(live_scenes.rebuild(context.scene))


class Submerge(CameraOperator):
    """Lower everything in the scene, and an added floor, until the camera is at a depth. Keyframes
    of locations are left alone: only delta locations change.
    """

    bl_idname = "underwater.submerge"
    bl_label = "Submerge Scene"

    depth: bpy.props.FloatProperty(
        name="Camera depth", description="Depth of the camera afterwards", default=_DEFAULT_DEPTH,
        min=0.01, soft_max=50.0, subtype="DISTANCE",
    )  # fmt: skip

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.viewport import submerging

        context.view_layer.update()
        above = context.scene.camera.matrix_world.translation.z
        with live_updates.transaction():
            self.tell(submerging.lower(context.scene, self.depth + above))
            context.view_layer.update()


CLASSES = (
    AddWater,
    AddExample,
    RemoveWater,
    Show,
    Rebuild,
    Submerge,
    added_objects.AddLamps,
    added_objects.AddCloud,
    added_objects.AddPlumes,
    added_objects.DistributeObjects,
    added_objects.ChooseSpectrum,
    Auto,
    Render,
    RenderReference,
    FarmBundle,
    OpenWater,
    OpenSensor,
    ResetSection,
    added_objects.AddSunHandle,
    preferences.AddAssets,
    preferences.SaveStartFile,
)
"""All buttons that have help, in its order."""

register, unregister = bpy.utils.register_classes_factory(CLASSES)
