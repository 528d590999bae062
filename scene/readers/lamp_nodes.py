"""What the nodes of a lamp make of its light: a constant factor, and a photometric file."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import numpy as np

from ...uw_spectral.lamps.emission import colour_of_blackbody
from ...uw_spectral.lamps.ies import Photometry, parse_ies, read_ies
from ..materials import socket_rules
from ..materials.sampled_sockets import EVERYWHERE, SampledSockets
from ..materials.shader_nodes import ShaderNode
from ..materials.shader_walk import Closure, ShaderWalk
from ..materials.surface_points import Array, SurfacePoints

WATTS_PER_CANDELA = 0.0706650768394
"""Blender's value of an IES texture per candela: 4π over 177.83 lm/W."""
_WHITE = Closure(emission=1.0)


@dataclass(frozen=True, eq=False)
class LampNodes:
    """What the nodes of a lamp say."""

    #: On its light, linear Rec.709, (3,); that of an IES texture where its candela are highest.
    factor: Array = field(default_factory=lambda: np.ones(3))
    photometry: Photometry | None = None
    unsupported: tuple[str, ...] = ()  #: Kinds of nodes that change nothing.

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
    found = _LampSockets(SurfacePoints(), light=light)
    emission = _LampWalk(found).closure(output.inputs["Surface"]).emission
    factor = np.broadcast_to(emission, (1, 3))[0]
    return LampNodes(factor, found.photometry, tuple(sorted(found.unknown)))


@dataclass
class _LampSockets(SampledSockets):
    """Values of the nodes of one lamp, as Cycles has them: EEVEE leaves them out."""

    light: bpy.types.Light = field(kw_only=True)
    photometry: Photometry | None = None

    def output(self, output: bpy.types.NodeSocket) -> Array:
        node = output.node
        kind, inputs = node.bl_idname, node.inputs
        if kind == "ShaderNodeBlackbody" and not inputs[0].is_linked:
            return colour_of_blackbody(float(inputs[0].default_value))[None]
        if kind == "ShaderNodeLightFalloff":
            if output.name != "Quadratic" or inputs["Smooth"].default_value:
                self._unknown(node)
            return self.of(inputs["Strength"])
        if kind == "ShaderNodeTexIES" and not inputs["Vector"].is_linked and not self.photometry:
            self.photometry = self._read(node)
            highest = float(self.photometry.mean_candela.max())
            return self.of(inputs["Strength"]) * (highest * WATTS_PER_CANDELA)
        if kind not in EVERYWHERE:
            return self._unknown(node)
        find = functools.partial(super().output, output)
        return find() if self._multiplies(node) else self.apart(find, np.ones((1, 3)))

    def _multiplies(self, node: bpy.types.Node) -> bool:
        """Whether a node does nothing but multiply, as an IES texture may be."""
        if node.bl_idname == "ShaderNodeMath":
            return node.operation == "MULTIPLY" and not node.use_clamp
        if node.bl_idname not in ("ShaderNodeMix", "ShaderNodeMixRGB"):
            return False
        clamps = node.clamp_result if node.bl_idname == "ShaderNodeMix" else node.use_clamp
        fraction = next(i for i in node.inputs if not i.is_unavailable)
        return node.blend_type == "MULTIPLY" and not clamps and bool(self.of(fraction) == 1.0)

    def apart[Found](self, find: Callable[[], Found], otherwise: Found) -> Found:
        """Find a part of the light, which an IES texture cannot shape by itself."""
        before, self.photometry = self.photometry, None
        found = find()
        if self.photometry is not None:
            self.unknown.add("IES Texture")
            found = otherwise
        self.photometry = before
        return found

    def _read(self, node: bpy.types.Node) -> Photometry:
        if node.mode == "INTERNAL":
            text = "" if node.ies is None else node.ies.as_string()
            return parse_ies(text, f"text of node {node.name!r}")
        return read_ies(Path(bpy.path.abspath(node.filepath, library=self.light.library)))

    def _unknown(self, node: bpy.types.Node) -> Array:
        self.unknown.add(node.bl_label)
        return np.ones((1, 3))


@dataclass
class _LampWalk(ShaderWalk):
    """Light of the shaders of a lamp, of which only Emission is known."""

    sockets: _LampSockets

    def value(self, socket: bpy.types.NodeSocket) -> Array:
        found = self.sockets.apart(lambda: self.sockets.of(socket), np.ones((1, 3)))
        return np.clip(found, *socket_rules.limits(socket))

    def group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        del output
        return self.unknown(node)

    def part(self, socket: bpy.types.NodeSocket) -> Closure:
        return self.sockets.apart(lambda: self.closure(socket), _WHITE)

    def bare(self, output: bpy.types.NodeSocket) -> Closure:
        return Closure(emission=self.sockets.output(output))

    def unknown(self, node: bpy.types.Node) -> Closure:
        self.sockets.unknown.add(node.bl_label)
        return _WHITE

    def of(self, node: bpy.types.Node, row: ShaderNode) -> Closure:
        return self.unknown(node) if row.colour else super().of(node, row)

    def glow(self, colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Closure:
        return Closure(emission=self.sockets.of(colour) * self.sockets.of(strength))
