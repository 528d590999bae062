"""What a pixel knows about its ray.

Where view rays may come from the air, it is the part of the ray in the water: it begins where
the surface bends the ray.
"""

from __future__ import annotations

import bpy

from .node_mathematics import NODES, Graph, NodeValue

DIRECTION, ORIGIN, DISTANCE, PLACE = "Direction", "Origin", "Distance", "Place"


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


def camera_place(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of what looks at the background."""
    if graph.rays is not None:
        return graph.components(graph.term(graph.shared(graph.rays)[ORIGIN]))
    return eye_place(graph)


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


def straight_direction(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Unit direction of the pixel's ray at the camera, never bent."""
    x, y, z = graph.components(_geometry(graph, "Incoming"))
    return -x, -y, -z


def straight_distance(graph: Graph) -> NodeValue:
    """Distance of what is drawn from the camera."""
    return graph.term(graph.node("ShaderNodeCameraData").outputs["View Distance"])


def drawn_place(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates at which the shaded point is drawn."""
    return graph.components(_geometry(graph, "Position"))


def eye_place(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of the camera, or of the eye of a view."""
    camera = graph.node(
        "ShaderNodeVectorTransform", vector_type="POINT", convert_from="CAMERA", convert_to="WORLD"
    )
    camera.inputs[0].default_value = (0.0, 0.0, 0.0)
    return graph.components(graph.term(camera.outputs[0]))


def _geometry(graph: Graph, name: str) -> NodeValue:
    node: bpy.types.Node = graph.node("ShaderNodeNewGeometry")
    return graph.term(node.outputs[name])
