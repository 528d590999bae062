"""The shader nodes that materials may use: what each does with light, and where its colour is.

EEVEE lights the closure of a node without a row before the water, and takes its colour for grey.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...node_groups import realtime_highlights, uplift

PRINCIPLED = "ShaderNodeBsdfPrincipled"
"""All of it at once; its weights say what."""
MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"
REFLECTS, EMITS, PASSES, REFRACTS, HIDES = "reflects", "emits", "passes", "refracts", "hides"
EVEN, METAL, CLEAR = "even", "metal", "clear"
"""What facets reflect: the same at all angles, as a metal, or by a refractive index."""


@dataclass(frozen=True)
class ShaderNode:
    """What is known of a shader node."""

    #: One of the words above; by what passes straight, or refracts, what is behind shows.
    does: str
    colour: str = "Color"  #: Input with the colour that it does it by.
    mirrors: bool = False  #: It shows the water around it.
    behind: bool = False  #: It throws on the light from behind.
    facets: str = ""  #: How they reflect, if it consists of some.
    sunlit: str | None = None  #: Group of :mod:`.realtime_highlights` by which the sun lights it.
    porous: bool = False  #: Its colour may be that of a porous object, dry or wet.
    matte: str | None = None  #: Group of :mod:`.uplift` for EEVEE, which takes it for matte.
    approximate: str = ""  #: What to know of it in real time, after the name of a material.


_STRAIGHT = "refracts; in real time light goes straight through it"
_THREADS = "is hair, which real time takes for matte threads that throw back as much"

SHADER_NODES = {
    "ShaderNodeBsdfDiffuse": ShaderNode(REFLECTS, porous=True),
    "ShaderNodeBsdfAnisotropic": ShaderNode(
        REFLECTS, mirrors=True, facets=EVEN, sunlit=realtime_highlights.STRETCHED
    ),
    "ShaderNodeBsdfGlossy": ShaderNode(REFLECTS, mirrors=True, facets=EVEN),
    "ShaderNodeBsdfMetallic": ShaderNode(REFLECTS, "Base Color", mirrors=True, facets=METAL),
    "ShaderNodeBsdfSheen": ShaderNode(
        REFLECTS,
        matte=uplift.SHEEN,
        approximate="is a sheen, which real time takes for matte, as bright as it is",
    ),
    "ShaderNodeBsdfToon": ShaderNode(
        REFLECTS,
        sunlit=realtime_highlights.TOON,
        approximate="is a toon, which real time takes for matte but in the sun",
    ),
    "ShaderNodeBsdfTranslucent": ShaderNode(
        REFLECTS,
        behind=True,
        porous=True,
        approximate="is translucent; real time leaves out the water inside closed bodies",
    ),
    "ShaderNodeBsdfHair": ShaderNode(REFLECTS, matte=uplift.HAIR, approximate=_THREADS),
    "ShaderNodeBsdfHairPrincipled": ShaderNode(REFLECTS, matte=uplift.HAIR, approximate=_THREADS),
    "ShaderNodeSubsurfaceScattering": ShaderNode(REFLECTS, porous=True),
    "ShaderNodeEmission": ShaderNode(EMITS),
    "ShaderNodeBackground": ShaderNode(EMITS),
    "ShaderNodeBsdfTransparent": ShaderNode(PASSES),
    "ShaderNodeBsdfGlass": ShaderNode(REFRACTS, facets=CLEAR, approximate=_STRAIGHT),
    "ShaderNodeBsdfRefraction": ShaderNode(REFRACTS, approximate=_STRAIGHT),
    "ShaderNodeBsdfRayPortal": ShaderNode(
        PASSES, approximate="has a portal; real time shows what is straight behind it"
    ),
    "ShaderNodeEeveeSpecular": ShaderNode(
        REFLECTS, "Base Color", approximate="uses Specular, which Cycles draws black"
    ),
    "ShaderNodeHoldout": ShaderNode(HIDES),
}
"""By Blender's names of the nodes."""


def nodes_that(*do: str) -> set[str]:
    """Names of the nodes that do one of some things."""
    return {name for name, node in SHADER_NODES.items() if node.does in do}


def makes_closure(node: bpy.types.Node) -> bool:
    """Whether a node is where a closure comes from, and not a group, a zone or a mixture."""
    shaders = [socket for socket in (*node.inputs, *node.outputs) if socket.type == "SHADER"]
    own = node.bl_idname.startswith("ShaderNode") and node.bl_idname != "ShaderNodeGroup"
    return own and bool(shaders) and all(socket.is_output for socket in shaders)
