"""Inelastic light in Cycles: the water in layers, each of which emits evenly.

The emission of a layer is that of the solved field, averaged over its depth. It
comes from plane-parallel light: no shadow of an object dims it, and what is
emitted excites nothing again. All the scattering of the emitted light, and its
meeting with objects, is Cycles' own.
"""

from __future__ import annotations

import itertools
import math

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes
from ...node_groups.data_blocks import new_material, vector_of_view_layer
from ...node_groups.water_volume import volume_coefficients
from ...uw_spectral.transfer.discrete_ordinates import Emission
from . import scene_water
from .water_body import WaterExtent, box

NAME = "UW Layer"
# A layer is as thick as the strongest band takes to change by this share, within limits.
_CHANGE = 0.2
_THINNEST, _MOST = 0.1, 64
# Below, layers leave this share of the emission of the brightest depth to the last of them.
_DARKEST = 1e-4
_APART = 1e-3  # gap in m between layers, or Cycles would count their faces as one


def _attribute(layer: int) -> str:
    return f"{attributes.PREFIX}inelastic_{layer}"


def boundaries(light: Emission, floor_depth: float, bottom: float) -> NDArray[np.float64]:
    """Depths in m at which layers meet, from the surface to the bottom of the water."""
    bottom = min(bottom, floor_depth)
    edges = [0.0]
    total = float(light.at([0.0], floor_depth).sum())
    while edges[-1] < bottom and len(edges) < _MOST:
        y = edges[-1]
        here, below = light.at([y, y + _THINNEST], floor_depth).sum(axis=1).tolist()
        if here < _DARKEST * total:
            break
        rate = abs(math.log(max(below, 1e-300) / max(here, 1e-300))) / _THINNEST
        edges.append(min(y + max(_CHANGE / max(rate, 1e-9), _THINNEST), bottom))
    if edges[-1] < bottom:
        edges.append(bottom)
    return np.array(edges)


def add_layers(
    scene: bpy.types.Scene, light: Emission, floor_depth: float, extent: WaterExtent
) -> NDArray[np.float64]:
    """Add emitting layers to the water in a scene; they leave with it.

    Parameters
    ----------
    scene : Scene
        Its water is there already.
    light : Emission
        Of the first frame: it decides how thick the layers are.
    floor_depth : float
        Of the column that it is emitted in, m.
    extent : WaterExtent
        Size of the water.

    Returns
    -------
    array
        Depths at which the layers meet, for :func:`emission`.
    """
    edges = boundaries(light, floor_depth, extent.bottom)
    for layer, (upper, lower) in enumerate(itertools.pairwise(edges)):
        inside = WaterExtent(extent.half_width - _APART, float(lower) - _APART)
        item = box(f"{NAME} {layer}", inside, float(upper) + _APART)
        item.data.materials.append(_material(layer))
        scene_water.link(scene, item)
    return edges


def emission(
    light: Emission, floor_depth: float, edges: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Radiance per metre of every layer and band, by view-layer property.

    A layer is thinner than its share of the water by the gap; it makes up for it.
    """
    thickness = np.diff(edges)
    source = light.mean(edges[:-1], edges[1:], floor_depth) / (4.0 * math.pi)
    source = source * (thickness / (thickness - 2.0 * _APART))[:, None]
    return {_attribute(layer): values for layer, values in enumerate(source)}


def _material(layer: int) -> bpy.types.Material:
    material, graph, output = new_material(f"{NAME} {layer}")
    node = volume_coefficients(graph)
    emission = vector_of_view_layer(graph, _attribute(layer))
    graph.assign(emission, node.inputs["Emission Coefficients"])
    graph.tree.links.new(node.outputs[0], output.inputs["Volume"])
    return material
