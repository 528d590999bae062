"""Sends the scene's own materials through the real-time surface groups, and back.

A material keeps its nodes. Its closures stay, too: a white sun lights them, and their colours
become what the channels see of sunlight on them there (:mod:`.band_colors`); closures that have
lobes without a colour are mixed in with its fraction. Where that cannot be, in what refracts, or
where layers want to know the light, the shader is lit and measured instead (Shader to RGB). Beside
it stand nodes for what the same shader reflects, emits and lets through (:mod:`.closure_walk`).
"""

from __future__ import annotations

import bpy

from ...node_groups import surface_inputs, uplift
from ...node_groups.node_mathematics import MARK, NODES, Graph, NodeValue
from ...uw_spectral.mathematics import Operand
from ...uw_spectral.transfer.closures import whole_closure
from . import (
    band_colors,
    bare_colours,
    inlined_shaders,
    refractive_indices,
    wet_colours,
    wet_trees,
)
from .closure_walk import ClosureWalk, Surfaces
from .inserted import has_inserted, new_node, own_trees, put_before, repeat
from .native_closures import SUNLIGHT, groups_of_shaders, has_sunlight, native_materials
from .shader_nodes import row_of
from .shader_walk import Closure, is_zero, mean
from .surface_description import write_closure
from .wet_trees import HOLDER, MUTED, MUTED_VOLUME, THICKNESS_MODE

_SHEET, _BODY = "SLAB", "SPHERE"
_DARKEST = 1e-3


def insert(materials: list[bpy.types.Material], surfaces: Surfaces) -> list[str]:
    """Put a surface group behind the shader of each material.

    Returns what could not be treated, one line each.
    """
    notes = inlined_shaders.insert(materials)
    bare_colours.insert(materials)
    bare_colours.blacken(materials)
    refractive_indices.insert(materials)
    wet_colours.insert(materials)
    _insert_matte(materials)
    if surfaces.clear is not None:
        band_colors.filter_clear(materials, surfaces.clear)
    native = native_materials(materials, surfaces)
    for material in materials:
        if not material.is_editable:
            notes.append(
                f"material {material.name!r} is linked from {material.library.filepath} and stays "
                "dry; make it local"
            )
            continue
        output = _surface_output(material.node_tree)
        if MARK not in material:
            _leave_volume_out(material, notes)
        if output is None:
            continue
        name, closed = f"material {material.name!r}", material in surfaces.closed
        dithered = material.surface_render_method == "DITHERED"
        walk = ClosureWalk(material.node_tree, name, notes, surfaces, closed, dithered)
        band_colors.darken(material.node_tree, surfaces.is_apart)
        if material in native:
            measured = band_colors.is_measured(material) or material == surfaces.floor
            _keep(walk, material, output, surfaces.native, measured=measured)
            continue
        notes += [
            f"{name} is lit otherwise than wet ones with the same group {group.name!r}; remove the "
            "water and add it again"
            for group in filter(has_sunlight, groups_of_shaders(material.node_tree))
        ]
        fluoresces = surfaces.fluorescent is not None and material.name in surfaces.fluorescing
        _insert(walk, material, output, surfaces.fluorescent if fluoresces else surfaces.lit)
    for material in (m for m in materials if m.is_editable and MARK not in m):
        wet_trees.note_links(material)
    return list(dict.fromkeys(notes))


def _insert_matte(materials: list[bpy.types.Material]) -> None:
    """Let sheens and hair, which EEVEE takes for matte, throw back as much as they do."""
    for tree in own_trees(materials):
        for node, row in [(n, row_of(n)) for n in tree.nodes]:
            if row is None or row.matte is None:
                continue
            colour = node.inputs[row.colour]
            if has_inserted(colour) or not colour.enabled:
                continue
            group = put_before(tree, colour, new_node(tree, row.matte))
            if uplift.ROUGHNESS in group.inputs:
                repeat(tree, node.inputs["Roughness"], group.inputs[uplift.ROUGHNESS])


def _leave_volume_out(material: bpy.types.Material, notes: list[str]) -> None:
    """Mute what a material is filled with: EEVEE's froxels would neither light nor dim it."""
    output = material.node_tree.get_output_node("EEVEE")
    if output is None:
        return
    for link in [link for link in output.inputs["Volume"].links if not link.is_muted]:
        link.is_muted, output[MUTED_VOLUME] = True, True
    if output.get(MUTED_VOLUME):
        if not output.inputs["Surface"].is_linked:
            # Without anything EEVEE draws black.
            clear = Graph(material.node_tree).node("ShaderNodeBsdfTransparent")
            material.node_tree.links.new(clear.outputs[0], output.inputs["Surface"])
        notes.append(
            f"the volume of material {material.name!r} is left out in real time; the reference "
            "draws it"
        )


def _keep(
    walk: ClosureWalk,
    material: bpy.types.Material,
    output: bpy.types.Node,
    group: bpy.types.ShaderNodeTree,
    *,
    measured: bool,
) -> None:
    """Send the colours of a material through the sunlight, and add the light of the water."""
    tree = walk.tree
    socket = output.inputs["Surface"]
    link = socket.links[0]
    source, muted = link.from_socket, link.is_muted
    wet_trees.keep_shader(source)
    band_colors.route(tree, _sunlit_nodes(group), measured=measured)
    closure, graph = walk.closure(socket), walk.graph
    surface = _sunlight_of(tree, group)
    surface[MUTED] = muted
    surface.location = (output.location.x, output.location.y - 200.0)
    passing = write_closure(walk, closure, surface)
    fraction = graph.term(surface.outputs[uplift.FRACTION])
    mixed = graph.node("ShaderNodeMixShader", {0: fraction})
    mixed[HOLDER] = 2
    tree.links.new(source, mixed.inputs[2]).is_muted = muted
    seen = graph.added(mixed.outputs[0], surface.outputs[0])
    if not is_zero(closure.behind):
        sunlit = _sunlit(graph, closure, closure.behind, surface, measured=measured)
        seen = graph.added(seen, _translucent(walk, material, closure, sunlit, output, surface))
    if not is_zero(closure.highlight):
        sunlit = _sunlit(graph, closure, closure.highlight, surface, measured=measured)
        seen = graph.added(seen, _lambertian(graph, "Diffuse", closure, sunlit))
    if passing is not None:
        # What the fraction has taken of the light behind it.
        transparent = graph.node("ShaderNodeBsdfTransparent", {"Color": passing * (1.0 - fraction)})
        seen = graph.added(seen, transparent.outputs[0])
    tree.links.new(seen, socket)


def _sunlit(
    graph: Graph, closure: Closure, colour: Operand, surface: bpy.types.Node, *, measured: bool
) -> Operand:
    """Return what the channels see of sunlight on a colour that is part of a closure's."""
    if measured:
        part = mean(colour) / NODES.maximum(mean(closure.colour), _DARKEST)
        return graph.term(surface.outputs[uplift.MEASURED_INPUT]) * part
    columns = [graph.term(surface.outputs[name]) for name in uplift.COLUMNS]
    parts = [colour] * len(columns)
    if isinstance(colour, NodeValue):
        parts = list(graph.components(colour))
    red, green, blue = (column * part for column, part in zip(columns, parts, strict=True))
    return red + green + blue


def _lambertian(graph: Graph, kind: str, closure: Closure, colour: Operand) -> bpy.types.NodeSocket:
    """Add a closure of a colour and of the normal of another one."""
    node = graph.node(f"ShaderNodeBsdf{kind}", {"Color": colour})
    if closure.normal is not None:
        graph.assign(closure.normal, node.inputs["Normal"])
    return node.outputs[0]


def _translucent(
    walk: ClosureWalk,
    material: bpy.types.Material,
    closure: Closure,
    colour: Operand,
    output: bpy.types.Node,
    surface: bpy.types.Node,
) -> bpy.types.NodeSocket:
    """Add the one closure that light of lamps shines through, and say how thick it is."""
    graph, tree = walk.graph, walk.tree
    body = walk.closed and material.thickness_mode == _BODY
    if not walk.closed:
        put_before(tree, output.inputs["Thickness"], new_node(tree, uplift.THIN))
        if material.thickness_mode != _SHEET:
            material[THICKNESS_MODE] = material.thickness_mode
            material.thickness_mode = _SHEET
    if not body and surface_inputs.CLOSED in surface.inputs:
        surface.inputs[surface_inputs.CLOSED].default_value = 0.0
    return _lambertian(graph, "Translucent", closure, whole_closure(colour, NODES, closed=body))


def _sunlit_nodes(group: bpy.types.ShaderNodeTree) -> band_colors.Maker:
    """Return what makes the groups of colours, in the sunlight of a water."""

    def make(tree: bpy.types.NodeTree, kind: str) -> bpy.types.Node:
        node = Graph(tree).node("ShaderNodeGroup", node_tree=uplift.group(kind))
        if kind == uplift.DARK:
            return node
        source = _sunlight_of(tree, group)
        for name in (*uplift.COLUMNS, uplift.MEASURED_INPUT, uplift.FRACTION):
            if name in node.inputs and name in source.outputs:
                tree.links.new(source.outputs[name], node.inputs[name])
        return node

    return make


def _sunlight_of(tree: bpy.types.NodeTree, group: bpy.types.ShaderNodeTree) -> bpy.types.Node:
    """Return the one node of a tree that knows the sunlight there."""
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and SUNLIGHT in node:
            return node
    graph = Graph(tree)
    inputs = {surface_inputs.NORMAL: graph.node("ShaderNodeNewGeometry").outputs["Normal"]}
    node = graph.node("ShaderNodeGroup", inputs, node_tree=group)
    node[SUNLIGHT] = True
    return node


def _insert(
    walk: ClosureWalk,
    material: bpy.types.Material,
    output: bpy.types.Node,
    group: bpy.types.ShaderNodeTree,
) -> None:
    tree, graph = walk.tree, walk.graph
    socket = output.inputs["Surface"]
    link = socket.links[0]
    source, muted = link.from_socket, link.is_muted
    wet_trees.keep_shader(source)
    closure = walk.closure(socket)
    lit = graph.node("ShaderNodeShaderToRGB")
    surface = graph.node("ShaderNodeGroup", node_tree=group)
    surface[MUTED] = muted
    surface.location = (output.location.x, output.location.y - 200.0)
    passing = write_closure(walk, closure, surface)
    others = []
    if not is_zero(closure.behind):
        others.append(_translucent(walk, material, closure, closure.behind, output, surface))
    if not is_zero(closure.highlight):
        others.append(_lambertian(graph, "Diffuse", closure, closure.highlight))
    holder = lit
    for other in others:
        last, holder = holder, graph.node("ShaderNodeAddShader")
        tree.links.new(other, holder.inputs[1])
        tree.links.new(holder.outputs[0], last.inputs[0])
    holder[HOLDER] = 0
    tree.links.new(source, holder.inputs[0])
    tree.links.new(lit.outputs["Color"], surface.inputs[surface_inputs.LIT])
    seen = surface.outputs[0]
    if passing is not None:
        transparent = graph.node("ShaderNodeBsdfTransparent", {"Color": passing})
        seen = graph.added(seen, transparent.outputs[0])
    tree.links.new(seen, socket)


def _surface_output(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node | None:
    output = tree.get_output_node("EEVEE")
    return output if output is not None and output.inputs["Surface"].is_linked else None
