"""Node group of every number that the real-time groups need: UW Values.

The other groups hold an instance of it. A change of water, camera or sun
writes numbers here and reaches every material; no node is added or removed.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.wave_patterns import KNOTS
from ..uw_spectral.transfer.aureole import Aureole
from ..uw_spectral.transfer.closed_form import ClosedForm
from ..uw_spectral.transfer.depth_scale import DepthScale, Zone
from ..uw_spectral.transfer.inelastic_light import InelasticLight
from ..uw_spectral.transfer.light_field import LightField
from ..uw_spectral.transfer.pixel import PatchLight, Pixel, UndisturbedWater
from ..uw_spectral.transfer.radiance_table import RadianceTable, table_unit
from ..uw_spectral.transfer.sky import UNIFORM, Sky
from ..uw_spectral.transfer.solved_ray import (
    LayeredBeam,
    SolvedPatchLight,
    SolvedWater,
    SunOnPath,
)
from ..uw_spectral.transfer.sun_beam import SunBeam, half_angle2
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from . import realtime_inelastic
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_tables import (
    AUREOLE,
    EXTINCTION,
    EXTINCTION_OF_SUN,
    FAR,
    FROM_ABOVE,
    IMAGE,
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

NAME = "UW Values"
SHAPE = "uw_shape"

_FIELD_NUMBERS = ("mu_s", "y_f")
_NOT_PER_PIXEL = ("R",)
_FIELD_BANDS = tuple(
    f.name for f in fields(LightField) if f.name not in (*_FIELD_NUMBERS, *_NOT_PER_PIXEL)
)
_BEAM_BANDS = ("b", "c", "cp", "E")
_LAYERED_BANDS = ("E",)
_TABLE_SCALE, _TABLE_DECAY = "table scale", "table decay"
FLOOR = "floor radiance"
_ZONE = tuple(f.name for f in fields(Zone))
SUN = ("sun x", "sun y", "sun z")
SUN_IN_AIR = ("sun in air x", "sun in air y", "sun in air z")
_SMOOTH = tuple(f"aureole moment {i}" for i in range(3))
CAMERA_DEPTH = "camera depth"
INDEX = "refractive index"
SKY = "sky radiance"
REFLECTANCE = tuple(f"reflectance {c}" for c in ("red", "green", "blue"))
EMISSION = tuple(f"emission {c}" for c in ("red", "green", "blue"))
SENSOR = tuple(f"sensor {c}" for c in ("red", "green", "blue"))
SHAFT_END = "shaft end"
SHAFT_SCALE = "shaft scale"
WAVES_PER_METRE = "waves per metre"
WAVES_HALF_CELL = "waves half cell"
WAVES_LOG_DEPTH = "waves log depth"
WAVES_PER_LOG = "waves per log"
GLITTER = "glitter"
GLITTER_WIDTH = "glitter width"
CAUSTIC_STRENGTH = "caustic strength"
CONTRAST = tuple(f"caustic contrast {i}" for i in range(KNOTS))
TOWARDS, MIRRORED_TOWARDS = "Phase", "Mirrored Phase"
SEEN = "Seen"
DRAWN = "Drawn by the Volume"
_PART_SIZE = 64  # of a triple's groups; fastest to build within a factor of two
_WAVES = (
    WAVES_PER_METRE,
    WAVES_HALF_CELL,
    WAVES_LOG_DEPTH,
    WAVES_PER_LOG,
    GLITTER,
    GLITTER_WIDTH,
    CAUSTIC_STRENGTH,
)


@dataclass(frozen=True)
class Shape:
    """What decides the nodes of the groups; everything else is a number in them.

    Parameters
    ----------
    bands : int
        Number of bands n.
    components : tuple of PhaseFunction
        Parts of the phase function; their weights per band are numbers.
    lobes : int
        Terms of the sun's aureole, 0 leaves it out.
    flat : bool
        Whether the water has a surface that reflects.
    shafts : bool
        Whether single scattering comes from the volume.
    waves : bool
        Whether the surface moves and throws caustics.
    inelastic : tuple of bool
        Exponentials of depth of the inelastic light: whether each rises to the floor.
    diffuse_shadows : bool
        Whether things keep light from above other than the direct sun away.
    solved : bool
        Whether the light is looked up in tables of the solved field; it has no aureole and
        no inelastic exponentials then.
    sky : str
        Distribution of the sky's radiance.
    layered : bool
        Whether the water differs with depth; it is solved and has no shafts then.
    zones, slices : int
        Of the scale of depths of solved water.
    """

    bands: int
    components: tuple[PhaseFunction, ...]
    lobes: int
    flat: bool
    shafts: bool
    waves: bool = False
    inelastic: tuple[bool, ...] = ()
    diffuse_shadows: bool = False
    solved: bool = False
    sky: str = UNIFORM
    layered: bool = False
    zones: int = 0
    slices: int = 0

    @property
    def triples(self) -> int:
        """Number of vectors that carry the bands."""
        return math.ceil(self.bands / 3)

    @property
    def layered_components(self) -> int:
        """Parts of the phase function that layered water has tables for."""
        return len(self.components) if self.layered else 0


@dataclass(frozen=True, eq=False)
class Numbers:
    """The contents of UW Values.

    Parameters
    ----------
    bands : mapping of str to array, shape (n,)
        Quantities per band.
    single : mapping of str to float
        The others.
    """

    bands: Mapping[str, NDArray[np.float64]]
    single: Mapping[str, float]


def band_names(shape: Shape) -> list[str]:
    """Names of the quantities per band."""
    of_light = _FIELD_BANDS
    if shape.solved:
        of_beam = _LAYERED_BANDS if shape.layered else _BEAM_BANDS
        of_light = (*of_beam, _TABLE_SCALE, _TABLE_DECAY, FLOOR)
    names = [*of_light, SKY, *REFLECTANCE, *EMISSION, *SENSOR]
    if len(shape.components) > 1 and not shape.layered:
        names += [f"phase {i}" for i in range(len(shape.components))]
    if shape.lobes:
        names += ["aureole single", *_SMOOTH]
        names += [
            f"lobe {kind} {i}" for kind in ("weight", "asymmetry") for i in range(shape.lobes)
        ]
    if shape.waves:
        names += CONTRAST
    return [*names, *realtime_inelastic.band_names(shape.inelastic)]


def single_names(shape: Shape) -> list[str]:
    """Names of the quantities that are the same in every band."""
    names = [*_FIELD_NUMBERS, *SUN, *SUN_IN_AIR, CAMERA_DEPTH, INDEX, SHAFT_END, SHAFT_SCALE]
    return [*names, *_WAVES] if shape.waves else names


def _zone_names(shape: Shape) -> list[str]:
    return [_of_zone(field, place) for place in range(shape.zones) for field in _ZONE]


def of_table(beam: SunBeam, table: RadianceTable, floor: NDArray[np.float64]) -> Numbers:
    """Return the numbers of the sun, and of tables of the solved field over a floor's radiance.

    The beam is that of the water, or of the first of its layers.
    """
    bands = {name: getattr(beam, name) for name in _BEAM_BANDS}
    bands |= {_TABLE_SCALE: table.scale, _TABLE_DECAY: table.decay, FLOOR: floor}
    depths = {
        _of_zone(field, place): getattr(zone, field)
        for place, zone in enumerate(table.depth_scale.zones)
        for field in _ZONE
    }
    return Numbers(bands | _phase(beam.phase), _sun(beam) | depths)


def _of_zone(field: str, place: int) -> str:
    return f"zone {place} {field}"


def looked_up_on_surface(shape: Shape) -> list[str]:
    """Names of what :meth:`.Tables.near_and_far` and :meth:`.Tables.on_patch` find."""
    if not shape.solved:
        return []
    names = [NEAR, FAR, IMAGE, AUREOLE, PATCH, *([FROM_ABOVE] if shape.diffuse_shadows else [])]
    if shape.layered:
        names += [EXTINCTION, WITHOUT_PEAK, WITHOUT_PEAK_BEHIND]
        names += [EXTINCTION_OF_SUN, WITHOUT_PEAK_OF_SUN]
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
    return names


def _parts(shape: Shape, name: str) -> list[str]:
    return [f"{name} {i}" for i in range(shape.layered_components)]


def of_water(water: ClosedForm, shape: Shape) -> Numbers:
    """Return the numbers of the closed form itself."""
    bands = {name: getattr(water.field, name) for name in _FIELD_BANDS} | _phase(water.phase)
    if shape.lobes:
        aureole = water.aureole
        bands["aureole single"] = aureole.single
        bands |= dict(zip(_SMOOTH, aureole.smooth, strict=True))
        for kind, rows in (("weight", aureole.weights), ("asymmetry", aureole.asymmetries)):
            bands |= {f"lobe {kind} {i}": row for i, row in enumerate(rows)}
    return Numbers(bands, _sun(water.beam))


def _phase(phase: Mixture) -> dict[str, NDArray[np.float64]]:
    if len(phase.components) == 1:
        return {}
    return {f"phase {i}": row for i, row in enumerate(phase.weights)}


def _sun(beam: SunBeam) -> dict[str, float]:
    numbers = {name: getattr(beam, name) for name in _FIELD_NUMBERS}
    return numbers | dict(zip(SUN, beam.sun, strict=True))


def build(shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; its numbers are zero. Those of solved bands are in an image."""
    tree = new_group(NAME)
    tree[SHAPE] = repr(shape)
    graph = Graph(tree)
    output = tree.nodes.new("NodeGroupOutput")
    sources = [
        *(
            (name, "ShaderNodeValue", "NodeSocketFloat")
            for name in (*single_names(shape), *_zone_names(shape))
        ),
        *(
            (f"{name} {triple}", "ShaderNodeCombineXYZ", "NodeSocketVector")
            for name in (() if shape.solved else band_names(shape))
            for triple in range(shape.triples)
        ),
    ]
    for row, (name, kind, socket) in enumerate(sources):
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=socket)
        node = graph.node(kind, name=name, label=name)
        node.location = (0.0, -40.0 * row)
        tree.links.new(node.outputs[0], output.inputs[row])
    output.location = (300.0, 0.0)
    return tree


def write(tree: bpy.types.ShaderNodeTree, numbers: Numbers) -> None:
    """Put numbers into the group; only what differs is touched."""
    touched = None
    for name, values in numbers.bands.items():
        triples = _full_triples(name, values)
        for index, triple in enumerate(triples.reshape(-1, 3)):
            if f"{name} {index}" not in tree.nodes:
                break
            inputs = tree.nodes[f"{name} {index}"].inputs
            now = np.empty(3, np.float32)
            inputs.foreach_get("default_value", now)
            if not np.array_equal(now, triple):
                inputs.foreach_set("default_value", triple)
                touched = inputs[0]
    for name, value in numbers.single.items():
        outputs = tree.nodes[name].outputs
        if outputs[0].default_value != np.float32(value):
            outputs.foreach_set("default_value", [float(value)])
            touched = outputs[0]
    # Ordinary assignments update the tree, at a cost: one is enough for all.
    if touched is not None:
        touched.default_value = touched.default_value


def rows(numbers: Numbers, shape: Shape) -> list[NDArray[np.float32]]:
    """Return the numbers of solved bands, in full triples, as :class:`.Tables` finds them."""
    return [_full_triples(name, numbers.bands[name]) for name in band_names(shape)]


def _full_triples(name: str, values: NDArray[np.float64]) -> NDArray[np.float32]:
    triples = pad_triples(values).astype(np.float32)
    if name in SENSOR:  # bands that only fill their triple are not seen
        triples[len(values) :] = 0.0
    return triples


def pad_triples(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repeat the last band until the triples are full."""
    return np.pad(np.asarray(values, dtype=np.float64), (0, -len(values) % 3), mode="edge")


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
        numbers = {name: self[name] for name in (*_BEAM_BANDS, *_FIELD_NUMBERS)}
        p = self._known_phase(towards)
        return SunBeam(**numbers, phase=self._phase, sun=self.sun, p=p)

    def _leg(self, c: str, cp: str, near: Operand = 0.0, far: Operand = 0.0) -> LayeredBeam:
        """Return the direct sun on a path in layered water with the extinctions looked up."""
        numbers = {name: self[name] for name in (*_LAYERED_BANDS, *_FIELD_NUMBERS)}
        return LayeredBeam(self[c], self[cp], **numbers, sun=self.sun, near=near, far=far)

    def _once(self, name: str, towards: str, y: Operand) -> Operand:
        """Sunlight scattered once in layered water, looked up at depth y."""
        parts = range(self.shape.layered_components)
        light = (self[f"{towards} {i}"] * self[f"{name} {i}"] for i in parts)
        unit = table_unit(self[_TABLE_SCALE], self[_TABLE_DECAY], y, NODES)
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
        field = {name: self[name] for name in (*_FIELD_BANDS, *_FIELD_NUMBERS)}
        light = LightField(**field, **dict.fromkeys(_NOT_PER_PIXEL))
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

    def solved_path(self, y_o: NodeValue, y_e: NodeValue) -> SolvedWater:
        """Return the solved water in front of a thing at depth y_e."""
        near, far = (self._looked_up(name, y) for name, y in ((NEAR, y_o), (FAR, y_e)))
        image = self[IMAGE] * self[_TABLE_SCALE]
        beam, beyond = self._beams_to_thing(y_o, y_e)
        return SolvedWater(beam, near, far, image, beyond, aureole=self[AUREOLE])

    def _beams_to_thing(self, y_o: NodeValue, y_e: NodeValue) -> tuple[SunOnPath, SunOnPath | None]:
        if not self.shape.layered:
            return self.beam, None
        far = self._once(ONCE_BEHIND, TOWARDS, y_e)
        beam = self._leg(EXTINCTION, WITHOUT_PEAK, self._once(ONCE, TOWARDS, y_o), far)
        return beam, self._leg(WITHOUT_PEAK_BEHIND, WITHOUT_PEAK_BEHIND, far)

    def solved_background(self, y_o: NodeValue) -> SolvedWater:
        """Return the solved water up to its surface and its floor."""
        index, mirrored = None, 0.0
        if self.shape.flat:
            index, mirrored = self[INDEX], self[MIRRORED] * self[_TABLE_SCALE]
        near, floor = self._looked_up(NEAR, y_o), self[FLOOR]
        beam, below = self._beams_ahead(y_o)
        return SolvedWater(
            beam, near, mirrored=mirrored, below=below, floor=floor, sky=self._sky(), index=index,
            aureole=self[AUREOLE],
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
        return SolvedPatchLight(beam, self._looked_up(PATCH, y), above)

    def _looked_up(self, name: str, y: Operand) -> NodeValue:
        return self[name] * table_unit(self[_TABLE_SCALE], self[_TABLE_DECAY], y, NODES)

    def _aureole(self) -> Aureole:
        if not self.shape.lobes:
            return Aureole(1.0, (0.0, 0.0, 0.0), (), ())
        lobes = range(self.shape.lobes)
        return Aureole(
            self["aureole single"],
            tuple(self[name] for name in _SMOOTH),
            tuple(self[f"lobe weight {i}"] for i in lobes),
            tuple(self[f"lobe asymmetry {i}"] for i in lobes),
        )

    def seen(self, pixel: Pixel) -> NodeValue:
        """Return what three bands of a pixel add to the colour that the sensor sees."""
        return self.sensor(pixel.total)

    def sensor(self, radiance: NodeValue) -> NodeValue:
        """Return what three bands add to the colour that the sensor sees."""
        weights = [self[name] for name in SENSOR]
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
    formula: Callable[[Graph, Values], Sequence[NodeValue]],
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
        Makes the nodes; returns what the bands add to the colour: of all light, and,
        if the shape has shafts, of the light that the volume draws.
    """
    tree = new_group(name)
    sockets = dict(inputs)
    sockets |= dict.fromkeys(single_names(shape), "NodeSocketFloat")
    sockets |= dict.fromkeys(band_names(shape), "NodeSocketVector")
    for socket, kind in sockets.items():
        tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind)
    graph = Graph(tree, None if shape.solved else _PART_SIZE)
    outputs = graph.node("NodeGroupInput").outputs
    given = {socket.name: graph.term(socket) for socket in outputs if socket.name}
    results = formula(graph, Values(graph, given, shape))
    for socket in (SEEN, DRAWN)[: len(results)]:
        tree.interface.new_socket(socket, in_out="OUTPUT", socket_type="NodeSocketVector")
    end = graph.node("NodeGroupOutput").inputs
    for result, socket in zip(results, end, strict=False):
        graph.assign(result, socket)
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
    image : Image, optional
        The tables of solved bands.
    """

    def __init__(
        self,
        graph: Graph,
        values: bpy.types.ShaderNodeTree,
        shape: Shape,
        image: bpy.types.Image | None,
    ) -> None:
        self._graph, self._shape = graph, shape
        self._numbers = graph.node("ShaderNodeGroup", node_tree=values).outputs
        if image is not None:
            self._begin = graph.node("GeometryNodeRepeatInput")
            self._end = graph.node("GeometryNodeRepeatOutput")
            self._begin.pair_with_output(self._end)
            self._begin.inputs["Iterations"].default_value = shape.triples
            self.tables = self._tables(image)

    def _tables(self, image: bpy.types.Image) -> Tables:
        zones = tuple(
            Zone(**{field: self._number(_of_zone(field, place)) for field in _ZONE})
            for place in range(self._shape.zones)
        )
        return Tables(
            self._graph,
            image,
            self._shape.triples,
            self._graph.term(self._begin.outputs["Iteration"]),
            band_names(self._shape),
            DepthScale(zones, self._shape.slices),
            [self._number(name) for name in SUN],
            self._shape.layered_components,
        )

    def _number(self, name: str) -> NodeValue:
        return self._graph.term(self._numbers[name])

    def own(self, name: str, given: Mapping[str, NodeValue]) -> NodeValue:
        """Of the terms ``NAME i``, one for each triple, return that of the present one."""
        total: Operand = 0.0
        for triple in range(self._shape.triples):
            here = self._graph.operation("COMPARE", (self.tables.index, float(triple), 0.5))
            total = here * given[f"{name} {triple}"] + total
        return total

    def sum(self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]) -> NodeValue:
        """Add up the triples, without the light that the volume draws.

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
        if len(totals) == 1:
            return totals[0]
        return totals[0] - NODES.maximum(totals[1], 0.0)

    def _unrolled(
        self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]
    ) -> list[Operand]:
        totals: list[Operand] = [0.0] * (2 if DRAWN in triple.interface.items_tree else 1)
        for index in range(self._shape.triples):
            node = self._graph.node("ShaderNodeGroup", node_tree=triple)
            for socket in node.inputs:
                own = f"{socket.name} {index}"
                source = given.get(socket.name) or given.get(own)
                if source is None:
                    source = self._number(own if own in self._numbers else socket.name)
                self._graph.assign(source, socket)
            for place, output in enumerate(node.outputs):
                totals[place] = self._graph.term(output) + totals[place]
        return totals

    def _looped(
        self, triple: bpy.types.ShaderNodeTree, given: Mapping[str, NodeValue]
    ) -> list[Operand]:
        node = self._graph.node("ShaderNodeGroup", node_tree=triple)
        of_bands = set(band_names(self._shape))
        for socket in node.inputs:
            source = given.get(socket.name)
            if source is None:
                look_up = self.tables.number if socket.name in of_bands else self._number
                source = look_up(socket.name)
            self._graph.assign(source, socket)
        self._end.repeat_items.clear()
        for output in node.outputs:
            self._end.repeat_items.new("VECTOR", output.name)
        for output in node.outputs:
            before = self._graph.term(self._begin.outputs[output.name])
            self._graph.assign(before + self._graph.term(output), self._end.inputs[output.name])
        return [self._graph.term(self._end.outputs[output.name]) for output in node.outputs]
