"""What the nodes of a lamp make of its light: a constant factor, and a photometric file."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.lamps.emission import colour_of_blackbody
from ...uw_spectral.lamps.ies import Photometry, parse_ies, read_ies
from ..materials import socket_rules
from ..materials.shader_nodes import ADD, MIX

type Array = NDArray[np.float64]

WATTS_PER_CANDELA = 0.0706650768394
"""Blender's value of an IES texture per candela: 4π over 177.83 lm/W."""
_NUMBERED = re.compile(r"^\d+_")  # what Blender puts before the names of nodes it inlines
_OPERATIONS: dict[str, Callable[..., Array]] = {
    "MULTIPLY": operator.mul,
    "ADD": operator.add,
    "SUBTRACT": operator.sub,
    "DIVIDE": lambda a, b: np.divide(a, b, out=np.zeros(3), where=b != 0.0),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "ABSOLUTE": np.abs,
    "SQRT": lambda a: np.sqrt(np.maximum(a, 0.0)),
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "DARKEN": np.minimum,
    "LIGHTEN": np.maximum,
    "MIX": lambda _, b: b,
}
"""Of Math and of Mix."""


@dataclass(frozen=True, eq=False)
class LampNodes:
    """What the nodes of a lamp say.

    Its light has a factor, linear Rec.709, shape (3,); that of an IES texture where its candela are
    highest. Nodes with the ``unsupported`` names change nothing.
    """

    factor: Array = field(default_factory=lambda: np.ones(3))
    photometry: Photometry | None = None
    unsupported: tuple[str, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether they change nothing."""
        return self.photometry is None and bool(np.all(self.factor == 1.0))


def nodes_of(light: bpy.types.Light) -> LampNodes:
    """Return what the nodes of a lamp say; InputError if a photometric file cannot be used."""
    if light.node_tree is None:
        return LampNodes()
    # Groups, zones, reroutes and what is muted are gone in it; it lives as long as its owner.
    inlined = light.inline_shader_nodes()
    output = inlined.node_tree.get_output_node("CYCLES")
    if output is None:
        return LampNodes(np.zeros(3))
    reader = _Reader(light)
    factor = reader.shader(output.inputs["Surface"])
    return LampNodes(factor, reader.photometry, tuple(dict.fromkeys(reader.unsupported)))


@dataclass
class _Reader:
    """Follows the nodes of one lamp, as Cycles does: EEVEE leaves them out."""

    light: bpy.types.Light
    photometry: Photometry | None = None
    unsupported: list[str] = field(default_factory=list)

    def shader(self, socket: bpy.types.NodeSocket) -> Array:
        """Light that arrives at a shader's input."""
        source = socket_rules.source(socket)
        if source is None:
            return np.zeros(3)
        node = source.node
        if source.type != "SHADER":  # Blender takes it for an Emission
            return self._output(node, source)
        if node.bl_idname == "ShaderNodeEmission":
            return self.value(node.inputs["Color"]) * self.value(node.inputs["Strength"])
        if node.bl_idname in (ADD, MIX):
            one, other = (self._apart(self.shader, i) for i in node.inputs if i.type == "SHADER")
            if node.bl_idname == ADD:
                return one + other
            fraction = np.clip(self._still(node.inputs[0]), *socket_rules.limits(node.inputs[0]))
            return one + fraction * (other - one)
        return self._unknown(node)

    def value(self, socket: bpy.types.NodeSocket) -> Array:
        """What a colour or a number gets."""
        source = socket_rules.source(socket)
        if source is None:
            return _constant(socket)
        found = self._output(source.node, source)
        if socket.type != "VALUE":
            return found
        return np.full(3, socket_rules.as_number(found, source.type))

    def _output(self, node: bpy.types.Node, source: bpy.types.NodeSocket) -> Array:
        kind, inputs = node.bl_idname, node.inputs
        if kind in ("ShaderNodeRGB", "ShaderNodeValue"):
            return _constant(source)
        if kind == "ShaderNodeBlackbody" and not inputs[0].is_linked:
            return colour_of_blackbody(float(inputs[0].default_value))
        if kind == "ShaderNodeLightFalloff":
            if source.name != "Quadratic" or np.any(_constant(inputs["Smooth"])):
                self._unknown(node)
            return self.value(inputs["Strength"])
        if kind == "ShaderNodeTexIES" and not inputs["Vector"].is_linked and not self.photometry:
            self.photometry = self._read(node)
            highest = float(self.photometry.mean_candela.max())
            return self.value(inputs["Strength"]) * (highest * WATTS_PER_CANDELA)
        if kind == "ShaderNodeMath":
            shown = [i for i in inputs if not i.is_unavailable]
            return self._operation(node, node.operation, shown, np.ones(3), clamp=node.use_clamp)
        if kind in ("ShaderNodeMix", "ShaderNodeMixRGB"):
            return self._mixed(node)
        return self._unknown(node)

    def _mixed(self, node: bpy.types.Node) -> Array:
        shown = [i for i in node.inputs if not i.is_unavailable]
        fraction, newer = self._still(shown[0]), node.bl_idname == "ShaderNodeMix"
        if not newer or node.clamp_factor:
            fraction = np.clip(fraction, 0.0, 1.0)
        colours = not newer or node.data_type == "RGBA"
        clamp = colours and (node.clamp_result if newer else node.use_clamp)
        name = node.blend_type if colours else "MIX"
        return self._operation(node, name, shown[1:3], fraction, clamp=clamp)

    def _operation(
        self,
        node: bpy.types.Node,
        name: str,
        sockets: list[bpy.types.NodeSocket],
        fraction: Array,
        *,
        clamp: bool,
    ) -> Array:
        """Of constants; an IES texture may be multiplied."""
        if name not in _OPERATIONS:
            return self._unknown(node)
        whole = name == "MULTIPLY" and np.all(fraction == 1.0) and not clamp
        given = [(self.value if whole else self._still)(i) for i in sockets]
        changed = _OPERATIONS[name](*given)
        found = given[0] + fraction * (changed - given[0])
        return np.clip(found, 0.0, 1.0) if clamp else found

    def _still(self, socket: bpy.types.NodeSocket) -> Array:
        return self._apart(self.value, socket)

    def _apart(
        self, follow: Callable[[bpy.types.NodeSocket], Array], socket: bpy.types.NodeSocket
    ) -> Array:
        """Follow a part of the light, which an IES texture cannot shape by itself."""
        before, self.photometry = self.photometry, None
        found = follow(socket)
        if self.photometry is not None:
            self.unsupported.append("IES Texture")
            found = np.ones(3)
        self.photometry = before
        return found

    def _read(self, node: bpy.types.Node) -> Photometry:
        if node.mode == "INTERNAL":
            text = "" if node.ies is None else node.ies.as_string()
            return parse_ies(text, f"text of node {node.name!r}")
        return read_ies(Path(bpy.path.abspath(node.filepath, library=self.light.library)))

    def _unknown(self, node: bpy.types.Node) -> Array:
        self.unsupported.append(_NUMBERED.sub("", node.name))
        return np.ones(3)


def _constant(socket: bpy.types.NodeSocket) -> Array:
    value = socket.default_value
    return np.full(3, value, np.float64) if isinstance(value, float | int) else np.array(value[:3])
