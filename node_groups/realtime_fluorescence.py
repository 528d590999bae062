"""The light that excites fluorophores, as node groups read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import override

import bpy

from .realtime_tables import exciting_sizes, new_image
from .realtime_values import OF_LIGHT
from .shape import Shape, TermShape

PART = "uw_exciting"
EXCITING = {name: f"exciting {name}" for name in OF_LIGHT}
"""Its numbers, by what they are of the light that is seen."""


@dataclass(frozen=True)
class FluorescenceShape(TermShape):
    """Objects fluoresce by so many fluorophores; names are of their materials."""

    channels = tuple(EXCITING.values())

    fluorophores: int = 0
    materials: tuple[str, ...] = ()

    @property
    @override
    def emissions(self) -> int:
        return self.fluorophores

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image(exciting_sizes(shape))}
