"""What a pixel knows about its ray, and what lies at the ray's end in open water."""

from __future__ import annotations

from typing import Any

from . import realtime_inelastic
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_values import GLITTER, GLITTER_WIDTH, INDEX, SHAFT_END, SKY, Values


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


def background(
    values: Values,
    y: NodeValue,
    w: tuple[NodeValue, NodeValue, NodeValue],
    slopes: tuple[NodeValue, NodeValue] | None = None,
) -> NodeValue:
    """Radiance of undisturbed water with surface or floor behind, seen from depth y."""
    sky: Any = values[SKY]
    if values.shape.flat:
        sky = values.water.under_surface(w, sky, values[INDEX], NODES, slopes)
    if slopes is not None:
        width = values[GLITTER_WIDTH]
        glitter = values.water.sun_glitter(y, w, values[INDEX], width, slopes, NODES)
        sky = sky + glitter * values[GLITTER]
    seen = values.water.background(y, w, sky, NODES)
    if values.shape.inelastic:
        seen = seen + realtime_inelastic.background(values, y, w, values[INDEX])
    return seen


def shaft(
    values: Values, y_o: NodeValue, w: tuple[NodeValue, NodeValue, NodeValue], P: NodeValue | None
) -> NodeValue:
    """Single scattering that the volume draws: up to its end, at most up to P."""
    end = values[SHAFT_END]
    reach = end if P is None else NODES.minimum(P, end)
    return values.water.single_scattering(y_o, w, reach, NODES)
