"""What the group of a surface is told of the material before it."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_lamps, surface_inputs
from ...node_groups.node_mathematics import NODES, Graph, NodeValue
from ...uw_spectral.mathematics import Operand
from .closure_walk import ClosureWalk
from .native_closures import SUNLIGHT
from .shader_walk import Closure, is_zero, mean
from .wet_trees import MUTED, surface_node

_LEAST_FACETS = 1e-6
_MATTE = "mirrors; in real time it throws back the water's light as a matte object does"


def write_closure(walk: ClosureWalk, closure: Closure, surface: bpy.types.Node) -> Operand | None:
    """Tell a surface group what a closure is; return what passes through it, if anything does."""
    graph = walk.graph
    graph.assign(closure.colour, surface.inputs[surface_inputs.COLOR])
    if surface_inputs.EMITTED in surface.inputs:
        graph.assign(closure.emission, surface.inputs[surface_inputs.EMITTED])
    if surface_inputs.MIRRORED in surface.inputs:
        graph.assign(closure.mirrored, surface.inputs[surface_inputs.MIRRORED])
        rough = _per_weight(closure.mirror_roughness, closure.mirrored)
        graph.assign(rough, surface.inputs[surface_inputs.MIRROR_ROUGHNESS])
    elif not is_zero(closure.mirrored):
        walk.notes.append(f"{walk.name} {_MATTE}")
    if walk.surfaces.facets:
        _describe_facets(walk, closure, surface)
    if surface_inputs.BEHIND in surface.inputs:
        graph.assign(closure.behind, surface.inputs[surface_inputs.BEHIND])
    if surface_inputs.CLOSED in surface.inputs:
        surface.inputs[surface_inputs.CLOSED].default_value = float(walk.closed)
    graph.assign(_normal(graph, closure.normal), surface.inputs[surface_inputs.NORMAL])
    if is_zero(closure.transmittance):
        return None
    passing = closure.transmittance
    covered = 1.0 - mean(passing)
    graph.assign(covered, surface.inputs[surface_inputs.COVERAGE])
    if surface_inputs.COVERED in surface.inputs:
        graph.assign(1.0 - passing, surface.inputs[surface_inputs.COVERED])
    return passing


def _describe_facets(walk: ClosureWalk, closure: Closure, surface: bpy.types.Node) -> None:
    """Tell a surface group what throws back the light of lamps."""
    graph, lamps, ratio = walk.graph, realtime_lamps, _per_weight
    values = {
        lamps.MIRROR: closure.mirror,
        lamps.EDGE: closure.edge,
        lamps.CLEAR: closure.clear,
        lamps.ROUGHNESS: ratio(closure.roughness, closure.facets),
        lamps.CLEAR_INDEX: ratio(closure.index, closure.clear),
    }
    if walk.surfaces.facets > 1:
        values |= {
            lamps.COAT: mean(closure.coat),
            lamps.COAT_ROUGHNESS: ratio(closure.coat_roughness, closure.coat),
            lamps.COAT_INDEX: ratio(closure.coat_index, closure.coat),
            lamps.COAT_NORMAL: _normal(graph, closure.coat_normal),
        }
    for name, value in values.items():
        graph.assign(value, surface.inputs[name])


def _normal(graph: Graph, own: NodeValue | None) -> NodeValue:
    """Return a closure's own normal, or that of the surface."""
    return own or graph.term(graph.node("ShaderNodeNewGeometry").outputs["Normal"])


def write_reflectance(
    material: bpy.types.Material, column: int, channels: NDArray[np.float64]
) -> None:
    """Tell a wet material where its measured reflectance is, and its channels."""
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and (MUTED in node or SUNLIGHT in node):
            node.inputs[surface_inputs.COLUMN].default_value = float(column)
            node.inputs[surface_inputs.MEASURED].default_value = channels


def write_fluorescence(material: bpy.types.Material, absorptance: NDArray[np.float64]) -> None:
    """Tell a wet material how much each fluorophore in it absorbs."""
    surface = surface_node(material.node_tree)
    if surface is not None and surface_inputs.FLUORESCENCE in surface.inputs:
        surface.inputs[surface_inputs.FLUORESCENCE].default_value = absorptance


def _per_weight(total: Operand, weight: Operand) -> Operand:
    return mean(total) / NODES.maximum(mean(weight), _LEAST_FACETS)
