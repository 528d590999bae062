"""Particles around the camera as geometry nodes, and the materials of them.

Each size class is one node of the group :func:`build_class`: its points fill a box that follows
the active camera, while the particles stay where they are in the water and drift with time. Only
those that the camera sees are instanced.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy

from ..uw_spectral.mathematics import dot
from ..uw_spectral.water.particles import (
    BUBBLES,
    PLANKTON,
    SILT,
    SNOW,
    TYPICAL_SLOPE,
    ParticleCloud,
    diameter,
    drifted,
    wrapped,
)
from .chance import PlaceChance
from .data_blocks import new_material
from .group_sockets import COLOUR, FLOAT, GEOMETRY, INTEGER, SWITCH, VECTOR, OpenGroup, Socket
from .node_mathematics import MARK, NODES, Graph, NodeValue, new_group

SHAPE, COUNT, SIDE, SEED = "Shape", "Count", "Box Side", "Seed"
TIMES = "Times"
SMALLEST, LARGEST, SLOPE = "Smallest", "Largest", "Slope"
RISE, RISE_LARGEST = "Rise of Smallest", "Rise of Largest"
DRIFT, WANDER, PACE, STRETCH = "Drift", "Wander", "Pace", "Stretch"
REFLECTANCE, DEEPEST, IN_VIEW = "Reflectance", "Deepest", "In View Only"
CLASS_NAME = "UW Particles of a Size"
_ATTRIBUTE = "uw_reflectance"
_PORT = 0.1
"""Nearer to the camera than this, m, is its housing."""
_MARGIN = 1.3  # of the picture's half width, for blurred ones that only reach into it
_INDEX = 1.34  # of water around bubbles; coarse beside their own distortion
_INPUTS = {
    SHAPE: Socket(GEOMETRY, "Bodies of diameter 1, as instances; one is picked each"),
    COUNT: Socket(INTEGER, "Particles in the box", 1000),
    TIMES: Socket(FLOAT, "Factor on their number", 1.0),
    SIDE: Socket(FLOAT, "Side of the box around the camera, m", 2.0),
    SMALLEST: Socket(FLOAT, "Diameter, m", 5e-4),
    LARGEST: Socket(FLOAT, "Diameter, m", 1e-3),
    SLOPE: Socket(FLOAT, "Numbers fall with this power of the diameter", TYPICAL_SLOPE),
    RISE: Socket(FLOAT, "Speed upwards of the smallest, m/s; negative sinks", 0.0),
    RISE_LARGEST: Socket(FLOAT, "Speed upwards of the largest, m/s", 0.0),
    DRIFT: Socket(VECTOR, "Velocity of the water, m/s", (0.0, 0.0, 0.0)),
    WANDER: Socket(FLOAT, "How far a particle strays from its path, m", 0.01),
    PACE: Socket(FLOAT, "How fast it does, radians per second", 1.0),
    STRETCH: Socket(FLOAT, "Longest side over the others, at most", 1.0),
    REFLECTANCE: Socket(COLOUR, "Mean reflectance", (0.5, 0.5, 0.5, 1.0)),
    DEEPEST: Socket(FLOAT, "Depth of the floor, m", 1e4),
    SEED: Socket(INTEGER, "Of places, sizes and turns", 0),
    IN_VIEW: Socket(SWITCH, "Leave out what the active camera does not see", True),
}


def build_class() -> bpy.types.GeometryNodeTree:
    """Build the group of the particles of a size class; output: instances in world space."""
    group = OpenGroup(CLASS_NAME, _INPUTS, {"Instances": GEOMETRY}, kind="GeometryNodeTree")
    graph, given = group.graph, group.given
    chance = PlaceChance(graph, given[SEED])
    side = given[SIDE]
    start = graph.components(chance.vector(0) * side)
    fraction = chance.number(1)
    size = diameter(fraction, given[SMALLEST], given[LARGEST], given[SLOPE], NODES)
    # Between the ends the speed follows a power law, as it does over an octave.
    along = NODES.log(size / given[SMALLEST]) / NODES.log(given[LARGEST] / given[SMALLEST])
    rise = given[RISE] + (given[RISE_LARGEST] - given[RISE]) * along
    time = graph.term(graph.node("GeometryNodeInputSceneTime").outputs["Seconds"])
    phases = graph.components(chance.vector(2) * (2.0 * math.pi))
    moved = drifted(
        start, time, rise, graph.components(given[DRIFT]), given[WANDER], given[PACE], phases, NODES
    )
    camera = graph.node("GeometryNodeInputActiveCamera").outputs[0]
    seat = graph.node("GeometryNodeObjectInfo", {"Object": camera}, transform_space="ORIGINAL")
    eye = graph.components(graph.term(seat.outputs["Location"]))
    place = [wrapped(x, o, side, NODES) for x, o in zip(moved, eye, strict=True)]
    shown = _is_there(place, eye, size, given[DEEPEST]) * _is_seen(
        graph, place, camera, seat.outputs["Transform"], given[IN_VIEW]
    )
    inputs = {"Count": given[COUNT] * given[TIMES], "Position": graph.vector(*place)}
    points = graph.node("GeometryNodePoints", inputs)
    turn = graph.node("FunctionNodeEulerToRotation", {0: chance.vector(4) * (2.0 * math.pi)})
    longer = 1.0 + (given[STRETCH] - 1.0) * chance.number(5)
    thinner = NODES.power(longer, -0.5)
    inputs = {
        "Points": points.outputs[0],
        "Selection": shown,
        "Instance": given[SHAPE],
        "Pick Instance": True,
        "Instance Index": NODES.floor(chance.number(3) * 1e3),
        "Rotation": turn.outputs[0],
        "Scale": graph.vector(size * longer, size * thinner, size * thinner),
    }
    instances = graph.node("GeometryNodeInstanceOnPoints", inputs)
    named = graph.node(
        "GeometryNodeStoreNamedAttribute", {"Name": _ATTRIBUTE, "Geometry": instances.outputs[0]},
        data_type="FLOAT_COLOR", domain="INSTANCE",
    )  # fmt: skip
    colour = given[REFLECTANCE] * (0.7 + 0.6 * chance.number(6))
    graph.assign(colour, named.inputs["Value"])
    return group.finished({"Instances": named.outputs[0]})


def _is_there(
    place: Sequence[NodeValue], eye: Sequence[NodeValue], size: NodeValue, deepest: NodeValue
) -> NodeValue:
    """Whether a place is in the water, and not in the camera."""
    away = [x - o for x, o in zip(place, eye, strict=True)]
    in_water = NODES.less(place[2], size * -1.0) * NODES.less(deepest * -1.0, place[2])
    return in_water * NODES.less(_PORT**2, dot(away, away))


def _is_seen(
    graph: Graph,
    place: Sequence[NodeValue],
    camera: bpy.types.NodeSocket,
    seat: bpy.types.NodeSocket,
    in_view: NodeValue,
) -> NodeValue:
    """Whether the camera sees a place, or every place counts."""
    lens = graph.node("GeometryNodeCameraInfo", {0: camera})
    back = graph.node("FunctionNodeInvertMatrix", {0: seat})
    inputs = {"Vector": graph.vector(*place), "Transform": back.outputs[0]}
    local = graph.node("FunctionNodeTransformPoint", inputs)
    inputs = {"Vector": local.outputs[0], "Transform": lens.outputs["Projection Matrix"]}
    flat = graph.node("FunctionNodeProjectPoint", inputs)
    x, y, _ = graph.components(graph.term(flat.outputs[0]))
    before = NODES.less(graph.components(graph.term(local.outputs[0]))[2], 0.0)
    inside = NODES.less(NODES.absolute(x), _MARGIN) * NODES.less(NODES.absolute(y), _MARGIN)
    return NODES.maximum(before * inside, 1.0 - in_view)


def build(name: str, cloud: ParticleCloud, material: bpy.types.Material) -> bpy.types.NodeTree:
    """Build the geometry of a kind of particles; :func:`write` gives it its numbers.

    They join what geometry there is, wherever the object of the modifier is.
    """
    tree = new_group(name, "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("OUTPUT", "INPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    times = tree.interface.new_socket(TIMES, in_out="INPUT", socket_type="NodeSocketFloat")
    times.default_value, times.min_value, times.description = 1.0, 0.0, _INPUTS[TIMES].text
    graph, group = Graph(tree), build_class()
    given = graph.node("NodeGroupInput").outputs
    inputs = {"Material": material, "Geometry": _SHAPES[cloud.kind.name](graph)}
    dressed = graph.node("GeometryNodeSetMaterial", inputs).outputs[0]
    inputs = {SHAPE: dressed, TIMES: given[TIMES]}
    nodes = [graph.node("GeometryNodeGroup", inputs, node_tree=group) for _ in cloud.classes]
    made = _in_own_space(graph, _joined(graph, [node.outputs[0] for node in nodes]))
    whole = _joined(graph, [made, given["Geometry"]])
    graph.node("NodeGroupOutput", {0: whole})
    return tree


def _joined(graph: Graph, parts: Sequence[bpy.types.NodeSocket]) -> bpy.types.NodeSocket:
    joined = graph.node("GeometryNodeJoinGeometry")
    for part in parts:
        graph.assign(part, joined.inputs[0])
    return joined.outputs[0]


def _in_own_space(graph: Graph, geometry: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    inputs = {"Object": graph.node("GeometryNodeSelfObject").outputs[0]}
    seat = graph.node("GeometryNodeObjectInfo", inputs, transform_space="ORIGINAL")
    back = graph.node("FunctionNodeInvertMatrix", {0: seat.outputs["Transform"]})
    inputs = {"Mode": "Matrix", "Geometry": geometry, "Transform": back.outputs[0]}
    return graph.node("GeometryNodeTransform", inputs).outputs[0]


def write(
    tree: bpy.types.NodeTree,
    cloud: ParticleCloud,
    drift: Sequence[float],
    deepest: float,
    seed: int,
) -> None:
    """Give the geometry of a kind its numbers; what is right already is left alone."""
    nodes = [n for n in tree.nodes if n.bl_idname == "GeometryNodeGroup"]
    kind = cloud.kind
    for index, (node, part) in enumerate(zip(nodes, cloud.classes, strict=True)):
        values = {
            COUNT: part.count,
            SIDE: part.side,
            SMALLEST: part.smallest,
            LARGEST: part.largest,
            SLOPE: cloud.slope,
            RISE: part.rise[0],
            RISE_LARGEST: part.rise[1],
            DRIFT: tuple(drift),
            WANDER: kind.wander,
            PACE: 2.0 * math.pi / kind.period,
            STRETCH: kind.stretch,
            REFLECTANCE: (*kind.reflectance, 1.0),
            DEEPEST: min(deepest, 1e4),
            SEED: len(nodes) * seed + index,
        }
        for name, value in values.items():
            socket = node.inputs[name]
            now = socket.default_value
            now = tuple(now) if isinstance(value, tuple) else now
            if now != value:
                socket.default_value = value


def empty(tree: bpy.types.NodeTree) -> None:
    """Take all particles out of the geometry of a kind."""
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeGroup" and node.inputs[COUNT].default_value:
            node.inputs[COUNT].default_value = 0


def grain_material() -> bpy.types.Material:
    """Make the material of grains and flocs: they let through as much light as they throw back."""
    made = new_material("UW Particles")
    _, graph, _ = made
    own = graph.node("ShaderNodeAttribute", attribute_type="INSTANCER", attribute_name=_ATTRIBUTE)
    colour = {"Color": own.outputs["Color"]}
    matte = graph.node("ShaderNodeBsdfDiffuse", colour)
    behind = graph.node("ShaderNodeBsdfTranslucent", colour)
    return _as_the_users(*made, graph.mixed(0.5, matte.outputs[0], behind.outputs[0]))


def bubble_material() -> bpy.types.Material:
    """Make the material of bubbles: mirrors towards their rim, where light is totally reflected."""
    made = new_material("UW Bubbles")
    _, graph, _ = made
    fresnel = graph.node("ShaderNodeFresnel", {"IOR": 1.0 / _INDEX})
    clear = graph.node("ShaderNodeBsdfTransparent")
    mirror = graph.node("ShaderNodeBsdfGlossy", {"Roughness": 0.15})
    shown = graph.mixed(fresnel.outputs[0], clear.outputs[0], mirror.outputs[0])
    return _as_the_users(*made, shown)


def _as_the_users(
    material: bpy.types.Material,
    graph: Graph,
    output: bpy.types.Node,
    shown: bpy.types.NodeSocket,
) -> bpy.types.Material:
    """Let a material of the water show a shader, with nodes that are sent through it as any."""
    graph.assign(shown, output.inputs["Surface"])
    for node in graph.tree.nodes:
        del node[MARK]
    material[MARK] = True
    return material


def _ball(graph: Graph, fine: int) -> bpy.types.NodeSocket:
    inputs = {"Radius": 0.5, "Subdivisions": fine}
    return graph.node("GeometryNodeMeshIcoSphere", inputs).outputs["Mesh"]


def _scaled(
    graph: Graph,
    mesh: bpy.types.NodeSocket,
    scale: tuple[float, float, float],
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> bpy.types.NodeSocket:
    inputs = {"Geometry": mesh, "Scale": scale, "Translation": place}
    return graph.node("GeometryNodeTransform", inputs).outputs[0]


def _instances(graph: Graph, meshes: Sequence[bpy.types.NodeSocket]) -> bpy.types.NodeSocket:
    node = graph.node("GeometryNodeGeometryToInstance")
    for mesh in meshes:
        graph.assign(mesh, node.inputs[0])
    return node.outputs[0]


def _lumps(graph: Graph, fine: int, roughness: float, kinds: int) -> bpy.types.NodeSocket:
    """Return balls that noise has pushed in and out."""
    meshes = []
    for number in range(kinds):
        inputs = {"Scale": 2.5, "Detail": 3.0, "W": 7.0 * number}
        noise = graph.node("ShaderNodeTexNoise", inputs, noise_dimensions="4D")
        push = (graph.term(noise.outputs[0]) - 0.5) * roughness
        normal = graph.term(graph.node("GeometryNodeInputNormal").outputs[0])
        inputs = {"Geometry": _ball(graph, fine), "Offset": normal * push}
        meshes.append(graph.node("GeometryNodeSetPosition", inputs).outputs[0])
    return _instances(graph, meshes)


def _copepod(graph: Graph) -> bpy.types.NodeSocket:
    """Return a body with antennae across its head, half as long as its stretch is at most."""
    body = _scaled(graph, _ball(graph, 2), (0.8, 0.4, 0.4))
    antennae = _scaled(graph, _ball(graph, 1), (0.05, 1.1, 0.05), (0.28, 0.0, 0.0))
    tail = _scaled(graph, _ball(graph, 1), (0.35, 0.1, 0.1), (-0.5, 0.0, 0.0))
    return _instances(graph, [_joined(graph, (body, antennae, tail))])


def _bubble(graph: Graph) -> bpy.types.NodeSocket:
    smooth = graph.node("GeometryNodeSetShadeSmooth", {"Geometry": _ball(graph, 3)})
    return _instances(graph, [smooth.outputs[0]])


_SHAPES = {
    SNOW: lambda graph: _lumps(graph, 2, 0.9, 4),
    PLANKTON: _copepod,
    BUBBLES: _bubble,
    SILT: lambda graph: _lumps(graph, 1, 0.5, 2),
}
