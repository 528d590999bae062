"""Material of the water surface for Cycles: refraction, total reflection and caustics.

The camera and scattered light see a smooth dielectric; shadow rays pass, since
the sun's lamp already carries the refracted direction and the transmitted share.

Waves turn the normal of the dielectric, and colour the shadow rays by the
caustic pattern: a shadow ray goes along the refracted sun, so it meets the
surface just where the pattern is defined, and its length tells the depth of the
point that it lights. What follows, in surfaces and by scattering, is up to Cycles.

Foam is matte from above; from below it glows with what it lets through. Only what is seen has it:
the light that objects and water get is that without.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy

from ..uw_spectral.surface.wave_patterns import layer_position, pattern_at, sunlight_factor
from ..uw_spectral.transfer.radiance_field import surface_normal
from . import attributes
from .data_blocks import new_material, of_view_layer
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_waves import (
    CAUSTIC_STRENGTH,
    FOAM_FIRST,
    FOAM_PER_CROWDING,
    WAVES_FAR_HALF_CELL,
    WAVES_FAR_PER_METRE,
    WAVES_HALF_CELL,
    WAVES_LOG_DEPTH,
    WAVES_PER_LOG,
    WAVES_PER_METRE,
    WaveImages,
    WaveTables,
    layers_at,
)

NAME = "UW Surface"
_SUN_HEIGHT = "sun height"
_SUN_RUN = ("sun run x", "sun run y")
_OF_HEIGHTS = (WAVES_FAR_PER_METRE, WAVES_FAR_HALF_CELL, *_SUN_RUN)
_OF_FOAM = FOAM_FIRST, FOAM_PER_CROWDING
_NUMBERS = (
    WAVES_PER_METRE,
    WAVES_HALF_CELL,
    WAVES_LOG_DEPTH,
    WAVES_PER_LOG,
    CAUSTIC_STRENGTH,
    _SUN_HEIGHT,
)


def build(
    refractive_index: float, images: WaveImages | None = None, *, from_air: bool = True
) -> bpy.types.Material:
    """Build the material; the surface's normal points up, into the air. Images are those of waves.

    Where no camera may be in the air, light that objects in the air have from the water's side
    comes with the factor n² that it has in the water.
    """
    material, graph, output = new_material(NAME)
    path = graph.node("ShaderNodeLightPath").outputs
    colour: NodeValue | float = 1.0
    # Cycles leaves out that radiance has a factor n² in the water. The sky brings it, and what
    # is seen from the air, the mirrored sky too, loses it here.
    if from_air:
        inside = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Backfacing"])
        colour = NODES.select(inside, 1.0, refractive_index**-2)
    inputs = {"Color": colour, "Roughness": 0.0, "IOR": refractive_index}
    glass = graph.node("ShaderNodeBsdfGlass", inputs)
    clear = graph.node("ShaderNodeBsdfTransparent", {"Color": 1.0})
    seen = glass.outputs[0]
    if images is not None:
        waves = WaveTables(graph, images, _numbers_of(graph, images).__getitem__)
        normal, sunlight = _waves(waves, graph.term(path["Ray Length"]))
        graph.assign(normal, glass.inputs["Normal"])
        graph.assign(sunlight, clear.inputs["Color"])
        if images.crowding is not None:
            seen = _with_foam(waves, seen, normal)
            material.cycles.emission_sampling = "NONE"
    shown = graph.mixed(path["Is Shadow Ray"], seen, clear.outputs[0])
    graph.assign(shown, output.inputs["Surface"])
    return material


def _numbers_of(graph: Graph, images: WaveImages) -> dict[str, NodeValue]:
    names = _NUMBERS if images.far is None else _NUMBERS + _OF_HEIGHTS
    names += () if images.crowding is None else _OF_FOAM
    return {
        name: graph.term(graph.node("ShaderNodeValue", name=name, label=name).outputs[0])
        for name in names
    }


def _with_foam(
    waves: WaveTables, glass: bpy.types.NodeSocket, normal: NodeValue
) -> bpy.types.NodeSocket:
    graph = waves.graph
    geometry = graph.node("ShaderNodeNewGeometry").outputs
    x, y, _ = graph.components(graph.term(geometry["Position"]))
    foam = waves.foam(x, y, filtered=True)
    assert foam is not None, "there are images of the crowding"
    path = graph.node("ShaderNodeLightPath").outputs
    lights = NODES.maximum(
        graph.term(path["Is Diffuse Ray"]), graph.term(path["Is Volume Scatter Ray"])
    )
    above, below = (
        of_view_layer(graph, name).outputs["Color"]
        for name in (attributes.FOAM_REFLECTANCE, attributes.FOAM_BELOW)
    )
    matte = graph.node("ShaderNodeBsdfDiffuse", {"Color": above, "Normal": normal})
    glow = graph.node("ShaderNodeEmission", {"Color": below})
    sides = graph.mixed(geometry["Backfacing"], matte.outputs[0], glow.outputs[0])
    return graph.mixed((1.0 - lights) * foam, glass, sides)


def _waves(waves: WaveTables, ray_length: NodeValue) -> tuple[NodeValue, NodeValue]:
    """Normal of the surface, and what it lets through to a shadow ray of a length."""
    graph, number = waves.graph, waves.number
    geometry = graph.node("ShaderNodeNewGeometry").outputs
    x, y, z = graph.components(graph.term(geometry["Position"]))
    slopes = waves.slopes(x, y)
    facing = 1.0 - 2.0 * graph.term(geometry["Backfacing"])
    normal = graph.vector(*surface_normal(*graph.components(slopes)[:2], NODES)) * facing
    depth = ray_length * number(_SUN_HEIGHT)
    if waves.images.far is not None:
        # Patterns belong to where a straight ray meets the mean level.
        depth = depth - z
        x, y = x + z * number(_SUN_RUN[0]), y + z * number(_SUN_RUN[1])
    position = layer_position(depth, number(WAVES_LOG_DEPTH), number(WAVES_PER_LOG), NODES)
    layers = layers_at(graph, waves.images.caustics, x, y, number)
    pattern = pattern_at(depth, position, layers, NODES)
    return normal, sunlight_factor(pattern, number(CAUSTIC_STRENGTH), NODES)


def write(material: bpy.types.Material, numbers: Mapping[str, float], sun: Sequence[float]) -> None:
    """Give the waves of a material their numbers, by the names of :mod:`.realtime_values`.

    ``sun`` is the travel direction of the sunlight in the water.
    """
    of_sun = {_SUN_HEIGHT: -sun[2], _SUN_RUN[0]: -sun[0] / sun[2], _SUN_RUN[1]: -sun[1] / sun[2]}
    for name, value in {**numbers, **of_sun}.items():
        node = material.node_tree.nodes.get(name)
        if node is not None:
            node.outputs[0].default_value = value
