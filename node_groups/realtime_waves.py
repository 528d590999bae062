"""The moving surface as node groups read it: two images, and where to look them up.

The images are ordinary data-blocks, so a file opens without the extension:
``UW Caustics`` holds the relative sunlight at four depths, one per channel,
``UW Slopes`` the slopes of the surface along x and y.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.surface.wave_patterns import (
    WavePatterns,
    layer_position,
    pattern_at,
    under_waves,
)
from .node_mathematics import MARK, NODES, Graph, NodeValue
from .realtime_values import (
    CAMERA_DEPTH,
    SUN,
    WAVES_HALF_CELL,
    WAVES_LOG_DEPTH,
    WAVES_PER_LOG,
    WAVES_PER_METRE,
)

CAUSTICS, SLOPES = "UW Caustics", "UW Slopes"
PATTERN, POSITION = "Caustic Pattern", "Caustic Knot"
SLOPE = "Slope"
_FLATTEST = 1e-3  # vertical component of a view ray that still finds a place on the surface


def write_image(name: str, pixels: NDArray[np.float32], *, fresh: bool = False) -> None:
    """Put pixels, shape (N, N, 4), into an image, which is made if need be.

    The first row is the lowest, as Blender has it. With ``fresh`` the image is
    replaced: Cycles keeps what it has read of one while its data are persistent.
    """
    size, image = len(pixels), bpy.data.images.get(name)
    if image is None or fresh or tuple(image.size) != (size, size):
        new = bpy.data.images.new(name, size, size, alpha=True, float_buffer=True, is_data=True)
        new.alpha_mode = "CHANNEL_PACKED"
        new[MARK] = True
        if image is not None:
            image.user_remap(new)
            bpy.data.images.remove(image)
            new.name = name
        image = new
    image.pixels.foreach_set(np.ravel(pixels))
    image.update()
    # A file that is saved now opens with these pixels, without the extension.
    image.pack()


def write_patterns(waves: WavePatterns, *, fresh: bool = False) -> None:
    """Put the waves of a moment into the two images; see :func:`write_image`."""
    write_image(CAUSTICS, waves.caustics_image(), fresh=fresh)
    write_image(SLOPES, waves.slopes_image(), fresh=fresh)


def write_calm() -> None:
    """Make the images of a surface without waves."""
    for name, value in ((CAUSTICS, 1.0), (SLOPES, 0.0)):
        write_image(name, np.full((4, 4, 4), value, np.float32))


def remove_images() -> None:
    """Delete the images."""
    for name in (CAUSTICS, SLOPES):
        image = bpy.data.images.get(name)
        if image is not None and MARK in image:
            bpy.data.images.remove(image)


def sample(
    graph: Graph,
    name: str,
    x: NodeValue,
    y: NodeValue,
    per_metre: NodeValue,
    half_cell: NodeValue,
) -> tuple[NodeValue, NodeValue]:
    """Colour and alpha of a tiled image at a place on the surface."""
    texture = graph.node("ShaderNodeTexImage", image=bpy.data.images[name], interpolation="Linear")
    texture.extension = "REPEAT"
    where = graph.vector(x * per_metre + half_cell, y * per_metre + half_cell, 0.0)
    graph.assign(where, texture.inputs["Vector"])
    return graph.term(texture.outputs["Color"]), graph.term(texture.outputs["Alpha"])


def layers_at(
    graph: Graph, x: NodeValue, y: NodeValue, per_metre: NodeValue, half_cell: NodeValue
) -> tuple[NodeValue, NodeValue, NodeValue, NodeValue]:
    """Relative sunlight at the depths of the four layers."""
    colour, alpha = sample(graph, CAUSTICS, x, y, per_metre, half_cell)
    return (*graph.components(colour), alpha)


def caustics_here(graph: Graph, values: bpy.types.ShaderNodeTree) -> dict[str, NodeValue]:
    """Relative sunlight at the shaded point, and its place among the knots of the contrast."""
    number = _numbers(graph, values)
    geometry = graph.node("ShaderNodeNewGeometry")
    px, py, pz = graph.components(graph.term(geometry.outputs["Position"]))
    depth = NODES.maximum(-pz, 0.0)
    x, y = under_waves(px, py, depth, [number(name) for name in SUN])
    layers = layers_at(graph, x, y, number(WAVES_PER_METRE), number(WAVES_HALF_CELL))
    position = layer_position(depth, number(WAVES_LOG_DEPTH), number(WAVES_PER_LOG), NODES)
    return {PATTERN: pattern_at(depth, position, layers, NODES), POSITION: 2.0 * position}


def slope_ahead(
    graph: Graph, values: bpy.types.ShaderNodeTree, w: tuple[NodeValue, NodeValue, NodeValue]
) -> dict[str, NodeValue]:
    """Slopes of the surface where the view ray w of the background meets it."""
    number = _numbers(graph, values)
    camera = graph.node(
        "ShaderNodeVectorTransform", vector_type="POINT", convert_from="CAMERA", convert_to="WORLD"
    )
    camera.inputs[0].default_value = (0.0, 0.0, 0.0)
    x, y, _ = graph.components(graph.term(camera.outputs[0]))
    reach = NODES.maximum(number(CAMERA_DEPTH), 0.0) / NODES.maximum(w[2], _FLATTEST)
    slopes, _ = sample(
        graph,
        SLOPES,
        x + w[0] * reach,
        y + w[1] * reach,
        number(WAVES_PER_METRE),
        number(WAVES_HALF_CELL),
    )
    return {SLOPE: slopes}


def _numbers(graph: Graph, values: bpy.types.ShaderNodeTree):  # noqa: ANN202
    outputs = graph.node("ShaderNodeGroup", node_tree=values).outputs
    return lambda name: graph.term(outputs[name])
