"""The shader nodes that materials may use: what each does with light, and by which inputs.

All that reads shaders reads this table. EEVEE lights the closure of a node without a row before the
water, and takes its colour for grey.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...node_groups import realtime_highlights, uplift
from .inserted import is_idle, own_input, value_curves

MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"
EVEN, METAL, CLEAR, LAYERED = "even", "metal", "clear", "layered"
"""What facets reflect: the same at all angles, as a metal, by a refractive index, or all at once
under a coat."""

type Weight = float | str
"""How much of something a node does: a number, or the name of the input that says it."""


@dataclass(frozen=True)
class ShaderNode:
    """What is known of a shader node.

    What it covers it reflects, or lets through where it is ``clear`` and does not mirror.
    """

    colour: str = "Color"  #: Input of the colour that it reflects or lets through; "" of neither.
    cover: Weight = 1.0  #: What is not covered lets light through as it is.
    clear: Weight = 0.0
    mirrors: Weight = 0.0  #: How much of what it reflects shows the water around it.
    emits: tuple[str, str] | None = None  #: Inputs of what it emits: colour and strength.
    refracts: bool = False  #: It bends what it lets through.
    by_face: bool = False  #: A face lets through the root of its colour: a body has two.
    coat: bool = False  #: It has Coat Weight, by which Coat Tint filters all of it.
    behind: bool = False  #: It throws on the light from behind.
    facets: str = ""  #: How they reflect, if it consists of some.
    anisotropy: str = ""  #: Input that makes highlights longer than wide.
    sunlit: str | None = None  #: Group of :mod:`.realtime_highlights` by which the sun lights it.
    porous: bool = False  #: Its colour may be that of a porous object, dry or wet.
    matte: str | None = None  #: Group of :mod:`.uplift` for EEVEE, which takes it for matte.
    #: What to know of it in real time, after the name of a material; of a clear one if it is.
    approximate: str = ""

    @property
    def hides(self) -> bool:
        """Whether it is nothing but black."""
        return not self.colour and self.emits is None

    def may_mirror(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether a node of the kind mirrors, now or at another time."""
        return _weighs(tree, node, self.mirrors)

    def may_glow(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether it emits light."""
        return self.emits is not None and _weighs(tree, node, self.emits[1])

    def may_be_clear(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether it lets light through where it covers."""
        return _weighs(tree, node, self.clear)

    def may_let_through(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether it lets light through there, or does not cover all."""
        if not isinstance(self.cover, str):
            return self.may_be_clear(tree, node)
        cover = node.inputs[self.cover]
        full = not cover.is_linked and cover.default_value == 1.0
        return not full or bool(value_curves(tree, cover)) or self.may_be_clear(tree, node)

    def may_bend(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether it bends light."""
        return self.refracts and self.may_be_clear(tree, node)

    def may_filter(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> bool:
        """Whether it lets through more of one colour than of another."""
        if not self.may_be_clear(tree, node):
            return False
        own = own_input(node.inputs[self.colour])
        grey = len(set(own.default_value[:3])) == 1
        return own.is_linked or not grey or bool(value_curves(tree, own))

    def count_facets(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> int:
        """How many of :data:`.realtime_lamps.FACETS` it may have."""
        if self.facets != LAYERED:
            return int(bool(self.facets))
        if not is_idle(tree, node, "Coat Weight"):
            return 2
        return int(not is_idle(tree, node, "Specular IOR Level") or self.may_mirror(tree, node))

    def drawn_by(self, tree: bpy.types.NodeTree, node: bpy.types.Node) -> str | None:
        """Group of highlights by which the sun lights it."""
        kind = self.sunlit
        if kind == realtime_highlights.STRETCHED and is_idle(tree, node, self.anisotropy):
            return None
        if kind == realtime_highlights.TOON and node.component != "DIFFUSE":
            return None
        return kind


_STRAIGHT = "refracts; in real time light goes straight through it"
_THREADS = "is hair, which real time takes for matte threads that throw back as much"

SHADER_NODES = {
    "ShaderNodeBsdfPrincipled": ShaderNode(
        "Base Color",
        cover="Alpha",
        clear="Transmission Weight",
        mirrors="Metallic",
        emits=("Emission Color", "Emission Strength"),
        refracts=True,
        by_face=True,
        coat=True,
        facets=LAYERED,
        anisotropy="Anisotropic",
        porous=True,
        approximate="transmits light; in real time it goes straight through",
    ),
    "ShaderNodeBsdfDiffuse": ShaderNode(porous=True),
    "ShaderNodeBsdfAnisotropic": ShaderNode(
        mirrors=1.0, facets=EVEN, anisotropy="Anisotropy", sunlit=realtime_highlights.STRETCHED
    ),
    "ShaderNodeBsdfMetallic": ShaderNode(
        "Base Color", mirrors=1.0, facets=METAL, anisotropy="Anisotropy"
    ),
    "ShaderNodeBsdfSheen": ShaderNode(
        matte=uplift.SHEEN,
        approximate="is a sheen, which real time takes for matte, as bright as it is",
    ),
    "ShaderNodeBsdfToon": ShaderNode(
        sunlit=realtime_highlights.TOON,
        approximate="is a toon, which real time takes for matte but in the sun",
    ),
    "ShaderNodeBsdfTranslucent": ShaderNode(
        behind=True,
        porous=True,
        approximate="is translucent; real time leaves out the water inside closed bodies",
    ),
    "ShaderNodeBsdfHair": ShaderNode(matte=uplift.HAIR, approximate=_THREADS),
    "ShaderNodeBsdfHairPrincipled": ShaderNode(matte=uplift.HAIR, approximate=_THREADS),
    "ShaderNodeSubsurfaceScattering": ShaderNode(porous=True),
    "ShaderNodeEmission": ShaderNode("", emits=("Color", "Strength")),
    "ShaderNodeBackground": ShaderNode("", emits=("Color", "Strength")),
    "ShaderNodeBsdfTransparent": ShaderNode(clear=1.0),
    "ShaderNodeBsdfGlass": ShaderNode(
        clear=1.0, refracts=True, facets=CLEAR, approximate=_STRAIGHT
    ),
    "ShaderNodeBsdfRefraction": ShaderNode(clear=1.0, refracts=True, approximate=_STRAIGHT),
    "ShaderNodeBsdfRayPortal": ShaderNode(
        clear=1.0, approximate="has a portal; real time shows what is straight behind it"
    ),
    "ShaderNodeEeveeSpecular": ShaderNode(
        "Base Color", approximate="uses Specular, which Cycles draws black"
    ),
    "ShaderNodeHoldout": ShaderNode(""),
}
"""By Blender's names of the nodes."""


def row_of(node: bpy.types.Node) -> ShaderNode | None:
    """Return the row of a node."""
    return SHADER_NODES.get(node.bl_idname)


def _weighs(tree: bpy.types.NodeTree, node: bpy.types.Node, weight: Weight) -> bool:
    """Whether a weight may be more than 0 while a job runs."""
    return not is_idle(tree, node, weight) if isinstance(weight, str) else weight > 0.0


def makes_closure(node: bpy.types.Node) -> bool:
    """Whether a node is where a closure comes from, and not a group, a zone or a mixture."""
    shaders = [socket for socket in (*node.inputs, *node.outputs) if socket.type == "SHADER"]
    own = node.bl_idname.startswith("ShaderNode") and node.bl_idname != "ShaderNodeGroup"
    return own and bool(shaders) and all(socket.is_output for socket in shaders)
