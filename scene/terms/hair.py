"""Hair, whose threads keep the light of the water from one another."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self, override

import bpy

from ...node_groups import hair
from ...node_groups.shape import TermShape
from .. import contents
from ..materials.wet_trees import surface_node
from ..readers.threads import hair_of, material_of
from ..rendered import ever_rendered
from ..water.frame_water import RealtimeWater
from ..water.term import SceneFrame, Term


@dataclass(frozen=True)
class HairTerm(Term):
    """There is hair in the scene, at this frame or another."""

    @classmethod
    @override
    def read(cls, frame: SceneFrame) -> Self | None:
        return cls() if any(True for _ in _of_hair(frame.scene)) else None

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (hair.HairShape(),)

    @override
    def write(self, scene: bpy.types.Scene, water: RealtimeWater) -> None:
        for material in dict.fromkeys(_of_hair(scene)):
            surface = surface_node(material.node_tree) if material.is_editable else None
            if surface is not None and hair.HIDDEN in surface.inputs:
                hair.hide(surface)


def _of_hair(scene: bpy.types.Scene) -> Iterator[bpy.types.Material]:
    """Yield the materials of hair, of curves and of particles."""
    for item in contents.objects(scene, ever_rendered(scene)):
        found = [material_of(item, x.settings.material - 1) for x in hair_of(item)]
        if item.type == "CURVES":
            found += [slot.material for slot in item.material_slots]
        yield from filter(None, found)
