"""Routes the colours of a scene's own materials through the water.

Every colour that enters a shader node gets a group node in between: RGB goes in, and in Cycles the
values of the pass's bands come out, in EEVEE what the channels see of the colour in the sunlight
there. Nothing else of the tree changes, and taking the groups out again leaves the tree as it was.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterable, Iterator

import bpy
import numpy as np

from ...node_groups import attributes, uplift
from ...node_groups.node_mathematics import MARK, Graph
from ...uw_spectral.spectra.spectrum import Spectrum
from .. import contents
from .inserted import (
    add_node,
    has_inserted,
    is_idle,
    is_inserted,
    new_node,
    own_trees,
    put_before,
    take_out,
    trees_but,
    value_curves,
)
from .shader_nodes import SHADER_NODES, makes_closure, row_of

MEASURED_WAVELENGTHS = "uw_reflectance_wavelengths_nm"
MEASURED_REFLECTANCE = "uw_reflectance"
_MEASURED_INDEX = "uw_measured_index"

# Vectors that hold one number per colour channel, so they follow the bands too.
_SPECTRAL_VECTORS = {
    "Subsurface Radius",
    "Radius",
    "IOR",
    "Extinction",
    "Absorption Coefficient",
    "Absorption Coefficients",
    "Scatter Coefficients",
}
# Inputs without effect while another one is zero.
_WEIGHTS = {
    "Coat Tint": "Coat Weight",
    "Emission Color": "Emission Strength",
    "Sheen Tint": "Sheen Weight",
    "Subsurface Radius": "Subsurface Weight",
}
# What lets through what is behind it, which has its water already; and what only filters.
_CLEAR = {name for name, row in SHADER_NODES.items() if row.clear == 1.0}
_FILTERS = {"Coat Tint"}
_BASE_COLORS = {"Base Color", "Color"}
_UNTOUCHED = 1e-6


type Maker = Callable[[bpy.types.NodeTree, str], bpy.types.Node]
"""Makes the group node of a kind in a tree."""


def route(tree: bpy.types.NodeTree, make: Maker, *, measured: bool) -> None:
    """Put EEVEE's groups, of the kinds of :mod:`.uplift`, before the colours of a tree's closures.

    In its groups, too; ``measured`` is whether the base colour gives way to a measured reflectance.
    """
    for node, socket in _colours(tree):
        if node.bl_idname in _CLEAR or socket.name in _FILTERS:
            continue
        kind, weight = _group_for(node, socket), _WEIGHTS.get(socket.name, "")
        if kind is None or socket.type != "RGBA" or is_idle(tree, node, weight):
            continue
        if kind == uplift.EMISSION:
            kind = uplift.DARK
        elif measured and socket.name in _BASE_COLORS:
            kind = uplift.SUNLIT_MEASURED
        else:
            kind = uplift.SUNLIT
        put_before(tree, socket, make(tree, kind))
    for group in _groups(tree):
        route(group, make, measured=False)


def darken(
    tree: bpy.types.NodeTree, apart: Callable[[bpy.types.NodeTree, bpy.types.Node], bool]
) -> None:
    """Leave nothing of the colours of some nodes, in groups neither: other closures have them."""
    for node, socket in _colours(tree):
        if socket.type == "RGBA" and apart(tree, node):
            put_before(tree, socket, new_node(tree, uplift.DARK))
    for group in _groups(tree):
        darken(group, apart)


def filter_clear(materials: Iterable[bpy.types.Material], group: bpy.types.ShaderNodeTree) -> None:
    """Put EEVEE's group before the colours of what lets through what is behind.

    ``group`` is that of :func:`.uplift.build_filter`.
    """
    for tree in own_trees(materials):
        for node, socket in _colours(tree):
            if node.bl_idname not in _CLEAR or socket.type != "RGBA":
                continue
            if not _has_no_effect(tree, node, socket, uplift.REFLECTANCE):
                made = Graph(tree).node("ShaderNodeGroup", node_tree=group)
                put_before(tree, socket, made)


def insert(materials: Iterable[bpy.types.Material]) -> list[str]:
    """Insert the groups into materials; returns what could not be treated, one line each."""
    notes = []
    taken = [m[_MEASURED_INDEX] for m in bpy.data.materials if _MEASURED_INDEX in m]
    indices = itertools.count(1 + max(taken, default=-1))
    for material in materials:
        if not material.is_editable:
            notes.append(
                f"material {material.name!r} is linked from {material.library.filepath} and keeps "
                "its RGB colours; make it local to give it spectra"
            )
            continue
        if is_measured(material) and _MEASURED_INDEX not in material:
            material[_MEASURED_INDEX] = next(indices)
        _insert_into_tree(material.node_tree, material.get(_MEASURED_INDEX))
    return notes


def remove(kept: Collection[bpy.types.Material]) -> None:
    """Take every inserted group out again, except from materials and from groups in them."""
    for tree in trees_but(kept):
        for node in [n for n in tree.nodes if is_inserted(n)]:
            measured = node.inputs.get(uplift.MEASURED_INPUT)
            for link in list(measured.links) if measured is not None else ():
                if link.from_node.bl_idname == "ShaderNodeAttribute":
                    tree.nodes.remove(link.from_node)
            take_out(tree, node)
    for material in bpy.data.materials:
        if _MEASURED_INDEX in material and material not in kept:
            del material[_MEASURED_INDEX]


def is_measured(material: bpy.types.Material) -> bool:
    """Whether a material carries a measured reflectance."""
    return MEASURED_REFLECTANCE in material and MEASURED_WAVELENGTHS in material


def measured_reflectances(scene: bpy.types.Scene) -> Iterator[tuple[bpy.types.Material, Spectrum]]:
    """Yield the materials that carry a measured reflectance, with it; InputError if it is none."""
    for material in filter(is_measured, contents.materials(scene)):
        yield (
            material,
            Spectrum(
                np.array(material[MEASURED_WAVELENGTHS], dtype=np.float64),
                np.array(material[MEASURED_REFLECTANCE], dtype=np.float64),
                f"reflectance of material {material.name!r}",
            ),
        )


def measured_attribute(material: bpy.types.Material) -> str | None:
    """Name of the pass value that holds a material's measured reflectance, if it reads one."""
    index = material.get(_MEASURED_INDEX)
    return None if index is None else attributes.measured(index)


def _insert_into_tree(tree: bpy.types.NodeTree, measured_index: int | None) -> None:
    for group in _groups(tree):
        _insert_into_tree(group, None)
    for node, socket in _colours(tree):
        kind = _group_for(node, socket)
        if kind is None:
            continue
        if measured_index is not None and socket.name in _BASE_COLORS and kind != uplift.EMISSION:
            _put_measured_before(tree, socket, measured_index)
        elif not _has_no_effect(tree, node, socket, kind):
            put_before(tree, socket, new_node(tree, kind))


def _colours(tree: bpy.types.NodeTree) -> Iterator[tuple[bpy.types.Node, bpy.types.NodeSocket]]:
    """Yield the inputs of a tree's shaders that nothing was put before yet."""
    for node in list(tree.nodes):
        if MARK in node or not makes_closure(node):
            continue
        yield from (
            (node, socket) for socket in node.inputs if not has_inserted(socket, uplift.READ)
        )


def _groups(tree: bpy.types.NodeTree) -> list[bpy.types.NodeTree]:
    found = [n.node_tree for n in tree.nodes if n.bl_idname == "ShaderNodeGroup" and MARK not in n]
    own = [g for g in found if g is not None and g.is_editable and MARK not in g]
    return list(dict.fromkeys(own))


def _group_for(node: bpy.types.Node, socket: bpy.types.NodeSocket) -> str | None:
    if not socket.enabled:
        return None
    if socket.type == "RGBA":
        row = row_of(node)
        glow = None if row is None or row.emits is None else row.emits[0]
        emits = socket.name == glow or "Emissi" in socket.name
        return uplift.EMISSION if emits else uplift.REFLECTANCE
    if socket.type == "VECTOR" and socket.name == "Emission Coefficients":
        return uplift.EMISSION
    if socket.type == "VECTOR" and socket.name in _SPECTRAL_VECTORS:
        return uplift.REFLECTANCE
    return None


def _has_no_effect(
    tree: bpy.types.NodeTree, node: bpy.types.Node, socket: bpy.types.NodeSocket, kind: str
) -> bool:
    """Whether the group would change nothing: the input weighs nothing, or is white."""
    if is_idle(tree, node, _WEIGHTS.get(socket.name, "")):
        return True
    if socket.is_linked or value_curves(tree, socket):
        return False
    value = np.array(socket.default_value)[:3]
    return kind == uplift.REFLECTANCE and bool(np.all(np.abs(value - 1.0) < _UNTOUCHED))


def _put_measured_before(
    tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, index: int
) -> None:
    node = put_before(tree, socket, new_node(tree, uplift.MEASURED))
    attribute = add_node(tree, "ShaderNodeAttribute", node)
    attribute.attribute_type = "VIEW_LAYER"
    attribute.attribute_name = attributes.measured(index)
    tree.links.new(attribute.outputs["Vector"], node.inputs[uplift.MEASURED_INPUT])
