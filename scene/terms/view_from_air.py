"""Views from above the water, whose rays are bent at its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, override

import bpy

from ...node_groups import realtime_values
from ...node_groups.realtime_air import AirShape
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.transfer.above_water import flattened_sun, light_in_air
from .. import marks
from ..readers.moving_surface import ViewFromAir
from ..water import refraction_displacement, scene_water
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term


@dataclass(frozen=True, eq=False)
class AirTerm(Term):
    """The camera may be above the water."""

    view: ViewFromAir

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        view = frame.from_air()
        return None if view is None else cls(view)

    def seen(self, *, in_air: bool) -> Self:
        """Return the same for rays that all begin in the air, or all in the water."""
        return replace(self, view=replace(self.view, in_air=in_air))

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (AirShape(),)

    @override
    def prepare(self, scene: bpy.types.Scene) -> list[str]:
        refraction_displacement.subdivide(scene, self.view.camera)
        return []

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        view, column = self.view, water.column
        index = column.refractive_index if column.reflects else 1.0
        single = {
            realtime_values.IN_AIR: float(view.in_air),
            realtime_values.RAY_INDEX: index,
            **dict(zip(realtime_values.CAMERA, view.camera, strict=True)),
            **dict(zip(realtime_values.DRAWN_SUN, self._sun(water), strict=True)),
        }
        return in_air(water) | Numbers({}, single)

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        for item in marks.objects(scene):
            if marks.FLOOR_DEPTH in item:  # its faces are fine in its middle
                item.location.x, item.location.y = self.view.camera[:2]
            if item.get(marks.IS_SUN):
                scene_water.turn(item, self._sun(water))

    def _sun(self, water: RealtimeWater) -> list[float]:
        """Direction of the sun as it is drawn."""
        column, view = water.column, self.view
        sun = column.sun_direction.tolist()
        if not view.in_air:
            return sun
        index = column.refractive_index if column.reflects else 1.0
        return flattened_sun(sun, view.towards, index).tolist()


def in_air(water: RealtimeWater) -> Numbers:
    """Return the numbers of the light in the air."""
    light, channels = light_in_air(water.column, water.field), water.channels
    single = {
        realtime_values.MIRRORED_FRACTION: float(light.mirrored),
        realtime_values.MIRRORED_SUN: float(light.sun_mirrored),
    }
    # Sun and sky alone and on colours, and light that colours emit.
    found = {
        realtime_values.SUN_LEVEL: channels.project(light.sun),
        realtime_values.SKY_LEVEL: channels.project(light.level),
    }
    for names, columns in (
        (realtime_values.SUN_ABOVE, channels.project_colours(light.sun)),
        (realtime_values.SKY_ABOVE, channels.project_colours(light.sky)),
        (realtime_values.WATER_ABOVE, channels.project_colours(light.leaving)),
        (realtime_values.GLOW_ABOVE, channels.project(channels.emission.T).T),
    ):
        found |= dict(zip(names, columns.T, strict=True))
    return Numbers(found, single)
