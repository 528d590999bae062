"""A sky that is a picture: what is seen of it through the surface, and its light in Cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes, realtime_sky, sky_world
from ...node_groups.realtime_sky import SkyShape
from ...node_groups.realtime_values import SKY_LEVELS, Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.transfer.sky_picture import SkyPicture
from .. import marks
from ..water.frame_water import RealtimeWater
from ..water.pass_values import gain_in_water
from ..water.term import SceneFrame, Term


@dataclass(frozen=True, eq=False)
class SkyTerm(Term):
    """The picture, its sun left out."""

    picture: SkyPicture

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        picture = frame.plan.column.sky_picture
        return None if picture is None else cls(picture)

    @classmethod
    @override
    def add_to_cycles(cls, frame: SceneFrame) -> list[str]:
        if frame.plan.column.sky_picture is not None:
            sky_world.show(frame.scene.world, realtime_sky.new_image())
        return []

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        column = frame.plan.column
        if column.sky_picture is None:
            return {}
        # Cycles keeps the pixels of an image that it has drawn.
        image = sky_world.image_of(frame.scene.world)
        realtime_sky.write(image, column.sky_picture, fresh=True)
        levels = np.asarray(column.skylight.level).T * gain_in_water(column)
        return dict(zip(attributes.SKY_BASIS, levels, strict=True))

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (SkyShape(),)

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        levels = water.channels.project(np.asarray(water.column.skylight.level).T)
        return Numbers(dict(zip(SKY_LEVELS, levels, strict=True)))

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        realtime_sky.write(marks.part(scene, realtime_sky.PART), self.picture)
