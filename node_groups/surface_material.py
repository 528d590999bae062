"""The material of a surface, as the inputs of its group tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.closures import BOTH_SIDES
from ..uw_spectral.transfer.facets import Facets
from ..uw_spectral.transfer.pixel_parts import COLOURS, OcclusionFactor
from ..uw_spectral.transfer.rough_mirror import mirrored_by_chance
from .chance import chance
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel
from .realtime_values import REFLECTANCE, Values
from .shape import Shape
from .surface_inputs import (
    BEHIND,
    CLOSED,
    COLOR,
    COLUMN,
    COVERAGE,
    COVERED,
    EMITTED,
    LIT,
    MEASURED,
    MIRROR_ROUGHNESS,
    MIRRORED,
    NORMAL,
)

_DARKEST = 1e-3  # reflectance below which a colour does not tell how an object is lit


@dataclass(frozen=True, eq=False)
class OwnMaterial:
    """What an object reflects, emits and lets through, of inputs of :mod:`.surface_inputs`."""

    graph: Graph
    shape: Shape
    given: Mapping[str, NodeValue]

    def reflected(self) -> tuple[Sequence[Operand], Sequence[Operand]]:
        """Columns of the object's colours, and what it reflects of each."""
        base = self.graph.components(self.given[COLOR])
        if not self.shape.measured:
            return COLOURS, base
        column = self.given[COLUMN]
        known = NODES.less(0.5, column)
        first = NODES.select(known, self.given[COVERAGE], base[0])
        return (column, 1, 2), (first, *((1.0 - known) * part for part in base[1:]))

    def behind(self) -> Operand | None:
        """Fraction of the colour that light from behind shines through, on both sides of a body."""
        if not self.shape.translucent:
            return None
        part, whole = (self._sum(self.given[name]) for name in (BEHIND, COLOR))
        behind = NODES.minimum(part / NODES.maximum(whole, _DARKEST), 1.0)
        return behind * NODES.select(self.given[CLOSED], BOTH_SIDES, 1.0)

    def glow(self) -> Sequence[Operand]:
        """Return the RGB radiance that the object emits."""
        return self.graph.components(self.given[EMITTED]) if self.shape.glows else ()

    def _sum(self, colour: NodeValue) -> Operand:
        x, y, z = self.graph.components(colour)
        return x + y + z

    def lit(self) -> Operand:
        """Colour of the object under the white sun, without what it emits."""
        lit = self.given[LIT]
        return NODES.maximum(lit - self.given[EMITTED], 0.0) if self.shape.glows else lit

    def in_columns(self, colour: NodeValue, reflected: Sequence[Operand]) -> list[Operand]:
        """Return a colour that is part of the object's own in the columns of that."""
        parts = self.graph.components(colour)
        if not self.shape.measured:
            return list(parts)
        known = NODES.less(0.5, self.given[COLUMN])
        own = self.graph.components(self.given[COLOR])
        fraction = (parts[0] + parts[1] + parts[2]) / NODES.maximum(
            own[0] + own[1] + own[2], _DARKEST
        )
        first = NODES.select(known, fraction * reflected[0], parts[0])
        return [first, *((1.0 - known) * part for part in parts[1:])]

    def mirrored_light(self, at: Pixel, occlusion: OcclusionFactor) -> Operand:
        """Radiance that comes to the object along the mirrored view ray, one of many if rough."""
        roughness, normal = self.given[MIRROR_ROUGHNESS], self.graph.components(self.given[NORMAL])
        r, weight = mirrored_by_chance(
            at.w, normal, roughness, chance(self.graph, at.point)[:2], NODES
        )
        ray = at.water.along(r)
        M, single = ray.ahead(at.y, r)
        L = M + single + ray.boundary(at.y, r)
        colour = NODES.maximum(self._sum(self.given[MIRRORED]) / 3.0, _DARKEST)
        facets = Facets(normal, roughness, [colour], [0.0])
        (brighter,) = facets.with_all_light([-x for x in at.w], NODES).even
        return ray.occluded(L, occlusion, at.y) * weight * (brighter / colour)

    def tint(self) -> Operand:
        """Return what channels see through beyond the mean of them, which EEVEE lets through.

        Before the first wall of a body lies what its second has filtered already.
        """
        passing = 1.0 - self.given[COVERED]
        geometry = self.graph.node("ShaderNodeNewGeometry").outputs
        first = self.given[CLOSED] * (1.0 - self.graph.term(geometry["Backfacing"]))
        beyond = passing - (1.0 - self.given[COVERAGE])
        return beyond * NODES.select(first, passing, 1.0)

    def reflectance(self, values: Values) -> Operand:
        """Return what channels see of its colour in white light."""
        base = self.graph.components(self.given[COLOR])
        total: Operand = 0.0
        for part, name in zip(base, REFLECTANCE, strict=True):
            total = part * values[name] + total
        if not self.shape.measured:
            return total
        known = NODES.less(0.5, self.given[COLUMN])
        return NODES.select(known, self.given[MEASURED], total)
