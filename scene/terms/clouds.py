"""Clouds in the water: numbers and grids that the shaders of EEVEE read, volumes of Cycles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import cloud_table
from ...node_groups.cloud_term import CloudShape
from ...node_groups.shape import TermShape
from ...uw_spectral.clouds.cloud_numbers import CloudNumbers
from ...uw_spectral.clouds.solved_cloud import Cloud, cloud_numbers, lamplight_on
from .. import marks
from ..readers.clouds import clouds_of, grids_of
from ..readers.scene_lamps import SceneLamps
from ..water import cloud_volumes
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term
from .lamps import LampTerm


@dataclass(frozen=True, eq=False)
class CloudTerm(Term):
    """The clouds of a frame, and how far each is from the camera, m."""

    blobs: tuple[tuple[Cloud, float], ...] = ()
    grids: tuple[tuple[Cloud, float], ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self:
        found = clouds_of(frame.scene, frame.plan.bands.centres)
        if not found.objects:
            return cls()
        grids, empty = frame.cache.grids.of(frame.scene, found.grids, unchanged=frame.unchanged)
        notes = (*found.unseen_by_eevee(shafts=frame.plan.draws_shafts), *empty)
        blobs, grids = (
            tuple((cloud, math.dist(cloud.blob.middle, frame.eye.place)) for cloud in some)
            for some in (found.blobs, grids)
        )
        return cls(blobs, grids, notes)

    @classmethod
    @override
    def add_to_cycles(cls, frame: SceneFrame) -> list[str]:
        return cloud_volumes.add_clouds(frame.scene, frame.plan)

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        return cloud_volumes.values(frame.scene, frame.plan)

    @property
    @override
    def floating(self) -> float:
        sizes = [cloud.blob.size for cloud, _ in (*self.blobs, *self.grids)]
        return float(np.mean(sizes)) if sizes else 0.0

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        blobs, grids = (
            tuple(cloud.matter.phase for cloud, _ in some) for some in (self.blobs, self.grids)
        )
        return (CloudShape(blobs, grids),) if blobs or grids else ()

    @override
    def prepare(self, scene: bpy.types.Scene) -> list[str]:
        notes = [*self.notes, *cloud_volumes.leave_out(scene)]
        if self.grids:
            notes += [said for said in map(cloud_volumes.clear, grids_of(scene)) if said]
        return notes

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        if self.blobs:
            image = marks.part(scene, cloud_table.PART)
            cloud_table.write_clouds(image, self.numbers_of(self.blobs, water))
        if self.grids:
            grids = self.numbers_of(self.grids, water)
            of_lamps = marks.part(scene, cloud_table.GRID_LAMPS)
            cloud_table.write_grids(marks.part(scene, cloud_table.GRIDS), grids)
            if of_lamps is not None:
                cloud_table.write_lamps(of_lamps, grids)

    def numbers_of(
        self, clouds: Sequence[tuple[Cloud, float]], water: RealtimeWater
    ) -> list[CloudNumbers]:
        """Return the numbers of some of the clouds."""
        shining = water.term(LampTerm) or LampTerm(SceneLamps())
        lamps, found = shining.scene.lamps, []
        phases = cloud_table.kinds(water.shape.of(CloudShape).all)
        for cloud, away in clouds:
            lit = None
            if shining.scene.around is not None:
                lit = lamplight_on(cloud, lamps, shining.scene.around)
            numbers = cloud_numbers(cloud, water.field, water.channels, away, lit, lamps)
            found.append(replace(numbers, kind=float(phases.index(cloud.matter.phase))))
        return found
