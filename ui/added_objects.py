"""Buttons that add lamps, clouds, objects and what holds the sun, and give lamps their spectra."""

from __future__ import annotations

import math
from typing import override

import bpy
from mathutils import Euler, Vector

from ..scene import stored_clouds, stored_lamps, stored_settings
from ..scene.water import lamp_rigs, new_clouds
from ..settings.known_words import LAMP_SPECTRA
from ..uw_spectral.clouds.matter import UNITS
from ..uw_spectral.errors import InputError
from .live_updates import refresh
from .reporting import CameraOperator, ReportingOperator

SUN = "Underwater Sun"
"""An empty to grab: where it stands in the sky, there is the sun.

Drivers read its place, so moves, keyframes and constraints of it all count.
"""
_DISTANCE = 12.0  # m
_LIMIT = 89.9  # degrees; as the setting
_EXPRESSIONS = {
    "sun_zenith": f"min(degrees(atan2(sqrt(x*x + y*y), max(z, 0.001))), {_LIMIT})",
    # The light travels away from the sun.
    "sun_azimuth": "degrees(atan2(-y, -x))",
}


class AddLamps(CameraOperator):
    """Hang a torch, strobes or the lights of a vehicle on the camera."""

    bl_idname = "underwater.add_lamps"
    bl_label = "Add Lamps"

    rig: bpy.props.EnumProperty(
        name="Lamps", description="What to add",
        items=[(name, rig.label, "") for name, rig in lamp_rigs.RIGS.items()], default="rov2",
    )  # fmt: skip

    @override
    def run(self, context: bpy.types.Context) -> None:
        lamp_rigs.add_rig(context.scene, self.rig)
        refresh(context.scene)


class AddCloud(ReportingOperator):
    """Add a cloud before the camera: an empty, whose outline is its size."""

    bl_idname = "underwater.add_cloud"
    bl_label = "Add Cloud"

    constituent: bpy.props.EnumProperty(
        name="Cloud of",
        description="What floats in it",
        items=[(name, *stored_clouds.WORDS[name]) for name in UNITS],
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        made = new_clouds.add_blob(context.scene, self.constituent)
        for item in context.selected_objects:
            item.select_set(False)
        made.select_set(True)
        context.view_layer.objects.active = made
        refresh(context.scene)


class AddPlumes(ReportingOperator):
    """Add clouds of bubbles below the largest whitecaps before the camera at this frame. By
    keyframes they follow the waves, and thin out in nine seconds.
    """

    bl_idname = "underwater.add_plumes"
    bl_label = "Add Bubble Plumes"

    count: bpy.props.IntProperty(name="Plumes", description="How many", default=3, min=1, max=8)
    keyed: bpy.props.BoolProperty(
        name="Come and Go", description="Keyframe place and concentration", default=True
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene.water import new_plumes

        chosen = stored_settings.stored_settings(context.scene)
        new_plumes.add_plumes(context.scene, chosen, self.count, keyed=self.keyed)
        refresh(context.scene)


class DistributeObjects(ReportingOperator):
    """Set the objects of a collection on the selected mesh, or on what lies below the place that
    the camera looks at; or let them swim there. The modifier of what is added has all numbers.
    """

    bl_idname = "underwater.distribute"
    bl_label = "Scatter Objects"

    preset: bpy.props.EnumProperty(
        name="As",
        description="How they stand, or swim",
        items=[
            ("corals", "Corals", "In patches, on slopes too"),
            ("rocks", "Rocks", "Strewn, as the ground leans"),
            ("meadow", "Meadow", "Dense and upright, on level ground"),
            ("school", "School of Fish", "They swim a circle, looking along their y"),
        ],
    )
    collection: bpy.props.StringProperty(
        name="Collection", description="Of which objects are picked", options={"SKIP_SAVE"}
    )
    seed: bpy.props.IntProperty(name="Seed", description="Of places, sizes and turns", min=0)

    @override
    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: bpy.types.Context) -> None:
        """Ask for the collection, and say what it is set on."""
        self.layout.prop(self, "preset")
        self.layout.prop_search(self, "collection", bpy.data, "collections")
        self.layout.prop(self, "seed")
        chosen = _selected_mesh(context)
        if self.preset != "school":
            self.layout.label(text=f"On {chosen.name}" if chosen else "On what lies ahead")

    @override
    def run(self, context: bpy.types.Context) -> None:
        from ..scene import distributed_objects

        found, chosen = bpy.data.collections.get(self.collection), _selected_mesh(context)
        distributed_objects.distribute(context.scene, found, self.preset, chosen, Seed=self.seed)
        refresh(context.scene)


def _selected_mesh(context: bpy.types.Context) -> bpy.types.Object | None:
    active = context.object
    return active if active in context.selected_objects and active.type == "MESH" else None


class ChooseSpectrum(ReportingOperator):
    """Give the lamp a measured spectrum: LEDs, halogen, metal halide, xenon."""

    bl_idname = "underwater.choose_spectrum"
    bl_label = "Measured Spectra"

    spectrum: bpy.props.EnumProperty(
        name="Spectrum",
        description="What the lamp emits",
        items=[(name, text, name) for name, text in LAMP_SPECTRA.items()],
    )
    lamp: bpy.props.StringProperty(
        name="Lamp", description="Which lamp, by the name of its data", options={"SKIP_SAVE"}
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        light = bpy.data.lights.get(self.lamp)
        if light is None or not light.is_editable:
            raise InputError(f"there is no lamp {self.lamp!r} that can be changed")
        getattr(light, stored_lamps.PROPERTY).spectrum = self.spectrum


def driven(scene: bpy.types.Scene) -> bool:
    """Whether drivers turn the sun of a scene."""
    data = scene.animation_data
    paths = {f"{stored_settings.PROPERTY}.{name}" for name in _EXPRESSIONS}
    return data is not None and any(d.data_path in paths for d in data.drivers)


class AddSunHandle(ReportingOperator):
    """Add an empty in the sky above the origin; the sun stands where you move it. Delete the
    drivers of zenith and azimuth to set numbers again.
    """

    bl_idname = "underwater.add_sun_handle"
    bl_label = "Grab the Sun"

    @classmethod
    @override
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.is_editable and not driven(context.scene)

    @override
    def run(self, context: bpy.types.Context) -> None:
        scene = context.scene
        group = getattr(scene, stored_settings.PROPERTY)
        handle = bpy.data.objects.new(SUN, None)
        handle.empty_display_type, handle.empty_display_size = "SPHERE", 0.8
        turn = Euler((0.0, -math.radians(group.sun_zenith), math.radians(group.sun_azimuth)))
        handle.location = _DISTANCE * (turn.to_matrix() @ Vector((0.0, 0.0, 1.0)))
        scene.collection.objects.link(handle)
        for name, expression in _EXPRESSIONS.items():
            driver = scene.driver_add(f"{stored_settings.PROPERTY}.{name}").driver
            driver.type, driver.expression = "SCRIPTED", expression
            for axis in "xyz":
                variable = driver.variables.new()
                variable.name, variable.type = axis, "TRANSFORMS"
                target = variable.targets[0]
                target.id, target.transform_type = handle, f"LOC_{axis.upper()}"
                target.transform_space = "WORLD_SPACE"
