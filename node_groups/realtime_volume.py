"""Material of the shafts of light: single scattering of the sun, with its shadows.

EEVEE multiplies the scattering coefficient with the sun's shadows. So the
coefficient holds the radiance that the sensor sees, made small by ``shaft
scale``, and the lamp's volume factor makes it large again: the volume adds
light and hardly dims what is behind it. Its phase function is a
Henyey-Greenstein one, which takes most of the contrast between directions out
of the coefficient (froxels hold few bits); the water's own phase function over
that one is part of the coefficient.
"""

from __future__ import annotations

import bpy

from ..uw_spectral.surface.wave_patterns import sunlight_factor
from ..uw_spectral.water.phase import henyey_greenstein
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_rays import depth_here, view_direction, view_distance
from .realtime_triples import SEEN, TableImages, Triples, Values, build_triple
from .realtime_values import CAUSTIC_STRENGTH, SHAFT_END, SHAFT_SCALE, Shape
from .realtime_waves import PATTERN, WaveImages, caustics_here

NAME = "UW Shafts"
ANISOTROPY = 0.8
TRIPLE_NAME = "UW Shafts of Three Bands"


def build(
    values: bpy.types.ShaderNodeTree,
    shape: Shape,
    images: WaveImages | None,
    tables: TableImages,
) -> bpy.types.Material:
    """Build the material.

    A coefficient cannot be negative: where the sensor's sum over the bands is,
    the volume draws nothing and the surfaces keep that light, without shadows.
    """
    inputs = {PATTERN: "NodeSocketFloat"} if shape.waves else {}
    triple = build_triple(TRIPLE_NAME, shape, inputs, _coefficient)
    material = bpy.data.materials.new(NAME)
    tree = material.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    scatter = graph.node("ShaderNodeVolumeScatter")
    given = {} if images is None else caustics_here(graph, values, images.caustics)
    total = Triples(graph, values, shape, tables).sum(triple, given)
    coefficient = NODES.maximum(total[SEEN], 0.0)
    graph.assign(coefficient, scatter.inputs["Color"])
    scatter.inputs["Density"].default_value = 1.0
    scatter.inputs["Anisotropy"].default_value = ANISOTROPY
    output = graph.node("ShaderNodeOutputMaterial")
    tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    return material


def _coefficient(graph: Graph, values: Values) -> dict[str, NodeValue]:
    w, v, y = view_direction(graph), view_distance(graph), depth_here(graph)
    per_metre = values.beam.scattered_once_at(y, w, v, NODES)
    inside = NODES.less(v, values[SHAFT_END])
    sun = values.beam.sun
    cosine = -(w[0] * sun[0] + w[1] * sun[1] + w[2] * sun[2])
    phase = henyey_greenstein(ANISOTROPY, 0.5 - 0.5 * cosine, NODES)
    strength = values[SHAFT_SCALE] * inside / phase
    if values.shape.waves:
        # The unscattered sun carries the whole pattern, whatever the band.
        strength = strength * sunlight_factor(values[PATTERN], values[CAUSTIC_STRENGTH], NODES)
    return {SEEN: values.sensor(per_metre) * strength}
