"""The light that excites fluorophores, as node groups read it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.pixel_parts import COLOURS
from .group_sockets import VECTOR
from .pixel_term import Pixel, TermPixel
from .realtime_tables import ImageTables, exciting_sizes, new_image
from .realtime_values import OF_LIGHT
from .shape import Shape, TermShape
from .surface_inputs import COVERAGE, FLUORESCENCE

PART = "uw_exciting"
EXCITING = {name: f"exciting {name}" for name in OF_LIGHT}
"""Its numbers, by what they are of the light that is seen."""


@dataclass(frozen=True)
class FluorescenceShape(TermShape):
    """Objects fluoresce by so many fluorophores; names are of their materials."""

    channels = tuple(EXCITING.values())
    surfaces = "UW Fluorescent Object in Water"

    fluorophores: int = 0
    materials: tuple[str, ...] = ()

    @property
    @override
    def emissions(self) -> int:
        return self.fluorophores

    @property
    @override
    def own_inputs(self) -> Mapping[str, str]:
        return {FLUORESCENCE: VECTOR}

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image(exciting_sizes(shape))}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel | None:
        given = pixel.given
        return None if given is None or FLUORESCENCE not in given else _FluorescentPixel(pixel)


class _FluorescentPixel(TermPixel):
    def __init__(self, pixel: Pixel) -> None:
        self._pixel = pixel

    @override
    def excitation(
        self, irradiance: Callable[[ChannelWater, Sequence[int]], Operand]
    ) -> Sequence[Operand]:
        given, shape = self._pixel.given, self._pixel.shape
        assert given is not None, "objects fluoresce"
        E = irradiance(self._exciting(), COLOURS[:1])
        absorbed = given[FLUORESCENCE] * given[COVERAGE]
        count = shape.of(FluorescenceShape).fluorophores
        return self._pixel.graph.components(E * absorbed * (1.0 / math.pi))[:count]

    def _exciting(self) -> ChannelWater:
        """Return the water along the ray in the light that excites, a channel for each."""
        pixel, values = self._pixel, self._pixel.water.values
        image, sizes = pixel.sources.parts[PART], exciting_sizes(pixel.shape)
        tables = ImageTables(pixel.graph, image, sizes, values.depth_scale, values.lengths)
        return replace(pixel.ray, tables=tables, numbers=values.light(EXCITING))
