"""What materials reflect and cover in the mean, by following the shader that is rendered.

Textures count by the mean of their pixels, ramps by their middle, mixtures by their factor; noise
has its own distribution, so that patches count by what they cover. What varies in a way that cannot
be known from the nodes counts as halfway.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Color
from numpy.typing import NDArray

from ...node_groups import uplift
from ...uw_spectral.spectra.colour_rendering import luminance
from ...uw_spectral.surface.refraction import REFRACTIVE_INDEX
from ...uw_spectral.surface.wet_reflectance import (
    GRAIN_INDEX,
    mean_cosine_of_grains,
    wet_reflectance_TwomeyEtAl1986,
)
from ...uw_spectral.transfer.closures import hair_albedo, sheen_albedo
from ..stored_materials import is_porous
from .shader_nodes import EMITS, HIDES, PASSES, PRINCIPLED, REFRACTS, SHADER_NODES, nodes_that
from .wet_trees import own_shader

Array = NDArray[np.float64]
Rgb = tuple[float, float, float]

_PLAIN: Rgb = (0.5, 0.5, 0.5)
_BARE: Rgb = (0.8, 0.8, 0.8)  # what Blender draws without a material
_BLACK: Rgb = (0.0, 0.0, 0.0)
_THINNEST = 1e-6
_HALFWAY = 0.5
_RAMP = np.linspace(0.3, 0.7, 9)  # where noise of most kinds lies
_NOISE = np.array(
    [
        0.366,
        0.403,
        0.426,
        0.443,
        0.458,
        0.471,
        0.483,
        0.494,
        0.505,
        0.517,
        0.529,
        0.542,
        0.557,
        0.574,
        0.596,
        0.634,
    ]
)
"""Quantiles of Blender's noise texture, measured at a detail of 8 and a roughness of 0.5; much the
same with a detail of 3 or 15."""
_PIXELS = 4096  # of an image that are looked at
_DEEPEST = 32  # nodes in a row
_GRAZING = 0.1  # mean share of what shows at grazing angles
_GRAZING_NODES = {"ShaderNodeFresnel", "ShaderNodeLayerWeight"}
_GRAINS = GRAIN_INDEX / REFRACTIVE_INDEX
_FROM_BEHIND = (
    0.5  # of what comes through, by the light on this side: sides seen are mostly the lit
)
_SIDES = 64
_THREADS = {"ShaderNodeBsdfHair", "ShaderNodeBsdfHairPrincipled"}
_CLEAR, _DARK = nodes_that(PASSES, REFRACTS), nodes_that(EMITS, HIDES)
_TEXTURES = {"ShaderNodeTexChecker", "ShaderNodeTexBrick"}
_MATH: dict[str, Callable[..., float]] = {
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DIVIDE": lambda a, b: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b: max(a, 0.0) ** b if a > 0 or b > 0 else 0.0,
    "SQRT": lambda a: max(a, 0.0) ** 0.5,
    "ABSOLUTE": lambda a: abs(a),
    "MINIMUM": min,
    "MAXIMUM": max,
}
"""What numbers become, as if they did not vary."""
_PASSED_ON = {
    "ShaderNodeGamma", "ShaderNodeBrightContrast", "ShaderNodeHueSaturation", "ShaderNodeRGBCurve",
    "NodeReroute",
}  # fmt: skip


@dataclass(frozen=True)
class MeanSurface:
    """Mean base colour of what covers, linear Rec.709, and the share of light that it stops."""

    colour: Rgb
    coverage: float


def mean_colour(material: bpy.types.Material | None) -> Rgb:
    """Mean base colour of a material, linear Rec.709."""
    return mean_surface(material).colour


def mask_of(material: bpy.types.Material | None) -> str:
    """Name of the one attribute of meshes by which a material is mixed; empty if there is none."""
    tree = None if material is None else material.node_tree
    names = {node.attribute_name for node in (tree.nodes if tree else ()) if _is_mask(node)}
    return names.pop() if len(names) == 1 else ""


def _is_mask(node: bpy.types.Node) -> bool:
    if node.bl_idname != "ShaderNodeAttribute" or node.attribute_type != "GEOMETRY":
        return False
    return any(_is_number(output) and output.is_linked for output in node.outputs)


def _is_number(output: bpy.types.NodeSocket) -> bool:
    return output.type == "VALUE" and output.name != "Alpha"


def mean_surface(material: bpy.types.Material | None, mask: float = _HALFWAY) -> MeanSurface:
    """Return what a material reflects and covers; that of Blender's grey without one.

    ``mask`` is the value of the attribute of :func:`mask_of`.
    """
    if material is None:
        return MeanSurface(_BARE, 1.0)
    tree = material.node_tree
    shader = None if tree is None else own_shader(tree)
    if shader is None:
        return MeanSurface(_rgb(material.diffuse_color), 1.0)
    if not shader.is_linked:
        is_volume = tree.get_output_node("EEVEE").inputs["Volume"].is_linked
        return MeanSurface(_BLACK, 0.0 if is_volume else 1.0)
    colour, coverage = _Means(mask if mask_of(material) else _HALFWAY).shader(shader)
    shown = np.clip(np.array(colour) / max(coverage, _THINNEST), 0.0, 1.0)
    if is_porous(material):
        shown = wet_reflectance_TwomeyEtAl1986(shown, mean_cosine_of_grains(_GRAINS), -1.0)
    return MeanSurface(_rgb(shown), min(max(coverage, 0.0), 1.0))


@dataclass
class _Means:
    """Follows the nodes of one material."""

    mask: float
    depth: int = 0
    groups: list[bpy.types.Node] = field(default_factory=list)

    def shader(self, socket: bpy.types.NodeSocket) -> tuple[Array, float]:
        """Mean colour times coverage, and coverage, of what arrives at a shader's input."""
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return np.zeros(3), 1.0
        self.depth += 1
        try:
            if self.depth > _DEEPEST:
                return np.array(_PLAIN), 1.0
            return self._closure(links[0].from_node, links[0].from_socket)
        finally:
            self.depth -= 1

    def _closure(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> tuple[Array, float]:
        kind, inputs = node.bl_idname, node.inputs
        if node.mute or kind == "NodeReroute":
            first = next((i for i in inputs if i.type == "SHADER"), None)
            return (np.zeros(3), 1.0) if first is None else self.shader(first)
        if kind in ("ShaderNodeMixShader", "ShaderNodeAddShader"):
            (one, covers), (other, also) = (self.shader(i) for i in inputs if i.type == "SHADER")
            if kind == "ShaderNodeAddShader":
                return one + other, covers * also
            share = self.of(inputs[0])[0]
            return one + share * (other - one), covers + share * (also - covers)
        if kind == "ShaderNodeGroup" and node.node_tree is not None:
            return self._inside(node, output, self.shader, (np.array(_PLAIN), 1.0))
        if kind == "NodeGroupInput" and self.groups:
            return self._outside(output, self.shader)
        if kind in _DARK:
            return np.zeros(3), 1.0
        if kind in _CLEAR:
            passing = self.of(inputs[SHADER_NODES[kind].colour])
            return np.zeros(3), 1.0 - float(np.mean(passing))
        colour = inputs.get("Base Color") or inputs.get("Color")
        base = np.array(_PLAIN if colour is None else self.of(colour))
        if kind == "ShaderNodeBsdfSheen":
            return base * _mean_sheen(self.of(inputs["Roughness"])[0]), 1.0
        if kind in _THREADS:
            return np.asarray(hair_albedo(base)), 1.0
        if kind != PRINCIPLED:
            known = SHADER_NODES.get(kind)
            return base * (_FROM_BEHIND if known is not None and known.behind else 1.0), 1.0
        coat, tint = self.of(inputs["Coat Weight"])[0], np.array(self.of(inputs["Coat Tint"]))
        base = base * (1.0 + coat * (tint - 1.0))
        alpha, passing = (self.of(inputs[name])[0] for name in ("Alpha", "Transmission Weight"))
        through = alpha * passing * float(base.mean())
        return base * (alpha * (1.0 - passing)), alpha - through

    def of(self, socket: bpy.types.NodeSocket) -> Rgb:
        """Mean of what an input gets."""
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        if not links:
            return _value(socket)
        self.depth += 1
        try:
            if self.depth > _DEEPEST:
                return _PLAIN
            return self._output(links[0].from_node, links[0].from_socket)
        finally:
            self.depth -= 1

    def _output(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Rgb:
        kind = node.bl_idname
        if node.mute:
            passed = [x.from_socket for x in node.internal_links if x.to_socket == output]
            return self.of(passed[0]) if passed else _PLAIN
        if kind in ("ShaderNodeRGB", "ShaderNodeValue"):
            return _value(output)
        if kind == "ShaderNodeValToRGB":
            values = self._values(node.inputs[0])
            places = _RAMP if values is None else values
            stops = np.array([node.color_ramp.evaluate(float(x))[:3] for x in places])
            return _rgb(stops.mean(axis=0))
        if _is_mask(node) and _is_number(output) and not self.groups:
            return _rgb([self.mask] * 3)
        if kind == "ShaderNodeMapRange":
            mapped = self._mapped(node)
            return _PLAIN if mapped is None else _rgb([mapped.mean()] * 3)
        if kind in ("ShaderNodeMix", "ShaderNodeMixRGB"):
            return self._mixed(node)
        if kind in _TEXTURES:
            return self._texture(node, output)
        if kind == "ShaderNodeMath" and node.operation in _MATH:
            values = [self.of(i)[0] for i in node.inputs if not i.is_unavailable]
            found = _MATH[node.operation](*values)
            return _rgb([min(max(found, 0.0), 1.0) if node.use_clamp else found] * 3)
        if kind == "ShaderNodeInvert":
            factor, colour = (np.array(self.of(i)) for i in node.inputs)
            return _rgb(colour + factor * (1.0 - 2.0 * colour))
        if kind == "ShaderNodeRGBToBW":
            return _rgb([luminance(self.of(node.inputs[0]))] * 3)
        if kind == "ShaderNodeSeparateColor" and node.mode == "RGB":
            place = [o.name for o in node.outputs].index(output.name)
            return _rgb([self.of(node.inputs[0])[place]] * 3)
        if kind == "ShaderNodeCombineColor" and node.mode == "RGB":
            return _rgb([self.of(i)[0] for i in node.inputs])
        if kind == "ShaderNodeClamp":
            value, low, high = (self.of(i)[0] for i in node.inputs)
            return _rgb([min(max(value, low), high)] * 3)
        if kind == "ShaderNodeTexImage":
            return _image_mean(node.image, alpha=output.name == "Alpha")
        if kind in _GRAZING_NODES:
            return _GRAZING, _GRAZING, _GRAZING
        if kind in _PASSED_ON:
            inputs = node.inputs
            return self.of(inputs["Color"] if "Color" in inputs else inputs[0])
        if kind == "ShaderNodeGroup" and uplift.is_uplift(node.node_tree):
            return self.of(node.inputs[uplift.COLOR_INPUT])
        if kind == "ShaderNodeGroup" and node.node_tree is not None:
            return self._inside(node, output, self.of, _PLAIN)
        if kind == "NodeGroupInput" and self.groups:
            return self._outside(output, self.of)
        return _PLAIN

    def _texture(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Rgb:
        """Mean of a pattern of two colours."""
        if output.name != "Color":
            return _PLAIN
        if node.bl_idname == "ShaderNodeTexChecker":
            one, other = (np.array(self.of(node.inputs[n])) for n in ("Color1", "Color2"))
            return _rgb(0.5 * (one + other))
        names = ("Color1", "Color2", "Mortar", "Mortar Size", "Bias", "Brick Width", "Row Height")
        one, other, between, gap, bias, wide, high = (
            np.array(self.of(node.inputs[name])) for name in names
        )
        sides = np.clip(1.0 - 2.0 * gap / np.maximum((wide, high), _THINNEST), 0.0, 1.0)
        # Of a number from 0 to 1 and the bias, cut to 0 to 1.
        least, most = np.clip(bias, -1.0, 0.0), np.clip(bias, 0.0, 1.0)
        share = np.where(bias < 0, 0.5 * (1.0 + least) ** 2, 1.0 - 0.5 * (1.0 - most) ** 2)
        bricks = one + share * (other - one)
        return _rgb(between + sides.prod(axis=0) * (bricks - between))

    def _values(self, socket: bpy.types.NodeSocket) -> Array | None:
        """Return values of a number that varies as noise does, all as frequent; None of others."""
        links = [link for link in socket.links if link.is_valid and not link.is_muted]
        node = links[0].from_node if links else None
        if node is None or node.mute:
            return None
        if node.bl_idname == "ShaderNodeMapRange":
            return self._mapped(node)
        is_noise = node.bl_idname == "ShaderNodeTexNoise" and node.noise_type == "FBM"
        return _NOISE if is_noise and node.normalize else None

    def _mapped(self, node: bpy.types.Node) -> Array | None:
        """Return what Map Range makes of such values."""
        values = self._values(node.inputs["Value"])
        if values is None or node.data_type != "FLOAT":
            return None
        names = "From Min", "From Max", "To Min", "To Max"
        low, high, first, last = (self.of(node.inputs[name])[0] for name in names)
        share = (values - low) / (high - low) if high != low else np.zeros(len(values))
        smooth = node.interpolation_type.startswith("SMOOTH")
        if node.clamp or smooth:
            share = np.clip(share, 0.0, 1.0)
        if smooth:
            share = share * share * (3.0 - 2.0 * share)
        return first + share * (last - first)

    def _mixed(self, node: bpy.types.Node) -> Rgb:
        shown = [i for i in node.inputs if not i.is_unavailable]
        factor = self.of(shown[0])[0]
        colours = [i for i in shown if i.type == "RGBA"] or shown[1:]
        one, other = (np.array(self.of(i)) for i in colours[:2])
        if node.blend_type == "MULTIPLY":
            other = one * other
        elif node.blend_type == "ADD":
            other = one + other
        elif node.blend_type != "MIX":
            return _rgb(one)
        return _rgb(one * (1.0 - factor) + other * factor)

    def _inside[Mean](
        self,
        node: bpy.types.Node,
        output: bpy.types.NodeSocket,
        mean: Callable[[bpy.types.NodeSocket], Mean],
        unknown: Mean,
    ) -> Mean:
        """Mean of what a group gives out."""
        ends = [
            n
            for n in node.node_tree.nodes
            if n.bl_idname == "NodeGroupOutput" and n.is_active_output
        ]
        inner = [i for end in ends for i in end.inputs if i.identifier == output.identifier]
        if not inner:
            return unknown
        self.groups.append(node)
        try:
            return mean(inner[0])
        finally:
            self.groups.pop()

    def _outside[Mean](
        self, output: bpy.types.NodeSocket, mean: Callable[[bpy.types.NodeSocket], Mean]
    ) -> Mean:
        """Mean of what the group that is followed gets."""
        group = self.groups.pop()
        try:
            return mean(next(i for i in group.inputs if i.identifier == output.identifier))
        finally:
            self.groups.append(group)


def _mean_sheen(roughness: float) -> float:
    """Share of light that a white sheen throws back, in the mean over a round thing."""
    side = (np.arange(_SIDES) + 0.5) / _SIDES
    return float(np.mean(sheen_albedo(roughness, np.sqrt(side))))


def _value(socket: bpy.types.NodeSocket) -> Rgb:
    value = getattr(socket, "default_value", _PLAIN)
    if isinstance(value, int | float):
        return float(value), float(value), float(value)
    return _rgb(list(value)[:3])


def _image_mean(image: bpy.types.Image | None, *, alpha: bool) -> Rgb:
    if image is None or (not image.has_data and not image.pixels):
        return _PLAIN
    count = len(image.pixels) // image.channels
    if not count:
        return _PLAIN
    texels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(texels)
    texels = texels.reshape(count, -1)[:: max(count // _PIXELS, 1)]
    if alpha:
        covered = float(texels[:, 3].mean()) if texels.shape[1] > 3 else 1.0
        return covered, covered, covered
    texels = texels[:, :3]
    if texels.shape[1] < 3:
        texels = np.repeat(texels[:, :1], 3, axis=1)
    if image.colorspace_settings.name.startswith("sRGB") and not image.is_float:
        return _rgb(np.mean([Color(c).from_srgb_to_scene_linear() for c in texels], axis=0))
    return _rgb(texels.mean(axis=0))


def _rgb(values: object) -> Rgb:
    red, green, blue = (float(v) for v in np.asarray(values).ravel()[:3])
    return red, green, blue
