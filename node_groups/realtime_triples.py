"""Three bands at a time: what their formulas read, and how a node tree adds them up."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.shade.shade_table import along_ray, ratio
from ..uw_spectral.surface.caustics import SUN_RADIUS
from ..uw_spectral.transfer.above_water import LightInAir, glitter_from_above, turned_sun
from ..uw_spectral.transfer.aureole import Aureole
from ..uw_spectral.transfer.closed_form import ClosedForm
from ..uw_spectral.transfer.depth_scale import DepthScale, Zone
from ..uw_spectral.transfer.inelastic_light import InelasticLight
from ..uw_spectral.transfer.light_field import LightField
from ..uw_spectral.transfer.pixel import PatchLight, Pixel, UndisturbedWater
from ..uw_spectral.transfer.radiance_field import Ripples
from ..uw_spectral.transfer.radiance_table import table_unit
from ..uw_spectral.transfer.sky import UNIFORM, Sky
from ..uw_spectral.transfer.solved_ray import (
    UNSHADED,
    LayeredBeam,
    PathShade,
    SolvedAhead,
    SolvedPatchLight,
    SolvedWater,
    SunOnPath,
)
from ..uw_spectral.transfer.sun_beam import SunBeam, half_angle2
from ..uw_spectral.water.phase import Mixture
from . import realtime_inelastic
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_lamps import TRIPLE
from .realtime_layers import LIGHT
from .realtime_refraction import DRY, LEAVING, MIRRORED_SKY, REFLECTANCE
from .realtime_shade import ON_IT, ON_PATH, REACH, SPECTRUM, Shade
from .realtime_tables import (
    AUREOLE,
    BEHIND_MIRROR,
    EXTINCTION,
    EXTINCTION_OF_SUN,
    FAR,
    FROM_ABOVE,
    IMAGE,
    MIRROR,
    MIRROR_AUREOLE,
    MIRRORED,
    NEAR,
    ONCE,
    ONCE_BEHIND,
    ONCE_MIRRORED,
    PATCH,
    WITHOUT_PEAK,
    WITHOUT_PEAK_BEHIND,
    WITHOUT_PEAK_MIRRORED,
    WITHOUT_PEAK_OF_SUN,
    Tables,
)
from .realtime_values import (
    BEAM_BANDS,
    DRAWN_SUN,
    FIELD_BANDS,
    FIELD_NUMBERS,
    FLOOR,
    GLITTER,
    GLITTER_WIDTH,
    INDEX,
    LAYERED_BANDS,
    LAYERS_SENSOR,
    MIRRORED_SHARE,
    NOT_PER_PIXEL,
    SENSOR,
    SHAFT_END,
    SKY,
    SKY_ABOVE,
    SMOOTH,
    SUN,
    SUN_ABOVE,
    SUN_IN_AIR,
    TABLE_DECAY,
    TABLE_SCALE,
    ZONE,
    Shape,
    band_names,
    name_of_zone,
    single_names,
)
from .realtime_waves import SLOPE

TOWARDS, MIRRORED_TOWARDS = "Phase", "Mirrored Phase"
SEEN = "Seen"
DRAWN = "Drawn by the Volume"
_PART_SIZE = 64  # of a triple's groups; fastest to build within a factor of two


@dataclass(frozen=True)
class TableImages:
    """The tables of solved bands, of the shade in them and of lamps, if there are any.

    ``rays`` is the group of :mod:`.realtime_refraction`, if the camera may be in the air.
    """

    light: bpy.types.Image | None = None
    shade: bpy.types.Image | None = None
    lamps: bpy.types.Image | None = None
    rays: bpy.types.ShaderNodeTree | None = None


def looked_up_on_surface(shape: Shape) -> list[str]:
    """Names of what :meth:`.Tables.near_and_far` and :meth:`.Tables.on_patch` find."""
    if not shape.solved:
        return []
    names = [NEAR, FAR, IMAGE, AUREOLE, PATCH, *([FROM_ABOVE] if shape.diffuse_shadows else [])]
    if shape.layered:
        names += [EXTINCTION, WITHOUT_PEAK, WITHOUT_PEAK_BEHIND]
        names += [EXTINCTION_OF_SUN, WITHOUT_PEAK_OF_SUN]
    names += [ON_IT, *ON_PATH] if shape.shade else []
    names += [MIRROR, BEHIND_MIRROR, MIRROR_AUREOLE] if shape.mirrors else []
    return [*names, *_parts(shape, ONCE), *_parts(shape, ONCE_BEHIND)]


def looked_up_ahead(shape: Shape) -> list[str]:
    """Names of what :meth:`.Tables.to_boundary` finds."""
    if not shape.solved:
        return []
    names = [NEAR, AUREOLE, *_parts(shape, ONCE)]
    names += [EXTINCTION, WITHOUT_PEAK] if shape.layered else []
    if shape.flat:
        names += [MIRRORED, *_parts(shape, ONCE_MIRRORED)]
        names += [WITHOUT_PEAK_MIRRORED] if shape.layered else []
    names += ON_PATH if shape.shade else []
    return names


def _parts(shape: Shape, name: str) -> list[str]:
    return [f"{name} {i}" for i in range(shape.layered_components)]


class Values:
    """The numbers of one triple of bands inside its group, read as terms.

    Parameters
    ----------
    graph : Graph
        The tree of :func:`build_triple`.
    given : mapping of str to NodeValue
        Its inputs.
    shape : Shape
        Its shape.
    """

    def __init__(self, graph: Graph, given: Mapping[str, NodeValue], shape: Shape) -> None:
        self._graph, self._given, self.shape = graph, given, shape
        self._constant = set() if shape.solved else set(band_names(shape))

    def __getitem__(self, name: str) -> NodeValue:
        """Return a quantity by its name, a vector of three bands or a single number."""
        value = self._given[name]
        return self._graph.as_varying(value) if name in self._constant else value

    @functools.cached_property
    def _phase(self) -> Mixture:
        parts = self.shape.components
        several = len(parts) > 1
        weights = tuple(self[f"phase {i}"] if several else 1.0 for i in range(len(parts)))
        return Mixture(parts, weights)

    @property
    def sun(self) -> tuple[NodeValue, ...]:
        """Direction the sunlight travels to."""
        return tuple(self[name] for name in SUN)

    @property
    def sun_in_air(self) -> tuple[NodeValue, ...]:
        """The same above the water."""
        return tuple(self[name] for name in SUN_IN_AIR)

    @functools.cached_property
    def beam(self) -> SunBeam:
        """The direct sun of three bands, in water that is the same at every depth."""
        return self._beam(TOWARDS)

    def _beam(self, towards: str) -> SunBeam:
        numbers = {name: self[name] for name in (*BEAM_BANDS, *FIELD_NUMBERS)}
        p = self._known_phase(towards)
        return SunBeam(**numbers, phase=self._phase, sun=self.sun, p=p)

    def _leg(self, c: str, cp: str, near: Operand = 0.0, far: Operand = 0.0) -> LayeredBeam:
        """Return the direct sun on a path in layered water with the extinctions looked up."""
        numbers = {name: self[name] for name in (*LAYERED_BANDS, *FIELD_NUMBERS)}
        return LayeredBeam(self[c], self[cp], **numbers, sun=self.sun, near=near, far=far)

    def _once(self, name: str, towards: str, y: Operand) -> Operand:
        """Sunlight scattered once in layered water, looked up at depth y."""
        parts = range(self.shape.layered_components)
        light = (self[f"{towards} {i}"] * self[f"{name} {i}"] for i in parts)
        unit = table_unit(self[TABLE_SCALE], self[TABLE_DECAY], y, NODES)
        return functools.reduce(operator.add, light) * unit

    def _known_phase(self, name: str) -> NodeValue | None:
        """Phase function of the bands whose parts the tree has computed, if it has."""
        if f"{name} 0" not in self._given:
            return None
        parts = [self[f"{name} {i}"] for i in range(len(self.shape.components))]
        weighted = (w * p for w, p in zip(self._phase.weights, parts, strict=True))
        return functools.reduce(operator.add, weighted)

    @functools.cached_property
    def elastic(self) -> ClosedForm:
        """The closed form of three bands over node values."""
        field = {name: self[name] for name in (*FIELD_BANDS, *FIELD_NUMBERS)}
        light = LightField(**field, **dict.fromkeys(NOT_PER_PIXEL))
        return ClosedForm(light, self._phase, self._aureole(), self.sun)

    @functools.cached_property
    def inelastic(self) -> InelasticLight | None:
        """Light of changed wavelength, if the shape has any."""
        if not self.shape.inelastic:
            return None
        return realtime_inelastic.light_of(
            self.elastic.field, self.shape.inelastic, self.__getitem__
        )

    @functools.cached_property
    def water(self) -> UndisturbedWater:
        """The undisturbed water of three bands."""
        index = self[INDEX] if self.shape.flat else None
        return UndisturbedWater(self.elastic, self._sky(), index, self.inelastic)

    def _sky(self) -> Sky:
        if self.shape.sky == UNIFORM:
            return Sky(self[SKY])
        return Sky(self[SKY], self.shape.sky, self.sun_in_air)

    def solved_path(
        self, y_o: NodeValue, y_e: NodeValue, w: Sequence[NodeValue], P: NodeValue
    ) -> SolvedWater:
        """Return the solved water in front of a thing at depth y_e, at distance P along w."""
        near, far = (self._looked_up(name, y) for name, y in ((NEAR, y_o), (FAR, y_e)))
        image = self[IMAGE] * self[TABLE_SCALE]
        beam, beyond = self._beams_to_thing(y_o, y_e)
        shade = self._path_shade(beam, w, P)
        return SolvedWater(beam, near, far, image, beyond, aureole=self[AUREOLE], shade=shade)

    def _path_shade(self, beam: SunOnPath, w: Sequence[NodeValue], P: NodeValue) -> PathShade:
        """What things leave of the light of the path; shafts have shadows of their own."""
        if not self.shape.shade:
            return UNSHADED
        found = [self._graph.components(self[name]) for name in ON_PATH]
        ratios = [ratio(mean, share, self[SPECTRUM], NODES) for mean, share, _ in found]
        sunlit = [step[2] for step in found]
        scattered = beam.cp - self[TABLE_DECAY] * w[2]
        once = beam.cp * (1.0 - w[2] / beam.mu_s)
        reach = P, self[REACH], NODES
        return PathShade(
            along_ray(ratios, scattered, *reach),
            1.0 if self.shape.shafts else along_ray(sunlit, once, *reach),
            self._graph.components(self[ON_IT])[2] if ON_IT in self._given else 1.0,
        )

    def _patch_shade(self) -> Operand:
        if not self.shape.shade:
            return None
        mean, share, _ = self._graph.components(self[ON_IT])
        return ratio(mean, share, self[SPECTRUM], NODES)

    def _beams_to_thing(self, y_o: NodeValue, y_e: NodeValue) -> tuple[SunOnPath, SunOnPath | None]:
        if not self.shape.layered:
            return self.beam, None
        far = self._once(ONCE_BEHIND, TOWARDS, y_e)
        beam = self._leg(EXTINCTION, WITHOUT_PEAK, self._once(ONCE, TOWARDS, y_o), far)
        return beam, self._leg(WITHOUT_PEAK_BEHIND, WITHOUT_PEAK_BEHIND, far)

    def solved_background(self, y_o: NodeValue, w: Sequence[NodeValue]) -> SolvedWater:
        """Return the solved water up to its surface and its floor."""
        index, mirrored = None, 0.0
        if self.shape.flat:
            index, mirrored = self[INDEX], self[MIRRORED] * self[TABLE_SCALE]
        near, floor = self._looked_up(NEAR, y_o), self[FLOOR]
        beam, below = self._beams_ahead(y_o)
        return SolvedWater(
            beam, near, mirrored=mirrored, below=below, floor=floor, sky=self._sky(), index=index,
            aureole=self[AUREOLE], shade=self._path_shade(beam, w, beam.boundary(y_o, w, NODES)),
        )  # fmt: skip

    def _beams_ahead(self, y_o: NodeValue) -> tuple[SunOnPath, SunOnPath | None]:
        """To the boundary ahead, and from the surface along a mirrored ray."""
        if not self.shape.layered:
            return self.beam, self._beam(MIRRORED_TOWARDS) if self.shape.flat else None
        beam = self._leg(EXTINCTION, WITHOUT_PEAK, self._once(ONCE, TOWARDS, y_o))
        if not self.shape.flat:
            return beam, None
        once = self._once(ONCE_MIRRORED, MIRRORED_TOWARDS, 0.0)
        return beam, self._leg(WITHOUT_PEAK_MIRRORED, WITHOUT_PEAK_MIRRORED, once)

    def patch_light(self, y: NodeValue) -> PatchLight:
        """Return the light on a patch at a depth."""
        if not self.shape.solved:
            return self.elastic.field
        shaded = self.shape.diffuse_shadows
        above = self._looked_up(FROM_ABOVE, y) if shaded else 0.0
        of_sun = EXTINCTION_OF_SUN, WITHOUT_PEAK_OF_SUN
        beam = self._leg(*of_sun) if self.shape.layered else self.beam
        return SolvedPatchLight(beam, self._looked_up(PATCH, y), above, self._patch_shade())

    def mirrored(self, y: NodeValue, r: Sequence[NodeValue]) -> Operand:
        """Radiance that comes to a thing at depth y along r, and is mirrored."""
        ahead = SolvedAhead(
            self._beam(MIRRORED_TOWARDS),
            self._looked_up(MIRROR, y),
            self[BEHIND_MIRROR] * self[TABLE_SCALE],
            self[MIRROR_AUREOLE],
        )
        shade = self._patch_shade()
        light = ahead.radiance(y, r, NODES)
        return light if shade is None else light * shade

    def _looked_up(self, name: str, y: Operand) -> NodeValue:
        return self[name] * table_unit(self[TABLE_SCALE], self[TABLE_DECAY], y, NODES)

    def _aureole(self) -> Aureole:
        if not self.shape.lobes:
            return Aureole(1.0, (0.0, 0.0, 0.0), (), ())
        lobes = range(self.shape.lobes)
        return Aureole(
            self["aureole single"],
            tuple(self[name] for name in SMOOTH),
            tuple(self[f"lobe weight {i}"] for i in lobes),
            tuple(self[f"lobe asymmetry {i}"] for i in lobes),
        )

    def of_group(self, tree: bpy.types.ShaderNodeTree) -> NodeValue:
        """Return the result of a group whose inputs have the names of values."""
        node = self._graph.node("ShaderNodeGroup", node_tree=tree)
        for socket in node.inputs:
            self._graph.assign(self[socket.name], socket)
        return self._graph.term(node.outputs[0])

    def shaft(self, y_o: NodeValue, w: Sequence[NodeValue], P: NodeValue | None) -> NodeValue:
        """Single scattering that the volume draws: up to its end, at most up to P."""
        end = self[SHAFT_END]
        reach = end if P is None else NODES.minimum(P, end)
        return self.beam.scattered_once(y_o, w, reach, NODES)

    def seen(self, pixel: Pixel, dry: NodeValue | None = None) -> NodeValue:
        """Return what three bands of a pixel add to the colour that the sensor sees.

        Parameters
        ----------
        pixel : Pixel
            In the water.
        dry : NodeValue, optional
            Radiance of a thing where it lies in the air.
        """
        if not self.shape.above:
            return self.sensor(pixel.total)
        ray = self._ray
        wet = ray(LEAVING) * pixel.total + pixel.coverage * self._mirrored_from_above()
        return self.sensor(wet if dry is None else NODES.select(ray(DRY), dry, wet))

    def dry_radiance(
        self, response: NodeValue, base: NodeValue, normal: Sequence[NodeValue]
    ) -> NodeValue:
        """Radiance that a thing in the air reflects, lit white by the sun as it is drawn."""
        drawn, in_air = ([self[name] for name in names] for names in (DRAWN_SUN, SUN_IN_AIR))
        turned = turned_sun(-dot(normal, in_air), -dot(normal, drawn), NODES)
        light = LightInAir(self[SUN_ABOVE], self[SKY_ABOVE], self[MIRRORED_SHARE])
        return light.reflected(response, base, turned, normal[2])

    def turned_sun(self, normal: Sequence[NodeValue]) -> Operand:
        """Factor on the light of the sun as it is drawn, for a patch in the water."""
        if not self.shape.above:
            return 1.0
        drawn = [self[name] for name in DRAWN_SUN]
        return turned_sun(-dot(normal, self.sun), -dot(normal, drawn), NODES)

    def _ray(self, name: str) -> NodeValue:
        graph = self._graph
        assert graph.rays is not None, "a camera in the air has rays that are bent"
        return graph.term(graph.shared(graph.rays)[name])

    def _mirrored_from_above(self) -> NodeValue:
        """Radiance of the sky that the surface mirrors, or of the sky itself."""
        v = self._graph.components(self._ray(MIRRORED_SKY))
        R = self._ray(REFLECTANCE)
        seen = R * self._sky().radiance(v, NODES)
        if not self.shape.waves:
            return seen
        slopes = self._graph.components(self._ray(SLOPE))[:2]
        ripples = Ripples(slopes, self[GLITTER_WIDTH], self[GLITTER], self.sun_in_air)
        glitter = glitter_from_above(
            self[SUN_ABOVE], v, R, ripples, self[INDEX], SUN_RADIUS**2, NODES
        )
        return seen + NODES.less(0.0, self._ray(LEAVING)) * glitter

    def sensor(self, radiance: NodeValue) -> NodeValue:
        """Return what three bands add to the colour that the sensor sees."""
        return self._weighted(radiance, SENSOR)

    def layers(self, values: Mapping[str, Operand]) -> dict[str, NodeValue]:
        """Return what three bands add to the layers of the shape, as their sensor has them."""
        known = {name: values.get(name, 0.0) for name in LIGHT if name in self.shape.layers}
        return {
            name: self._weighted(value, LAYERS_SENSOR)
            for name, value in known.items()
            if isinstance(value, NodeValue)
        }

    def _weighted(self, radiance: NodeValue, names: Sequence[str]) -> NodeValue:
        weights = [self[name] for name in names]
        return self._graph.vector(*(radiance.dot(weight) for weight in weights))

    def uplift(self, colour: NodeValue, names: Sequence[str]) -> NodeValue:
        """Return the three bands of an RGB colour."""
        rgb = self._graph.components(colour)
        red, green, blue = (c * self[n] for c, n in zip(rgb, names, strict=True))
        return red + green + blue


def build_triple(
    name: str,
    shape: Shape,
    inputs: Mapping[str, str],
    formula: Callable[[Graph, Values], Mapping[str, NodeValue]],
    rays: bpy.types.ShaderNodeTree | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group that adds three bands to the picture.

    Parameters
    ----------
    name : str
        Of the group.
    shape : Shape
        Shape of the water.
    inputs : mapping of str to str
        Name and socket type of what it gets besides the numbers of the water.
    formula : callable
        Makes the nodes; returns what the bands add to the colour, :data:`SEEN`: of all light;
        if the shape has shafts, of the light that the volume draws, :data:`DRAWN`; and to each
        of its layers.
    rays : ShaderNodeTree, optional
        As of :class:`TableImages`.
    """
    tree = new_group(name)
    sockets = dict(inputs)
    sockets |= dict.fromkeys(single_names(shape), "NodeSocketFloat")
    sockets |= dict.fromkeys(band_names(shape), "NodeSocketVector")
    sockets |= {TRIPLE: "NodeSocketFloat"} if shape.lamps else {}
    for socket, kind in sockets.items():
        tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind)
    graph = Graph(tree, None if shape.solved else _PART_SIZE, rays)
    outputs = graph.node("NodeGroupInput").outputs
    given = {socket.name: graph.term(socket) for socket in outputs if socket.name}
    results = formula(graph, Values(graph, given, shape))
    for socket in results:
        tree.interface.new_socket(socket, in_out="OUTPUT", socket_type="NodeSocketVector")
    end = graph.node("NodeGroupOutput").inputs
    for name, result in results.items():
        graph.assign(result, end[name])
    return tree


def phase_inputs(name: str, shape: Shape) -> list[str]:
    """Names of the inputs that :func:`phase_towards` fills."""
    return [f"{name} {i}" for i in range(len(shape.components))] if shape.solved else []


def phase_towards(
    name: str,
    shape: Shape,
    w: Sequence[NodeValue],
    sun: Sequence[NodeValue],
) -> dict[str, NodeValue]:
    """Compute the parts of the phase function for sunlight that turns against w, once."""
    s2 = half_angle2(w, sun, NODES)
    parts = [component.per_steradian(s2, NODES) for component in shape.components]
    return dict(zip(phase_inputs(name, shape), parts, strict=True))


class Triples:
    """The bands of a node tree, three at a time, added up.

    In closed form each triple has nodes of its own. Solved, they go through the same nodes in
    turn, in a repeat zone: what is compiled does not grow with the number of bands.

    Parameters
    ----------
    graph : Graph
        The tree.
    values : ShaderNodeTree
        The group of :func:`build`.
    shape : Shape
    images : TableImages
    """

    def __init__(
        self,
        graph: Graph,
        values: bpy.types.ShaderNodeTree,
        shape: Shape,
        images: TableImages,
    ) -> None:
        self._graph, self._shape = graph, shape
        self.numbers = graph.node("ShaderNodeGroup", node_tree=values).outputs
        image = images.light
        if images.shade is not None:
            self.shade = Shade(graph, self.numbers, images.shade)
        if image is not None:
            self._begin = graph.node("GeometryNodeRepeatInput")
            self._end = graph.node("GeometryNodeRepeatOutput")
            self._begin.pair_with_output(self._end)
            self._begin.inputs["Iterations"].default_value = shape.triples
            self.tables = self._tables(image)

    def _tables(self, image: bpy.types.Image) -> Tables:
        zones = tuple(
            Zone(**{field: self.number(name_of_zone(field, place)) for field in ZONE})
            for place in range(self._shape.zones)
        )
        return Tables(
            self._graph,
            image,
            self._shape.triples,
            self._graph.term(self._begin.outputs["Iteration"]),
            band_names(self._shape),
            DepthScale(zones, self._shape.slices),
            [self.number(name) for name in SUN],
            self._shape.layered_components,
        )

    def number(self, name: str) -> NodeValue:
        """Return a number of the water that is the same in every band."""
        return self._graph.term(self.numbers[name])

    def own(self, name: str, given: Mapping[str, NodeValue]) -> NodeValue:
        """Of the terms ``NAME i``, one for each triple, return that of the present one."""
        total: Operand = 0.0
        for triple in range(self._shape.triples):
            here = self._graph.operation("COMPARE", (self.tables.index, float(triple), 0.5))
            total = here * given[f"{name} {triple}"] + total
        return total

    def sum(
        self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]
    ) -> dict[str, NodeValue]:
        """Add up the triples; :data:`SEEN` is without the light that the volume draws.

        The volume draws no negative light: where the sum over the bands is
        negative, its light stays in what is returned.

        Parameters
        ----------
        triple : ShaderNodeTree
            The group of :func:`build_triple`.
        given : mapping of str to NodeValue
            Its inputs besides the numbers; ``NAME i`` goes to ``NAME`` of triple i.
        """
        found = self._looped if self._shape.solved else self._unrolled
        totals = found(triple, given)
        drawn = totals.pop(DRAWN, None)
        if drawn is not None:
            totals[SEEN] = totals[SEEN] - NODES.maximum(drawn, 0.0)
        return totals

    def _unrolled(
        self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]
    ) -> dict[str, Operand]:
        known: dict[str, Operand] = dict(given)
        if self._shape.lamps:
            known |= {f"{TRIPLE} {i}": float(i) for i in range(self._shape.triples)}
        totals: dict[str, Operand] = {}
        for index in range(self._shape.triples):
            node = self._graph.node("ShaderNodeGroup", node_tree=triple)
            for socket in node.inputs:
                own = f"{socket.name} {index}"
                source = known.get(socket.name, known.get(own))
                if source is None:
                    source = self.number(own if own in self.numbers else socket.name)
                self._graph.assign(source, socket)
            for output in node.outputs:
                totals[output.name] = self._graph.term(output) + totals.get(output.name, 0.0)
        return totals

    def _looped(
        self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]
    ) -> dict[str, Operand]:
        if self._shape.lamps:
            given = {**given, TRIPLE: self.tables.index}
        node = self._graph.node("ShaderNodeGroup", node_tree=triple)
        of_bands = set(band_names(self._shape))
        for socket in node.inputs:
            source = given.get(socket.name)
            if source is None:
                look_up = self.tables.number if socket.name in of_bands else self.number
                source = look_up(socket.name)
            self._graph.assign(source, socket)
        self._end.repeat_items.clear()
        for output in node.outputs:
            self._end.repeat_items.new("VECTOR", output.name)
        for output in node.outputs:
            before = self._graph.term(self._begin.outputs[output.name])
            self._graph.assign(before + self._graph.term(output), self._end.inputs[output.name])
        names = [output.name for output in node.outputs]
        return {name: self._graph.term(self._end.outputs[name]) for name in names}
