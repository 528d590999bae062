"""Sums of terms along rays past lamps, by places and weights that the lamps' image holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_path import Quadrature, fewer
from ..uw_spectral.mathematics import Operand
from . import lamp_images as layout
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import closest


def _first_of(nodes: int) -> float:
    """Column of the first place of a quadrature."""
    return float(sum(layout.QUADRATURES[: layout.QUADRATURES.index(nodes)]))


@dataclass(frozen=True, eq=False)
class ImageQuadrature:
    """Places and weights of an image; ``virtual`` is how many lamps stand for objects."""

    graph: Graph
    image: bpy.types.Image
    virtual: int

    def integrate(
        self, count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
    ) -> tuple[NodeValue, ...]:
        """Add up terms of the places of a quadrature, as :func:`.gauss_sum` does."""
        return self._integrated(_first_of(count), count, term)

    def nodes_for(self, lamp: Lamp) -> Quadrature:
        """Return what adds up terms along rays past a lamp, as :func:`.nodes_for` does."""
        if not self.virtual:
            return self.integrate

        def integrate(
            count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
        ) -> tuple[NodeValue, ...]:
            few, many = (float(n) for n in (fewer(count), count))
            first = NODES.select(lamp.virtual, _first_of(fewer(count)), _first_of(count))
            return self._integrated(first, NODES.select(lamp.virtual, few, many), term)

        return integrate

    def _integrated(
        self,
        first: NodeValue | float,
        count: NodeValue | int,
        term: Callable[[Operand, Operand], tuple[Operand, ...]],
    ) -> tuple[NodeValue, ...]:
        def of_place(index: NodeValue) -> tuple[NodeValue, ...]:
            place, fraction, _ = self.graph.components(
                closest(self.graph, self.image, index + first, 0.0)
            )
            return term(place, fraction)

        return summed(self.graph, count, of_place)
