"""Mean base colours of materials, by following what feeds them.

Textures count by the mean of their pixels, ramps by their middle, mixtures by their factor; what
varies in a way that cannot be known from the nodes counts as halfway.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Color

Rgb = tuple[float, float, float]

_PLAIN: Rgb = (0.5, 0.5, 0.5)
_BARE: Rgb = (0.8, 0.8, 0.8)  # what Blender draws without a material
_HALFWAY = 0.5
_RAMP = np.linspace(0.3, 0.7, 9)  # where noise of most kinds lies
_PIXELS = 4096  # of an image that are looked at
_DEEPEST = 32  # nodes in a row
_PASSED_ON = {
    "ShaderNodeGamma", "ShaderNodeBrightContrast", "ShaderNodeHueSaturation", "ShaderNodeRGBCurve",
    "NodeReroute",
}  # fmt: skip


def mean_colour(material: bpy.types.Material | None) -> Rgb:
    """Mean base colour of a material, linear Rec.709."""
    if material is None:
        return _BARE
    for node in material.node_tree.nodes if material.node_tree else ():
        socket = node.inputs.get("Base Color") or (
            node.inputs.get("Color") if node.type.startswith("BSDF") else None
        )
        if socket is not None:
            red, green, blue = (min(max(c, 0.0), 1.0) for c in _Means().of(socket))
            return red, green, blue
    red, green, blue = material.diffuse_color[:3]
    return red, green, blue


@dataclass
class _Means:
    """Follows the nodes of one material."""

    depth: int = 0
    groups: list[bpy.types.Node] = field(default_factory=list)

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
        if kind in ("ShaderNodeRGB", "ShaderNodeValue"):
            return _value(output)
        if kind == "ShaderNodeValToRGB":
            stops = np.array([node.color_ramp.evaluate(float(x))[:3] for x in _RAMP])
            return _rgb(stops.mean(axis=0))
        if kind in ("ShaderNodeMix", "ShaderNodeMixRGB"):
            return self._mixed(node)
        if kind == "ShaderNodeTexImage":
            return _image_mean(node.image)
        if kind in _PASSED_ON:
            inputs = node.inputs
            return self.of(inputs["Color"] if "Color" in inputs else inputs[0])
        if kind == "ShaderNodeGroup" and node.node_tree is not None:
            return self._inside(node, output)
        if kind == "NodeGroupInput" and self.groups:
            group = self.groups.pop()
            try:
                return self.of(group.inputs[output.name])
            finally:
                self.groups.append(group)
        return _PLAIN

    def _mixed(self, node: bpy.types.Node) -> Rgb:
        shown = [i for i in node.inputs if not i.is_unavailable]
        factor = self.of(shown[0])[0] if not shown[0].links else _HALFWAY
        colours = [i for i in shown if i.type == "RGBA"] or shown[1:]
        one, other = (np.array(self.of(i)) for i in colours[:2])
        if node.blend_type == "MULTIPLY":
            other = one * other
        elif node.blend_type == "ADD":
            other = one + other
        elif node.blend_type != "MIX":
            return _rgb(one)
        return _rgb(one * (1.0 - factor) + other * factor)

    def _inside(self, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Rgb:
        ends = [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
        if not ends or output.name not in ends[0].inputs:
            return _PLAIN
        self.groups.append(node)
        try:
            return self.of(ends[0].inputs[output.name])
        finally:
            self.groups.pop()


def _value(socket: bpy.types.NodeSocket) -> Rgb:
    value = getattr(socket, "default_value", _PLAIN)
    if isinstance(value, int | float):
        return float(value), float(value), float(value)
    return _rgb(list(value)[:3])


def _image_mean(image: bpy.types.Image | None) -> Rgb:
    if image is None or (not image.has_data and not image.pixels):
        return _PLAIN
    count = len(image.pixels) // image.channels
    if not count:
        return _PLAIN
    texels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(texels)
    texels = texels.reshape(count, -1)[:: max(count // _PIXELS, 1), :3]
    if texels.shape[1] < 3:
        texels = np.repeat(texels[:, :1], 3, axis=1)
    if image.colorspace_settings.name == "sRGB" and not image.is_float:
        return _rgb(np.mean([Color(c).from_srgb_to_scene_linear() for c in texels], axis=0))
    return _rgb(texels.mean(axis=0))


def _rgb(values: object) -> Rgb:
    red, green, blue = (float(v) for v in np.asarray(values).ravel()[:3])
    return red, green, blue
