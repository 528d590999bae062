"""What the shaders of a material reflect, emit and let through, followed by nodes beside theirs."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace

import bpy
import numpy as np

from ...node_groups import realtime_highlights, realtime_lamps, uplift
from ...node_groups.node_mathematics import MARK, NODES, Graph, NodeValue
from ...uw_spectral.mathematics import Operand
from ...uw_spectral.transfer.facets import specular_index
from . import socket_rules, wet_trees
from .inserted import is_idle, own_input, value_curves
from .shader_nodes import CLEAR, LAYERED, METAL, ShaderNode, row_of
from .shader_walk import GREY, Closure, ShaderWalk, Weights, is_zero, mean

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


@dataclass
class ClosureWalk(ShaderWalk):
    """Reads the shaders of one tree."""

    tree: bpy.types.ShaderNodeTree
    name: str
    notes: list[str]
    surfaces: Surfaces
    closed: bool = False
    dithered: bool = False
    shines = True
    graph: Graph = field(init=False)
    measures: bool = field(init=False)

    def __post_init__(self) -> None:
        self.graph = Graph(self.tree)
        own = (node for node in self.tree.nodes if MARK not in node)
        self.measures = any(node.bl_idname == _MEASURING for node in own)

    def group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Closure:
        """Return what a group is: what outputs for it tell."""
        if node.bl_idname == "NodeGroupInput":
            return self.unknown(node)
        group = node.node_tree
        if group is None:
            return Closure()
        if not group.is_editable:
            self.note(f"uses the linked group {group.name!r}; its colour counts as grey {GREY}")
            return Closure(colour=GREY)
        names = self._names(output)
        if names["colour"] not in node.outputs:
            _open_group(group, output.identifier, names, self)
        found = {q: self.graph.term(node.outputs[n]) for q, n in names.items() if n in node.outputs}
        return Closure(**found)

    def unknown(self, node: bpy.types.Node) -> Closure:
        """Return grey, and say so."""
        self.note(f"uses {node.bl_label}, whose colour is unknown; it counts as grey {GREY}")
        return Closure(colour=GREY, normal=self._normal(node))

    def reflected(
        self, node: bpy.types.Node, row: ShaderNode, body: Closure, weights: Weights
    ) -> Closure:
        """Return what a node is, with its normals, what mirrors of it and its facets."""
        found: dict[str, Operand | None] = {"normal": self._normal(node)}
        found["coat_normal"] = self._normal(node, "Coat Normal")
        if row.facets and self.surfaces.facets:
            layered = row.facets == LAYERED
            found |= self._layered(node, weights) if layered else self._facets(node, row, weights)
        if self.surfaces.is_apart(self.tree, node) and row.sunlit is not None:
            found["highlight"] = weights.base * self._highlight(node, row.sunlit)
        elif row.anisotropy and not is_idle(self.tree, node, row.anisotropy):
            self.note(_ANISOTROPIC)
        if not is_zero(weights.metallic):
            mirrored = body.colour * weights.metallic
            rough = mean(mirrored) * self.value(node.inputs["Roughness"])
            found |= {"mirrored": mirrored, "mirror_roughness": rough}
        return replace(body, **found)

    def glow(self, colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> Closure:
        """Return what is emitted: of light that Shader to RGB tells, what has thrown it back."""
        own, factor = own_input(colour), self.value(strength)
        lit = socket_rules.before(own, _MEASURING)
        if lit is None:
            return Closure(emission=0.0 if is_zero(factor) else self.value(colour) * factor)
        nearest = socket_rules.source(own)
        if nearest is not None and nearest.node != lit:
            self.note(_CHANGED)
        return replace(self.closure(lit.inputs[0]).times(factor), transmittance=0.0)

    def _facets(
        self, node: bpy.types.Node, row: ShaderNode, weights: Weights
    ) -> dict[str, Operand]:
        """Return what a closure of facets throws back of lamps."""
        colour = weights.base
        roughness, weight = self.value(node.inputs["Roughness"]), mean(colour)
        if row.facets == CLEAR:
            index = self._wet_value(node.inputs["IOR"])
            found, weight = {"index": index * weight}, weight * _CLEAR_REFLECTS
            found["clear"] = colour
            self._note_hidden()
        else:
            if self.surfaces.is_apart(self.tree, node):
                self.note(_ROUND)
            found = {"mirror": colour, "edge": 1.0 - colour if row.facets == METAL else 0.0}
        return found | {"facets": weight, "roughness": roughness * weight}

    def _note_hidden(self) -> None:
        if self.dithered:
            self.note(_HIDDEN)

    def _layered(self, node: bpy.types.Node, weights: Weights) -> dict[str, Operand]:
        """Return the same of all that a principled closure consists of."""
        inputs, found = node.inputs, {}
        base, alpha, metallic = weights.base, weights.cover, weights.metallic
        level, metal = self.value(inputs["Specular IOR Level"]), metallic * alpha
        clear: Operand = 0.0 if is_zero(level) else alpha * (1.0 - metallic)
        if not is_zero(clear):
            if not is_zero(weights.passing):
                self._note_hidden()
            index = specular_index(self._wet_value(inputs["IOR"]), level, NODES)
            found |= {"clear": clear, "index": index * clear}
        mirror = base * metal
        weight = mean(mirror) + clear * _CLEAR_REFLECTS
        found |= {"mirror": mirror, "edge": metal - mirror, "facets": weight}
        found |= {"roughness": self.value(inputs["Roughness"]) * weight}
        coat = self.value(inputs["Coat Weight"])
        if self.surfaces.facets > 1 and not is_zero(coat):
            coat = coat * alpha
            found |= {
                "coat": coat,
                "coat_roughness": self.value(inputs["Coat Roughness"]) * coat,
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
                self.graph.assign(source, group.inputs[name])
        for name in realtime_highlights.NUMBERS[kind]:
            self.graph.assign(self.value(node.inputs[name]), group.inputs[name])
        return self.graph.term(group.outputs[0])

    def _names(self, shader: bpy.types.NodeSocket) -> dict[str, str]:
        """Names of the outputs for what a shader of a group is, in a closed body or not."""
        end = f"{shader.identifier}{' closed' if self.closed else ''}"
        names = (part.name for part in fields(Closure))
        return {name: f"UW {name.replace('_', ' ').title()} {end}" for name in names}

    def value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return what a socket holds: its link, or a constant that follows its value."""
        own, limits = own_input(socket, but=_READ), socket_rules.limits(socket)
        source = socket_rules.source(own)
        if source is not None:
            if self.measures and socket_rules.before(own, _MEASURING) is not None:
                self.note(_CHANGED)
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

    def filtered(self, colour: Operand) -> Operand:
        """Return what the channels have left of what a colour lets through."""
        clear = self.surfaces.clear
        if clear is None or not isinstance(colour, NodeValue):
            return colour
        node = self.graph.node("ShaderNodeGroup", {0: colour}, node_tree=clear)
        return self.graph.term(node.outputs[0])

    def _wet_value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return an index against what is around an object: what arrives where it is used."""
        source = socket_rules.source(socket)
        return self.value(socket) if source is None else self._of_type(source, socket.type)

    def _normal(self, node: bpy.types.Node, name: str = "Normal") -> NodeValue | None:
        socket = node.inputs.get(name)
        source = None if socket is None else socket_rules.source(socket)
        return None if source is None else self.graph.term(source)

    def note(self, text: str) -> None:
        """Tell it of what the walk is through."""
        self.notes.append(f"{self.name} {text}")


@dataclass(frozen=True)
class Surfaces:
    """The groups that materials are sent through."""

    #: Of :func:`.realtime_surface.build`, for shaders that are lit first.
    lit: bpy.types.ShaderNodeTree
    #: Of :func:`.uplift.build_filter`, for what lets through what is behind.
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
        row = row_of(node)
        return row is not None and (row.behind or row.drawn_by(tree, node) in self.highlights)


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


def _limited(value: Operand, limits: tuple[float, float]) -> Operand:
    least, most = limits
    value = value if least == -math.inf else NODES.maximum(value, least)
    return value if most == math.inf else NODES.minimum(value, most)


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
