"""Node group of every number that the real-time groups need: UW Values.

The other groups hold an instance of it. A change of water, camera or sun
writes numbers here and reaches every material; no node is added or removed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.transfer.channel_tables import RATES, ChannelNumbers, ChannelTables, LengthScale
from ..uw_spectral.transfer.depth_scale import DepthScale, Zone
from ..uw_spectral.transfer.radiance_field import FARTHEST
from .node_mathematics import Graph, NodeValue, new_group
from .shape import Shape

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
CAMERA = ("camera x", "camera y", "camera z")
DRAWN_SUN = ("drawn sun x", "drawn sun y", "drawn sun z")
MIRRORED_FRACTION, MIRRORED_SUN = "mirrored sky", "mirrored sun"
THROUGH = "picture of the air"
"""1 while the picture is drawn that shows what lies above the water, else 0."""
OF_LIGHT = ("scale", "decay", *RATES, "single_decay")
SUN_ABOVE = tuple(f"sun above on {c}" for c in ("red", "green", "blue"))
SKY_ABOVE = tuple(f"sky above on {c}" for c in ("red", "green", "blue"))
WATER_ABOVE = tuple(f"light of water on {c}" for c in ("red", "green", "blue"))
GLOW_ABOVE = tuple(f"glow in air {c}" for c in ("red", "green", "blue"))
SKY_LEVEL, SUN_LEVEL = "sky above", "sun above"
SKY_LEVELS = tuple(f"sky above of {c}" for c in ("red", "green", "blue"))
"""The first of a sky that is a picture, in its red, green and blue."""
OF_AIR = (*SUN_ABOVE, *SKY_ABOVE, *WATER_ABOVE, *GLOW_ABOVE, SKY_LEVEL, SUN_LEVEL)
"""Numbers of the light in the air."""
FILTERS = tuple(f"let through of {c}" for c in ("red", "green", "blue"))
REFLECTANCE = tuple(f"reflectance {c}" for c in ("red", "green", "blue"))


@dataclass(frozen=True, eq=False)
class Numbers:
    """The contents of UW Values, or part of them."""

    #: Quantities of which each channel has its own, (3,).
    channels: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    single: Mapping[str, float] = field(default_factory=dict)  #: The others.

    def __or__(self, more: Numbers) -> Numbers:
        return Numbers({**self.channels, **more.channels}, {**self.single, **more.single})


def channel_names(shape: Shape) -> list[str]:
    """Names of the quantities that each channel has its own of."""
    names: list[str] = [*OF_LIGHT, *FILTERS]
    names += REFLECTANCE if "reflectance" in shape.layers else ()
    names += (name for term in shape.terms for name in term.channels)
    return list(dict.fromkeys(names))


def single_names(shape: Shape) -> list[str]:
    """Names of the quantities that are the same in every channel."""
    names = list(_ALWAYS)
    names += (name for term in shape.terms for name in term.singles)
    names += (_of_zone(field, i) for i in range(shape.zones) for field in ZONE)
    return list(dict.fromkeys(names))


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
    return Numbers({name: getattr(numbers, name) for name in OF_LIGHT}, single)


@dataclass(frozen=True, eq=False)
class Values:
    """The numbers of UW Values, a group of :func:`build`, in a node tree."""

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
        return self.light({name: name for name in OF_LIGHT})

    def light(self, names: Mapping[str, str]) -> ChannelNumbers:
        """Return those of a light whose own numbers have other names."""
        light = {name: self[names[name]] for name in OF_LIGHT}
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
