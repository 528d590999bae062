"""Node group of every number that the real-time groups need: UW Values.

The other groups hold an instance of it. A change of water, camera or sun
writes numbers here and reaches every material; no node is added or removed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.channel_tables import RATES, ChannelNumbers, ChannelTables, LengthScale
from ..uw_spectral.transfer.depth_scale import DepthScale, Zone
from ..uw_spectral.transfer.radiance_field import FARTHEST
from ..uw_spectral.transfer.sky import UNIFORM
from ..uw_spectral.water.phase import PhaseFunction
from . import (
    realtime_adjacency,
    realtime_lamps,
    realtime_occlusion,
    realtime_reflected_view,
    realtime_refracted_view,
)
from .node_mathematics import Graph, NodeValue, new_group

NAME = "UW Values"
SHAPE = "uw_shape"

ZONE = tuple(f.name for f in fields(Zone))
SUN = ("sun x", "sun y", "sun z")
SUN_IN_AIR = ("sun in air x", "sun in air y", "sun in air z")
MU_S, FLOOR_DEPTH = "mu_s", "y_f"
LENGTH_FIRST, LENGTH_PER_LOG = "length first", "length per log"
FASTEST = "fastest"
CAMERA_DEPTH = "camera depth"
INDEX = "refractive index"
FRAME = ("frame left", "frame bottom", "frame width", "frame height")
SUN_GAIN = "sun gain"
SHAFT_END = "shaft end"
SHAFT_SCALE = "shaft scale"
_ALWAYS = (
    *(MU_S, FLOOR_DEPTH, *SUN, *SUN_IN_AIR, LENGTH_FIRST, LENGTH_PER_LOG, FASTEST),
    *(CAMERA_DEPTH, *FRAME, INDEX, SUN_GAIN, SHAFT_END, SHAFT_SCALE),
)
IN_AIR, RAY_INDEX = "camera in air", "index of rays"
PORT = "port before the camera"
CAMERA = ("camera x", "camera y", "camera z")
DRAWN_SUN = ("drawn sun x", "drawn sun y", "drawn sun z")
MIRRORED_FRACTION, MIRRORED_SUN = "mirrored sky", "mirrored sun"
_ABOVE = (IN_AIR, RAY_INDEX, *CAMERA, *DRAWN_SUN, MIRRORED_FRACTION, MIRRORED_SUN)
THROUGH = "picture of the air"
"""1 while the picture is drawn that shows what lies above the water, else 0."""
_WINDOW = (THROUGH, *CAMERA, MIRRORED_FRACTION, MIRRORED_SUN, *realtime_refracted_view.FIELDS.names)
WAVES_PER_METRE = "waves per metre"
WAVES_HALF_CELL = "waves half cell"
WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL = "long waves per metre", "long waves half cell"
WAVES_HIGHEST = "waves highest"
WAVES_LOG_DEPTH = "waves log depth"
WAVES_PER_LOG = "waves per log"
GLITTER = "glitter"
GLITTER_WIDTH = "glitter width"
CAUSTIC_STRENGTH, LEAST_PATTERN = "caustic strength", "least caustic pattern"
_WAVES = (
    *(WAVES_PER_METRE, WAVES_HALF_CELL, WAVES_LOG_DEPTH, WAVES_PER_LOG),
    *(GLITTER, GLITTER_WIDTH, CAUSTIC_STRENGTH, LEAST_PATTERN),
)

_RAISED = (WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL, WAVES_HIGHEST)
FOAM_FIRST, FOAM_PER_CROWDING = "foam first", "foam per crowding"
_FOAM = FOAM_FIRST, FOAM_PER_CROWDING
FOAM_IN_SUN, FOAM_IN_SKY, FOAM_BELOW = "foam in sun", "foam in sky", "foam below"

_OF_LIGHT = ("scale", "decay", *RATES, "single_decay")
SUN_ABOVE = tuple(f"sun above on {c}" for c in ("red", "green", "blue"))
SKY_ABOVE = tuple(f"sky above on {c}" for c in ("red", "green", "blue"))
WATER_ABOVE = tuple(f"light of water on {c}" for c in ("red", "green", "blue"))
GLOW_ABOVE = tuple(f"glow in air {c}" for c in ("red", "green", "blue"))
SKY_LEVEL, SUN_LEVEL = "sky above", "sun above"
FILTERS = tuple(f"let through of {c}" for c in ("red", "green", "blue"))
EXCITING = {name: f"exciting {name}" for name in _OF_LIGHT}
"""Numbers of the light that excites fluorophores, by what they are of the light that is seen."""
REFLECTANCE = tuple(f"reflectance {c}" for c in ("red", "green", "blue"))


@dataclass(frozen=True)
class Shape:
    """What decides the nodes of the groups; everything else is a number in them.

    Parameters
    ----------
    components : tuple of PhaseFunction
        Parts of the phase function.
    flat : bool
        Whether the water has a surface that reflects.
    zones, slices : int
        Of the scale of depths.
    shafts : bool
        Whether single scattering comes from the volume.
    waves : bool
        Whether the surface moves and throws caustics.
    raised : bool
        Whether it has heights.
    foam : bool
        Whether waves with heights leave foam.
    sky : str
        Distribution of the sky's radiance.
    layered : bool
        Whether the water differs with depth.
    occlusion : bool
        Whether objects keep all kinds of light away, and throw some back.
    adjacency : bool
        Whether it is known which part of the view objects fill.
    lamps, virtual : int
        Lamps in the water, and how many of them stand for what lit objects throw back.
    lamp_components : tuple of PhaseFunction
        Parts of the phase function of the water that they shine in.
    lamps_in_air : bool
        Whether some of them may shine into it from above.
    facets : int
        How many of :data:`.realtime_lamps.FACETS` the light of lamps may meet on an object.
    layers : tuple of str
        What is written beside the picture, of :mod:`.realtime_layers`.
    above : bool
        Whether the camera may be above the water.
    mirrors : bool
        Whether objects mirror the water.
    translucent : bool
        Whether light from behind objects shines through them.
    highlights : tuple of str
        Groups of :mod:`.realtime_highlights` that there are.
    filters : bool
        Whether objects let through more of one colour than of another.
    glows : bool
        Whether objects emit light.
    measured : int
        Measured reflectances.
    clouds, grids : tuple of PhaseFunction
        Of the matter of each cloud: of blobs, and of grids.
    port : bool
        Whether the camera looks through a port, where the water begins.
    planar_reflections : bool
        Whether a picture shows the objects that the surface mirrors.
    window : bool
        Whether a picture shows the objects in the air that are seen through the surface.
    fluorophores : int
        Of objects.
    fluorescent : tuple of str
        Names of the materials that have them.
    """

    components: tuple[PhaseFunction, ...]
    flat: bool
    zones: int = 1
    slices: int = 0
    shafts: bool = False
    waves: bool = False
    sky: str = UNIFORM
    layered: bool = False
    occlusion: bool = False
    adjacency: bool = False
    lamps: int = 0
    virtual: int = 0
    lamp_components: tuple[PhaseFunction, ...] = ()
    lamps_in_air: bool = False
    facets: int = 0
    layers: tuple[str, ...] = ()
    above: bool = False
    mirrors: bool = False
    translucent: bool = False
    highlights: tuple[str, ...] = ()
    filters: bool = False
    glows: bool = False
    measured: int = 0
    clouds: tuple[PhaseFunction, ...] = ()
    grids: tuple[PhaseFunction, ...] = ()
    port: bool = False
    planar_reflections: bool = False
    fluorophores: int = 0
    fluorescent: tuple[str, ...] = ()
    raised: bool = False
    foam: bool = False
    window: bool = False

    @property
    def floating(self) -> tuple[PhaseFunction, ...]:
        """Of the matter of all clouds."""
        return self.clouds + self.grids


@dataclass(frozen=True, eq=False)
class Numbers:
    """The contents of UW Values.

    Parameters
    ----------
    channels : mapping of str to array, shape (3,)
        Quantities of which each channel has its own.
    single : mapping of str to float
        The others.
    """

    channels: Mapping[str, NDArray[np.float64]]
    single: Mapping[str, float]


def channel_names(shape: Shape) -> list[str]:
    """Names of the quantities that each channel has its own of."""
    names: list[str] = [*_OF_LIGHT, *FILTERS]
    names += REFLECTANCE if "reflectance" in shape.layers else ()
    names += EXCITING.values() if shape.fluorophores else ()
    if shape.foam:
        names += [FOAM_BELOW, FOAM_IN_SUN, FOAM_IN_SKY]
    if shape.above or shape.window:
        names += [*SUN_ABOVE, *SKY_ABOVE, *WATER_ABOVE, *GLOW_ABOVE, SKY_LEVEL, SUN_LEVEL]
    return names


def single_names(shape: Shape) -> list[str]:
    """Names of the quantities that are the same in every channel."""
    names = list(_ALWAYS)
    names += _WAVES if shape.waves else ()
    names += _RAISED if shape.raised else ()
    names += _FOAM if shape.foam else ()
    names += realtime_occlusion.FIELDS.names if shape.occlusion else ()
    names += realtime_adjacency.FIELDS.names if shape.adjacency else ()
    names += _ABOVE if shape.above else ()
    names += _WINDOW if shape.window else ()
    names += (PORT,) if shape.port else ()
    names += realtime_reflected_view.FIELDS.names if shape.planar_reflections else ()
    names += realtime_lamps.NUMBERS if shape.lamps else ()
    return names + [_of_zone(field, i) for i in range(shape.zones) for field in ZONE]


def _of_zone(field: str, place: int) -> str:
    return f"zone {place} {field}"


def of_light(light: ChannelTables, sun: tuple[float, ...]) -> Numbers:
    """Return the numbers of the channel tables."""
    numbers = light.numbers
    single = {
        MU_S: float(numbers.mu_s),
        FLOOR_DEPTH: min(float(numbers.y_f), FARTHEST),
        **dict(zip(SUN, sun, strict=True)),
        LENGTH_FIRST: float(numbers.lengths.first),
        LENGTH_PER_LOG: float(numbers.lengths.per_log),
        FASTEST: light.fastest,
    }
    single |= {
        _of_zone(field, place): float(getattr(zone, field))
        for place, zone in enumerate(light.depth_scale.zones)
        for field in ZONE
    }
    return Numbers({name: getattr(numbers, name) for name in _OF_LIGHT}, single)


@dataclass(frozen=True, eq=False)
class Values:
    """The numbers of UW Values in a node tree.

    Parameters
    ----------
    graph : Graph
        The tree.
    group : ShaderNodeTree
        Of :func:`build`.
    """

    graph: Graph
    group: bpy.types.ShaderNodeTree
    shape: Shape

    def __getitem__(self, name: str) -> NodeValue:
        """Return a quantity by its name, a vector of channels or a single number."""
        return self.graph.term(self.graph.shared(self.group)[name])

    def of(self, *names: str) -> tuple[NodeValue, ...]:
        """Return several."""
        return tuple(self[name] for name in names)

    @property
    def outputs(self) -> bpy.types.NodeOutputs:
        """All of them."""
        return self.graph.shared(self.group)

    @property
    def lengths(self) -> LengthScale:
        """The scale of distances."""
        return LengthScale(self[LENGTH_FIRST], self[LENGTH_PER_LOG])

    @property
    def depth_scale(self) -> DepthScale:
        """The scale of depths."""
        zones = tuple(
            Zone(**{field: self[_of_zone(field, place)] for field in ZONE})
            for place in range(self.shape.zones)
        )
        return DepthScale(zones, self.shape.slices)

    @property
    def numbers(self) -> ChannelNumbers:
        """The numbers of the channel tables."""
        return self._numbers({name: self[name] for name in _OF_LIGHT})

    @property
    def exciting(self) -> ChannelNumbers:
        """Those of the light that excites fluorophores."""
        return self._numbers({name: self[EXCITING[name]] for name in _OF_LIGHT})

    def _numbers(self, light: dict[str, NodeValue]) -> ChannelNumbers:
        return ChannelNumbers(**light, lengths=self.lengths, mu_s=self[MU_S], y_f=self[FLOOR_DEPTH])


def build(shape: Shape) -> bpy.types.ShaderNodeTree:
    """Build the group; its numbers are zero."""
    tree = new_group(NAME)
    tree[SHAPE] = repr(shape)
    graph = Graph(tree)
    output = tree.nodes.new("NodeGroupOutput")
    sources = [
        *((name, "ShaderNodeValue", "NodeSocketFloat") for name in single_names(shape)),
        *((name, "ShaderNodeCombineXYZ", "NodeSocketVector") for name in channel_names(shape)),
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
    for name, values in numbers.channels.items():
        if name not in tree.nodes:
            continue
        inputs, wanted = tree.nodes[name].inputs, np.asarray(values, np.float32)
        now = np.empty(3, np.float32)
        inputs.foreach_get("default_value", now)
        if not np.array_equal(now, wanted):
            inputs.foreach_set("default_value", wanted)
            touched = inputs[0]
    for name, value in numbers.single.items():
        outputs = tree.nodes[name].outputs
        if outputs[0].default_value != np.float32(value):
            outputs.foreach_set("default_value", [float(value)])
            touched = outputs[0]
    # Ordinary assignments update the tree, at a cost: one is enough for all.
    if touched is not None:
        touched.default_value = touched.default_value
