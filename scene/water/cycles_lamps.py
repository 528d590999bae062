"""Lamps in the water of Cycles."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes, water_lamp
from .. import marks
from ..readers.scene_lamps import SceneLamps
from . import scene_water
from .term import Follower


def followers(lamps: SceneLamps) -> list[Follower]:
    """Make the lamps of a frame, each with the one that it follows."""
    pairs = enumerate(zip(lamps.lamps, lamps.shown, strict=True))
    return [(water_lamp.build(index, lamp, own.light), own) for index, (lamp, own) in pairs]


def let_through(scene: bpy.types.Scene, lamps: SceneLamps) -> None:
    """Let no object keep the light of lamps from others that cast no shadows.

    Without its shadow Cycles would leave out the water on the way too. So it has one, of what is
    in a collection without any surface: the water is not asked.
    """
    followers = zip(marks.followers(scene), lamps.lamps, strict=True)
    unblocked = [item for item, lamp in followers if lamp.unblocked]
    water = marks.collection_of(scene)
    if not unblocked or water is None:
        return
    nothing = bpy.data.collections.new("UW Nothing")
    nothing[marks.MARK] = True
    nothing.objects.link(unblocked[0])
    water.children.link(nothing)
    for item in unblocked:
        item.light_linking.blocker_collection = nothing


def shape(scene: bpy.types.Scene, lamps: SceneLamps) -> dict[str, NDArray[np.float64]]:
    """Give lamps whose cone, profile or size has changed since a frame the new ones.

    Returns their intensities. Those in the air are put where they seem to be: their light goes
    straight through the surface.
    """
    found = zip(marks.followers(scene), lamps.lamps, lamps.shown, strict=True)
    for index, (item, lamp, own) in enumerate(found):
        before = item.data
        if not water_lamp.fits(before, lamp, own.light):
            item.data = water_lamp.build(index, lamp, own.light)
            if marks.MARK in before:
                item.data[marks.MARK] = before[marks.MARK]
            bpy.data.lights.remove(before)
        scene_water.follow(item, own)
        for constraint in item.constraints:
            constraint.mute = lamp.shines_in
        if lamp.shines_in:
            item.location = lamp.position
            scene_water.turn(item, lamp.axis)
            # Rays that are refracted must not find it too; shadow rays bring its light.
            item.visible_transmission = False
    return {attributes.lamp(index): lamp.intensity for index, lamp in enumerate(lamps.lamps)}
