"""What Blender makes of what a socket gets: which link counts, how it converts, where it clamps."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Color
from numpy.typing import NDArray

_FRACTION, _POSITIVE = (0.0, 1.0), (0.0, math.inf)
_NUMBERS = {
    "Factor": _FRACTION,
    "Metallic": _FRACTION,
    "Alpha": _FRACTION,
    "Transmission Weight": _FRACTION,
    "Coat Weight": _FRACTION,
    "Roughness": _FRACTION,
    "Coat Roughness": _FRACTION,
    "Specular IOR Level": _POSITIVE,
    "Strength": _POSITIVE,
}
_UNLIMITED = {"Emission Color"}
_DEEPEST = 1024  # links in a row; Blender refuses circles, not for every input


def source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Return the output that an input gets its value from; None if it has its own.

    Reroutes are followed, and muted nodes as they pass on; what ends there without a value leaves
    an input its own, as in EEVEE and Cycles.
    """
    for _ in range(_DEEPEST):
        links = [k for k in socket.links if k.is_valid and not k.is_muted]
        links = [k for k in links if not k.from_socket.is_unavailable]
        if not links:
            return None
        node, output = links[0].from_node, links[0].from_socket
        if node.bl_idname == "NodeReroute":
            socket = node.inputs[0]
        elif node.mute:
            passed = [k.from_socket for k in node.internal_links if k.to_socket == output]
            if not passed:
                return None
            socket = passed[0]
        else:
            return output
    return None


def before(socket: bpy.types.NodeSocket, kind: str) -> bpy.types.Node | None:
    """Return a node of a kind that an input depends on, in the same tree; the nearest."""
    waiting, seen = [socket], set()
    while waiting:
        found = source(waiting.pop(0))
        if found is None or found.node in seen:
            continue
        if found.node.bl_idname == kind:
            return found.node
        seen.add(found.node)
        waiting += list(found.node.inputs)
    return None


def limits(socket: bpy.types.NodeSocket) -> tuple[float, float]:
    """Least and greatest value of an input of a shader node that EEVEE heeds.

    Of EEVEE 5.2; Cycles has the same, but its light may be negative.
    """
    if socket.type == "RGBA" and socket.name not in _UNLIMITED:
        # Cycles amplifies by what is clear and more than white.
        return _FRACTION if socket.node.bl_idname == "ShaderNodeBsdfTransparent" else _POSITIVE
    return _NUMBERS.get(socket.name, (-math.inf, math.inf))


def luminance_weights() -> NDArray[np.float64]:
    """Luminance of red, green and blue in the colour space that the file works in, (3,)."""
    return np.array([Color(row).from_scene_linear_to_xyz_d65()[1] for row in np.eye(3).tolist()])
