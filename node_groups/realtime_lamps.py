"""The light of lamps in the water, and on objects, as node groups that loop over them.

Shadows on objects are EEVEE's own: a lamp of one colour stands for each, so faint beside the sun
that it is not seen on the scene's own materials, and a white surface reads it.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Collection, Mapping, Sequence

import bpy

from ..uw_spectral.clouds.cloud_light import Clouds
from ..uw_spectral.clouds.lamp_lit_cloud import LampAndClouds, transmittance_to_surface
from ..uw_spectral.lamps.lamp import Lamp, ray_past_lamp
from ..uw_spectral.lamps.lamp_channels import COLOURS, matte_part, of_colour
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.facets import Facets
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.water.phase import PhaseFunction
from .group_sockets import COLOUR, FLOAT, VECTOR, OpenGroup
from .lamp_images import MEASURED_KEY, NAME, LampImages
from .lamp_table import LampTable
from .loops import followed, summed
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue
from .realtime_rays import camera_depth, camera_place, place_here, view_direction, view_distance

NORMAL, VISIBILITY, COLOR, MEASURED = "Normal", "Lamp Visibility", "Color", "Measured"
LIGHT = "Light"
MIRROR, EDGE, CLEAR, ROUGHNESS, CLEAR_INDEX = "Mirror", "Edge", "Clear", "Roughness", "Index"
COAT, COAT_ROUGHNESS, COAT_INDEX, COAT_NORMAL = (
    f"Coat{of}" for of in ("", " Roughness", " Index", " Normal")
)
FACETS: tuple[dict[str, str], ...] = (
    {MIRROR: COLOUR, EDGE: COLOUR, CLEAR: COLOUR, ROUGHNESS: FLOAT, CLEAR_INDEX: FLOAT},
    {COAT: FLOAT, COAT_ROUGHNESS: FLOAT, COAT_INDEX: FLOAT, COAT_NORMAL: VECTOR},
)
"""Inputs of the facets of objects and of those of coats over them: see :class:`.Facets`."""
SEEN, UNSCATTERED, FORWARD, THERE, IRRADIANCE, EXCITING = "Seen", "D", "F", "J", "E", "Exciting"
"""Outputs of :func:`build_patch`."""
CloudsOf = Callable[[Graph], Clouds]
"""Makes the clouds of a scene in a node tree."""


def build_path(
    images: LampImages,
    components: Sequence[PhaseFunction],
    *,
    ahead: bool,
    rays: bpy.types.ShaderNodeTree | None = None,
    clouds: CloudsOf | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the light of lamps in the water before an object, or up to the boundary.

    ``ahead`` is whether it goes to the boundary; the group has the input ``y_f`` then. Images have
    to be made for the clouds that lamps shine through. The output :data:`LIGHT` has three channels,
    the lamps themselves and what clouds scatter included.
    """
    inputs = {"y_f": FLOAT} if ahead else {}
    group = _group(f"{NAME} in the Water", inputs, (LIGHT,), rays, slim=clouds is not None)
    graph, given = group.graph, group.given
    table, w = LampTable.of(graph, images), view_direction(graph)
    if ahead:
        origin = camera_place(graph)
        P = distance_in_water(camera_depth(graph), -w[2], given["y_f"], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    floating = None if clouds is None else clouds(graph)
    add_up, follow = functools.partial(summed, graph), functools.partial(followed, graph)
    passed = {}
    if floating is not None:
        passed = floating.rays(floating.group.grids, origin, w, P, add_up)

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index)
        ray = ray_past_lamp(lamp, origin, w, P, NODES, before_surface=not ahead)
        light = table.in_water(index, components)
        if floating is None:
            return (light.along(lamp, ray, NODES, table.nodes_for(lamp)),)
        number = index
        if table.rows.inelastic:
            # Clouds know it by the lamp whose light it was.
            later = NODES.less(table.count_on_surfaces - 0.5, index)
            number = index - later * float(table.count_on_surfaces)
        through = LampAndClouds(floating, lamp, ray, origin, w, P, number, passed)
        return (through.seen(light, table.nodes_for(lamp), add_up, follow),)

    return group.finished({LIGHT: summed(graph, table.count, of_lamp)[0]})


def build_patch(
    images: LampImages,
    outputs: Collection[str] = (SEEN,),
    rays: bpy.types.ShaderNodeTree | None = None,
    facets: int = 0,
    clouds: CloudsOf | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the light of lamps on an object.

    Inputs: ``Normal``; ``Lamp Visibility``, of :func:`.visibility`; ``Color``, the reflectance;
    so many of :data:`FACETS`; and, if the image has measured reflectances, ``Measured``: 0, or the
    number of one from 1 on that replaces the colour.

    Outputs, in three channels: :data:`SEEN`, the radiance that arrives at the camera, of which
    :data:`UNSCATTERED` and :data:`FORWARD` are the parts; :data:`THERE`, the radiance at the
    object; :data:`IRRADIANCE`, on it; :data:`EXCITING`, that as fluorophores weigh it.
    """
    inputs = dict.fromkeys((NORMAL, VISIBILITY), VECTOR) | {COLOR: COLOUR}
    for one in FACETS[:facets]:
        inputs |= one
    measured = bool(images.numbers[MEASURED_KEY])
    inputs |= {MEASURED: FLOAT} if measured else {}
    group = _group(f"{NAME} on Objects", inputs, outputs, rays, slim=clouds is not None)
    graph, given = group.graph, group.given
    table, here, P = LampTable.of(graph, images), place_here(graph), view_distance(graph)
    normal, colour = (graph.components(given[name]) for name in (NORMAL, COLOR))
    floating = None if clouds is None else clouds(graph)
    to_eye = [-part for part in view_direction(graph)]
    mirroring = [one.with_all_light(to_eye, NODES) for one in _facets(graph, given, facets)]
    matte = matte_part(colour, _facets(graph, given, facets), NODES) if facets else colour

    def of_lamp(index: NodeValue) -> tuple[NodeValue, ...]:
        lamp = table.with_parts(index, table.lamp(index))
        visible = given[VISIBILITY].dot(table.colour(index)) + lamp.unblocked
        found = found_of(index, lamp, visible)
        if floating is None:
            return found
        transmittance = transmittance_to_surface(floating, lamp, here, index)
        if table.virtual:
            # What objects throw back comes from near by.
            transmittance = NODES.select(lamp.virtual, 1.0, transmittance)
        return tuple(value * transmittance for value in found)

    def found_of(index: NodeValue, lamp: Lamp, visible: Operand) -> tuple[NodeValue, ...]:
        light = table.on_surfaces(index)
        patch = patch_past_lamp(lamp, here, normal, NODES)
        arriving = light.arriving_at(lamp, patch, visible, NODES)
        bands = light.on_patch(arriving, patch, NODES)
        to_lamp = [-part for part in lamp.towards(here, NODES)[1]]
        virtual = [
            light.on_facets(arriving, lamp, patch, one, to_eye, to_lamp, NODES) for one in mirroring
        ]

        def of_surface(tables: Sequence[Sequence[Operand]], length: NodeValue) -> list[Operand]:
            coloured = of_colour(tables, matte)
            if not measured:
                return coloured
            number = given[MEASURED]
            known, chosen = table.of_measured(index, number, length), NODES.less(0.5, number)
            pairs = zip(known, coloured, strict=True)
            return [NODES.select(chosen, one, other) for one, other in pairs]

        def reflected(length: NodeValue, fractions: Mapping[str, Operand]) -> dict[str, NodeValue]:
            tables = light.tables(length)
            parts = [(bands, of_surface(tables, length))]
            parts += [(one, of_colour(tables, colour)) for one, colour in virtual]
            return {
                name: functools.reduce(
                    operator.add,
                    (light.arriving(one * (1.0 / math.pi) * fraction, seen) for one, seen in parts),
                )
                for name, fraction in fractions.items()
                if name in outputs
            }

        found: dict[str, NodeValue] = {}
        if not {SEEN, UNSCATTERED, FORWARD}.isdisjoint(outputs):
            fractions = {UNSCATTERED: light.unscattered(P, NODES), FORWARD: light.forward(P)}
            fractions[SEEN] = fractions[UNSCATTERED] + fractions[FORWARD]
            found |= reflected(arriving.length + P, fractions)
        if not {THERE, IRRADIANCE}.isdisjoint(outputs):
            tables = light.tables(arriving.length)
            found |= reflected(arriving.length, {THERE: 1.0})
            if IRRADIANCE in outputs:
                found[IRRADIANCE] = light.arriving(bands, of_colour(tables, (1.0, 1.0, 1.0)))
        if EXCITING in outputs:
            found[EXCITING] = light.arriving(bands, table.exciting(index, arriving.length))
        return tuple(found[name] for name in outputs)

    totals = summed(graph, table.count_on_surfaces, of_lamp)
    return group.finished(dict(zip(outputs, totals, strict=True)))


def _facets(graph: Graph, given: Mapping[str, NodeValue], count: int) -> list[Facets]:
    """Return the facets that a group gets as inputs."""
    found = []
    if count:
        even, grazing, clear = (graph.components(given[name]) for name in (MIRROR, EDGE, CLEAR))
        normal = graph.components(given[NORMAL])
        own = Facets(normal, given[ROUGHNESS], even, grazing, clear, given[CLEAR_INDEX])
        found.append(own)
    if count > 1:
        normal, clear = graph.components(given[COAT_NORMAL]), [given[COAT]] * COLOURS
        coat = Facets(normal, given[COAT_ROUGHNESS], clear=clear, index=given[COAT_INDEX])
        found.append(coat)
    return found


def _group(
    name: str,
    inputs: dict[str, str],
    outputs: Collection[str],
    rays: bpy.types.ShaderNodeTree | None,
    *,
    slim: bool,
) -> OpenGroup:
    # Clouds besides would need more constants than a shader holds.
    return OpenGroup(
        name, inputs, dict.fromkeys(outputs, VECTOR),
        part_size=PART_SIZE, slim=slim, rays=rays, slim_numbers=slim,
    )  # fmt: skip
