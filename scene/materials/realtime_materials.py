"""Sends the scene's own materials through the real-time surface groups, and back.

A material keeps its nodes. Its closures stay, too: a white sun lights them, and their colours
become what the channels see of sunlight on them there (:mod:`.band_colors`); closures that have
lobes without a colour are mixed in with its share. Where that cannot be, in what refracts, or
where layers want to know the light, the shader is lit and measured instead (Shader to RGB).
Beside it, the colours, the emission and the transparency of the same shader
are computed by nodes that follow the shader's tree, since a closure cannot be
asked for them. Every quantity is linear in the closures, so Mix and Add Shader
mix and add it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import realtime_highlights, realtime_lamps, realtime_surface, uplift
from ...node_groups.node_mathematics import MARK, NODES, Graph, NodeValue
from ...uw_spectral.mathematics import Operand
from ...uw_spectral.transfer.closures import (
    whole_closure,
)
from ...uw_spectral.transfer.facets import specular_index
from .. import contents
from ..animation import curves
from . import (
    band_colors,
    bare_colours,
    inlined_shaders,
    matte_fallbacks,
    refractive_indices,
    socket_rules,
    wet_colours,
    wet_trees,
)
from .inserted import is_idle, new_node, own_input, put_before
from .shader_nodes import (
    CLEAR,
    EMITS,
    HIDES,
    METAL,
    PASSES,
    PRINCIPLED,
    REFLECTS,
    REFRACTS,
    SHADER_NODES,
    ShaderNode,
    makes_closure,
    nodes_that,
)
from .wet_trees import HOLDER, MUTED, MUTED_VOLUME, OPENED, THICKNESS_MODE, surface_node

_SUNLIGHT = "uw_sunlight"
_SHEET, _BODY = "SLAB", "SPHERE"
_OUTPUTS = {
    "colour": "UW Color",
    "emission": "UW Emission",
    "transmittance": "UW Transmittance",
    "mirrored": "UW Mirrored",
    "behind": "UW Behind",
    "highlight": "UW Highlight",
    "mirror": "UW Mirror",
    "edge": "UW Edge",
    "clear": "UW Clear",
    "facets": "UW Facets",
    "roughness": "UW Roughness",
    "mirror_roughness": "UW Mirror Roughness",
    "index": "UW Index",
    "coat": "UW Coat",
    "coat_roughness": "UW Coat Roughness",
    "coat_index": "UW Coat Index",
}
_GREY, _DARKEST = 0.5, 1e-3
_LEAST_FACETS = 1e-6
_CLEAR_REFLECTS = 0.02  # about, of light from all sides, by which clear facets count beside others
_MATTE = "mirrors; in real time it throws back the water's light as a matte thing does"

_ANISOTROPIC = "is anisotropic; the highlights of real time are round"
_HIDDEN = "is clear; in real time it mirrors lamps if its render method is Blended"
_CHANGED = (
    "changes by nodes what Shader to RGB tells of its light; real time measures it under a white "
    "sun of strength 1 and has the rest of the light as if nothing were changed"
)
_ROUND = "is anisotropic; in real time its highlights of lamps are round"
_EMITTING, _KEPT = nodes_that(EMITS), nodes_that(REFLECTS, EMITS, PASSES)
_MIRRORING = {name for name, node in SHADER_NODES.items() if node.mirrors}
_TRANSLUCENT = {name for name, node in SHADER_NODES.items() if node.behind}
_READ = uplift.READ | {uplift.FILTER}
_IMAGE, _MEASURING = "ShaderNodeTexImage", "ShaderNodeShaderToRGB"
_JOINING = {"ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeGroup"}


@dataclass(frozen=True)
class _Closure:
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

    def times(self, factor: Operand) -> _Closure:
        return replace(self, **{name: getattr(self, name) * factor for name in _OUTPUTS})

    def combined(self, other: _Closure, join: Callable[[Operand, Operand], Operand]) -> _Closure:
        joined = {name: join(getattr(self, name), getattr(other, name)) for name in _OUTPUTS}
        normals = self.normal or other.normal, self.coat_normal or other.coat_normal
        return _Closure(**joined, normal=normals[0], coat_normal=normals[1])


@dataclass
class _Walk:
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

    def closure(self, socket: bpy.types.NodeSocket) -> _Closure:
        """Return what arrives at a shader input."""
        source = socket_rules.source(socket)
        return _Closure() if source is None else self._of(source.node, source)

    def _of(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> _Closure:
        kind, shaders = node.bl_idname, [i for i in node.inputs if i.type == "SHADER"]
        if kind == "ShaderNodeMixShader":
            share = self._value(node.inputs[0])
            first, second = (self.closure(s) for s in shaders)
            return first.combined(second, lambda a, b: a * (1.0 - share) + b * share)
        if kind == "ShaderNodeAddShader":
            first, second = (self.closure(s) for s in shaders)
            return first.combined(second, lambda a, b: a + b)
        if kind == "ShaderNodeGroup":
            return _Closure() if node.node_tree is None else self._group(node, output)
        if kind == PRINCIPLED:
            return self._principled(node)
        known, normal = SHADER_NODES.get(kind), self._normal(node)
        if known is not None and known.does == HIDES:
            return _Closure()
        if known is not None and known.colour in node.inputs:
            return self._known(node, known, normal)
        self._note(f"uses {node.bl_label}, whose colour is unknown; it counts as grey {_GREY}")
        return _Closure(colour=_GREY, normal=normal)

    def _known(self, node: bpy.types.Node, known: ShaderNode, normal: NodeValue | None) -> _Closure:
        if known.approximate:
            self._note(known.approximate)
        if known.does == EMITS:
            return self._glow(node.inputs[known.colour], node.inputs["Strength"])
        colour, mirrored = self._value(node.inputs[known.colour]), {}
        if known.does == PASSES:
            return _Closure(transmittance=colour)
        facets = self._facets(node, known.facets, colour)
        if known.does == REFRACTS:
            return _Closure(transmittance=colour, normal=normal, **facets)
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
        return _Closure(
            colour, behind=behind, highlight=highlight, normal=normal, **mirrored, **facets
        )

    def _glow(self, colour: bpy.types.NodeSocket, strength: bpy.types.NodeSocket) -> _Closure:
        """Return what is emitted: of light that Shader to RGB tells, what has thrown it back."""
        own, factor = own_input(colour), self._value(strength)
        lit = socket_rules.before(own, _MEASURING)
        if lit is None:
            return _Closure(emission=0.0 if _is_zero(factor) else self._value(colour) * factor)
        nearest = socket_rules.source(own)
        if nearest is not None and nearest.node != lit:
            self._note(_CHANGED)
        return replace(self.closure(lit.inputs[0]).times(factor), transmittance=0.0)

    def _mirrored(self, colour: Operand, roughness: bpy.types.NodeSocket) -> dict[str, Operand]:
        """Return what of a closure mirrors the water, and how roughly."""
        rough = _mean(colour) * self._value(roughness)
        return {"mirrored": colour, "mirror_roughness": rough}

    def _facets(self, node: bpy.types.Node, kind: str, colour: Operand) -> dict[str, Operand]:
        """Return what a closure of facets throws back of lamps."""
        if not kind or not self.surfaces.facets:
            return {}
        roughness, weight = self._value(node.inputs["Roughness"]), _mean(colour)
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
        clear: Operand = 0.0 if _is_zero(level) else alpha * (1.0 - metallic)
        if not _is_zero(clear):
            if not _is_zero(passing):
                self._note_hidden()
            index = specular_index(self._wet_value(inputs["IOR"]), level, NODES)
            found |= {"clear": clear, "index": index * clear}
        mirror = base * metal
        weight = _mean(mirror) + clear * _CLEAR_REFLECTS
        found |= {"mirror": mirror, "edge": metal - mirror, "facets": weight}
        found |= {"roughness": self._value(inputs["Roughness"]) * weight}
        coat = self._value(inputs["Coat Weight"])
        if self.surfaces.facets > 1 and not _is_zero(coat):
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

    def _principled(self, node: bpy.types.Node) -> _Closure:
        inputs = node.inputs
        alpha, base = self._value(inputs["Alpha"]), self._value(inputs["Base Color"])
        metallic = self._value(inputs["Metallic"])
        passing = self._value(inputs["Transmission Weight"]) * (1.0 - metallic)
        transmittance = 1.0 - alpha
        if not _is_zero(passing):
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
        if not _is_zero(coat) and isinstance(tint, NodeValue):
            through = 1.0 + coat * (tint - 1.0)
            base, glow = base * through, glow.times(through)
        facets = self._principled_facets(node, base, alpha, metallic, passing)
        colour = base * (alpha * (1.0 - passing))
        if not _is_zero(metallic):
            facets |= self._mirrored(colour * metallic, inputs["Roughness"])
        normals = self._normal(node), self._normal(node, "Coat Normal")
        own = _Closure(
            colour, transmittance=transmittance, normal=normals[0], coat_normal=normals[1],
            **facets,
        )  # fmt: skip
        return own.combined(glow.times(alpha), lambda a, b: a + b)

    def _group(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> _Closure:
        group = node.node_tree
        if not group.is_editable:
            self._note(f"uses the linked group {group.name!r}; its colour counts as grey {_GREY}")
            return _Closure(colour=_GREY)
        names = self._names(output)
        if names["colour"] not in node.outputs:
            _open_group(group, output.identifier, names, self)
        found = {q: self.graph.term(node.outputs[n]) for q, n in names.items() if n in node.outputs}
        return _Closure(**found)

    def _names(self, shader: bpy.types.NodeSocket) -> dict[str, str]:
        """Names of the outputs for what a shader of a group is, in a closed body or not."""
        end = f"{shader.identifier}{' closed' if self.closed else ''}"
        names = _OUTPUTS | {"normal": "UW Normal", "coat_normal": "UW Coat Normal"}
        return {quantity: f"{name} {end}" for quantity, name in names.items()}

    def _value(self, socket: bpy.types.NodeSocket) -> Operand:
        """Return what a socket holds: its link, or a constant that follows its value."""
        own, limits = own_input(socket, but=_READ), socket_rules.limits(socket)
        source = socket_rules.source(own)
        if source is not None:
            if self.measures and socket_rules.before(own, _MEASURING) is not None:
                self._note(_CHANGED)
            return _limited(self._of_type(_alpha_beside_colour(source), socket.type), limits)
        values, still = np.atleast_1d(own.default_value)[:3], not _is_animated(self.tree, own)
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
        """Return an index against what is around a thing: what arrives where it is used."""
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
    """The groups that materials are sent through.

    Attributes
    ----------
    lit : ShaderNodeTree
        Of :func:`.realtime_surface.build`, for shaders that are lit first.
    clear : ShaderNodeTree, optional
        Of :func:`.realtime_filter.build`, for what lets through what is behind.
    keeping : ShaderNodeTree, optional
        The one that keeps closures.
    floor : Material, optional
        Of the added floor, whose reflectance is a measured one.
    closed : collection of Material
        Those of bodies that are closed; of the others light from behind crosses one sheet.
    highlights : mapping of str to ShaderNodeTree
        Groups of :mod:`.realtime_highlights`.
    fluorescent : ShaderNodeTree, optional
        The one for shaders that are lit first and fluoresce.
    fluorescing : collection of str
        Names of the materials that do.
    """

    lit: bpy.types.ShaderNodeTree
    clear: bpy.types.ShaderNodeTree | None = None
    keeping: bpy.types.ShaderNodeTree | None = None
    floor: bpy.types.Material | None = None
    closed: Collection[bpy.types.Material] = ()
    highlights: Mapping[str, bpy.types.ShaderNodeTree] = field(default_factory=dict)
    fluorescent: bpy.types.ShaderNodeTree | None = None
    fluorescing: Collection[str] = ()

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
        return known.behind or _drawn_by(tree, node) in self.highlights


@dataclass(frozen=True)
class Kinds:
    """What any of the materials of a scene may do.

    Mirror what is around it, emit light, throw on light from behind it, filter what is seen
    through it, have highlights that are longer than wide, be toons; and how many of
    :data:`.realtime_lamps.FACETS` they have.
    """

    mirrors: bool = False
    glows: bool = False
    translucent: bool = False
    filters: bool = False
    stretched: bool = False
    toons: bool = False
    facets: int = 0

    @property
    def highlights(self) -> tuple[str, ...]:
        """Groups of :mod:`.realtime_highlights` that are needed."""
        found = (
            (realtime_highlights.STRETCHED, self.stretched),
            (realtime_highlights.TOON, self.toons),
        )
        return tuple(kind for kind, is_there in found if is_there)


def insert(materials: list[bpy.types.Material], surfaces: Surfaces) -> list[str]:
    """Put a surface group behind the shader of each material.

    Returns
    -------
    list of str
        What could not be treated, one line each.
    """
    notes = inlined_shaders.insert(materials)
    bare_colours.insert(materials)
    bare_colours.blacken(materials)
    refractive_indices.insert(materials)
    wet_colours.insert(materials)
    matte_fallbacks.insert(materials)
    if surfaces.clear is not None:
        band_colors.filter_clear(materials, surfaces.clear)
    kept = _kept(materials, surfaces)
    for material in materials:
        if not material.is_editable:
            notes.append(
                f"material {material.name!r} is linked from {material.library.filepath} and stays "
                "dry; make it local"
            )
            continue
        output = _surface_output(material.node_tree)
        if MARK not in material:
            _leave_volume_out(material, notes)
        if output is None:
            continue
        name, closed = f"material {material.name!r}", material in surfaces.closed
        dithered = material.surface_render_method == "DITHERED"
        walk = _Walk(material.node_tree, name, notes, surfaces, closed, dithered)
        band_colors.darken(material.node_tree, surfaces.is_apart)
        if material in kept:
            measured = band_colors.is_measured(material) or material == surfaces.floor
            _keep(walk, material, output, surfaces.keeping, measured=measured)
            continue
        notes += [
            f"{name} is lit otherwise than wet ones with the same group {group.name!r}; remove the "
            "water and add it again"
            for group in filter(_has_sunlight, _groups_of_shaders(material.node_tree))
        ]
        fluoresces = surfaces.fluorescent is not None and material.name in surfaces.fluorescing
        _insert(walk, material, output, surfaces.fluorescent if fluoresces else surfaces.lit)
    return list(dict.fromkeys(notes))


def _leave_volume_out(material: bpy.types.Material, notes: list[str]) -> None:
    """Mute what a material is filled with: EEVEE's froxels would neither light nor dim it."""
    output = material.node_tree.get_output_node("EEVEE")
    if output is None:
        return
    for link in [link for link in output.inputs["Volume"].links if not link.is_muted]:
        link.is_muted, output[MUTED_VOLUME] = True, True
    if output.get(MUTED_VOLUME):
        if not output.inputs["Surface"].is_linked:
            # Without anything EEVEE draws black.
            clear = Graph(material.node_tree).node("ShaderNodeBsdfTransparent")
            material.node_tree.links.new(clear.outputs[0], output.inputs["Surface"])
        notes.append(
            f"the volume of material {material.name!r} is left out in real time; the reference "
            "draws it"
        )


def _kept(materials: Iterable[bpy.types.Material], surfaces: Surfaces) -> set[bpy.types.Material]:
    """Return the materials whose closures can all be lit as they are.

    Of those that share a group of shaders all are, or none: it has the colours of one way.
    """
    groups = {m: _groups_of_shaders(m.node_tree) for m in materials if m.is_editable}
    kept = {
        m
        for m, inner in groups.items()
        if surfaces.keeping is not None
        and (surfaces.fluorescent is None or m.name not in surfaces.fluorescing)
        and all(_keepable(tree, node) for tree in {m.node_tree, *inner} for node in tree.nodes)
        and not any(map(_is_lit_first, inner))
    }
    while True:
        others = set().union(*(inner for m, inner in groups.items() if m not in kept))
        fallen = {m for m in kept if groups[m] & others}
        if not fallen:
            return kept
        kept -= fallen


def _groups_of_shaders(tree: bpy.types.ShaderNodeTree) -> set[bpy.types.NodeTree]:
    return {
        group
        for group in contents.inner_groups([tree])
        if MARK not in group and any(map(makes_closure, group.nodes))
    }


def _has_sunlight(group: bpy.types.NodeTree) -> bool:
    return any(_SUNLIGHT in node for node in group.nodes)


def _is_lit_first(group: bpy.types.NodeTree) -> bool:
    """Whether wet materials use a group whose closures were not kept."""
    return not _has_sunlight(group) and OPENED in group


def _keepable(tree: bpy.types.ShaderNodeTree, node: bpy.types.Node) -> bool:
    if MARK in node:
        return True
    if node.bl_idname == "ShaderNodeShaderToRGB":
        return False
    if not any(output.type == "SHADER" for output in node.outputs):
        return True
    if node.bl_idname == PRINCIPLED:
        inputs = node.inputs
        # What layers filter has no colour of its own to be seen by the channels.
        tinted = any(part != 1.0 for part in inputs["Coat Tint"].default_value[:3])
        if (tinted or inputs["Coat Tint"].is_linked) and not is_idle(tree, node, "Coat Weight"):
            return False
        return is_idle(tree, node, "Transmission Weight")
    return node.bl_idname in _KEPT or node.bl_idname in _JOINING


def kinds(materials: Iterable[bpy.types.Material]) -> Kinds:
    """Return what any of some materials may do."""
    trees = {material.node_tree for material in materials if MARK not in material}
    own = [tree for tree in trees | contents.inner_groups(trees) if MARK not in tree]
    nodes = [(tree, node) for tree in own for node in tree.nodes if MARK not in node]
    return Kinds(
        any(_may(tree, node, _MIRRORING, "Metallic") for tree, node in nodes),
        any(_may(tree, node, _EMITTING, "Emission Strength") for tree, node in nodes)
        or any(next(bare_colours.bare(tree), None) is not None for tree in own),
        any(node.bl_idname in _TRANSLUCENT for _, node in nodes),
        any(_filters(tree, node) for tree, node in nodes),
        any(_drawn_by(*found) == realtime_highlights.STRETCHED for found in nodes),
        any(_drawn_by(*found) == realtime_highlights.TOON for found in nodes),
        max((_count_facets(tree, node) for tree, node in nodes), default=0),
    )


def _count_facets(tree: bpy.types.NodeTree, node: bpy.types.Node) -> int:
    """How many of :data:`.realtime_lamps.FACETS` a node may have."""
    if node.bl_idname == PRINCIPLED:
        if not is_idle(tree, node, "Coat Weight"):
            return 2
        return int(not all(is_idle(tree, node, x) for x in ("Specular IOR Level", "Metallic")))
    known = SHADER_NODES.get(node.bl_idname)
    return int(known is not None and bool(known.facets))


def _drawn_by(tree: bpy.types.NodeTree, node: bpy.types.Node) -> str | None:
    """Group of highlights by which the sun lights a node."""
    known = SHADER_NODES.get(node.bl_idname)
    kind = None if known is None else known.sunlit
    if kind == realtime_highlights.STRETCHED and is_idle(tree, node, "Anisotropy"):
        return None
    if kind == realtime_highlights.TOON and node.component != "DIFFUSE":
        return None
    return kind


def _filters(tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
    """Whether a node may let through more of one colour than of another."""
    if node.bl_idname == PRINCIPLED:
        clear, colour = not is_idle(tree, node, "Transmission Weight"), node.inputs["Base Color"]
    else:
        known = SHADER_NODES.get(node.bl_idname)
        if known is None or known.does not in (PASSES, REFRACTS):
            return False
        clear, colour = True, node.inputs[known.colour]
    own = own_input(colour)
    grey = len(set(own.default_value[:3])) == 1
    return clear and (own.is_linked or not grey or _is_animated(tree, own))


def _may(tree: bpy.types.NodeTree, node: bpy.types.Node, always: set[str], weight: str) -> bool:
    """Whether a node is of some kinds, or a principled one that may have a weight."""
    if node.bl_idname != PRINCIPLED:
        return node.bl_idname in always
    socket = node.inputs[weight]
    # What may change while a job runs counts from its beginning: its nodes stay.
    return socket.is_linked or socket.default_value != 0.0 or _is_animated(tree, socket)


def write_reflectance(
    material: bpy.types.Material, column: int, channels: NDArray[np.float64]
) -> None:
    """Tell a wet material where its measured reflectance is, and its channels."""
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and (MUTED in node or _SUNLIGHT in node):
            node.inputs[realtime_surface.COLUMN].default_value = float(column)
            node.inputs[realtime_surface.MEASURED].default_value = channels


def write_fluorescence(material: bpy.types.Material, absorptance: NDArray[np.float64]) -> None:
    """Tell a wet material how much each fluorophore in it absorbs."""
    surface = surface_node(material.node_tree)
    if surface is not None and realtime_surface.FLUORESCENCE in surface.inputs:
        surface.inputs[realtime_surface.FLUORESCENCE].default_value = absorptance


def _keep(
    walk: _Walk,
    material: bpy.types.Material,
    output: bpy.types.Node,
    group: bpy.types.ShaderNodeTree,
    *,
    measured: bool,
) -> None:
    """Send the colours of a material through the sunlight, and add the light of the water."""
    tree = walk.tree
    socket = output.inputs["Surface"]
    link = socket.links[0]
    source, muted = link.from_socket, link.is_muted
    wet_trees.keep_shader(source)
    band_colors.route(tree, _sunlit_nodes(group), measured=measured)
    closure, graph = walk.closure(socket), walk.graph
    surface = _sunlight_of(tree, group)
    surface[MUTED] = muted
    surface.location = (output.location.x, output.location.y - 200.0)
    passing = _describe(walk, closure, surface)
    share = graph.term(surface.outputs[uplift.SHARE])
    mixed = graph.node("ShaderNodeMixShader")
    mixed[HOLDER] = 2
    graph.assign(share, mixed.inputs[0])
    tree.links.new(source, mixed.inputs[2]).is_muted = muted
    seen = _added(graph, mixed.outputs[0], surface.outputs[0])
    if not _is_zero(closure.behind):
        sunlit = _sunlit(graph, closure, closure.behind, surface, measured=measured)
        seen = _added(graph, seen, _translucent(walk, material, closure, sunlit, output, surface))
    if not _is_zero(closure.highlight):
        sunlit = _sunlit(graph, closure, closure.highlight, surface, measured=measured)
        seen = _added(graph, seen, _matte(graph, closure, sunlit))
    if passing is not None:
        # What the share has taken of the light behind it.
        transparent = graph.node("ShaderNodeBsdfTransparent")
        graph.assign(passing * (1.0 - share), transparent.inputs["Color"])
        seen = _added(graph, seen, transparent.outputs[0])
    tree.links.new(seen, socket)


def _sunlit(
    graph: Graph, closure: _Closure, colour: Operand, surface: bpy.types.Node, *, measured: bool
) -> Operand:
    """Return what the channels see of sunlight on a colour that is part of a closure's."""
    if measured:
        part = _mean(colour) / NODES.maximum(_mean(closure.colour), _DARKEST)
        return graph.term(surface.outputs[uplift.MEASURED_INPUT]) * part
    columns = [graph.term(surface.outputs[name]) for name in uplift.COLUMNS]
    parts = [colour] * len(columns)
    if isinstance(colour, NodeValue):
        parts = list(graph.components(colour))
    red, green, blue = (column * part for column, part in zip(columns, parts, strict=True))
    return red + green + blue


def _matte(graph: Graph, closure: _Closure, colour: Operand) -> bpy.types.NodeSocket:
    node = graph.node("ShaderNodeBsdfDiffuse")
    graph.assign(colour, node.inputs["Color"])
    if closure.normal is not None:
        graph.assign(closure.normal, node.inputs["Normal"])
    return node.outputs[0]


def _translucent(
    walk: _Walk,
    material: bpy.types.Material,
    closure: _Closure,
    colour: Operand,
    output: bpy.types.Node,
    surface: bpy.types.Node,
) -> bpy.types.NodeSocket:
    """Add the one closure that light of lamps shines through, and say how thick it is."""
    graph, tree = walk.graph, walk.tree
    body = walk.closed and material.thickness_mode == _BODY
    if not walk.closed:
        put_before(tree, output.inputs["Thickness"], new_node(tree, uplift.THIN))
        if material.thickness_mode != _SHEET:
            material[THICKNESS_MODE] = material.thickness_mode
            material.thickness_mode = _SHEET
    if not body and realtime_surface.CLOSED in surface.inputs:
        surface.inputs[realtime_surface.CLOSED].default_value = 0.0
    node = graph.node("ShaderNodeBsdfTranslucent")
    graph.assign(whole_closure(colour, NODES, closed=body), node.inputs["Color"])
    if closure.normal is not None:
        graph.assign(closure.normal, node.inputs["Normal"])
    return node.outputs[0]


def _sunlit_nodes(group: bpy.types.ShaderNodeTree) -> band_colors.Maker:
    """Return what makes the groups of colours, in the sunlight of a water."""

    def make(tree: bpy.types.NodeTree, kind: str) -> bpy.types.Node:
        node = Graph(tree).node("ShaderNodeGroup", node_tree=uplift.group(kind))
        if kind == uplift.DARK:
            return node
        source = _sunlight_of(tree, group)
        for name in (*uplift.COLUMNS, uplift.MEASURED_INPUT, uplift.SHARE):
            if name in node.inputs and name in source.outputs:
                tree.links.new(source.outputs[name], node.inputs[name])
        return node

    return make


def _sunlight_of(tree: bpy.types.NodeTree, group: bpy.types.ShaderNodeTree) -> bpy.types.Node:
    """Return the one node of a tree that knows the sunlight there."""
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and _SUNLIGHT in node:
            return node
    graph = Graph(tree)
    node = graph.node("ShaderNodeGroup", node_tree=group)
    node[_SUNLIGHT] = True
    normal = graph.node("ShaderNodeNewGeometry").outputs["Normal"]
    tree.links.new(normal, node.inputs[realtime_surface.NORMAL])
    return node


def _added(
    graph: Graph, one: bpy.types.NodeSocket, other: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    node = graph.node("ShaderNodeAddShader")
    for socket, source in zip(node.inputs, (one, other), strict=True):
        graph.tree.links.new(source, socket)
    return node.outputs[0]


def _describe(walk: _Walk, closure: _Closure, surface: bpy.types.Node) -> Operand | None:
    """Tell a surface group what a closure is; return what passes through it, if anything does."""
    graph = walk.graph
    graph.assign(closure.colour, surface.inputs[realtime_surface.COLOR])
    if realtime_surface.EMITTED in surface.inputs:
        graph.assign(closure.emission, surface.inputs[realtime_surface.EMITTED])
    if realtime_surface.MIRRORED in surface.inputs:
        graph.assign(closure.mirrored, surface.inputs[realtime_surface.MIRRORED])
        rough = _per_weight(closure.mirror_roughness, closure.mirrored)
        graph.assign(rough, surface.inputs[realtime_surface.MIRROR_ROUGHNESS])
    elif not _is_zero(closure.mirrored):
        walk.notes.append(f"{walk.name} {_MATTE}")
    if walk.surfaces.facets:
        _describe_facets(walk, closure, surface)
    if realtime_surface.BEHIND in surface.inputs:
        graph.assign(closure.behind, surface.inputs[realtime_surface.BEHIND])
    if realtime_surface.CLOSED in surface.inputs:
        surface.inputs[realtime_surface.CLOSED].default_value = float(walk.closed)
    normal = closure.normal
    if normal is None:
        normal = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Normal"])
    graph.assign(normal, surface.inputs[realtime_surface.NORMAL])
    if _is_zero(closure.transmittance):
        return None
    passing = closure.transmittance
    covered = 1.0 - _mean(passing)
    graph.assign(covered, surface.inputs[realtime_surface.COVERAGE])
    if realtime_surface.COVERED in surface.inputs:
        graph.assign(1.0 - passing, surface.inputs[realtime_surface.COVERED])
    return passing


def _describe_facets(walk: _Walk, closure: _Closure, surface: bpy.types.Node) -> None:
    """Tell a surface group what throws back the light of lamps."""
    graph, lamps, mean = walk.graph, realtime_lamps, _per_weight
    values = {
        lamps.MIRROR: closure.mirror,
        lamps.EDGE: closure.edge,
        lamps.CLEAR: closure.clear,
        lamps.ROUGHNESS: mean(closure.roughness, closure.facets),
        lamps.CLEAR_INDEX: mean(closure.index, closure.clear),
    }
    if walk.surfaces.facets > 1:
        normal = closure.coat_normal
        if normal is None:
            normal = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Normal"])
        values |= {
            lamps.COAT: _mean(closure.coat),
            lamps.COAT_ROUGHNESS: mean(closure.coat_roughness, closure.coat),
            lamps.COAT_INDEX: mean(closure.coat_index, closure.coat),
            lamps.COAT_NORMAL: normal,
        }
    for name, value in values.items():
        graph.assign(value, surface.inputs[name])


def _insert(
    walk: _Walk,
    material: bpy.types.Material,
    output: bpy.types.Node,
    group: bpy.types.ShaderNodeTree,
) -> None:
    tree, graph = walk.tree, walk.graph
    socket = output.inputs["Surface"]
    link = socket.links[0]
    source, muted = link.from_socket, link.is_muted
    wet_trees.keep_shader(source)
    closure = walk.closure(socket)
    lit = graph.node("ShaderNodeShaderToRGB")
    surface = graph.node("ShaderNodeGroup", node_tree=group)
    surface[MUTED] = muted
    surface.location = (output.location.x, output.location.y - 200.0)
    passing = _describe(walk, closure, surface)
    others = []
    if not _is_zero(closure.behind):
        others.append(_translucent(walk, material, closure, closure.behind, output, surface))
    if not _is_zero(closure.highlight):
        others.append(_matte(graph, closure, closure.highlight))
    holder = lit
    for other in others:
        last, holder = holder, graph.node("ShaderNodeAddShader")
        tree.links.new(other, holder.inputs[1])
        tree.links.new(holder.outputs[0], last.inputs[0])
    holder[HOLDER] = 0
    tree.links.new(source, holder.inputs[0])
    tree.links.new(lit.outputs["Color"], surface.inputs[realtime_surface.LIT])
    seen = surface.outputs[0]
    if passing is not None:
        transparent = graph.node("ShaderNodeBsdfTransparent")
        graph.assign(passing, transparent.inputs["Color"])
        seen = _added(graph, seen, transparent.outputs[0])
    tree.links.new(seen, socket)


def _open_group(
    group: bpy.types.ShaderNodeTree, shader: str, names: Mapping[str, str], outer: _Walk
) -> None:
    """Give a group outputs for what one of its shaders is."""
    ends = [n for n in group.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output]
    if not ends:
        return
    owner = f"group {group.name!r}"
    walk = _Walk(group, owner, outer.notes, outer.surfaces, outer.closed, outer.dithered)
    closure = walk.closure(next(i for i in ends[0].inputs if i.identifier == shader))
    made = list(group.get(OPENED, ()))
    for quantity, name in names.items():
        value = getattr(closure, quantity)
        if value is None or (quantity != "colour" and _is_zero(value)):
            continue
        kind = "NodeSocketVector" if "normal" in quantity else "NodeSocketColor"
        made.append(group.interface.new_socket(name, in_out="OUTPUT", socket_type=kind).identifier)
        walk.graph.assign(value, ends[0].inputs[name])
    group[OPENED] = made


def _surface_output(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node | None:
    output = tree.get_output_node("EEVEE")
    return output if output is not None and output.inputs["Surface"].is_linked else None


def _is_animated(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket) -> bool:
    return any(curves(tree, f"{socket.path_from_id()}.default_value"))


def _limited(value: Operand, limits: tuple[float, float]) -> Operand:
    least, most = limits
    value = value if least == -math.inf else NODES.maximum(value, least)
    return value if most == math.inf else NODES.minimum(value, most)


def _is_zero(value: object) -> bool:
    return not isinstance(value, NodeValue) and value == 0.0


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


def _per_weight(total: Operand, weight: Operand) -> Operand:
    return _mean(total) / NODES.maximum(_mean(weight), _LEAST_FACETS)


def _mean(colour: Operand) -> Operand:
    if not isinstance(colour, NodeValue) or colour.size == 1:
        return colour
    x, y, z = colour.graph.components(colour)
    return (x + y + z) / 3.0
