"""What a pixel knows about its ray.

Where view rays may come from the air, or through a port, it is the part of the ray in the water: it
begins where the surface bends the ray, or mirrors it, or at the port.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand, dot
from .group_sockets import OpenGroup
from .node_mathematics import NODES, Graph, NodeValue
from .shape import Sources, TermShape

_LEAST_COSINE = 1e-4
_UNMOVED = 1e-3  # m
_PORT_NAME, _MIRRORED_NAME = "UW Port Rays", "UW Mirrored Rays"
DIRECTION, ORIGIN, DISTANCE, PLACE = "Direction", "Origin", "Distance", "Place"
PORT = "port before the camera"


class PortShape(TermShape):
    """The camera looks through a port, where the water begins."""

    singles = (PORT,)

    @override
    def rays(self, sources: Sources) -> bpy.types.ShaderNodeTree:
        return build_port(sources.values)


def view_direction(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Components of the unit view direction, away from the camera."""
    if graph.rays is not None:
        return graph.components(graph.term(graph.shared(graph.rays)[DIRECTION]))
    return straight_direction(graph)


def place_here(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of the shaded point."""
    if graph.rays is not None:
        return graph.components(graph.term(graph.shared(graph.rays)[PLACE]))
    return drawn_place(graph)


def depth_here(graph: Graph) -> NodeValue:
    """Depth of the shaded point, at least 0."""
    return NODES.maximum(-place_here(graph)[2], 0.0)


def camera_place(
    graph: Graph, frame: Sequence[Operand] | None = None
) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of what looks at the background; arguments as of :func:`eye_place`."""
    if graph.rays is not None:
        return graph.components(graph.term(graph.shared(graph.rays)[ORIGIN]))
    return eye_place(graph, frame)


def camera_depth(graph: Graph) -> NodeValue:
    """Depth of what looks at the background, at least 0."""
    return NODES.maximum(-camera_place(graph)[2], 0.0)


def camera_depth_behind(
    y: NodeValue, w: tuple[NodeValue, NodeValue, NodeValue], P: NodeValue
) -> NodeValue:
    """Depth, at least 0, of the camera that sees a point at depth y at distance P along w."""
    return NODES.maximum(y + w[2] * P, 0.0)


def view_distance(graph: Graph) -> NodeValue:
    """Distance of the shaded point from the camera."""
    if graph.rays is not None:
        return graph.term(graph.shared(graph.rays)[DISTANCE])
    return straight_distance(graph)


def build_port(values: bpy.types.ShaderNodeTree) -> bpy.types.ShaderNodeTree:
    """Build the group of rays of a camera behind a port: straight, in the water from there on."""
    group = OpenGroup(_PORT_NAME)
    graph = group.graph
    w = straight_direction(graph)
    start = graph.term(graph.shared(values)[PORT]) / _along_axis(graph, w)
    return _begun(group, start)


def build_mirrored() -> bpy.types.ShaderNodeTree:
    """Build the group of rays that begin at the surface, for an eye at a camera's mirror image.

    Those of an eye in the water are as they are.
    """
    group = OpenGroup(_MIRRORED_NAME)
    graph = group.graph
    height, down = eye_place(graph)[2], -straight_direction(graph)[2]
    return _begun(group, NODES.maximum(height, 0.0) / NODES.maximum(down, _LEAST_COSINE))


def _begun(group: OpenGroup, start: NodeValue) -> bpy.types.ShaderNodeTree:
    """Bring out straight rays that begin at a distance from the eye."""
    graph = group.graph
    w, eye = straight_direction(graph), eye_place(graph)
    found = {
        DIRECTION: graph.vector(*w),
        ORIGIN: graph.vector(*(e + start * part for e, part in zip(eye, w, strict=True))),
        DISTANCE: NODES.maximum(straight_distance(graph) - start, 0.0),
        PLACE: graph.vector(*drawn_place(graph)),
    }
    return group.finished(found)


def straight_direction(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Unit direction of the pixel's ray at the camera, never bent."""
    x, y, z = graph.components(_geometry(graph, "Incoming"))
    return -x, -y, -z


def straight_distance(graph: Graph) -> NodeValue:
    """Distance of what is drawn from the camera along the pixel's ray.

    Rays of an orthographic camera begin on its plane, not at a point: the depth along the axis
    over the ray's cosine with that serves for both.
    """
    depth = graph.term(graph.node("ShaderNodeCameraData").outputs["View Z Depth"])
    return depth / _along_axis(graph, straight_direction(graph))


def _along_axis(graph: Graph, w: tuple[NodeValue, NodeValue, NodeValue]) -> NodeValue:
    """Cosine of a direction to the axis of the camera, not 0."""
    axis = _from_camera(graph, "VECTOR", (0.0, 0.0, -1.0))
    return NODES.maximum(dot(w, axis), _LEAST_COSINE)


def drawn_place(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates at which the shaded point is drawn."""
    return graph.components(_geometry(graph, "Position"))


def is_at_rest(graph: Graph) -> NodeValue:
    """Whether a displacement is asked for a vertex, 0 or 1, not for the normal of what it moved.

    EEVEE turns the normals of what is displaced as those of a bump, and wrongly: it takes the
    displacement along the normal for a height. It finds none where objects have been moved.
    """
    given = graph.node("ShaderNodeAttribute", attribute_type="GEOMETRY", attribute_name="position")
    own = _in_world(graph, "OBJECT", "POINT", given.outputs["Vector"])
    away = [a - b for a, b in zip(own, drawn_place(graph), strict=True)]
    unmoved = NODES.less(dot(away, away), _UNMOVED * _UNMOVED)
    strand = graph.term(graph.node("ShaderNodeHairInfo").outputs["Is Strand"])
    return NODES.maximum(unmoved, strand)


def eye_place(
    graph: Graph, frame: Sequence[Operand] | None = None
) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of the camera, or of the eye of a view.

    With the left and bottom edge, width and height of the picture of an orthographic camera, m, all
    zero of others: where the pixel's ray begins on its plane.
    """
    if frame is None:
        return _from_camera(graph, "POINT", (0.0, 0.0, 0.0))
    place = graph.components(graph.term(graph.node("ShaderNodeTexCoord").outputs["Window"]))
    left, bottom, width, height = frame
    at = left + place[0] * width, bottom + place[1] * height, 0.0
    return _from_camera(graph, "POINT", at)


def _from_camera(
    graph: Graph, kind: str, value: Sequence[Operand]
) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates in the world of a point or a vector in camera space, z backwards."""
    # The node's camera looks along +z, unlike Blender's.
    x, y, z = value
    if all(isinstance(part, float) for part in value):
        return _in_world(graph, "CAMERA", kind, (x, y, -z))
    return _in_world(graph, "CAMERA", kind, graph.vector(x, y, -1.0 * z))


def _in_world(
    graph: Graph, space: str, kind: str, value: Operand
) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates in the world of a point or a vector in another space."""
    node = graph.node(
        "ShaderNodeVectorTransform", {0: value},
        vector_type=kind, convert_from=space, convert_to="WORLD",
    )  # fmt: skip
    return graph.components(graph.term(node.outputs[0]))


def _geometry(graph: Graph, name: str) -> NodeValue:
    node: bpy.types.Node = graph.node("ShaderNodeNewGeometry")
    return graph.term(node.outputs[name])
