"""Develops band images into an RGB image through the sensor, in Blender's compositor."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..node_groups import sensor_reduction
from ..scene.engines.exr_output import write_float_exr

_NAME = "UW Development"


def develop(
    images: Sequence[Path],
    weights: NDArray[np.float64],
    passes: Sequence[tuple[int, ...]],
    destination: Path,
) -> None:
    """Combine band images into a scene-linear RGB image.

    Parameters
    ----------
    images : sequence of Path
        One float EXR per pass, in the order of ``passes``.
    weights : array, shape (3, n)
        Linear RGB per unit radiance of each band.
    passes : sequence of tuples
        The bands that each image carries.
    destination : Path
        The float EXR to write.
    """
    scene = bpy.data.scenes.new(_NAME)
    loaded = [bpy.data.images.load(str(path)) for path in images]
    sensor = sensor_reduction.build(weights, passes)
    tree = bpy.data.node_groups.new(_NAME, "CompositorNodeTree")
    try:
        group = tree.nodes.new("CompositorNodeGroup")
        group.node_tree = sensor
        for image, socket in zip(loaded, group.inputs, strict=True):
            image.colorspace_settings.is_data = True
            source = tree.nodes.new("CompositorNodeImage")
            source.image = image
            tree.links.new(source.outputs["Image"], socket)
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        output = tree.nodes.new("NodeGroupOutput")
        tree.links.new(group.outputs["Image"], output.inputs["Image"])
        scene.compositing_node_group = tree
        scene.render.compositor_device = "CPU"
        scene.render.resolution_x, scene.render.resolution_y = loaded[0].size
        write_float_exr(scene, destination)
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.node_groups.remove(tree)
        bpy.data.node_groups.remove(sensor)
        for image in loaded:
            bpy.data.images.remove(image)
