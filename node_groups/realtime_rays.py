"""What a pixel knows about its ray."""

from __future__ import annotations

from .node_mathematics import NODES, Graph, NodeValue


def view_direction(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Components of the unit view direction, away from the camera."""
    geometry = graph.node("ShaderNodeNewGeometry")
    x, y, z = graph.components(graph.term(geometry.outputs["Incoming"]))
    return -x, -y, -z


def place_here(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of the shaded point."""
    geometry = graph.node("ShaderNodeNewGeometry")
    return graph.components(graph.term(geometry.outputs["Position"]))


def depth_here(graph: Graph) -> NodeValue:
    """Depth of the shaded point, at least 0."""
    return NODES.maximum(-place_here(graph)[2], 0.0)


def camera_place(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Coordinates of what looks at the background."""
    camera = graph.node(
        "ShaderNodeVectorTransform", vector_type="POINT", convert_from="CAMERA", convert_to="WORLD"
    )
    camera.inputs[0].default_value = (0.0, 0.0, 0.0)
    return graph.components(graph.term(camera.outputs[0]))


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
    return graph.term(graph.node("ShaderNodeCameraData").outputs["View Distance"])
