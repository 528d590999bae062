"""What a pixel knows about its ray, and the light that a volume draws along it."""

from __future__ import annotations

from .node_mathematics import NODES, Graph, NodeValue
from .realtime_values import SHAFT_END, Values


def view_direction(graph: Graph) -> tuple[NodeValue, NodeValue, NodeValue]:
    """Components of the unit view direction, away from the camera."""
    geometry = graph.node("ShaderNodeNewGeometry")
    x, y, z = graph.components(graph.term(geometry.outputs["Incoming"]))
    return -x, -y, -z


def depth_here(graph: Graph) -> NodeValue:
    """Depth of the shaded point, at least 0."""
    geometry = graph.node("ShaderNodeNewGeometry")
    z = graph.components(graph.term(geometry.outputs["Position"]))[2]
    return NODES.maximum(-z, 0.0)


def view_distance(graph: Graph) -> NodeValue:
    """Distance of the shaded point from the camera."""
    return graph.term(graph.node("ShaderNodeCameraData").outputs["View Distance"])


def shaft(
    values: Values, y_o: NodeValue, w: tuple[NodeValue, NodeValue, NodeValue], P: NodeValue | None
) -> NodeValue:
    """Single scattering that the volume draws: up to its end, at most up to P."""
    end = values[SHAFT_END]
    reach = end if P is None else NODES.minimum(P, end)
    return values.elastic.single_scattering(y_o, w, reach, NODES)
