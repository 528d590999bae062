"""Takes the colours of porous materials, which are those of dry objects, for wet where they are."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...node_groups import uplift
from ...node_groups.node_mathematics import MARK
from ..stored_materials import is_porous
from .inserted import has_inserted, new_node, own_trees, put_before
from .shader_nodes import row_of


def of(materials: Iterable[bpy.types.Material]) -> tuple[str, ...]:
    """Names of those that are porous."""
    return tuple(sorted(material.name for material in materials if is_porous(material)))


def insert(materials: Iterable[bpy.types.Material]) -> None:
    """Put the groups before the matte colours of porous materials.

    :func:`.uplift.set_wet_grains` tells them of the water. Shader groups that others use, too,
    stay as they are.
    """
    known = list(materials)
    porous = [material for material in known if is_porous(material)]
    others = [material for material in known if material not in porous]
    for tree in own_trees(porous) - own_trees(others):
        for node, row in [(n, row_of(n)) for n in tree.nodes if MARK not in n]:
            if row is None or not row.porous:
                continue
            colour = node.inputs[row.colour]
            if colour.enabled and not has_inserted(colour):
                put_before(tree, colour, new_node(tree, uplift.WET))
