"""Node group of what clouds before a pixel do to it; formulas of uw_spectral/clouds."""

from __future__ import annotations

import bpy

from ..uw_spectral.clouds.cloud_light import CloudNumbers, Clouds, Veil
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.sun_beam import half_angle2
from .loops import summed
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue, new_group
from .realtime_rays import camera_place, place_here, view_direction, view_distance
from .realtime_values import FLOOR_DEPTH, FRAME, SUN, Shape, Values, cloud_names

NAME = "UW Clouds"
UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD = (
    "Unscattered", "Passed", "Light", "Middle", "Forward",
)  # fmt: skip
SUNLIGHT, SKYLIGHT = "Sunlight", "Skylight"
_OUTPUTS = (UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD)


def build(
    shape: Shape,
    values: bpy.types.ShaderNodeTree,
    rays: bpy.types.ShaderNodeTree | None = None,
    *,
    ahead: bool,
) -> bpy.types.ShaderNodeTree:
    """Build the group of clouds before a thing, or up to the boundary.

    Parameters
    ----------
    shape : Shape
    values : ShaderNodeTree
        Of :func:`.realtime_values.build`.
    rays : ShaderNodeTree, optional
        Of :mod:`.realtime_refraction`.
    ahead : bool
        Whether the path goes to the boundary. Else there are the outputs :data:`SUNLIGHT` and
        :data:`SKYLIGHT`: shares of the sun's and of other light that clouds leave on the thing.
    """
    tree = new_group(NAME)
    graph = Graph(tree, PART_SIZE, rays=rays)
    found = Values(graph, values, shape)
    clouds, w = _clouds(found, shape), view_direction(graph)
    if ahead:
        origin = camera_place(graph, found.of(*FRAME))
        y_o = NODES.maximum(-origin[2], 0.0)
        P = distance_in_water(y_o, -w[2], found[FLOOR_DEPTH], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    def add_up(count: int, terms: object) -> tuple[NodeValue, ...]:
        return summed(graph, count, terms)  # pyright: ignore[reportArgumentType]

    veil = clouds.veil(origin, w, P, half_angle2(w, found.of(*SUN), NODES), add_up)
    results: dict[str, Operand] = {
        UNSCATTERED: veil.unscattered,
        PASSED: veil.passed,
        LIGHT: veil.light,
        MIDDLE: veil.middle,
        FORWARD: veil.forward,
    }
    if not ahead:
        results[SUNLIGHT] = clouds.sunlight_left(place_here(graph))
        results[SKYLIGHT] = clouds.skylight_left(place_here(graph))
    for name in results:
        kind = "NodeSocketFloat" if name == MIDDLE else "NodeSocketVector"
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
    end = graph.node("NodeGroupOutput").inputs
    for name, result in results.items():
        graph.assign(result, end[name])
    return tree


def veil_of(found: dict[str, NodeValue]) -> Veil:
    """Return the veil from the outputs of the group."""
    return Veil(*(found[name] for name in _OUTPUTS))


def _clouds(values: Values, shape: Shape) -> Clouds:
    numbers = []
    for index in range(len(shape.clouds)):
        parts: dict[str, Operand] = {}
        for field, names in cloud_names(index).items():
            found = values.of(*names)
            parts[field] = found if len(names) > 1 else found[-1]
        numbers.append(CloudNumbers(**parts))
    return Clouds(numbers, shape.clouds, values.of(*SUN), NODES)
