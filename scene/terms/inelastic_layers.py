"""Inelastic light in Cycles: the water in layers, each of which emits evenly.

The emission of a layer is that of the solved field, averaged over its depth. It comes from
plane-parallel light: no shadow of an object dims it, and what is emitted excites nothing again. All
the scattering of the emitted light, and its meeting with objects, is Cycles' own.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import override

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes
from ...node_groups.data_blocks import new_material, vector_of_view_layer
from ...node_groups.water_volume import volume_coefficients
from ...uw_spectral.transfer.discrete_ordinates import Emission
from .. import marks
from ..water import scene_water
from ..water.term import SceneFrame, Term
from ..water.water_body import WaterExtent, box

NAME = "UW Layer"
_LAYER = "uw_layer"
"""Mark of objects that are layers: their number."""
# A layer is as thick as the strongest band takes to change by this fraction, more where that makes
# too many: the sooner, the farther it is from the camera.
_CHANGE, _GROWTH, _THINNEST = 0.2, 0.05, 0.1
_COARSER = 1.1
# Cycles looks up from a camera for the volumes that it is in, and finds 64 faces at most: with 33
# layers above it, it is wrong. The others are left to the water, clouds and the scene's own.
MOST_ABOVE, _MOST = 24, 48
# Below, layers leave this fraction of the emission at the camera to the last of them.
_DARKEST = 1e-4
_APART = 1e-3  # gap in m between layers, or Cycles would count their faces as one


def boundaries(
    light: Emission, floor_depth: float, bottom: float, depth: float
) -> NDArray[np.float64]:
    """Depths in m at which layers meet, from the surface to the bottom of the water.

    They are finest about the depth of a camera, which is in the middle of one.
    """
    bottom, coarser = min(bottom, floor_depth), 1.0
    while True:
        edges = _boundaries(light, floor_depth, bottom, depth, coarser)
        if len(edges) <= _MOST and (edges < depth).sum() <= MOST_ABOVE:
            return edges
        coarser *= _COARSER


def _boundaries(
    light: Emission, floor_depth: float, bottom: float, depth: float, coarser: float
) -> NDArray[np.float64]:
    def thin(y: float) -> tuple[float, float]:
        """Emission, and how thick a layer may be."""
        here, below = light.at([y, y + _THINNEST], floor_depth).sum(axis=1).tolist()
        rate = abs(math.log(max(below, 1e-300) / max(here, 1e-300))) / _THINNEST
        return here, max(coarser * _CHANGE / max(rate, 1e-9), _THINNEST)

    at_camera, own = thin(min(depth, bottom))
    edges = [0.0]
    while edges[-1] < bottom:
        y = edges[-1]
        here, thickness = thin(y)
        if y > depth and here < _DARKEST * at_camera:
            edges.append(bottom)
            break
        step = min(coarser * thickness, thickness + _GROWTH * abs(y - depth))
        edges.append(min(y + step, bottom))
    if own / 2.0 < depth < bottom - own / 2.0:
        others = [y for y in edges if abs(y - depth) > own or y in (0.0, bottom)]
        edges = sorted({*others, depth - own / 2.0, depth + own / 2.0})
    return np.array(edges)


class InelasticTerm(Term):
    """Light that the water emits; the tables of EEVEE hold it."""

    @classmethod
    @override
    def bring_to_cycles(cls, frame: SceneFrame) -> Mapping[str, NDArray[np.float64]]:
        assert frame.extent is not None, "there is water"
        light, floor_depth = frame.plan.emission(), frame.plan.column.floor_depth
        return bring(frame.scene, light, floor_depth, frame.extent, frame.eye.depth)


def bring(
    scene: bpy.types.Scene,
    light: Emission | None,
    floor_depth: float,
    extent: WaterExtent,
    depth: float,
) -> dict[str, NDArray[np.float64]]:
    """Put the emitting layers of a frame into the water of a scene; they leave with it.

    ``floor_depth`` is that of the column that it is emitted in, ``depth`` the camera's, m. Returns
    the radiance per metre of every layer and band, by view-layer property.
    """
    for item in [item for item in marks.objects(scene) if _LAYER in item]:
        bpy.data.batch_remove([item, item.data, *item.data.materials])
    if light is None:
        return {}
    edges = boundaries(light, floor_depth, extent.bottom, max(depth, 0.0))
    for layer, (upper, lower) in enumerate(itertools.pairwise(edges)):
        inside = WaterExtent(extent.half_width - _APART, float(lower) - _APART)
        item = box(f"{NAME} {layer}", inside, float(upper) + _APART)
        item[_LAYER] = layer
        item.data.materials.append(_material(layer))
        scene_water.link(scene, item)
    return emission(light, floor_depth, edges)


def emission(
    light: Emission, floor_depth: float, edges: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Radiance per metre of every layer and band, by view-layer property.

    A layer is thinner than its fraction of the water by the gap; it makes up for it.
    """
    thickness = np.diff(edges)
    source = light.mean(edges[:-1], edges[1:], floor_depth) / (4.0 * math.pi)
    source = source * (thickness / (thickness - 2.0 * _APART))[:, None]
    return {attributes.inelastic(layer): values for layer, values in enumerate(source)}


def _material(layer: int) -> bpy.types.Material:
    material, graph, output = new_material(f"{NAME} {layer}")
    node = volume_coefficients(graph)
    emission = vector_of_view_layer(graph, attributes.inelastic(layer))
    graph.assign(emission, node.inputs["Emission Coefficients"])
    graph.tree.links.new(node.outputs[0], output.inputs["Volume"])
    return material
