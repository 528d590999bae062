"""What the sockets of a material hold at points of a surface, its closures apart.

Nodes are evaluated point by point as Blender's own do it. What cannot be known from nodes and mesh
counts as halfway; noise is drawn from its own distribution, so that patches count by what they
cover.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...node_groups import uplift
from .colour_nodes import BLENDS, as_hsl, as_hsv, from_hsl, from_hsv
from .image_texels import texels
from .number_nodes import MATHS, VECTOR_MATHS, map_range
from .pattern_nodes import brick, checker, gradient, noise, voronoi, wave
from .socket_rules import luminance_weights, source
from .surface_points import Array, SurfacePoints, spread

_DEEPEST = 64  # nodes in a row
_GRAZING = np.full((1, 1), 0.1)  # mean fraction of what shows at grazing angles
_CURVES = {"ShaderNodeRGBCurve": (3, 0, 1, 2), "ShaderNodeVectorCurve": (0, 1, 2)}
_SPACES = {"HSV": (as_hsv, from_hsv), "HSL": (as_hsl, from_hsl)}


@dataclass
class SampledSockets:
    """Values of the sockets of one material: shape (1 or n, 1) of numbers, else (1 or n, 3)."""

    points: SurfacePoints
    halfway: float = 0.5  #: What counts where nodes are not known.
    asked: bool = False  #: Something was asked that differs from surface to surface.
    #: Nodes that are not known, as Blender's menus call them.
    unknown: set[str] = field(default_factory=set)
    groups: list[bpy.types.Node] = field(default_factory=list)
    depth: int = 0

    @property
    def guess(self) -> Array:
        """What a socket holds if it is not known."""
        return np.full((1, 1), self.halfway)

    def of(self, socket: bpy.types.NodeSocket) -> Array:
        """Return what an input gets, as what it takes."""
        output = source(socket)
        if output is None:
            return _value(socket)
        return self.followed(lambda: converted(self.output(output), output, socket), self.guess)

    def number(self, socket: bpy.types.NodeSocket) -> Array:
        """Return what an input of a number gets, shape (1 or n,)."""
        return self.of(socket)[:, 0]

    def followed[Found](self, find: Callable[[], Found], too_deep: Found) -> Found:
        """Return what is found at an output, unless it lies too deep."""
        if self.depth >= _DEEPEST:
            return too_deep
        self.depth += 1
        try:
            return find()
        finally:
            self.depth -= 1

    def within[Found](
        self,
        output: bpy.types.NodeSocket,
        find: Callable[[bpy.types.NodeSocket], Found],
        unknown: Found,
    ) -> Found:
        """Return what is found at an output of a group, or of the inputs of the one followed."""
        node, groups = output.node, list(self.groups)
        if node.bl_idname == "NodeGroupInput":
            found = self.groups.pop().inputs if self.groups else ()
        else:
            ends = [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
            found = [i for end in ends if end.is_active_output for i in end.inputs]
            self.groups.append(node)
        try:
            inner = [i for i in found if i.identifier == output.identifier]
            return find(inner[0]) if inner else unknown
        finally:
            self.groups = groups

    def output(self, output: bpy.types.NodeSocket) -> Array:
        """Return what comes out of a node."""
        node = output.node
        kind = node.bl_idname
        if kind == "ShaderNodeGroup" and uplift.is_uplift(node.node_tree):
            return self.of(node.inputs[uplift.COLOR_INPUT])
        if kind == "NodeGroupInput" or (kind == "ShaderNodeGroup" and node.node_tree is not None):
            return self.within(output, self.of, self.guess)
        find = _NODES.get(kind)
        found = None if find is None else find(self, node, output)
        if found is not None:
            return found
        self.unknown.add(node.bl_label)
        return self.guess

    def inputs(self, node: bpy.types.Node) -> list[Array]:
        """Return what the inputs in use get."""
        return [self.of(i) for i in node.inputs if not i.is_unavailable]

    def drawn(self, node: bpy.types.Node, salt: str = "") -> Array:
        """Return numbers from 0 to 1, evenly spread, in an order of the node's own, (n, 1)."""
        order = self.chance(node, salt).permutation(self.points.count)
        return (order[:, None] + 0.5) / self.points.count

    def chance(self, node: bpy.types.Node, salt: str = "") -> np.random.Generator:
        """Return what draws numbers for a node, always the same."""
        return np.random.default_rng(zlib.crc32(f"{node.name}{salt}".encode()))

    def place(self, node: bpy.types.Node) -> Array | None:
        """Return where a texture is looked up: in the mesh's own box, unless it is linked."""
        vector = node.inputs["Vector"]
        if source(vector) is not None:
            return self.whole(self.of(vector))
        self.asked = True
        return self.points.generated()

    def whole(self, value: Array, columns: int = 3) -> Array:
        """Return values of all points, shape (n, 3)."""
        return np.broadcast_to(value, (self.points.count, columns))


def converted(value: Array, output: bpy.types.NodeSocket, socket: bpy.types.NodeSocket) -> Array:
    """Return a value as the socket at the other end of its link takes it."""
    if socket.type in ("RGBA", "VECTOR"):
        return np.broadcast_to(value, (len(value), 3))
    if value.shape[1] == 1:
        return value
    weights = luminance_weights() if output.type == "RGBA" else np.full(3, 1.0 / 3.0)
    return value @ weights[:, None]


def _value(socket: bpy.types.NodeSocket) -> Array:
    value = getattr(socket, "default_value", 0.5)
    return np.atleast_1d(np.array(value, float))[None, :3]


type _Find = Callable[[SampledSockets, bpy.types.Node, bpy.types.NodeSocket], Array | None]


def _ramp(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    place = 3 if output.name == "Alpha" else slice(3)
    found = [node.color_ramp.evaluate(float(x)) for x in at.number(node.inputs[0])]
    return np.array(found)[:, place].reshape(len(found), -1)


def _curves(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    fraction, colour = (at.of(i) for i in node.inputs)
    mapping = node.mapping
    mapping.initialize()
    curves = [mapping.curves[i] for i in _CURVES[node.bl_idname]]
    found = np.broadcast_to(colour, (len(colour), 3))
    if len(curves) == 4:
        every = curves.pop(0)
        found = np.array([[mapping.evaluate(every, x) for x in row] for row in found.tolist()])
    rows = [
        [mapping.evaluate(curve, x) for curve, x in zip(curves, row, strict=True)]
        for row in found.tolist()
    ]
    return colour + fraction * (np.array(rows) - colour)


def _float_curve(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    fraction, value = (at.of(i) for i in node.inputs)
    mapping = node.mapping
    mapping.initialize()
    found = np.array([[mapping.evaluate(mapping.curves[0], x)] for x in value[:, 0].tolist()])
    return value + fraction * (found - value)


def _mix(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array | None:
    fraction, one, other = at.inputs(node)
    old = node.bl_idname == "ShaderNodeMixRGB"
    if old or node.clamp_factor:
        fraction = np.clip(fraction, 0.0, 1.0)
    if not old and node.data_type != "RGBA":
        return one + fraction * (other - one)
    found = BLENDS[node.blend_type](one, other, fraction)
    clamp = node.use_clamp if old else node.clamp_result
    return np.clip(found, 0.0, 1.0) if clamp else found


def _math(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    with np.errstate(all="ignore"):
        found = MATHS[node.operation](*at.inputs(node))
    found = np.nan_to_num(found, posinf=0.0, neginf=0.0)
    return np.clip(found, 0.0, 1.0) if node.use_clamp else found


def _vector_math(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array | None:
    find = VECTOR_MATHS.get(node.operation)
    if find is None:
        return None
    with np.errstate(all="ignore"):
        return np.nan_to_num(find(*at.inputs(node)), posinf=0.0, neginf=0.0)


def _map_range(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    return map_range(*at.inputs(node), kind=node.interpolation_type, clamp=node.clamp)


def _clamp(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    value, low, high = at.inputs(node)
    if node.clamp_type == "RANGE":
        low, high = np.minimum(low, high), np.maximum(low, high)
    return np.minimum(np.maximum(value, low), high)


def _invert(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    fraction, colour = at.inputs(node)
    return colour + fraction * (1.0 - 2.0 * colour)


def _hue(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    names = "Hue", "Saturation", "Value", "Factor", "Color"
    hue, saturation, value, fraction, colour = (at.of(node.inputs[name]) for name in names)
    h, s, v = np.hsplit(as_hsv(colour), 3)
    changed = (h + hue + 0.5) % 1.0, np.clip(s * saturation, 0.0, 1.0), v * value
    found = from_hsv(np.concatenate(np.broadcast_arrays(*changed), axis=1))
    return np.maximum(colour + fraction * (found - colour), 0.0)


def _bright(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    colour, bright, contrast = at.inputs(node)
    return np.maximum((1.0 + contrast) * colour + bright - contrast * 0.5, 0.0)


def _gamma(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    colour, gamma = at.inputs(node)
    return np.where(colour > 0.0, np.maximum(colour, 1e-30) ** gamma, colour)


def _apart(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    value = at.of(node.inputs[0])
    if node.bl_idname == "ShaderNodeSeparateColor" and node.mode in _SPACES:
        value = _SPACES[node.mode][0](value)
    place = [o.identifier for o in node.outputs].index(output.identifier)
    return value[:, place : place + 1]


def _joined(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    found = np.concatenate(np.broadcast_arrays(*at.inputs(node)), axis=1)
    is_colour = node.bl_idname == "ShaderNodeCombineColor" and node.mode in _SPACES
    return _SPACES[node.mode][1](found) if is_colour else found


def _mapping(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    values = {i.name: at.of(i) for i in node.inputs if not i.is_unavailable}
    vector, scale, turn = values["Vector"], values["Scale"], _turn(values["Rotation"][0])
    shift = values.get("Location", np.zeros((1, 3)))
    if node.vector_type == "TEXTURE":
        return ((vector - shift) @ turn) / np.where(scale == 0.0, 1.0, scale)
    if node.vector_type == "NORMAL":
        return _unit((vector / np.where(scale == 0.0, 1.0, scale)) @ turn.T)
    return (vector * scale) @ turn.T + shift


def _turn(angles: Array) -> Array:
    (sx, sy, sz), (cx, cy, cz) = np.sin(angles), np.cos(angles)
    x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ y @ x


def _rotated(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array | None:
    values = {i.name: at.of(i) for i in node.inputs if not i.is_unavailable}
    away = values["Vector"] - values["Center"]
    sign = -1.0 if node.invert else 1.0
    if node.rotation_type == "EULER_XYZ":
        turn = _turn(values["Rotation"][0])
        return away @ (turn if node.invert else turn.T) + values["Center"]
    axes = {"X_AXIS": (1, 0, 0), "Y_AXIS": (0, 1, 0), "Z_AXIS": (0, 0, 1)}
    axis = np.array([axes[node.rotation_type]], float) if node.rotation_type in axes else None
    axis = _unit(values["Axis"] if axis is None else axis)
    angle = sign * values["Angle"]
    along = (away * axis).sum(axis=1, keepdims=True) * axis
    across = np.cos(angle) * (away - along) + np.sin(angle) * np.cross(axis, away)
    return along + across + values["Center"]


def _unit(vector: Array) -> Array:
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    return vector / np.where(length == 0.0, 1.0, length)


def _image(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    vector, at.asked = node.inputs["Vector"], True
    place = at.points.uv() if source(vector) is None else at.whole(at.of(vector))
    normal = at.points.normal()
    if node.projection == "BOX" and normal is not None and place is not None:
        across = np.abs(normal).argmax(axis=1)
        place = place[np.arange(len(place))[:, None], np.array([(1, 2), (0, 2), (0, 1)])[across]]
    elif node.projection != "FLAT" or place is None:
        place = spread(at.points.count)
    found = texels(node, place)
    return found[:, 3:] if output.name == "Alpha" else found[:, :3]


def _attribute(
    at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket
) -> Array | None:
    at.asked = True
    if node.bl_idname == "ShaderNodeVertexColor":
        found = at.points.attribute(node.layer_name)
    elif node.attribute_type == "GEOMETRY":
        found = at.points.attribute(node.attribute_name)
    else:
        item = at.points.item if node.attribute_type == "OBJECT" else None
        found = None if item is None else _property(item, node.attribute_name)
    if found is None:
        return np.zeros((1, 1)) if at.points.has_mesh else None
    if output.name == "Alpha":
        return found[:, 3:] if found.shape[1] == 4 else np.ones((1, 1))
    return found[:, :3].mean(axis=1, keepdims=True) if output.type == "VALUE" else found[:, :3]


def _property(item: bpy.types.Object, name: str) -> Array:
    """Return a property of an object's own, or one of Blender's, as an attribute."""
    try:
        found = item[name] if name in item else item.path_resolve(name)
        return np.atleast_1d(np.array(found, float))[None]
    except (TypeError, ValueError):
        return np.zeros((1, 1))


def _coordinates(
    at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket
) -> Array | None:
    at.asked, points = True, at.points
    match output.name:
        case "UV":
            return points.uv()
        case "Generated":
            return points.generated()
        case "Normal":
            return points.normal()
        case "Object":
            if node.object is None:
                return points.local()
            return _moved(points.local(), node.object.matrix_world.inverted() @ points.place)
    return None


def _geometry(
    at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket
) -> Array | None:
    at.asked, points = True, at.points
    match output.name:
        case "Position":
            return _moved(points.local(), points.place)
        case "Normal" | "True Normal":
            normal = points.normal()
            turn = np.array(points.place.to_3x3().inverted_safe())
            return None if normal is None else _unit(normal @ turn)
        case "Backfacing":
            return np.zeros((1, 1))
        case "Random Per Island":
            return at.drawn(node)
    return None


def _moved(places: Array | None, matrix: object) -> Array | None:
    turn = np.array(matrix)
    return None if places is None else places @ turn[:3, :3].T + turn[:3, 3]


def _object(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array | None:
    if output.name == "Random":
        return at.drawn(node)
    item, at.asked = at.points.item, True
    match output.name:
        case "Color" if item is not None:
            return np.array([item.color[:3]])
        case "Alpha" if item is not None:
            return np.array([[item.color[3]]])
        case "Object Index" if item is not None:
            return np.array([[float(item.pass_index)]])
        case "Location" if item is not None:
            return np.array([at.points.place.translation])
    return None


def _uv_map(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array | None:
    at.asked = True
    found = at.points.uv(node.uv_map)
    return np.zeros((1, 3)) if found is None and at.points.has_mesh else found


def _random(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    if output.type == "VALUE":
        return at.drawn(node)
    return np.concatenate([at.drawn(node, axis) for axis in "xyz"], axis=1)


def _noise(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array | None:
    if node.noise_type != "FBM" or not node.normalize:
        return None
    return noise(_random(at, node, output))


def _voronoi(
    at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket
) -> Array | None:
    if output.name == "Color":
        return _random(at, node, output)
    if output.name != "Distance":
        return None
    return voronoi(node, at.chance(node), at.points.count)


def _checker(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    one, other, scale = (at.of(node.inputs[n]) for n in ("Color1", "Color2", "Scale"))
    place = at.place(node)
    first = at.drawn(node) < 0.5 if place is None else checker(place * scale)
    fraction = first.astype(np.float64)
    return other + fraction * (one - other) if output.name == "Color" else fraction


def _brick(at: SampledSockets, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Array:
    values = {i.name: at.of(i) for i in node.inputs}
    place = at.place(node)
    if place is None:
        place = at.drawn(node) * (97.0, 0.0, 0.0) + at.drawn(node, "y") * (0.0, 89.0, 0.0)
    mortar, tint = brick(node, place * values["Scale"], values)
    if output.name != "Color":
        return mortar
    colour = values["Color1"] + tint * (values["Color2"] - values["Color1"])
    return colour + mortar * (values["Mortar"] - colour)


def _gradient(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    place = at.place(node)
    return at.drawn(node) if place is None else gradient(node.gradient_type, place)


def _wave(at: SampledSockets, node: bpy.types.Node, _: bpy.types.NodeSocket) -> Array:
    place = at.place(node)
    scale, phase = at.of(node.inputs["Scale"]), at.of(node.inputs["Phase Offset"])
    if place is None or np.any(at.of(node.inputs["Distortion"])):
        place, scale = at.drawn(node) * (1.0, 1.0, 1.0), np.full((1, 1), 10.0)
    return wave(node, place * scale, phase)


_NUMBERS: dict[str, _Find] = {
    "ShaderNodeRGB": lambda *about: _value(about[2]),
    "ShaderNodeValue": lambda *about: _value(about[2]),
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _curves,
    "ShaderNodeVectorCurve": _curves,
    "ShaderNodeFloatCurve": _float_curve,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix,
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeInvert": _invert,
    "ShaderNodeHueSaturation": _hue,
    "ShaderNodeBrightContrast": _bright,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeRGBToBW": lambda at, node, _: at.of(node.inputs[0]) @ luminance_weights()[:, None],
    "ShaderNodeSeparateColor": _apart,
    "ShaderNodeSeparateXYZ": _apart,
    "ShaderNodeCombineColor": _joined,
    "ShaderNodeCombineXYZ": _joined,
    "ShaderNodeMapping": _mapping,
    "ShaderNodeVectorRotate": _rotated,
}
EVERYWHERE = frozenset(_NUMBERS)
"""Nodes that make numbers of others, wherever they are evaluated."""
_NODES = _NUMBERS | {
    "ShaderNodeTexImage": _image,
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeVertexColor": _attribute,
    "ShaderNodeTexCoord": _coordinates,
    "ShaderNodeNewGeometry": _geometry,
    "ShaderNodeObjectInfo": _object,
    "ShaderNodeUVMap": _uv_map,
    "ShaderNodeTexNoise": _noise,
    "ShaderNodeTexWhiteNoise": _random,
    "ShaderNodeTexVoronoi": _voronoi,
    "ShaderNodeTexChecker": _checker,
    "ShaderNodeTexBrick": _brick,
    "ShaderNodeTexGradient": _gradient,
    "ShaderNodeTexWave": _wave,
    "ShaderNodeFresnel": lambda *_: _GRAZING,
    "ShaderNodeLayerWeight": lambda *_: _GRAZING,
}
