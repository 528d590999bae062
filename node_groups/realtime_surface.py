"""Node group that turns a lit surface into its picture through the water.

It replaces the shader of a user's material: lit colour and base colour go in,
a shader that emits what the sensor sees comes out. All bands in one pass.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.refraction import mirrored_direction
from ..uw_spectral.surface.wave_patterns import interp, sunlight_factor
from ..uw_spectral.transfer.pixel import surface_light
from ..uw_spectral.transfer.pixel_layers import illumination, pixel_layers
from . import realtime_lamps, realtime_layers
from .node_mathematics import NODES, Graph, NodeValue, new_group
from .realtime_rays import (
    camera_depth_behind,
    depth_here,
    place_here,
    view_direction,
    view_distance,
)
from .realtime_shadows import OPENNESS, SUNLIT, openness, sun_visibility
from .realtime_tables import Tables
from .realtime_triples import (
    DRAWN,
    MIRRORED_TOWARDS,
    SEEN,
    TOWARDS,
    TableImages,
    Triples,
    Values,
    build_triple,
    looked_up_on_surface,
    phase_inputs,
    phase_towards,
)
from .realtime_values import CAUSTIC_STRENGTH, CONTRAST, EMISSION, REFLECTANCE, SUN, Shape
from .realtime_waves import PATTERN, POSITION, WaveImages, caustics_here

NAME = "UW Surface of Bands"
TRIPLE_NAME = "UW Surface of Three Bands"

LIT, COLOR, EMITTED = "Lit", "Color", "Emission"
MIRRORED = "Mirrored"
COVERAGE, NORMAL, IS_MEASURED = "Coverage", "Normal", "Is Measured"
_MEASURED = "Measured"
_INPUTS = {
    LIT: "NodeSocketColor",
    COLOR: "NodeSocketColor",
    EMITTED: "NodeSocketColor",
    COVERAGE: "NodeSocketFloat",
    NORMAL: "NodeSocketVector",
    IS_MEASURED: "NodeSocketFloat",
    _MEASURED: "NodeSocketVector",
}
_DARKEST = 1e-3  # reflectance below which an uplifted colour cannot carry a measured spectrum


def measured(triple: int) -> str:
    """Name of the input for a measured reflectance of three bands."""
    return f"{_MEASURED} {triple}"


def build(
    values: bpy.types.ShaderNodeTree,
    shape: Shape,
    images: WaveImages | None,
    tables: TableImages,
) -> bpy.types.ShaderNodeTree:
    """Build the group.

    Inputs: ``Lit``, the colour of the surface under a white sun of strength 1,
    emission included; ``Color``, its reflectance; ``Emission``, its emitted
    RGB radiance; ``Coverage``, the share that is not transparent, with which
    the three are multiplied already; ``Normal``; ``Is Measured`` (0 or 1) and
    ``Measured i``, reflectances that replace the colour; and, if things mirror, ``Mirrored``,
    the part of the reflectance that does.
    """
    own = [PATTERN, POSITION] if shape.waves else []
    own += [OPENNESS] if shape.diffuse_shadows else []
    own += phase_inputs(TOWARDS, shape)
    own += phase_inputs(MIRRORED_TOWARDS, shape) if shape.mirrors else []
    kinds = dict.fromkeys(own, "NodeSocketFloat")
    kinds |= dict.fromkeys(looked_up_on_surface(shape), "NodeSocketVector")
    needs_sunlit = not {"E", "shadow"}.isdisjoint(shape.layers)
    if needs_sunlit:
        kinds[SUNLIT] = "NodeSocketFloat"
    lit = None
    if tables.lamps is not None:
        kinds[realtime_lamps.VISIBILITY] = "NodeSocketVector"
        lit = (
            realtime_lamps.build_patch(shape.components, tables.lamps, tables.rays),
            realtime_lamps.build_path(
                shape.components, tables.lamps, ahead=False, rays=tables.rays
            ),
            realtime_lamps.build_carried(shape.components, tables.lamps, tables.rays),
        )
    picture = functools.partial(_picture, lit=lit)
    given_colours = _INPUTS | ({MIRRORED: "NodeSocketColor"} if shape.mirrors else {})
    triple = build_triple(TRIPLE_NAME, shape, given_colours | kinds, picture, tables.rays)
    tree = new_group(NAME)
    inputs = {name: kind for name, kind in given_colours.items() if name != _MEASURED}
    inputs |= {measured(t): "NodeSocketVector" for t in range(shape.triples)}
    for name, kind in inputs.items():
        socket = tree.interface.new_socket(name, in_out="INPUT", socket_type=kind)
        if name == COVERAGE:
            socket.default_value = 1.0
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    graph = Graph(tree, rays=tables.rays)
    outputs = graph.node("NodeGroupInput").outputs
    given = {socket.name: graph.term(socket) for socket in outputs if socket.name}
    if images is not None:
        given |= caustics_here(graph, values, images.caustics)
    if shape.diffuse_shadows:
        given[OPENNESS] = openness(graph, given[NORMAL])
    triples = Triples(graph, values, shape, tables)
    if needs_sunlit:
        sun = [triples.number(name) for name in SUN]
        given[SUNLIT] = sun_visibility(graph, given[NORMAL], sun)
    if tables.lamps is not None:
        given[realtime_lamps.VISIBILITY] = realtime_lamps.visibility(
            graph, triples.numbers, tables.lamps, given[NORMAL]
        )
    if tables.light is not None:
        given |= _look_up(graph, triples.tables, shape, given[NORMAL])
    if shape.shade:
        w, P, here = view_direction(graph), view_distance(graph), place_here(graph)
        camera = [x - along * P for x, along in zip(here, w, strict=True)]
        given |= triples.shade.on_patch(here, graph.components(given[NORMAL]))
        given |= triples.shade.on_path(camera, w, P)
    if tables.light is not None:
        given[_MEASURED] = triples.own(_MEASURED, given)
    emission = graph.node("ShaderNodeEmission")
    total = triples.sum(triple, given)
    graph.assign(total[SEEN], emission.inputs["Color"])
    points = _points(triples, shape, given)
    realtime_layers.write(graph, shape.layers, total | points, given[COVERAGE])
    tree.links.new(emission.outputs[0], graph.node("NodeGroupOutput").inputs[0])
    return tree


def _look_up(
    graph: Graph,
    tables: Tables,
    shape: Shape,
    normal: NodeValue,
) -> dict[str, NodeValue]:
    w, y = view_direction(graph), depth_here(graph)
    y_o = camera_depth_behind(y, w, view_distance(graph))
    on_it = tables.on_patch(y, graph.components(normal), from_above=shape.diffuse_shadows)
    phase = phase_towards(TOWARDS, shape, w, tables.sun)
    if shape.mirrors:
        r = mirrored_direction(w, graph.components(normal))
        on_it |= tables.in_mirror(y, r) | phase_towards(MIRRORED_TOWARDS, shape, r, tables.sun)
    return tables.near_and_far(y_o, y, w) | on_it | phase


def _picture(
    graph: Graph,
    values: Values,
    *,
    lit: tuple[bpy.types.ShaderNodeTree, ...] | None,
) -> dict[str, NodeValue]:
    w, P, y = view_direction(graph), view_distance(graph), depth_here(graph)
    y_o, sun = camera_depth_behind(y, w, P), values.sun
    nx, ny, nz = graph.components(values[NORMAL])
    cosine = -(nx * sun[0] + ny * sun[1] + nz * sun[2])
    open_share = values[OPENNESS] if values.shape.diffuse_shadows else None
    sunlight = 1.0
    if values.shape.waves:
        contrast = interp(values[POSITION], [values[name] for name in CONTRAST], NODES)
        sunlight = sunlight_factor(values[PATTERN], contrast, NODES)
    lighting = values.patch_light(y)
    light = surface_light(lighting, y, nz, NODES, openness=open_share, sunlight=sunlight)
    response = values.uplift(NODES.maximum(values[LIT] - values[EMITTED], 0.0), REFLECTANCE)
    base = values.uplift(values[COLOR], REFLECTANCE)
    known = values[_MEASURED] / NODES.maximum(base, _DARKEST)
    known = NODES.select(values[IS_MEASURED], known, 1.0)
    in_water = response * values.turned_sun((nx, ny, nz))
    glow = values.uplift(values[EMITTED], EMISSION)
    mirrored = L_mirrored = 0.0
    if values.shape.mirrors:
        mirrored = values.uplift(values[MIRRORED], REFLECTANCE)
        L_mirrored = values.mirrored(y, mirrored_direction(w, (nx, ny, nz)))
    L = light.reflected(in_water, base, cosine, NODES, mirrored=mirrored, L_mirrored=L_mirrored)
    L = L * known + glow
    covered = values[COVERAGE]
    if values.shape.solved:
        pixel = values.solved_path(y_o, y, w, P).surface(y_o, y, w, P, L, NODES, coverage=covered)
    else:
        water, L_inelastic = values.water, 0.0
        if water.inelastic is not None:
            L_inelastic = base / math.pi * water.inelastic.surface_irradiance(y, nz, NODES) * known
        pixel = water.surface(y_o, y, w, P, L, NODES, L_inelastic=L_inelastic, coverage=covered)
    if lit is not None:
        on_things, on_way, from_things = lit
        carried = base / math.pi * known * values.of_group(on_things)
        lamps = values.of_group(on_way) * covered
        share = values.of_group(from_things)
        pixel = dataclasses.replace(pixel, lamps=lamps, L_carried=carried, carried_forward=share)
    dry = None
    if values.shape.above:
        dry = values.dry_radiance(response, base, (nx, ny, nz)) * known + glow
    found = {SEEN: values.seen(pixel, dry)}
    if values.shape.layers:
        layers = {**pixel_layers(pixel), "reflectance": base * known}
        if "E" in values.shape.layers:
            lamps = 0.0 if lit is None else values.of_group(lit[0])
            layers["E"] = illumination(light, cosine, values[SUNLIT], lamps, NODES)
        found |= values.layers(layers)
    if values.shape.shafts:
        found[DRAWN] = values.sensor(values.shaft(y_o, w, P) * covered)
    return found


def _points(triples: Triples, shape: Shape, given: dict[str, NodeValue]) -> dict[str, Operand]:
    """Layers that are the same for all bands."""
    found: dict[str, Operand] = {"albedo": given[COLOR]}
    if SUNLIT in given:
        found["shadow"] = given[SUNLIT]
    if shape.waves:
        strength = triples.number(CAUSTIC_STRENGTH)
        found["caustics"] = sunlight_factor(given[PATTERN], strength, NODES)
    else:
        found["caustics"] = 1.0
    return found
