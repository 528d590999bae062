"""Scans whose photographed light is given off again: what to do with them under water."""

from __future__ import annotations

import bpy

from ..uw_spectral.errors import first_of
from . import contents
from .rendered import ever_rendered

_PICTURES = {"TEX_IMAGE", "ATTRIBUTE", "VERTEX_COLOR"}
_PASSES = {"BSDF_TRANSPARENT"}  # beside the glow, as importers of glTF lay it
_GLOWS = {"EMISSION", "BACKGROUND"}


def notes(scene: bpy.types.Scene) -> list[str]:
    """Return a hint about materials that give off a picture and reflect nothing, if there are."""
    seen = contents.objects(scene, ever_rendered(scene))
    found = dict.fromkeys(m.name for item in seen for m in contents.materials_of(item) if _is(m))
    if not found:
        return []
    return [
        f"material {first_of(map(repr, found))} glows with its picture, as unlit "
        "scans do: it is as bright at any depth and takes no light; to light it, link the picture "
        "to the Base Color of a Principled BSDF"
    ]


def _is(material: bpy.types.Material) -> bool:
    """Whether a picture or a colour of vertices is given off, and no surface reflects."""
    nodes = [
        node
        for node in material.node_tree.nodes
        if not node.mute and any(socket.is_linked for socket in node.outputs)
    ]
    if any(node.type.startswith("BSDF_") and node.type not in _PASSES for node in nodes):
        return False
    glows = [node for node in nodes if node.type in _GLOWS]
    return any(
        link.from_node.type in _PICTURES for node in glows for link in node.inputs["Color"].links
    )
