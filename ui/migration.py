"""Brings files of earlier versions to this one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields

import bpy

from ..scene import stored_settings as optics
from ..scene.animation import curves_of
from ..settings.scene_settings import SceneSettings
from ..settings.setting import FORMER_NAMES
from . import panel_job

Step = Callable[[bpy.types.Scene], None]


def _keep_single_water(scene: bpy.types.Scene) -> None:
    """From 0 to 1: a fraction without a second water meant nothing; now it would be refused."""
    group = getattr(scene, optics.PROPERTY)
    if not group.second_water:
        group.property_unset("second_water_fraction")
        group.bl_system_properties_get().pop("second_water_share", None)


def _plain_switches(scene: bpy.types.Scene) -> None:
    """From 1 to 2: switches are booleans of the scene; turbidity is called scattering factor."""
    group, panel = getattr(scene, optics.PROPERTY), getattr(scene, panel_job.PROPERTY)
    stored, of_panel = group.bl_system_properties_get(), panel.bl_system_properties_get()
    if "diffuse_shadows" in stored:  # it was the words "on" and "off", by their places
        group.diffuse_shadows = stored["diffuse_shadows"] == 0
    if "shafts" in of_panel:
        group.shafts = bool(of_panel["shafts"])
        del of_panel["shafts"]
    _rename(scene, "turbidity", "scattering_factor")


def _present_names(scene: bpy.types.Scene) -> None:
    """From 2 to 3: settings have the field's names."""
    for was, name in FORMER_NAMES.items():
        _rename(scene, was, name)


def _rename(scene: bpy.types.Scene, was: str, name: str) -> None:
    """Give a setting, and what animates it, another name."""
    group = getattr(scene, optics.PROPERTY)
    stored = group.bl_system_properties_get()
    if was in stored:
        setattr(group, name, type(getattr(group, name))(stored[was]))
        del stored[was]
    for curve in _curves(scene):
        if curve.data_path == f"{optics.PROPERTY}.{was}":
            curve.data_path = f"{optics.PROPERTY}.{name}"


def _curves(scene: bpy.types.Scene) -> Iterator[bpy.types.FCurve]:
    """Animation curves and drivers of a scene."""
    data = scene.animation_data
    if data is None:
        return
    yield from data.drivers
    if data.action is not None:
        yield from curves_of(data.action)


STEPS: tuple[Step, ...] = (_keep_single_water, _plain_switches, _present_names)
"""``STEPS[v]`` takes a scene from version v to v + 1."""

VERSION = len(STEPS)


def is_used(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds settings of the water."""
    group = getattr(scene, optics.PROPERTY)
    stored = group.bl_system_properties_get() or {}
    return any(group.is_property_set(x.name) for x in fields(SceneSettings)) or any(
        name in stored for name in FORMER_NAMES
    )


def stamp(scene: bpy.types.Scene) -> None:
    """Mark a scene as one of this version."""
    getattr(scene, panel_job.PROPERTY).version = VERSION


def is_newer(scene: bpy.types.Scene) -> bool:
    """Whether a newer version of the extension has written this scene."""
    return getattr(scene, panel_job.PROPERTY).version > VERSION


def migrate(scene: bpy.types.Scene, steps: Sequence[Step] = STEPS) -> None:
    """Apply the steps that a scene has not seen; leave newer, unused and linked scenes alone.

    ``steps[v]`` takes a scene from version v to v + 1.
    """
    group = getattr(scene, panel_job.PROPERTY)
    if not scene.is_editable or group.version >= len(steps) or not is_used(scene):
        return
    for step in steps[group.version :]:
        step(scene)
    group.version = len(steps)
