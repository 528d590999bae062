"""Node groups that turn an RGB colour into the values of the pass's bands.

Reflectance and emission differ only in the basis, which the pass supplies.
The sum over red, green and blue is linear, hence textures, mixes and ramps
before it keep their meaning.
"""

from __future__ import annotations

import bpy
from nodebpy import shader as s
from nodebpy.builder import VectorSocket

from . import attributes
from .node_mathematics import MARK

REFLECTANCE = "UW Reflectance of Bands"
EMISSION = "UW Emission of Bands"
MEASURED = "UW Measured Reflectance"

_KIND = "uw_uplift"
COLOR_INPUT = "Color"
MEASURED_INPUT = "Measured"


def _basis_sum(color: VectorSocket, basis: tuple[str, str, str]) -> VectorSocket:
    rgb = s.SeparateXYZ(color)
    red, green, blue = (s.Attribute.view_layer(attribute).o.vector for attribute in basis)
    return red * rgb.o.x + green * rgb.o.y + blue * rgb.o.z


def build_reflectance() -> bpy.types.ShaderNodeTree:
    """Build the group RGB reflectance → reflectance of the three bands."""
    with s.tree(REFLECTANCE) as tree:
        color = tree.inputs.vector(COLOR_INPUT)
        _basis_sum(color, attributes.REFLECTANCE_BASIS) >> tree.outputs.vector("Bands")
    return tree.tree


def build_emission() -> bpy.types.ShaderNodeTree:
    """Build the group RGB emission → radiance of the three bands."""
    with s.tree(EMISSION) as tree:
        color = tree.inputs.vector(COLOR_INPUT)
        _basis_sum(color, attributes.EMISSION_BASIS) >> tree.outputs.vector("Bands")
    return tree.tree


def build_measured() -> bpy.types.ShaderNodeTree:
    """Build the group that puts a measured reflectance in the place of a colour.

    The colour input is kept, unused, so that the colour's own link has a home
    until the water is removed.
    """
    with s.tree(MEASURED) as tree:
        tree.inputs.vector(COLOR_INPUT)
        tree.inputs.vector(MEASURED_INPUT) >> tree.outputs.vector("Bands")
    return tree.tree


_BUILDERS = {
    REFLECTANCE: build_reflectance,
    EMISSION: build_emission,
    MEASURED: build_measured,
}


def group(kind: str) -> bpy.types.ShaderNodeTree:
    """Return the group of a kind, building it on first use."""
    for existing in bpy.data.node_groups:
        if existing.get(_KIND) == kind and existing.is_editable:
            return existing
    built = _BUILDERS[kind]()
    built[MARK], built[_KIND] = True, kind
    return built


def is_uplift(tree: bpy.types.NodeTree | None) -> bool:
    """Whether a node tree is a group of :func:`group`."""
    return tree is not None and _KIND in tree
