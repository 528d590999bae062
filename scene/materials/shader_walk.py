"""The one walk through the shaders of a tree: what arrives at an input reflects, emits, passes.

A closure cannot be asked for its colour. Every quantity is linear in the closures, so Mix and Add
Shader mix and add it. What sockets hold may be nodes or arrays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import bpy
import numpy as np

from ...node_groups.node_mathematics import NODES, NodeValue
from ...uw_spectral.mathematics import Operand
from . import socket_rules
from .shader_nodes import ADD, MIX, ShaderNode, Weight, row_of

GREY = 0.5
"""Colour of what is not known."""


@dataclass(frozen=True)
class Closure:
    """What a shader reflects, emits and lets through, as RGB terms or numbers.

    Of the colour, ``mirrored`` is the part that mirrors, and ``behind`` the part that the light
    from behind shines through; ``highlight`` is the colour of a matte closure that is as bright in
    the sun as closures that EEVEE lacks. By ``mirror``, ``edge`` and ``clear`` facets throw back
    lamps (:class:`.Facets`); ``roughness`` is times the weight ``facets``, ``mirror_roughness``
    times ``mirrored``, ``index`` times ``clear``, and what coats have times ``coat``.
    """

    colour: Operand = 0.0
    emission: Operand = 0.0
    transmittance: Operand = 0.0
    mirrored: Operand = 0.0
    behind: Operand = 0.0
    highlight: Operand = 0.0
    mirror: Operand = 0.0
    edge: Operand = 0.0
    clear: Operand = 0.0
    facets: Operand = 0.0
    roughness: Operand = 0.0
    mirror_roughness: Operand = 0.0
    index: Operand = 0.0
    coat: Operand = 0.0
    coat_roughness: Operand = 0.0
    coat_index: Operand = 0.0
    normal: NodeValue | None = None
    coat_normal: NodeValue | None = None

    def times(self, factor: Operand) -> Closure:
        """Return it with all of it times a factor."""
        return replace(self, **{name: getattr(self, name) * factor for name in _QUANTITIES})

    def combined(self, other: Closure, join: Callable[[Operand, Operand], Operand]) -> Closure:
        """Return what two are together; of normals those of the first."""
        joined = {name: join(getattr(self, name), getattr(other, name)) for name in _QUANTITIES}
        normals = self.normal or other.normal, self.coat_normal or other.coat_normal
        return Closure(**joined, normal=normals[0], coat_normal=normals[1])


_QUANTITIES = [part.name for part in fields(Closure) if part.default == 0.0]
"""All but the normals."""


class ShaderWalk(ABC):
    """Follows shaders; what their sockets hold, and what more is asked of them, is a subclass's."""

    closed: bool = False  #: Light comes into a body through one wall and out through another.
    shines: bool = False  #: What it emits and mirrors is asked for, too.

    @abstractmethod
    def value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return what a socket holds, in the limits of the shader."""

    @abstractmethod
    def group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        """Return what comes out of a group, or of the inputs of the one that is followed."""

    def closure(self, socket: bpy.types.NodeSocket) -> Closure:
        """Return what arrives at a shader input."""
        output = socket_rules.source(socket)
        if output is None:
            return Closure()
        node, row = output.node, row_of(output.node)
        if output.type != "SHADER":
            return self.bare(output)
        if node.bl_idname in (MIX, ADD):
            fraction = None if node.bl_idname == ADD else self.value(node.inputs[0])
            first, second = (self.part(i) for i in node.inputs if i.type == "SHADER")
            if fraction is None:
                return first.combined(second, lambda a, b: a + b)
            return first.combined(second, lambda a, b: a * (1.0 - fraction) + b * fraction)
        if node.bl_idname in ("NodeGroupInput", "ShaderNodeGroup"):
            return self.group(node, output)
        if row is not None and (not row.colour or row.colour in node.inputs):
            return self.of(node, row)
        return self.unknown(node)

    def part(self, socket: bpy.types.NodeSocket) -> Closure:
        """Return what arrives at an input of what joins shaders."""
        return self.closure(socket)

    def bare(self, output: bpy.types.NodeSocket) -> Closure:
        """Return what a colour is that arrives as a shader: Blender takes it for an Emission."""
        del output
        return Closure()

    def unknown(self, node: bpy.types.Node) -> Closure:
        """Return what a shader counts as that has no row."""
        del node
        return Closure(colour=GREY)

    def note(self, text: str) -> None:
        """Hear what is to be known of a material."""
        del text

    def colour(self, node: bpy.types.Node, row: ShaderNode) -> Operand:
        """Return the colour by which a node reflects and lets through."""
        return self.value(node.inputs[row.colour])

    def filtered(self, colour: Operand) -> Operand:
        """Return what is left of what a colour lets through."""
        return colour

    def glow(self, colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Closure:
        """Return what a node emits."""
        del colour, strength
        return Closure()

    def reflected(
        self, node: bpy.types.Node, row: ShaderNode, body: Closure, weights: Weights
    ) -> Closure:
        """Return what a node is, with its normals, what mirrors of it and its facets."""
        del node, row, weights
        return body

    def of(self, node: bpy.types.Node, row: ShaderNode) -> Closure:
        """Return what a node of the table is."""
        if not row.colour:
            return self._glow(node, row)
        cover, base = self.weight(node, row.cover), self.colour(node, row)
        clear = self.weight(node, row.clear)
        is_asked = self.shines or not is_zero(clear)
        metallic = self.weight(node, row.mirrors) if is_asked else 0.0
        passing = clear * (1.0 - metallic)
        if row.approximate and not (row.clear and is_zero(passing)):
            self.note(row.approximate)
        transmittance = 1.0 - cover
        if not is_zero(passing):
            transmittance = transmittance + cover * passing * self._left(row, base)
        glow = self._glow(node, row)
        if row.coat:
            coat, tint = (self.value(node.inputs[name]) for name in ("Coat Weight", "Coat Tint"))
            if not is_zero(coat) and not (isinstance(tint, float) and tint == 1.0):
                through = 1.0 + coat * (tint - 1.0)
                base, glow = base * through, glow.times(through)
        colour, behind = base * (cover * (1.0 - passing)), 0.0
        if row.behind:
            behind = colour = colour * colour if self.closed else colour
        body = Closure(colour, transmittance=transmittance, behind=behind)
        body = self.reflected(node, row, body, Weights(base, cover, metallic, passing))
        return body.combined(glow.times(cover), lambda a, b: a + b)

    def weight(self, node: bpy.types.Node, weight: Weight) -> Operand:
        """Return how much of something a node does."""
        return self.value(node.inputs[weight]) if isinstance(weight, str) else weight

    def _glow(self, node: bpy.types.Node, row: ShaderNode) -> Closure:
        return Closure() if row.emits is None else self.glow(*(node.inputs[n] for n in row.emits))

    def _left(self, row: ShaderNode, base: Operand) -> Operand:
        """Return what a colour leaves of what passes: half of it at each face, if so by its row."""
        if not row.by_face:
            return base
        if self.closed:
            # What both faces leave of a channel is no product of means.
            return NODES.sqrt(NODES.maximum(self.filtered(base), 0.0))
        return self.filtered(NODES.sqrt(base))


@dataclass(frozen=True)
class Weights:
    """Colour of a node, and how much of it covers, mirrors of that, and lets light through."""

    base: Operand
    cover: Operand
    metallic: Operand
    passing: Operand


def is_zero(value: Operand) -> bool:
    """Whether a value is 0 for good."""
    return not isinstance(value, NodeValue) and not np.any(value)


def mean(colour: Operand) -> Operand:
    """Return the mean of the three channels."""
    if isinstance(colour, np.ndarray):
        return colour.mean(axis=1, keepdims=True)
    if not isinstance(colour, NodeValue) or colour.size == 1:
        return colour
    x, y, z = colour.graph.components(colour)
    return (x + y + z) / 3.0
