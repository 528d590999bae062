"""Geometry nodes that set a collection's objects on a seabed, or let them swim in a school.

They are the user's: not marked, so that they stay when the water is removed. Places are drawn about
the object of the modifier and looked for on the seabed by rays: a larger one changes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import bpy

from .chance import PlaceChance
from .node_mathematics import MARK, NODES, Graph, NodeValue

OBJECTS, SEABED, SEED, RADIUS = "Objects", "Seabed", "Seed", "Radius"
DENSITY, STEEPEST, CLUMPS, PATCH, UPRIGHT = "Density", "Steepest", "Clumps", "Patch Size", "Upright"
NUMBER, SPEED, LENGTH, BREADTH, HEIGHT = "Number", "Speed", "Length", "Breadth", "Height"
WANDER, TURN, SMALLEST, LARGEST = "Wander", "Turn", "Smallest", "Largest"
_ABOVE, _FAR = 200.0, 1e4  # m: where rays start, and how far they look
_PATCHY = 0.62  # noise above it has an eighth of the ground
_PACES = 0.5, 1.5  # rad/s, of how each strays

_INPUTS: dict[str, tuple[str, str, str]] = {
    OBJECTS: ("Collection", "NONE", "Collection of which an object is picked for each place"),
    SEABED: ("Object", "NONE", "Object that they stand on"),
    SEED: ("Int", "NONE", "Of places, sizes and turns"),
    RADIUS: ("Float", "DISTANCE", "Of the round that is filled, or of the circle that is swum"),
    DENSITY: ("Float", "NONE", "Objects on a square metre where there are some, 1/m²"),
    STEEPEST: ("Float", "ANGLE", "Slope above which nothing stands"),
    CLUMPS: ("Float", "FACTOR", "0: evenly; 1: in patches only"),
    PATCH: ("Float", "DISTANCE", "Size of patches"),
    UPRIGHT: ("Float", "FACTOR", "0: as the ground leans; 1: upright"),
    SMALLEST: ("Float", "NONE", "Least factor on the size"),
    LARGEST: ("Float", "NONE", "Largest factor on the size"),
    NUMBER: ("Int", "NONE", "How many swim"),
    SPEED: ("Float", "NONE", "Along the circle, m/s"),
    LENGTH: ("Float", "DISTANCE", "Half of the school along its way"),
    BREADTH: ("Float", "DISTANCE", "Half of it across"),
    HEIGHT: ("Float", "DISTANCE", "Half of it upright"),
    WANDER: ("Float", "DISTANCE", "How far each strays"),
    TURN: ("Float", "ANGLE", "About z, of a model that does not look along its y"),
}

Value = float | bpy.types.Object | bpy.types.Collection


def build_on_seabed(name: str, values: Mapping[str, Value]) -> bpy.types.NodeTree:
    """Build what fills a round of a seabed; ``values`` of its inputs, by name."""
    made = _Distribution(name, values)
    graph, given = made.graph, made.given
    grid = made.node("GeometryNodeMeshGrid")
    for side in ("X", "Y"):
        graph.assign(2.0 * given[RADIUS], grid.inputs[f"Size {side}"])
        grid.inputs[f"Vertices {side}"].default_value = 2
    spots = made.node("GeometryNodeDistributePointsOnFaces", Mesh=grid.outputs[0])
    graph.assign(given[DENSITY], spots.inputs["Density"])
    made.link(made.sockets[SEED], spots.inputs["Seed"])
    place = graph.term(graph.node("GeometryNodeInputPosition").outputs[0])
    x, y, _ = graph.components(place)
    seabed = made.node("GeometryNodeObjectInfo", Object=made.sockets[SEABED])
    seabed.transform_space = "RELATIVE"
    ray = made.node("GeometryNodeRaycast", Target_Geometry=seabed.outputs["Geometry"])
    graph.assign(graph.vector(x, y, _ABOVE), ray.inputs["Source Position"])
    ray.inputs["Ray Direction"].default_value = (0.0, 0.0, -1.0)
    ray.inputs["Ray Length"].default_value = _FAR
    noise = made.node("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 1.0
    flat = graph.vector(x, y, 17.3 * given[SEED])
    graph.assign(flat * (1.0 / given[PATCH]), noise.inputs["Vector"])
    normal = graph.term(ray.outputs["Hit Normal"])
    slope = NODES.arccos(NODES.minimum(NODES.absolute(graph.components(normal)[2]), 1.0))
    here = (
        graph.term(ray.outputs["Is Hit"])
        * NODES.less(x * x + y * y, given[RADIUS] * given[RADIUS])
        * NODES.less(slope, given[STEEPEST])
        * NODES.less(_PATCHY * NODES.sqrt(given[CLUMPS]), graph.term(noise.outputs[0]))
    )
    upright = graph.vector(0.0, 0.0, 1.0) * given[UPRIGHT]
    leaning = made.node("FunctionNodeAlignRotationToVector")
    leaning.axis = "Z"
    graph.assign(normal * (1.0 - given[UPRIGHT]) + upright, leaning.inputs["Vector"])
    turned = made.node("FunctionNodeRotateRotation", Rotation=leaning.outputs[0])
    turned.rotation_space = "LOCAL"
    made.link(made.about_z(made.chance(0) * (2.0 * math.pi)), turned.inputs["Rotate By"])
    placed = made.node("GeometryNodeSetPosition", Geometry=spots.outputs["Points"])
    made.link(ray.outputs["Hit Position"], placed.inputs["Position"])
    return made.finished(placed.outputs[0], turned.outputs[0], here)


def build_school(name: str, values: Mapping[str, Value]) -> bpy.types.NodeTree:
    """Build what swims a circle about the object, each at its place in the school."""
    made = _Distribution(name, values)
    graph, given = made.graph, made.given
    # Places in a ball, of which the school is the image.
    height = 2.0 * made.chance(1) - 1.0
    around = made.chance(2) * (2.0 * math.pi)
    out = NODES.power(made.chance(3), 1.0 / 3.0)
    level = out * NODES.sqrt(NODES.maximum(1.0 - height * height, 0.0))
    time = graph.term(graph.node("GeometryNodeInputSceneTime").outputs["Seconds"])
    pace = _PACES[0] + (_PACES[1] - _PACES[0]) * made.chance(4)
    stray = [
        given[WANDER] * NODES.sine(pace * time + 2.0 * math.pi * made.chance(number))
        for number in (5, 6, 7)
    ]
    radius = given[RADIUS] + given[BREADTH] * level * _cosine(around) + stray[0]
    along = given[SPEED] * time + given[LENGTH] * level * NODES.sine(around) + stray[1]
    angle = along * (1.0 / given[RADIUS])
    z = given[HEIGHT] * out * height + stray[2]
    points = made.node("GeometryNodePoints", Count=made.sockets[NUMBER])
    place = graph.vector(radius * _cosine(angle), radius * NODES.sine(angle), z)
    graph.assign(place, points.inputs["Position"])
    # At angle 0 the way is +y, and so looks the model.
    return made.finished(points.outputs[0], made.about_z(angle + given[TURN]))


def _cosine(angle: NodeValue) -> NodeValue:
    return NODES.sine(angle + 0.5 * math.pi)


class _Distribution:
    """A tree under construction that makes instances of a collection."""

    def __init__(self, name: str, values: Mapping[str, Value]) -> None:
        self.tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
        self.tree.is_modifier = True
        for way in ("OUTPUT", "INPUT"):
            self.tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
        for key, value in values.items():
            kind, unit, text = _INPUTS[key]
            socket = self.tree.interface.new_socket(
                key, in_out="INPUT", socket_type=f"NodeSocket{kind}", description=text
            )
            socket.default_value = value
            if kind == "Float":
                socket.subtype, socket.min_value = unit, -math.inf if key == SPEED else 0.0
        self.graph = Graph(self.tree)
        inputs = self.graph.node("NodeGroupInput").outputs
        self.sockets = {socket.name: socket for socket in inputs if socket.name}
        self.chance = PlaceChance(self.graph, self.sockets[SEED]).number
        self.given = {
            key: self.graph.term(self.sockets[key])
            for key in values
            if _INPUTS[key][0] in ("Float", "Int")
        }

    def node(self, kind: str, **inputs: bpy.types.NodeSocket) -> bpy.types.Node:
        """Add a node with links to its inputs, of which names have _ for blanks."""
        made = self.graph.node(kind)
        for name, socket in inputs.items():
            self.link(socket, made.inputs[name.replace("_", " ")])
        return made

    def link(self, one: bpy.types.NodeSocket, other: bpy.types.NodeSocket) -> None:
        self.tree.links.new(one, other)

    def about_z(self, angle: NodeValue) -> bpy.types.NodeSocket:
        made = self.node("FunctionNodeAxisAngleToRotation")
        made.inputs["Axis"].default_value = (0.0, 0.0, 1.0)
        self.graph.assign(angle, made.inputs["Angle"])
        return made.outputs[0]

    def finished(
        self,
        points: bpy.types.NodeSocket,
        turned: bpy.types.NodeSocket,
        here: NodeValue | None = None,
    ) -> bpy.types.NodeTree:
        """Set objects on points; return the tree, which is the user's own."""
        graph, given = self.graph, self.given
        objects = self.node("GeometryNodeCollectionInfo", Collection=self.sockets[OBJECTS])
        objects.inputs["Separate Children"].default_value = True
        objects.inputs["Reset Children"].default_value = True
        made = self.node(
            "GeometryNodeInstanceOnPoints", Points=points, Rotation=turned,
            Instance=objects.outputs[0],
        )  # fmt: skip
        made.inputs["Pick Instance"].default_value = True
        graph.assign(NODES.floor(1e4 * self.chance(8)), made.inputs["Instance Index"])
        if here is not None:
            graph.assign(here, made.inputs["Selection"])
        size = given[SMALLEST] + (given[LARGEST] - given[SMALLEST]) * self.chance(9)
        graph.assign(graph.vector(size, size, size), made.inputs["Scale"])
        self.link(made.outputs[0], graph.node("NodeGroupOutput").inputs[0])
        for node in self.tree.nodes:
            del node[MARK]
        return self.tree
