"""Node group that turns a lit surface into its picture through the water.

It replaces the shader of a user's material: lit colour and base colour go in,
a shader that emits what the channels see comes out. All bands in one pass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import bpy

from ..uw_spectral.clouds.veiled_pixel import surroundings, veiled
from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.surface.wave_patterns import sunlight_factor
from ..uw_spectral.transfer.above_water import LightInAir, facing_mirrored, turned_sun
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.channel_tables import ON_PATCH
from ..uw_spectral.transfer.closures import BOTH_SIDES
from ..uw_spectral.transfer.facets import Facets
from ..uw_spectral.transfer.pixel_parts import (
    COLOURS,
    NO_OCCLUSION,
    ChannelPixel,
    OcclusionFactor,
    OcclusionOnPath,
    SeenObject,
    SurfaceMaterial,
)
from ..uw_spectral.transfer.rough_mirror import mirrored_by_chance
from . import lamp_images, realtime_clouds, realtime_lamps, realtime_layers
from .chance import chance
from .group_sockets import COLOUR, FLOAT, SHADER, VECTOR, OpenGroup, Socket
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_fluorescence import FluorescenceShape
from .realtime_occlusion import ON_IT, OcclusionShape
from .realtime_rays import (
    camera_depth_behind,
    depth_here,
    place_here,
    view_direction,
    view_distance,
)
from .realtime_refracted_view import WindowShape
from .realtime_refraction import DRY, LEAVING, AirShape
from .realtime_shadows import sun_visibility
from .realtime_values import (
    DRAWN_SUN,
    GLOW_ABOVE,
    MIRRORED_FRACTION,
    MIRRORED_SUN,
    REFLECTANCE,
    SHAFT_END,
    SKY_ABOVE,
    SUN_ABOVE,
    SUN_GAIN,
    SUN_IN_AIR,
    THROUGH,
    WATER_ABOVE,
)
from .realtime_water import PixelWater, in_group, pixel_layers
from .realtime_waves import CAUSTIC_STRENGTH, LEAST_PATTERN, caustics_here, images_in
from .shape import Shape, Sources
from .uplift import COLUMNS, FRACTION

NAME, NATIVE = "UW Surface in Water", "UW Water before Surface"
FLUORESCENT = "UW Fluorescent Object in Water"

LIT, COLOR, EMITTED = "Lit", "Color", "Emission"
MIRRORED, MIRROR_ROUGHNESS = "Mirrored", "Mirror Roughness"
BEHIND, CLOSED = "Behind", "Closed"
COVERAGE, COVERED, NORMAL = "Coverage", "Covered", "Normal"
COLUMN, MEASURED = "Column", "Measured"
FLUORESCENCE = "Fluorescence"
_BEHIND_IT = "Occlusion behind It"
_DARKEST = 1e-3  # reflectance below which a colour does not tell how an object is lit


def build(
    shape: Shape, sources: Sources, *, keeps: bool = False, fluoresces: bool = False
) -> bpy.types.ShaderNodeTree:
    """Build the group.

    With ``keeps`` the closures of the material stay: instead of the input ``Lit`` there are
    outputs, as of :mod:`.uplift`: the colours that the sun lights are seen by the channels in
    these columns, and all closures with this fraction.

    Inputs: ``Lit``, the colour of the surface under a white sun of strength 1, emission included;
    ``Color``, its reflectance; if objects glow, ``Emission``, its emitted RGB radiance;
    ``Coverage``, the fraction that is not transparent, with which the three are multiplied already;
    ``Normal``; if objects filter, ``Covered``, the fraction of each channel that is not
    transparent; if objects mirror, ``Mirrored``, the part of the reflectance that does, and
    ``Mirror Roughness``; if objects are translucent, ``Behind``, the part that light from behind
    shines through; if objects are either, ``Closed``, 1 where there is a wall behind a wall; if
    lamps shine on facets, :data:`.realtime_lamps.FACETS`; and if reflectances were measured,
    ``Column``, where that of the material is found if it is not 0, and ``Measured``, its channels.
    With ``fluoresces`` there is ``Fluorescence``, the absorptance of up to three fluorophores.
    """
    lamps = shape.of(realtime_lamps.LampShape)
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
        (fluoresces, {FLUORESCENCE: VECTOR}),
        *((True, facets) for facets in realtime_lamps.FACETS[: lamps.facets]),
    ):
        inputs |= sockets if wanted else {}
    name = FLUORESCENT if fluoresces else NATIVE if keeps else NAME
    options = realtime_clouds.options(shape, sources)
    group = OpenGroup(name, inputs, {"Shader": SHADER}, **options)
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
        self._w, self._P, self._y = view_direction(graph), view_distance(graph), depth_here(graph)
        self._y_o = camera_depth_behind(self._y, self._w, self._P)
        self._ray = self._water.along(self._w)
        self._pattern: Operand | None = None
        waves = images_in(sources.parts)
        if waves is not None:
            pattern = caustics_here(graph, sources.values, waves.caustics)
            self._pattern = NODES.maximum(pattern, self._values[LEAST_PATTERN])
        self._occlusion = {}
        occlusion, here = self._water.occlusion(), place_here(graph)
        if occlusion is not None:
            camera = [x - along * self._P for x, along in zip(here, self._w, strict=True)]
            self._occlusion = occlusion.on_patch(here, self._normal)
            if self._shape.translucent:
                back = occlusion.on_patch(here, [-part for part in self._normal])
                self._occlusion[_BEHIND_IT] = back[ON_IT]
            self._occlusion |= occlusion.on_path(camera, self._w, self._P)
        self._around = self._water.around(here)
        lamps = lamp_images.images_in(sources.parts)
        self._lamps = {} if lamps is None else self._lit_by_lamps(sources, lamps)
        self._clouds = {}
        if realtime_clouds.CloudShape in shape:
            group = realtime_clouds.build(shape, sources, ahead=False)
            rate = self._ray.falling_off(self._y, self._w)[1]
            self._clouds = in_group(graph, group, {realtime_clouds.RATE: rate})
        self._material = self._made_material()
        self._pixel = self._made_pixel()

    def _lit_by_lamps(self, sources: Sources, images: lamp_images.LampImages) -> dict[str, Operand]:
        """Light of lamps: on the object, and in the water before it."""
        graph, given = self._graph, self._given
        layers, lamps = self._shape.layers, realtime_lamps
        outputs = [lamps.UNSCATTERED, lamps.FORWARD] if layers else [lamps.SEEN]
        outputs += [lamps.THERE] if "J" in layers else []
        outputs += [lamps.IRRADIANCE] if "E" in layers else []
        outputs += [lamps.EXCITING] if FLUORESCENCE in given else []
        inputs: dict[str, Operand] = {
            lamps.NORMAL: given[NORMAL],
            lamps.COLOR: given[COLOR],
            lamps.VISIBILITY: lamps.visibility(graph, self._values.outputs, images, given[NORMAL]),
        }
        if self._shape.measured:
            # There measured reflectances count from 1, here columns go on after three colours.
            inputs[lamps.MEASURED] = NODES.maximum(given[COLUMN] - (len(COLOURS) - 1.0), 0.0)
        shape = self._shape.of(lamps.LampShape)
        for facets in lamps.FACETS[: shape.facets]:
            inputs |= {name: given[name] for name in facets}
        clouds = realtime_clouds.for_lamps(sources, self._shape)
        patch = lamps.build_patch(images, outputs, sources.rays, shape.facets, clouds)
        found = in_group(graph, patch, inputs)
        path = lamps.build_path(
            images, shape.components, ahead=False, rays=sources.rays, clouds=clouds
        )
        return found | in_group(graph, path, {})

    def seen(self) -> Operand:
        seen = self._water.seen(self._pixel.total, self._given[COVERAGE])
        dry = self._is_dry()
        if dry is not None:
            seen = NODES.select(dry, self._dry(), seen)
        if self._shape.shafts:
            seen = seen - NODES.maximum(self._drawn(), 0.0)
        return seen

    def sunlit(self) -> dict[str, Operand]:
        """What channels see of the white sun on colours, and the fraction of whole closures."""
        ray, y, P = self._ray, self._y, self._P
        factor = ray.transmittance_of_own(y, P, self._around) * self._turned(self._water.sun)
        factor = (
            factor * self._values[SUN_GAIN] * self._clouds.get(realtime_clouds.UNSCATTERED, 1.0)
        )
        factor = factor * self._under_clouds()
        wanted: dict[str, Operand] = dict(zip(COLUMNS, COLOURS, strict=True))
        if self._shape.measured:
            wanted[MEASURED] = self._given[COLUMN]
        columns = [ray.sunlight(y, P, k, self._material.pattern) * factor for k in wanted.values()]
        if AirShape in self._shape:
            columns = [self._water.ray(LEAVING) * column for column in columns]
        pick = self._is_dry()
        if pick is not None:
            turned = self._turned(self._values.of(*SUN_IN_AIR))
            turned = turned * self._values[SUN_GAIN]
            dry = [self._values[name] * turned for name in SUN_ABOVE]
            # A measured reflectance is only known in the water: red stands for it in the air.
            dry += dry[:1] * (len(columns) - len(dry))
            columns = [NODES.select(pick, a, b) for a, b in zip(dry, columns, strict=True)]
        white = columns[0] + columns[1] + columns[2]
        x, y, z = self._graph.components(white)
        fraction = NODES.minimum(NODES.maximum(NODES.maximum(x, y), z), 1.0)
        return dict(zip(wanted, columns, strict=True)) | {FRACTION: fraction}

    def layers(self) -> dict[str, Operand]:
        if not self._shape.layers:
            return {}
        wanted, here = self._shape.layers, self._pixel
        gain = self._values[SUN_GAIN]
        sun = sun_visibility(self._graph, self._given[NORMAL], self._water.sun, gain)
        if "B_single" in wanted:
            single = self._ray.single_scattering(self._y_o, self._y, self._w, self._P)
            sunlit = self._path_occlusion().single
            here = replace(here, single_scattering=single * sunlit * self._given[COVERAGE])
        found = pixel_layers(here)
        found |= {"albedo": self._given[COLOR], "shadow": sun, "caustics": 1.0}
        if "reflectance" in wanted:
            found["reflectance"] = self._reflectance()
        if "E" in wanted:
            found["E"] = self._illumination(sun)
        if self._pattern is not None:
            strength = self._values[CAUSTIC_STRENGTH]
            found["caustics"] = sunlight_factor(self._pattern, strength, NODES)
        return found

    def _base(self) -> tuple[Sequence[Operand], Sequence[Operand]]:
        """Columns of the object's colours, and what it reflects of each."""
        base = self._graph.components(self._given[COLOR])
        if not self._shape.measured:
            return COLOURS, base
        column = self._given[COLUMN]
        known = NODES.less(0.5, column)
        first = NODES.select(known, self._given[COVERAGE], base[0])
        return (column, 1, 2), (first, *((1.0 - known) * part for part in base[1:]))

    def _made_material(self) -> SurfaceMaterial:
        graph, given = self._graph, self._given
        columns, base = self._base()
        response = ()
        if LIT in given:
            lit = self._lit() * self._values[SUN_GAIN]
            turned = self._turned(self._water.sun) * self._under_clouds()
            response = [part * turned for part in self._in_columns(lit, base)]
        mirrored, L_mirrored = (), 0.0
        if self._shape.mirrors:
            mirrored = self._in_columns(given[MIRRORED], base)
            L_mirrored = self._mirrored_light()
        emitted = graph.components(given[EMITTED]) if self._shape.glows else ()
        behind = None
        if self._shape.translucent:
            part, whole = (self._sum(given[name]) for name in (BEHIND, COLOR))
            behind = NODES.minimum(part / NODES.maximum(whole, _DARKEST), 1.0)
            behind = behind * NODES.select(given[CLOSED], BOTH_SIDES, 1.0)
        return SurfaceMaterial(
            columns, response, base, mirrored, L_mirrored, emitted, self._pattern,
            self._occlusion_factor(), behind, self._occlusion_factor_behind(), self._fluorescing(),
        )  # fmt: skip

    def _fluorescing(self) -> Sequence[Operand]:
        """How much each fluorophore is excited, over π."""
        if FLUORESCENCE not in self._given:
            return ()
        graph, water = self._graph, self._water
        sun = sun_visibility(graph, self._given[NORMAL], water.sun, self._values[SUN_GAIN])
        sun = sun * self._under_clouds()
        E = self._irradiance(water.exciting(self._w), COLOURS[:1], sun, self._pattern)
        E = E + self._lamps.get(realtime_lamps.EXCITING, 0.0)
        absorbed = self._given[FLUORESCENCE] * self._given[COVERAGE]
        count = self._shape.of(FluorescenceShape).fluorophores
        return graph.components(E * absorbed * (1.0 / math.pi))[:count]

    def _sum(self, colour: NodeValue) -> Operand:
        x, y, z = self._graph.components(colour)
        return x + y + z

    def _lit(self) -> Operand:
        """Colour of the object under the white sun, without what it emits."""
        lit = self._given[LIT]
        return NODES.maximum(lit - self._given[EMITTED], 0.0) if self._shape.glows else lit

    def _in_columns(self, colour: NodeValue, base: Sequence[Operand]) -> list[Operand]:
        """Return a colour that is part of the object's own in the columns of that."""
        parts = self._graph.components(colour)
        if not self._shape.measured:
            return list(parts)
        known = NODES.less(0.5, self._given[COLUMN])
        own = self._graph.components(self._given[COLOR])
        fraction = (parts[0] + parts[1] + parts[2]) / NODES.maximum(
            own[0] + own[1] + own[2], _DARKEST
        )
        first = NODES.select(known, fraction * base[0], parts[0])
        return [first, *((1.0 - known) * part for part in parts[1:])]

    def _mirrored_light(self) -> Operand:
        """Radiance that comes to the object along the mirrored view ray, one of many if rough."""
        here = place_here(self._graph)
        roughness = self._given[MIRROR_ROUGHNESS]
        r, weight = mirrored_by_chance(
            self._w, self._normal, roughness, chance(self._graph, here)[:2], NODES
        )
        ray = self._water.along(r)
        M, single = ray.ahead(self._y, r)
        L = M + single + ray.boundary(self._y, r)
        colour = NODES.maximum(self._sum(self._given[MIRRORED]) / 3.0, _DARKEST)
        facets = Facets(self._normal, roughness, [colour], [0.0])
        (brighter,) = facets.with_all_light([-x for x in self._w], NODES).even
        return ray.occluded(L, self._occlusion_factor(), self._y) * weight * (brighter / colour)

    def _occlusion_factor(self) -> OcclusionFactor:
        """What objects leave of the light from all sides on this one."""
        clouds = self._clouds.get(realtime_clouds.SKYLIGHT, 1.0)
        if OcclusionShape not in self._shape:
            return OcclusionFactor(clouds) if self._clouds else NO_OCCLUSION
        mean, fraction, _ = self._graph.components(self._occlusion[ON_IT])
        return OcclusionFactor(clouds * mean, clouds * fraction)

    def _occlusion_factor_behind(self) -> OcclusionFactor:
        """Return the same of the light on the other side; inside a body there is no probe."""
        if _BEHIND_IT not in self._occlusion:
            return self._occlusion_factor()
        sides = self._occlusion[ON_IT], self._occlusion[_BEHIND_IT]
        mean, fraction, _ = self._graph.components(NODES.select(self._given[CLOSED], *sides))
        return OcclusionFactor(mean, fraction)

    def _is_dry(self) -> NodeValue | None:
        """Return whether what is drawn lies in the air, 0 or 1; None if nothing can."""
        if AirShape in self._shape:
            return self._water.ray(DRY)
        return self._values[THROUGH] if WindowShape in self._shape else None

    def _turned(self, sun: Sequence[Operand]) -> Operand:
        """Factor on the light of the sun as it is drawn, for a patch that another sun lights."""
        if AirShape not in self._shape:
            return 1.0
        drawn = self._values.of(*DRAWN_SUN)
        return turned_sun(-dot(self._normal, sun), -dot(self._normal, drawn), NODES)

    def _path_occlusion(self) -> OcclusionOnPath:
        rates = self._ray.falling_off(self._y, self._w)
        occlusion = self._water.path_occlusion(self._occlusion, rates, self._P)
        return realtime_clouds.shadowed(occlusion, self._clouds)

    def _made_pixel(self) -> ChannelPixel:
        ray, y, n = self._ray, self._y, self._normal
        leaving = ray.leaving(replace(self._material, emitted=(), fluorescing=()), y, n, self._P)
        coverage = self._given[COVERAGE]
        tint = self._tint() if self._shape.filters else None
        occlusion, glow = self._path_occlusion(), ray.glow(self._material, y, self._P)
        seen = SeenObject(leaving, coverage, tint, glow)
        pixel = ray.surface(
            self._y_o, y, self._w, self._P, seen, occlusion=occlusion, around=self._around
        )
        if not {"J", "I"}.isdisjoint(self._shape.layers):
            pixel = replace(pixel, L_end=ray.leaving(self._material, y, n, 0.0))
        pixel = self._with_lamps(pixel)
        if not self._clouds:
            return pixel
        y_o, w = self._y_o, self._w
        around = surroundings(ray, y_o, y, w, self._P) * coverage + self._by_lamps()
        veil = realtime_clouds.veil_of(self._clouds)
        return veiled(pixel, veil, ray, y_o, w, around=around, coverage=coverage)

    def _under_clouds(self) -> Operand:
        """Fraction of the sun's light on the object that clouds leave."""
        return self._clouds.get(realtime_clouds.SUNLIGHT, 1.0)

    def _tint(self) -> Operand:
        """Return what channels see through beyond the mean of them, which EEVEE lets through.

        Before the first wall of a body lies what its second has filtered already.
        """
        passing = 1.0 - self._given[COVERED]
        geometry = self._graph.node("ShaderNodeNewGeometry").outputs
        first = self._given[CLOSED] * (1.0 - self._graph.term(geometry["Backfacing"]))
        beyond = passing - (1.0 - self._given[COVERAGE])
        return beyond * NODES.select(first, passing, 1.0)

    def _with_lamps(self, pixel: ChannelPixel) -> ChannelPixel:
        found, lamps = self._lamps, realtime_lamps
        if not found:
            return pixel
        return replace(
            pixel,
            direct=pixel.direct + self._by_lamps(),
            forward_scattered=pixel.forward_scattered + found.get(lamps.FORWARD, 0.0),
            L_end=pixel.L_end + found.get(lamps.THERE, 0.0),
            lamps=found[lamps.LIGHT] * self._given[COVERAGE],
        )

    def _by_lamps(self) -> Operand:
        """Light of lamps from the object, but for what is scattered forward if that is apart."""
        found, lamps = self._lamps, realtime_lamps
        return found.get(lamps.SEEN, found.get(lamps.UNSCATTERED, 0.0))

    def _dry(self) -> Operand:
        """Radiance of the object where it lies in the air."""
        sun, up = self._values.of(*SUN_IN_AIR), self._normal[2]
        turned, facing = self._turned(sun), facing_mirrored(self._normal, sun, NODES)
        lit: Sequence[Operand] = (0.0, 0.0, 0.0)
        if LIT in self._given:
            lit = self._graph.components(self._lit() * self._values[SUN_GAIN])
        base = self._graph.components(self._given[COLOR])
        total: Operand = 0.0
        for k in range(3):
            light = LightInAir(
                self._values[SUN_ABOVE[k]],
                self._values[SKY_ABOVE[k]],
                self._values[MIRRORED_FRACTION],
                sun_mirrored=self._values[MIRRORED_SUN],
                leaving=self._values[WATER_ABOVE[k]],
            )
            total = light.reflected(lit[k], base[k], turned, up, facing) + total
        for k, radiance in enumerate(self._material.emitted):
            total = radiance * self._values[GLOW_ABOVE[k]] + total
        return total

    def _drawn(self) -> Operand:
        """Single scattering that the volume draws: up to its end, at most up to the object."""
        reach = NODES.minimum(self._P, self._values[SHAFT_END])
        drawn = shaft(self._ray, self._y_o, self._w, reach) * self._given[COVERAGE]
        # The volume has shadows of its own.
        return drawn * self._path_occlusion().single

    def _reflectance(self) -> Operand:
        base = self._graph.components(self._given[COLOR])
        total: Operand = 0.0
        for part, name in zip(base, REFLECTANCE, strict=True):
            total = part * self._values[name] + total
        if not self._shape.measured:
            return total
        known = NODES.less(0.5, self._given[COLUMN])
        return NODES.select(known, self._given[MEASURED], total)

    def _illumination(self, sun: Operand) -> Operand:
        """Irradiance on the object with its normal."""
        E = self._irradiance(self._ray, COLOURS, sun, self._pattern)
        return E + self._lamps.get(realtime_lamps.IRRADIANCE, 0.0)

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


def shaft(ray: ChannelWater, y_o: Operand, w: Sequence[Operand], reach: Operand) -> Operand:
    """Single scattering between the camera and a distance, as the volume draws it."""
    y_e = NODES.maximum(y_o - w[2] * reach, 0.0)
    return ray.single_scattering(y_o, y_e, w, reach)
