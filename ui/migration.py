"""Brings files of earlier versions to this one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields

import bpy

from ..scene import property_group as optics
from ..scene.settings import SceneSettings
from . import property_group

Step = Callable[[bpy.types.Scene], None]


def _keep_single_water(scene: bpy.types.Scene) -> None:
    """From 0 to 1: a share without a second water meant nothing; now it would be refused."""
    group = getattr(scene, optics.PROPERTY)
    if not group.second_water:
        group.property_unset("second_water_share")


STEPS: tuple[Step, ...] = (_keep_single_water,)
"""``STEPS[v]`` takes a scene from version v to v + 1."""

VERSION = len(STEPS)


def is_used(scene: bpy.types.Scene) -> bool:
    """Whether a scene holds settings of the water."""
    group = getattr(scene, optics.PROPERTY)
    return any(group.is_property_set(setting.name) for setting in fields(SceneSettings))


def stamp(scene: bpy.types.Scene) -> None:
    """Mark a scene as one of this version."""
    getattr(scene, property_group.PROPERTY).version = VERSION


def is_newer(scene: bpy.types.Scene) -> bool:
    """Whether a newer version of the extension has written this scene."""
    return getattr(scene, property_group.PROPERTY).version > VERSION


def migrate(scene: bpy.types.Scene, steps: Sequence[Step] = STEPS) -> None:
    """Apply the steps that a scene has not seen; leave newer and unused scenes alone.

    Parameters
    ----------
    scene : Scene
        The scene; linked ones stay as they are.
    steps : sequence of callable
        ``steps[v]`` takes a scene from version v to v + 1.
    """
    group = getattr(scene, property_group.PROPERTY)
    if not scene.is_editable or group.version >= len(steps) or not is_used(scene):
        return
    for step in steps[group.version :]:
        step(scene)
    group.version = len(steps)
