"""What the nodes of a lamp make of its light: a constant factor, and a photometric file."""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.lamps.emission import colour_of_blackbody
from ...uw_spectral.lamps.ies import Photometry, parse_ies, read_ies

type Array = NDArray[np.float64]

WATTS_PER_CANDELA = 0.0706650768394
"""Blender's value of an IES texture per candela: 4π over 177.83 lm/W."""
_DEEPEST = 32  # nodes in a row
_PRODUCTS: dict[str, Callable[[Array, Array], Array]] = {
    "MULTIPLY": operator.mul,
    "ADD": operator.add,
    "SUBTRACT": operator.sub,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
}


@dataclass(frozen=True, eq=False)
class LampNodes:
    """What the nodes of a lamp say.

    Attributes
    ----------
    factor : array, shape (3,)
        On its light, linear Rec.709; that of an IES texture where its candela are highest.
    photometry : Photometry, optional
        Of an IES texture.
    unheeded : tuple of str
        Names of the nodes that change nothing.
    """

    factor: Array = field(default_factory=lambda: np.ones(3))
    photometry: Photometry | None = None
    unheeded: tuple[str, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether they change nothing."""
        return self.photometry is None and bool(np.all(self.factor == 1.0))


def nodes_of(light: bpy.types.Light) -> LampNodes:
    """Return what the nodes of a lamp say; plain without any.

    Raises
    ------
    InputError
        If a photometric file cannot be used.
    """
    tree = light.node_tree
    if tree is None:
        return LampNodes()
    outputs = [n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputLight"]
    output = next((n for n in outputs if n.is_active_output), None)
    if output is None:
        return LampNodes(np.zeros(3))
    reader = _Reader(light)
    factor = reader.shader(output.inputs["Surface"])
    return LampNodes(factor, reader.photometry, tuple(dict.fromkeys(reader.unheeded)))


@dataclass
class _Reader:
    """Follows the nodes of one lamp."""

    light: bpy.types.Light
    photometry: Photometry | None = None
    unheeded: list[str] = field(default_factory=list)
    depth: int = 0

    def shader(self, socket: bpy.types.NodeSocket) -> Array:
        """Light that arrives at a shader's input."""
        source = _source(socket)
        if source is None:
            return np.zeros(3)
        node = source.node
        if node.bl_idname == "ShaderNodeEmission" and not node.mute:
            return self.value(node.inputs["Color"]) * self.value(node.inputs["Strength"])
        if node.bl_idname in ("ShaderNodeAddShader", "ShaderNodeMixShader") and not node.mute:
            one, other = (self._apart(self.shader, i) for i in node.inputs if i.type == "SHADER")
            if node.bl_idname == "ShaderNodeAddShader":
                return one + other
            share = self._apart(self.value, node.inputs[0])
            return one + share * (other - one)
        return self._unknown(node)

    def value(self, socket: bpy.types.NodeSocket) -> Array:
        """What a colour or a number gets."""
        source = _source(socket)
        if source is None:
            return _constant(socket)
        if self.depth > _DEEPEST:
            return self._unknown(source.node)
        self.depth += 1
        try:
            return self._output(source.node, source)
        finally:
            self.depth -= 1

    def _output(self, node: bpy.types.Node, source: bpy.types.NodeSocket) -> Array:
        kind, inputs = node.bl_idname, node.inputs
        if node.mute:
            return self._unknown(node)
        if kind in ("ShaderNodeRGB", "ShaderNodeValue"):
            return _constant(source)
        if kind == "ShaderNodeBlackbody" and not inputs[0].is_linked:
            return colour_of_blackbody(float(inputs[0].default_value))
        if kind == "ShaderNodeLightFalloff":
            if source.name != "Quadratic" or np.any(_constant(inputs["Smooth"])):
                self.unheeded.append(node.name)
            return self.value(inputs["Strength"])
        if kind == "ShaderNodeTexIES" and not inputs["Vector"].is_linked and not self.photometry:
            self.photometry = self._read(node)
            highest = float(self.photometry.mean_candela.max())
            return self.value(inputs["Strength"]) * (highest * WATTS_PER_CANDELA)
        if kind in ("ShaderNodeMath", "ShaderNodeMix"):
            return self._product(node)
        return self._unknown(node)

    def _product(self, node: bpy.types.Node) -> Array:
        """Of two constants; an IES texture may be multiplied."""
        shown = [i for i in node.inputs if not i.is_unavailable]
        if node.bl_idname == "ShaderNodeMath":
            name, share, pair = node.operation, np.ones(3), shown[:2]
        else:
            name, pair = getattr(node, "blend_type", "MIX"), shown[1:3]
            share = self._apart(self.value, shown[0])
        follow = self.value if name == "MULTIPLY" and np.all(share == 1.0) else self._still
        if len(pair) < 2 or name not in (*_PRODUCTS, "MIX"):
            return self._unknown(node)
        one, other = (follow(i) for i in pair)
        changed = other if name == "MIX" else _PRODUCTS[name](one, other)
        return one + share * (changed - one)

    def _still(self, socket: bpy.types.NodeSocket) -> Array:
        return self._apart(self.value, socket)

    def _apart(
        self, follow: Callable[[bpy.types.NodeSocket], Array], socket: bpy.types.NodeSocket
    ) -> Array:
        """Follow a part of the light, which an IES texture cannot shape by itself."""
        before, self.photometry = self.photometry, None
        found = follow(socket)
        if self.photometry is not None:
            self.unheeded.append("IES Texture")
            found = np.ones(3)
        self.photometry = before
        return found

    def _read(self, node: bpy.types.Node) -> Photometry:
        if node.mode == "INTERNAL":
            text = "" if node.ies is None else node.ies.as_string()
            return parse_ies(text, f"text of node {node.name!r}")
        return read_ies(Path(bpy.path.abspath(node.filepath, library=self.light.library)))

    def _unknown(self, node: bpy.types.Node) -> Array:
        self.unheeded.append(node.name)
        return np.ones(3)


def _source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """Output that an input gets its value from, reroutes followed."""
    for _ in range(_DEEPEST):
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return None
        if links[0].from_node.bl_idname != "NodeReroute":
            return links[0].from_socket
        socket = links[0].from_node.inputs[0]
    return None


def _constant(socket: bpy.types.NodeSocket) -> Array:
    value = socket.default_value
    return np.full(3, value, np.float64) if isinstance(value, float | int) else np.array(value[:3])
