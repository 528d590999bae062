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
    size = 2.0 * given[RADIUS]
    sides = {"Size X": size, "Vertices X": 2, "Size Y": size, "Vertices Y": 2}
    inputs = {
        "Mesh": graph.node("GeometryNodeMeshGrid", sides).outputs[0],
        "Density": given[DENSITY],
        "Seed": given[SEED],
    }
    spots = graph.node("GeometryNodeDistributePointsOnFaces", inputs)
    place = graph.term(graph.node("GeometryNodeInputPosition").outputs[0])
    x, y, _ = graph.components(place)
    inputs = {"Object": given[SEABED]}
    seabed = graph.node("GeometryNodeObjectInfo", inputs, transform_space="RELATIVE")
    inputs = {
        "Target Geometry": seabed.outputs["Geometry"],
        "Source Position": graph.vector(x, y, _ABOVE),
        "Ray Direction": (0.0, 0.0, -1.0),
        "Ray Length": _FAR,
    }
    ray = graph.node("GeometryNodeRaycast", inputs)
    flat = graph.vector(x, y, 17.3 * given[SEED]) * (1.0 / given[PATCH])
    noise = graph.node("ShaderNodeTexNoise", {"Scale": 1.0, "Vector": flat})
    normal = graph.term(ray.outputs["Hit Normal"])
    slope = NODES.arccos(NODES.minimum(NODES.absolute(graph.components(normal)[2]), 1.0))
    here = (
        graph.term(ray.outputs["Is Hit"])
        * NODES.less(x * x + y * y, given[RADIUS] * given[RADIUS])
        * NODES.less(slope, given[STEEPEST])
        * NODES.less(_PATCHY * NODES.sqrt(given[CLUMPS]), graph.term(noise.outputs[0]))
    )
    upright = graph.vector(0.0, 0.0, 1.0) * given[UPRIGHT]
    inputs = {"Vector": normal * (1.0 - given[UPRIGHT]) + upright}
    leaning = graph.node("FunctionNodeAlignRotationToVector", inputs, axis="Z")
    turn = made.about_z(made.chance(0) * (2.0 * math.pi))
    inputs = {"Rotation": leaning.outputs[0], "Rotate By": turn}
    turned = graph.node("FunctionNodeRotateRotation", inputs, rotation_space="LOCAL")
    inputs = {"Geometry": spots.outputs["Points"], "Position": ray.outputs["Hit Position"]}
    placed = graph.node("GeometryNodeSetPosition", inputs)
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
    place = graph.vector(radius * _cosine(angle), radius * NODES.sine(angle), z)
    points = graph.node("GeometryNodePoints", {"Count": given[NUMBER], "Position": place})
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
        self.given = {socket.name: self.graph.term(socket) for socket in inputs if socket.name}
        self.chance = PlaceChance(self.graph, self.given[SEED]).number

    def about_z(self, angle: NodeValue) -> bpy.types.NodeSocket:
        inputs = {"Axis": (0.0, 0.0, 1.0), "Angle": angle}
        return self.graph.node("FunctionNodeAxisAngleToRotation", inputs).outputs[0]

    def finished(
        self,
        points: bpy.types.NodeSocket,
        turned: bpy.types.NodeSocket,
        here: NodeValue | None = None,
    ) -> bpy.types.NodeTree:
        """Set objects on points; return the tree, which is the user's own."""
        graph, given = self.graph, self.given
        whole = {"Separate Children": True, "Reset Children": True}
        inputs = {"Collection": given[OBJECTS], **whole}
        objects = graph.node("GeometryNodeCollectionInfo", inputs)
        size = given[SMALLEST] + (given[LARGEST] - given[SMALLEST]) * self.chance(9)
        inputs = {
            "Points": points,
            "Rotation": turned,
            "Instance": objects.outputs[0],
            "Pick Instance": True,
            "Instance Index": NODES.floor(1e4 * self.chance(8)),
            "Scale": graph.vector(size, size, size),
        }
        made = graph.node("GeometryNodeInstanceOnPoints", inputs)
        if here is not None:
            graph.assign(here, made.inputs["Selection"])
        graph.node("NodeGroupOutput", {0: made.outputs[0]})
        for node in self.tree.nodes:
            del node[MARK]
        return self.tree
