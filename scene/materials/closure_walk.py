"""What the shaders of a material reflect, emit and let through, followed by nodes beside theirs.

A closure cannot be asked for its colour. Every quantity is linear in the closures, so Mix and Add
Shader mix and add it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields, replace

import bpy
import numpy as np

from ...node_groups import realtime_highlights, realtime_lamps, uplift
from ...node_groups.node_mathematics import MARK, NODES, Graph, NodeValue
from ...uw_spectral.mathematics import Operand
from ...uw_spectral.transfer.facets import specular_index
from . import socket_rules, wet_trees
from .inserted import is_idle, own_input, value_curves
from .shader_nodes import (
    ADD,
    CLEAR,
    EMITS,
    HIDES,
    METAL,
    MIX,
    PASSES,
    PRINCIPLED,
    REFRACTS,
    SHADER_NODES,
    ShaderNode,
)

_GREY = 0.5
_CLEAR_REFLECTS = 0.02  # about, of light from all sides, by which clear facets count beside others
_ANISOTROPIC = "is anisotropic; the highlights of real time are round"
_HIDDEN = "is clear; in real time it mirrors lamps if its render method is Blended"
_CHANGED = (
    "changes by nodes what Shader to RGB tells of its light; real time measures it under a white "
    "sun of strength 1 and has the rest of the light as if nothing were changed"
)
_ROUND = "is anisotropic; in real time its highlights of lamps are round"
_READ = uplift.READ | {uplift.FILTER}
_IMAGE, _MEASURING = "ShaderNodeTexImage", "ShaderNodeShaderToRGB"


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


@dataclass
class ClosureWalk:
    """Reads the shaders of one tree."""

    tree: bpy.types.ShaderNodeTree
    name: str
    notes: list[str]
    surfaces: Surfaces
    closed: bool = False
    dithered: bool = False
    graph: Graph = field(init=False)

    measures: bool = field(init=False)

    def __post_init__(self) -> None:
        self.graph = Graph(self.tree)
        own = (node for node in self.tree.nodes if MARK not in node)
        self.measures = any(node.bl_idname == _MEASURING for node in own)

    def closure(self, socket: bpy.types.NodeSocket) -> Closure:
        """Return what arrives at a shader input."""
        source = socket_rules.source(socket)
        return Closure() if source is None else self._of(source.node, source)

    def _of(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        kind, shaders = node.bl_idname, [i for i in node.inputs if i.type == "SHADER"]
        if kind == MIX:
            fraction = self._value(node.inputs[0])
            first, second = (self.closure(s) for s in shaders)
            return first.combined(second, lambda a, b: a * (1.0 - fraction) + b * fraction)
        if kind == ADD:
            first, second = (self.closure(s) for s in shaders)
            return first.combined(second, lambda a, b: a + b)
        if kind == "ShaderNodeGroup":
            return Closure() if node.node_tree is None else self._group(node, output)
        if kind == PRINCIPLED:
            return self._principled(node)
        known, normal = SHADER_NODES.get(kind), self._normal(node)
        if known is not None and known.does == HIDES:
            return Closure()
        if known is not None and known.colour in node.inputs:
            return self._known(node, known, normal)
        self._note(f"uses {node.bl_label}, whose colour is unknown; it counts as grey {_GREY}")
        return Closure(colour=_GREY, normal=normal)

    def _known(self, node: bpy.types.Node, known: ShaderNode, normal: NodeValue | None) -> Closure:
        if known.approximate:
            self._note(known.approximate)
        if known.does == EMITS:
            return self._glow(node.inputs[known.colour], node.inputs["Strength"])
        colour, mirrored = self._value(node.inputs[known.colour]), {}
        if known.does == PASSES:
            return Closure(transmittance=colour)
        facets = self._facets(node, known.facets, colour)
        if known.does == REFRACTS:
            return Closure(transmittance=colour, normal=normal, **facets)
        highlight: Operand = 0.0
        if self.surfaces.is_apart(self.tree, node) and known.sunlit is not None:
            highlight = colour * self._highlight(node, known.sunlit)
        elif known.mirrors and not is_idle(self.tree, node, "Anisotropy"):
            self._note(_ANISOTROPIC)
        if known.mirrors:
            mirrored = self._mirrored(colour, node.inputs["Roughness"])
        behind: Operand = 0.0
        if known.behind:
            # Light comes into a body through one wall and out through another.
            behind = colour = colour * colour if self.closed else colour
        return Closure(
            colour, behind=behind, highlight=highlight, normal=normal, **mirrored, **facets
        )

    def _glow(self, colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Closure:
        """Return what is emitted: of light that Shader to RGB tells, what has thrown it back."""
        own, factor = own_input(colour), self._value(strength)
        lit = socket_rules.before(own, _MEASURING)
        if lit is None:
            return Closure(emission=0.0 if is_zero(factor) else self._value(colour) * factor)
        nearest = socket_rules.source(own)
        if nearest is not None and nearest.node != lit:
            self._note(_CHANGED)
        return replace(self.closure(lit.inputs[0]).times(factor), transmittance=0.0)

    def _mirrored(self, colour: Operand, roughness: bpy.types.NodeSocket) -> dict[str, Operand]:
        """Return what of a closure mirrors the water, and how roughly."""
        rough = mean(colour) * self._value(roughness)
        return {"mirrored": colour, "mirror_roughness": rough}

    def _facets(self, node: bpy.types.Node, kind: str, colour: Operand) -> dict[str, Operand]:
        """Return what a closure of facets throws back of lamps."""
        if not kind or not self.surfaces.facets:
            return {}
        roughness, weight = self._value(node.inputs["Roughness"]), mean(colour)
        if kind == CLEAR:
            index = self._wet_value(node.inputs["IOR"])
            found, weight = {"index": index * weight}, weight * _CLEAR_REFLECTS
            found["clear"] = colour
            self._note_hidden()
        else:
            if self.surfaces.is_apart(self.tree, node):
                self._note(_ROUND)
            found = {"mirror": colour, "edge": 1.0 - colour if kind == METAL else 0.0}
        return found | {"facets": weight, "roughness": roughness * weight}

    def _note_hidden(self) -> None:
        if self.dithered:
            self._note(_HIDDEN)

    def _principled_facets(
        self,
        node: bpy.types.Node,
        base: Operand,
        alpha: Operand,
        metallic: Operand,
        passing: Operand,
    ) -> dict[str, Operand]:
        inputs, found = node.inputs, {}
        if not self.surfaces.facets:
            return found
        level, metal = self._value(inputs["Specular IOR Level"]), metallic * alpha
        clear: Operand = 0.0 if is_zero(level) else alpha * (1.0 - metallic)
        if not is_zero(clear):
            if not is_zero(passing):
                self._note_hidden()
            index = specular_index(self._wet_value(inputs["IOR"]), level, NODES)
            found |= {"clear": clear, "index": index * clear}
        mirror = base * metal
        weight = mean(mirror) + clear * _CLEAR_REFLECTS
        found |= {"mirror": mirror, "edge": metal - mirror, "facets": weight}
        found |= {"roughness": self._value(inputs["Roughness"]) * weight}
        coat = self._value(inputs["Coat Weight"])
        if self.surfaces.facets > 1 and not is_zero(coat):
            coat = coat * alpha
            found |= {
                "coat": coat,
                "coat_roughness": self._value(inputs["Coat Roughness"]) * coat,
                "coat_index": self._wet_value(inputs["Coat IOR"]) * coat,
            }
        return found

    def _highlight(self, node: bpy.types.Node, kind: str) -> Operand:
        """Return what of the sun a white closure throws back, over a matte one."""
        group = self.graph.node("ShaderNodeGroup", node_tree=self.surfaces.highlights[kind])
        geometry = self.graph.node("ShaderNodeNewGeometry").outputs
        for name in (realtime_highlights.NORMAL, realtime_highlights.TANGENT):
            if name in group.inputs:
                source = socket_rules.source(node.inputs[name]) or geometry[name]
                self.tree.links.new(source, group.inputs[name])
        for name in realtime_highlights.NUMBERS[kind]:
            self.graph.assign(self._value(node.inputs[name]), group.inputs[name])
        return self.graph.term(group.outputs[0])

    def _principled(self, node: bpy.types.Node) -> Closure:
        inputs = node.inputs
        alpha, base = self._value(inputs["Alpha"]), self._value(inputs["Base Color"])
        metallic = self._value(inputs["Metallic"])
        passing = self._value(inputs["Transmission Weight"]) * (1.0 - metallic)
        transmittance = 1.0 - alpha
        if not is_zero(passing):
            self._note("transmits light; in real time it goes straight through")
            # Each of two faces tints; what both leave of a channel is no product of means.
            if self.closed:
                left = NODES.sqrt(NODES.maximum(self._filtered(base), 0.0))
            else:
                left = self._filtered(NODES.sqrt(base))
            transmittance = transmittance + alpha * passing * left
        if not is_idle(self.tree, node, "Anisotropic"):
            self._note(_ANISOTROPIC)
        glow = self._glow(inputs["Emission Color"], inputs["Emission Strength"])
        coat, tint = self._value(inputs["Coat Weight"]), self._value(inputs["Coat Tint"])
        if not is_zero(coat) and isinstance(tint, NodeValue):
            through = 1.0 + coat * (tint - 1.0)
            base, glow = base * through, glow.times(through)
        facets = self._principled_facets(node, base, alpha, metallic, passing)
        colour = base * (alpha * (1.0 - passing))
        if not is_zero(metallic):
            facets |= self._mirrored(colour * metallic, inputs["Roughness"])
        normals = self._normal(node), self._normal(node, "Coat Normal")
        own = Closure(
            colour, transmittance=transmittance, normal=normals[0], coat_normal=normals[1],
            **facets,
        )  # fmt: skip
        return own.combined(glow.times(alpha), lambda a, b: a + b)

    def _group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        group = node.node_tree
        if not group.is_editable:
            self._note(f"uses the linked group {group.name!r}; its colour counts as grey {_GREY}")
            return Closure(colour=_GREY)
        names = self._names(output)
        if names["colour"] not in node.outputs:
            _open_group(group, output.identifier, names, self)
        found = {q: self.graph.term(node.outputs[n]) for q, n in names.items() if n in node.outputs}
        return Closure(**found)

    def _names(self, shader: bpy.types.NodeSocket) -> dict[str, str]:
        """Names of the outputs for what a shader of a group is, in a closed body or not."""
        end = f"{shader.identifier}{' closed' if self.closed else ''}"
        names = (part.name for part in fields(Closure))
        return {name: f"UW {name.replace('_', ' ').title()} {end}" for name in names}

    def _value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return what a socket holds: its link, or a constant that follows its value."""
        own, limits = own_input(socket, but=_READ), socket_rules.limits(socket)
        source = socket_rules.source(own)
        if source is not None:
            if self.measures and socket_rules.before(own, _MEASURING) is not None:
                self._note(_CHANGED)
            return _limited(self._of_type(_alpha_beside_colour(source), socket.type), limits)
        values, still = np.atleast_1d(own.default_value)[:3], not value_curves(self.tree, own)
        if still and (np.all(values == 0.0) or np.all(values == 1.0)):
            return float(values[0])
        constant = self._constant(own)
        inside = bool(np.all((values >= limits[0]) & (values <= limits[1])))
        return constant if still and inside else _limited(constant, limits)

    def _of_type(self, source: bpy.types.NodeSocket, kind: str) -> NodeValue:
        """Return what a socket of a kind gets of an output: a node converts it as Blender does."""
        found = self.graph.term(source)
        if kind != "VALUE" or found.size == 1:
            return found
        return self.graph.operation("ADD", (NodeValue(self.graph, source, 1), 0.0))

    def _constant(self, socket: bpy.types.NodeSocket) -> NodeValue:
        one = socket.type == "VALUE"
        constant = self.graph.node("ShaderNodeValue" if one else "ShaderNodeCombineXYZ")
        wet_trees.repeat(self.tree, constant, socket)
        return self.graph.term(constant.outputs[0])

    def _filtered(self, colour: Operand) -> Operand:
        """Return what the channels have left of what a colour lets through."""
        clear = self.surfaces.clear
        if clear is None or not isinstance(colour, NodeValue):
            return colour
        node = self.graph.node("ShaderNodeGroup", node_tree=clear)
        self.graph.assign(colour, node.inputs[0])
        return self.graph.term(node.outputs[0])

    def _wet_value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return an index against what is around an object: what arrives where it is used."""
        source = socket_rules.source(socket)
        return self._value(socket) if source is None else self._of_type(source, socket.type)

    def _normal(self, node: bpy.types.Node, name: str = "Normal") -> NodeValue | None:
        socket = node.inputs.get(name)
        source = None if socket is None else socket_rules.source(socket)
        return None if source is None else self.graph.term(source)

    def _note(self, text: str) -> None:
        self.notes.append(f"{self.name} {text}")


@dataclass(frozen=True)
class Surfaces:
    """The groups that materials are sent through."""

    #: Of :func:`.realtime_surface.build`, for shaders that are lit first.
    lit: bpy.types.ShaderNodeTree
    #: Of :func:`.realtime_filter.build`, for what lets through what is behind.
    clear: bpy.types.ShaderNodeTree | None = None
    native: bpy.types.ShaderNodeTree | None = None  #: The one that keeps closures.
    #: Of the added floor, whose reflectance is a measured one.
    floor: bpy.types.Material | None = None
    #: Of the others light from behind crosses one sheet.
    closed: Collection[bpy.types.Material] = ()
    #: Groups of :mod:`.realtime_highlights`, by name.
    highlights: Mapping[str, bpy.types.ShaderNodeTree] = field(default_factory=dict)
    #: For shaders that are lit first and fluoresce.
    fluorescent: bpy.types.ShaderNodeTree | None = None
    fluorescing: Collection[str] = ()  #: Names of the materials that do.

    @property
    def facets(self) -> int:
        """How many of :data:`.realtime_lamps.FACETS` the groups know."""
        known = {item.name for item in self.lit.interface.items_tree}
        return sum(known.issuperset(one) for one in realtime_lamps.FACETS)

    def is_apart(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether the sun lights a node by another closure than its own."""
        known = SHADER_NODES.get(node.bl_idname)
        if known is None:
            return False
        return known.behind or drawn_by(tree, node) in self.highlights


def _open_group(
    group: bpy.types.ShaderNodeTree, shader: str, names: Mapping[str, str], outer: ClosureWalk
) -> None:
    """Give a group outputs for what one of its shaders is."""
    ends = [n for n in group.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output]
    if not ends:
        return
    owner = f"group {group.name!r}"
    walk = ClosureWalk(group, owner, outer.notes, outer.surfaces, outer.closed, outer.dithered)
    closure = walk.closure(next(i for i in ends[0].inputs if i.identifier == shader))
    made = list(group.get(wet_trees.OPENED, ()))
    for quantity, name in names.items():
        value = getattr(closure, quantity)
        if value is None or (quantity != "colour" and is_zero(value)):
            continue
        kind = "NodeSocketVector" if "normal" in quantity else "NodeSocketColor"
        made.append(group.interface.new_socket(name, in_out="OUTPUT", socket_type=kind).identifier)
        walk.graph.assign(value, ends[0].inputs[name])
    group[wet_trees.OPENED] = made


def drawn_by(tree: bpy.types.NodeTree, node: bpy.types.Node) -> str | None:
    """Group of highlights by which the sun lights a node."""
    known = SHADER_NODES.get(node.bl_idname)
    kind = None if known is None else known.sunlit
    if kind == realtime_highlights.STRETCHED and is_idle(tree, node, "Anisotropy"):
        return None
    if kind == realtime_highlights.TOON and node.component != "DIFFUSE":
        return None
    return kind


def _limited(value: Operand, limits: tuple[float, float]) -> Operand:
    least, most = limits
    value = value if least == -math.inf else NODES.maximum(value, least)
    return value if most == math.inf else NODES.minimum(value, most)


def is_zero(value: object) -> bool:
    """Whether a value is 0 for good."""
    return not isinstance(value, NodeValue) and value == 0.0


def mean(colour: Operand) -> Operand:
    """Return the mean of the three channels."""
    if not isinstance(colour, NodeValue) or colour.size == 1:
        return colour
    x, y, z = colour.graph.components(colour)
    return (x + y + z) / 3.0


def _alpha_beside_colour(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    """Return the alpha of the node that gives the colour of the same image.

    EEVEE darkens colours by an alpha that nothing reads there: with another node's it counts twice
    along the edges of leaves. Files of OBJ come in with two such nodes.
    """
    node = socket.node
    if node.bl_idname != _IMAGE or socket.name != "Alpha":
        return socket
    for other in node.id_data.nodes:
        if other.bl_idname == _IMAGE and other.outputs["Color"].is_linked and _same(node, other):
            return other.outputs["Alpha"]
    return socket


def _same(node: bpy.types.Node, other: bpy.types.Node) -> bool:
    """Whether two image nodes look up the same texel."""
    places = [
        [(k.from_node.name, k.from_socket.name) for k in n.inputs[0].links if not k.is_muted]
        for n in (node, other)
    ]
    names = ("image", "interpolation", "projection", "extension")
    return places[0] == places[1] and all(getattr(node, x) == getattr(other, x) for x in names)
