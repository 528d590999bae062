"""The water of a pixel in a node tree: its tables and its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.pixel_parts import ChannelPixel
from ..uw_spectral.transfer.sky import UNIFORM, Sky
from ..uw_spectral.transfer.sun_beam import half_angle2
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue
from .realtime_tables import PART, ImageTables, sizes_of
from .realtime_values import FASTEST, INDEX, SKY_LEVEL, SKY_LEVELS, SUN, SUN_IN_AIR, Values
from .shape import Shape, Sources


class PixelWater:
    """The water of a pixel in a tree."""

    def __init__(self, graph: Graph, shape: Shape, sources: Sources) -> None:
        self.graph, self.shape, self.sources = graph, shape, sources
        self.values = Values(graph, sources.values, shape)
        scales = self.values.depth_scale, self.values.lengths
        self._tables = ImageTables(graph, sources.parts[PART], sizes_of(shape), *scales)

    @property
    def sun(self) -> tuple[NodeValue, ...]:
        """Direction the sunlight travels to."""
        return self.values.of(*SUN)

    def along(self, w: Sequence[NodeValue]) -> ChannelWater:
        """Return the water along a ray."""
        s2 = half_angle2(w, self.sun, NODES)
        parts = [part.per_steradian(s2, NODES) for part in self.shape.components]
        return ChannelWater(
            self._tables, self.values.numbers, self.sun, parts, self.shape.layered,
            self.values[FASTEST], NODES,
        )  # fmt: skip

    @property
    def sky(self) -> Sky:
        """The sky, of level 1."""
        for term in self.shape.terms:
            found = term.sky(self)
            if found is not None:
                return found
        if self.shape.sky == UNIFORM:
            return Sky(1.0)
        return Sky(1.0, self.shape.sky, self.values.of(*SUN_IN_AIR))

    def skylight(self, relative: Operand) -> Operand:
        """Return what the channels have of the sky in the air, of its radiance at level 1."""
        if sizes_of(self.shape).skies == 1:
            return relative * self.values[SKY_LEVEL]
        levels, parts = self.values.of(*SKY_LEVELS), self.graph.components(relative)
        red, green, blue = (part * level for part, level in zip(parts, levels, strict=True))
        return red + green + blue

    @property
    def index(self) -> NodeValue | None:
        """Index of the water against air, if it has a surface."""
        return self.values[INDEX] if self.shape.flat else None


def in_group(
    graph: Graph, tree: bpy.types.ShaderNodeTree, inputs: Mapping[str, Operand]
) -> dict[str, NodeValue]:
    """Put a group into a tree; return its outputs."""
    node = graph.node("ShaderNodeGroup", inputs, node_tree=tree)
    return {socket.name: graph.term(socket) for socket in node.outputs}


def pixel_layers(pixel: ChannelPixel) -> dict[str, Operand]:
    """Return the layers of a pixel, by the names of :data:`.layers.LAYERS`."""
    return {
        "I": pixel.total,
        "J": pixel.L_end,
        "D": pixel.direct,
        "B_single": pixel.single_scattering,
        "B_water": pixel.path,
        "F": pixel.forward_scattered,
        "B_lamps": pixel.lamps,
    }


def options(shape: Shape, sources: Sources) -> dict[str, Any]:
    """Return how the graph of a large group is made.

    Large terms together need most of the constants that a shader holds: they have to be few.
    """
    slim = sum(term.large for term in shape.terms) > 1
    return {"part_size": PART_SIZE, "slim": slim, "slim_numbers": slim, "rays": sources.rays}
