"""Node group that turns a lit surface into its picture through the water.

It replaces the shader of a user's material: lit colour and base colour go in,
a shader that emits what the channels see comes out. All bands in one pass.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import bpy

from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.channel_tables import ON_PATCH
from ..uw_spectral.transfer.closures import BOTH_SIDES
from ..uw_spectral.transfer.facets import Facets
from ..uw_spectral.transfer.pixel_parts import (
    COLOURS,
    NO_OCCLUSION,
    UNOCCLUDED,
    ChannelPixel,
    OcclusionFactor,
    OcclusionOnPath,
    SeenObject,
    SurfaceMaterial,
)
from ..uw_spectral.transfer.rough_mirror import mirrored_by_chance
from . import realtime_layers
from .chance import chance
from .group_sockets import COLOUR, FLOAT, SHADER, VECTOR, OpenGroup, Socket
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, terms_of
from .realtime_shadows import sun_visibility
from .realtime_values import REFLECTANCE, SHAFT_END, SUN_GAIN, Values
from .realtime_water import PixelWater, options, pixel_layers
from .shape import Shape, Sources, TermShape
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
from .uplift import COLUMNS, FRACTION

NAME, NATIVE = "UW Surface in Water", "UW Water before Surface"
_DARKEST = 1e-3  # reflectance below which a colour does not tell how an object is lit


def build(
    shape: Shape, sources: Sources, *, keeps: bool = False, own: TermShape | None = None
) -> bpy.types.ShaderNodeTree:
    """Build the group.

    With ``keeps`` the closures of the material stay: instead of the input ``Lit`` there are
    outputs, as of :mod:`.uplift`: the colours that the sun lights are seen by the channels in
    these columns, and all closures with this fraction.

    Inputs are those of :mod:`.surface_inputs` that the shape asks for, and what its terms add;
    with ``own`` those that surfaces have that one of these alone concerns.
    """
    inputs: dict[str, Socket | str] = {} if keeps else {LIT: COLOUR}
    for wanted, sockets in (
        (True, {COLOR: COLOUR}),
        (shape.glows, {EMITTED: COLOUR}),
        (True, {COVERAGE: Socket(FLOAT, value=1.0), NORMAL: VECTOR}),
        (shape.mirrors, {MIRRORED: COLOUR, MIRROR_ROUGHNESS: FLOAT}),
        (shape.translucent, {BEHIND: COLOUR}),
        (shape.filters, {COVERED: Socket(VECTOR, value=(1.0, 1.0, 1.0))}),
        (shape.translucent or shape.filters, {CLOSED: FLOAT}),
        (shape.measured, {COLUMN: FLOAT, MEASURED: VECTOR}),
        (own is not None, {} if own is None else own.own_inputs),
        *((True, term.inputs) for term in shape.terms),
    ):
        inputs |= sockets if wanted else {}
    name = NATIVE if keeps else NAME
    if own is not None:
        name = own.surfaces
    group = OpenGroup(name, inputs, {"Shader": SHADER}, **options(shape, sources))
    graph = group.graph
    surface = _Surface(graph, shape, sources, group.given)
    emission = graph.node("ShaderNodeEmission")
    graph.assign(surface.seen(), emission.inputs["Color"])
    realtime_layers.write(graph, shape.layers, surface.layers(), group.given[COVERAGE])
    seen = {"Shader": graph.term(emission.outputs[0])}
    return group.finished(seen | surface.sunlit() if keeps else seen)


class _Surface:
    """The pixel of a surface under construction."""

    def __init__(
        self, graph: Graph, shape: Shape, sources: Sources, given: dict[str, NodeValue]
    ) -> None:
        self._graph, self._shape, self._given = graph, shape, given
        self._water = PixelWater(graph, shape, sources)
        self._values = self._water.values
        self._normal = graph.components(given[NORMAL])
        self._at = at = Pixel.of_surface(self._water, given)
        self._w, self._P, self._y_o, self._y = at.w, at.P, at.y_o, at.y
        self._own = _OwnMaterial(graph, shape, given)
        self._ray, self._terms = at.ray, terms_of(at)
        self._pattern = self._terms.first(lambda term: term.pattern)
        self._dry = self._terms.first(lambda term: None if term.dry is None else term)
        self._around = self._terms.first(lambda term: term.around)
        self._material = self._made_material()
        self._pixel = self._made_pixel()

    def seen(self) -> Operand:
        seen = self._terms.seen(self._pixel.total, self._given[COVERAGE])
        if self._dry is not None:
            lit: Sequence[Operand] = (0.0, 0.0, 0.0)
            if LIT in self._given:
                lit = self._graph.components(self._own.lit() * self._values[SUN_GAIN])
            dry = self._dry.in_air(lit, self._material.emitted)
            seen = NODES.select(self._dry.dry, dry, seen)
        if self._shape.shafts:
            seen = seen - NODES.maximum(self._drawn(), 0.0)
        return seen

    def sunlit(self) -> dict[str, Operand]:
        """What channels see of the white sun on colours, and the fraction of whole closures."""
        ray, y, P = self._ray, self._y, self._P
        factor = ray.transmittance_of_own(y, P, self._around) * self._turned(self._water.sun)
        factor = factor * self._values[SUN_GAIN]
        factor = self._terms.combined(lambda found, term: found * term.unscattered, factor)
        factor = factor * self._sunlight
        wanted: dict[str, Operand] = dict(zip(COLUMNS, COLOURS, strict=True))
        if self._shape.measured:
            wanted[MEASURED] = self._given[COLUMN]
        columns = [ray.sunlight(y, P, k, self._material.pattern) * factor for k in wanted.values()]
        columns = self._terms.combined(lambda f, term: [term.leaving * x for x in f], columns)
        if self._dry is not None:
            dry = self._dry.sun_in_air()
            # A measured reflectance is only known in the water: red stands for it in the air.
            dry += dry[:1] * (len(columns) - len(dry))
            pairs = zip(dry, columns, strict=True)
            columns = [NODES.select(self._dry.dry, a, b) for a, b in pairs]
        white = columns[0] + columns[1] + columns[2]
        x, y, z = self._graph.components(white)
        fraction = NODES.minimum(NODES.maximum(NODES.maximum(x, y), z), 1.0)
        return dict(zip(wanted, columns, strict=True)) | {FRACTION: fraction}

    def layers(self) -> dict[str, Operand]:
        if not self._shape.layers:
            return {}
        wanted, here, sun = self._shape.layers, self._pixel, self._sun_visibility()
        if "B_single" in wanted:
            single = self._ray.single_scattering(self._y_o, self._y, self._w, self._P)
            sunlit = self._path_occlusion().single
            here = replace(here, single_scattering=single * sunlit * self._given[COVERAGE])
        found = pixel_layers(here)
        caustics = self._terms.combined(lambda found, term: found * term.caustics, 1.0)
        found |= {"albedo": self._given[COLOR], "shadow": sun, "caustics": caustics}
        if "reflectance" in wanted:
            found["reflectance"] = self._own.reflectance(self._values)
        if "E" in wanted:
            E = self._irradiance(self._ray, COLOURS, sun, self._pattern)
            found["E"] = self._terms.combined(lambda found, term: found + term.irradiance, E)
        return found

    def _made_material(self) -> SurfaceMaterial:
        own, (columns, base) = self._own, self._own.reflected()
        response = ()
        if LIT in self._given:
            lit = own.lit() * self._values[SUN_GAIN]
            turned = self._turned(self._water.sun) * self._sunlight
            response = [part * turned for part in own.in_columns(lit, base)]
        mirrored, L_mirrored = (), 0.0
        if self._shape.mirrors:
            mirrored = own.in_columns(self._given[MIRRORED], base)
            L_mirrored = own.mirrored_light(self._at, self._occlusion_factor())
        emitted, behind = own.glow(), own.behind()
        return SurfaceMaterial(
            columns, response, base, mirrored, L_mirrored, emitted, self._pattern,
            self._occlusion_factor(), behind,
            self._occlusion_factor(behind=self._shape.translucent), self._fluorescing(),
        )  # fmt: skip

    def _fluorescing(self) -> Sequence[Operand]:
        """How much each fluorophore is excited, over π."""

        def irradiance(ray: ChannelWater, white: Sequence[int]) -> Operand:
            sun = self._sun_visibility() * self._sunlight
            E = self._irradiance(ray, white, sun, self._pattern)
            return self._terms.combined(lambda found, term: found + term.exciting, E)

        return self._terms.combined(lambda found, term: found or term.excitation(irradiance), ())

    def _occlusion_factor(self, *, behind: bool = False) -> OcclusionFactor:
        """What objects leave of the light from all sides on this one, or on its other side."""
        return self._terms.combined(lambda f, term: term.occluded(f, behind=behind), NO_OCCLUSION)

    @functools.cached_property
    def _sunlight(self) -> Operand:
        """Fraction of the sun's light on the object that terms leave."""
        return self._terms.combined(lambda found, term: found * term.sunlight, 1.0)

    def _sun_visibility(self) -> NodeValue:
        gain = self._values[SUN_GAIN]
        return sun_visibility(self._graph, self._given[NORMAL], self._water.sun, gain)

    def _turned(self, sun: Sequence[NodeValue]) -> Operand:
        """Factor on the light of the sun as it is drawn, for a patch that another sun lights."""
        return self._terms.combined(lambda found, term: found * term.turned(sun), 1.0)

    def _path_occlusion(self) -> OcclusionOnPath:
        return self._terms.on_path(UNOCCLUDED)

    def _made_pixel(self) -> ChannelPixel:
        ray, y, n = self._ray, self._y, self._normal
        leaving = ray.leaving(replace(self._material, emitted=(), fluorescing=()), y, n, self._P)
        coverage = self._given[COVERAGE]
        tint = self._own.tint() if self._shape.filters else None
        occlusion, glow = self._path_occlusion(), ray.glow(self._material, y, self._P)
        seen = SeenObject(leaving, coverage, tint, glow)
        pixel = ray.surface(
            self._y_o, y, self._w, self._P, seen, occlusion=occlusion, around=self._around
        )
        if not {"J", "I"}.isdisjoint(self._shape.layers):
            pixel = replace(pixel, L_end=ray.leaving(self._material, y, n, 0.0))
        pixel = self._terms.combined(lambda found, term: term.lit(found), pixel)
        added = self._terms.combined(lambda found, term: found + term.added, 0.0)
        return self._terms.combined(lambda found, term: term.veiled(found, added), pixel)

    def _drawn(self) -> Operand:
        """Single scattering that the volume draws: up to its end, at most up to the object."""
        reach = NODES.minimum(self._P, self._values[SHAFT_END])
        drawn = self._at.shaft(reach) * self._given[COVERAGE]
        # The volume has shadows of its own.
        return drawn * self._path_occlusion().single

    def _irradiance(
        self, ray: ChannelWater, white: Sequence[int], sun: Operand, pattern: Operand | None
    ) -> Operand:
        """Irradiance by daylight; of a ray whose colours are white together."""
        facing = NODES.maximum(-dot(self._normal, self._water.sun), 0.0)
        direct: Operand = 0.0
        for k in white:
            direct = ray.sunlight(self._y, 0.0, k, pattern) + direct
        around = ray.irradiance(self._y, self._normal)
        return direct * (facing * sun) + ray.occluded(
            around, self._occlusion_factor(), self._y, ON_PATCH
        )


@dataclass(frozen=True, eq=False)
class _OwnMaterial:
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
        fraction = self._sum(colour) / NODES.maximum(self._sum(self.given[COLOR]), _DARKEST)
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
