"""Node group of every number that the real-time groups need: UW Values.

The other groups hold an instance of it. A change of water, camera or sun
writes numbers here and reaches every material; no node is added or removed.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.wave_patterns import KNOTS
from ..uw_spectral.transfer.aureole import Aureole
from ..uw_spectral.transfer.closed_form import ClosedForm
from ..uw_spectral.transfer.inelastic_light import InelasticLight
from ..uw_spectral.transfer.light_field import LightField
from ..uw_spectral.transfer.pixel import Pixel, UndisturbedWater
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from . import realtime_inelastic
from .node_mathematics import NODES, Graph, NodeValue, new_group

NAME = "UW Values"
SHAPE = "uw_shape"

_FIELD_NUMBERS = ("mu_s", "y_f")
_NOT_PER_PIXEL = ("R",)
_FIELD_BANDS = tuple(
    f.name for f in fields(LightField) if f.name not in (*_FIELD_NUMBERS, *_NOT_PER_PIXEL)
)
SUN = ("sun x", "sun y", "sun z")
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
    """

    bands: int
    components: tuple[PhaseFunction, ...]
    lobes: int
    flat: bool
    shafts: bool
    waves: bool = False
    inelastic: tuple[bool, ...] = ()
    diffuse_shadows: bool = False

    @property
    def triples(self) -> int:
        """Number of vectors that carry the bands."""
        return math.ceil(self.bands / 3)


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
    names = [*_FIELD_BANDS, SKY, *REFLECTANCE, *EMISSION, *SENSOR]
    if len(shape.components) > 1:
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
    names = [*_FIELD_NUMBERS, *SUN, CAMERA_DEPTH, INDEX, SHAFT_END, SHAFT_SCALE]
    return [*names, *_WAVES] if shape.waves else names


def of_water(water: ClosedForm, shape: Shape) -> Numbers:
    """Return the numbers of the closed form itself."""
    bands = {name: getattr(water.field, name) for name in _FIELD_BANDS}
    if len(shape.components) > 1:
        bands |= {f"phase {i}": row for i, row in enumerate(water.phase.weights)}
    if shape.lobes:
        aureole = water.aureole
        bands["aureole single"] = aureole.single
        bands |= dict(zip(_SMOOTH, aureole.smooth, strict=True))
        for kind, rows in (("weight", aureole.weights), ("asymmetry", aureole.asymmetries)):
            bands |= {f"lobe {kind} {i}": row for i, row in enumerate(rows)}
    single = {name: getattr(water.field, name) for name in _FIELD_NUMBERS}
    single |= dict(zip(SUN, water.sun, strict=True))
    return Numbers(bands, single)


def build(shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; its numbers are zero."""
    tree = new_group(NAME)
    tree[SHAPE] = repr(shape)
    graph = Graph(tree)
    output = tree.nodes.new("NodeGroupOutput")
    sources = [
        *((name, "ShaderNodeValue", "NodeSocketFloat") for name in single_names(shape)),
        *(
            (f"{name} {triple}", "ShaderNodeCombineXYZ", "NodeSocketVector")
            for name in band_names(shape)
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
        triples = pad_triples(values).astype(np.float32)
        if name in SENSOR:  # bands that only fill their triple are not seen
            triples[len(values) :] = 0.0
        for index, triple in enumerate(triples.reshape(-1, 3)):
            inputs = tree.nodes[f"{name} {index}"].inputs
            now = np.empty(3, np.float32)
            inputs.foreach_get("default_value", now)
            if not np.array_equal(now, triple):
                inputs.foreach_set("default_value", triple)
                touched = inputs[0]
    # Ordinary assignments update the tree, at a cost: one is enough for all triples.
    if touched is not None:
        touched.default_value = touched.default_value
    for name, value in numbers.single.items():
        _assign(tree.nodes[name].outputs[0], float(value))


def pad_triples(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Repeat the last band until the triples are full."""
    return np.pad(np.asarray(values, dtype=np.float64), (0, -len(values) % 3), mode="edge")


def _assign(socket: bpy.types.NodeSocket, value: float) -> None:
    if socket.default_value != np.float32(value):
        socket.default_value = value


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
        self._constant = set(band_names(shape))

    def __getitem__(self, name: str) -> NodeValue:
        """Return a quantity by its name, a vector of three bands or a single number."""
        value = self._given[name]
        return self._graph.as_varying(value) if name in self._constant else value

    @functools.cached_property
    def elastic(self) -> ClosedForm:
        """The closed form of three bands over node values."""
        shape = self.shape
        field = {name: self[name] for name in (*_FIELD_BANDS, *_FIELD_NUMBERS)}
        light = LightField(**field, **dict.fromkeys(_NOT_PER_PIXEL))
        several = len(shape.components) > 1
        weights = tuple(
            self[f"phase {i}"] if several else 1.0 for i in range(len(shape.components))
        )
        sun = tuple(self[name] for name in SUN)
        return ClosedForm(light, Mixture(shape.components, weights), self._aureole(), sun)

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
        return UndisturbedWater(self.elastic, self[SKY], index, self.inelastic)

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
    graph = Graph(tree, _PART_SIZE)
    outputs = graph.node("NodeGroupInput").outputs
    given = {socket.name: graph.term(socket) for socket in outputs if socket.name}
    results = formula(graph, Values(graph, given, shape))
    for socket in (SEEN, DRAWN)[: len(results)]:
        tree.interface.new_socket(socket, in_out="OUTPUT", socket_type="NodeSocketVector")
    end = graph.node("NodeGroupOutput").inputs
    for result, socket in zip(results, end, strict=False):
        graph.assign(result, socket)
    return tree


def sum_of_triples(
    graph: Graph,
    values: bpy.types.ShaderNodeTree,
    triple: bpy.types.ShaderNodeTree,
    shape: Shape,
    given: Mapping[str, NodeValue],
) -> NodeValue:
    """Add up the triples in a tree, without the light that the volume draws.

    The volume draws no negative light: where the sum over the bands is
    negative, its light stays in what is returned.

    Parameters
    ----------
    graph : Graph
        The tree.
    values : ShaderNodeTree
        The group of :func:`build`.
    triple : ShaderNodeTree
        The group of :func:`build_triple`.
    shape : Shape
        Shape of the water.
    given : mapping of str to NodeValue
        Its inputs besides the numbers; ``NAME i`` goes to ``NAME`` of triple i.
    """
    numbers = graph.node("ShaderNodeGroup", node_tree=values)
    totals: list[Operand] = [0.0] * (2 if DRAWN in triple.interface.items_tree else 1)
    for index in range(shape.triples):
        node = graph.node("ShaderNodeGroup", node_tree=triple)
        for socket in node.inputs:
            own = f"{socket.name} {index}"
            source = given.get(socket.name) or given.get(own)
            if source is None:
                name = own if own in numbers.outputs else socket.name
                source = graph.term(numbers.outputs[name])
            graph.assign(source, socket)
        for place, output in enumerate(node.outputs):
            totals[place] = graph.term(output) + totals[place]
    if len(totals) == 1:
        return totals[0]
    return totals[0] - NODES.maximum(totals[1], 0.0)
