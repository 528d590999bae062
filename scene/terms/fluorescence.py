"""Objects that fluoresce: light of the water excites other light."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_fluorescence, realtime_tables
from ...node_groups.realtime_values import Numbers
from ...node_groups.shape import TermShape
from ...uw_spectral.spectra.bands import Bands
from .. import contents, marks
from ..materials import surface_description
from ..materials.fluorescence import FluorescentObjects, fluorescent_objects, unseen
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term


@dataclass(frozen=True, eq=False)
class FluorescenceTerm(Term):
    """What fluoresces in a frame."""

    objects: FluorescentObjects
    bands: Bands

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        found = fluorescent_objects(contents.materials(frame.scene))
        return cls(found, frame.plan.bands) if found.fluorophores else None

    @classmethod
    @override
    def add_to_cycles(cls, frame: SceneFrame) -> list[str]:
        return unseen(contents.materials(frame.scene), "Cycles")

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        count, names = len(self.objects.fluorophores), tuple(self.objects.materials)
        return (realtime_fluorescence.FluorescenceShape(count, names),)

    @override
    def projection(self) -> Mapping[str, Any]:
        return {"emissions": self.objects.emissions_in(self.bands)}

    @override
    def excitation(self, bands: Bands) -> NDArray[np.float64]:
        return self.objects.excitation_in(bands)

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        light, named = water.exciting.numbers, realtime_fluorescence.EXCITING
        return Numbers({name: getattr(light, key) for key, name in named.items()})

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        realtime_tables.write_light(marks.part(scene, realtime_fluorescence.PART), water.exciting)
        known = {m.name: m for m in contents.materials(scene) if m.is_editable}
        for name, absorptance in self.objects.materials.items():
            if name in known:
                surface_description.write_fluorescence(known[name], absorptance)
