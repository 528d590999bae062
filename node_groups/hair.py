"""Hair in the water: threads keep the light from all sides from one another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.closures import among_hair
from ..uw_spectral.transfer.pixel_parts import OcclusionFactor
from .group_sockets import FLOAT
from .node_mathematics import NODES, Graph
from .pixel_term import Pixel, TermPixel
from .shape import TermShape
from .surface_inputs import COLOR

HIDDEN = "Hidden by Hair"
"""Input of surfaces: fraction of the light from all sides."""


class HairShape(TermShape):
    """There is hair."""

    @property
    @override
    def inputs(self) -> Mapping[str, str]:
        return {HIDDEN: FLOAT}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel | None:
        return None if pixel.given is None else _HairPixel(1.0 - pixel.given[HIDDEN])


@dataclass(frozen=True, eq=False)
class _HairPixel(TermPixel):
    open: Operand

    @override
    def occluded(self, factor: OcclusionFactor, *, behind: bool = False) -> OcclusionFactor:
        fractions = [part * self.open for part in factor.fractions]
        return replace(factor, mean=factor.mean * self.open, fractions=fractions)


def hide(surface: bpy.types.Node) -> None:
    """Tell the surface group of a material what threads hide where it is that of one."""
    hidden = surface.inputs[HIDDEN]
    if hidden.is_linked:
        return
    graph = Graph(surface.id_data)
    hair = graph.node("ShaderNodeHairInfo").outputs
    seen = graph.node("ShaderNodeAmbientOcclusion", {"Distance": hair["Length"]})
    colour: Operand = surface.inputs[COLOR].default_value[:3]
    if surface.inputs[COLOR].is_linked:
        colour = graph.components(graph.term(surface.inputs[COLOR].links[0].from_socket))
    open_to = among_hair(graph.term(seen.outputs["AO"]), sum(colour) / 3.0, NODES)
    graph.assign((1.0 - open_to) * graph.term(hair["Is Strand"]), hidden)
