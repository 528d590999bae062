"""Kinds of textures and attributes, each as a colour and an alpha on a plane of 2 m."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

RED, BLUE = (0.8, 0.2, 0.1, 1.0), (0.05, 0.1, 0.6, 1.0)
SIDE = 256


@dataclass
class Kind:
    """What a kind is made in: the tree of its material, its mesh, a folder for files."""

    tree: bpy.types.ShaderNodeTree
    mesh: bpy.types.Mesh
    folder: Path

    def node(self, kind, **inputs):
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            node.inputs[name.replace("_", " ")].default_value = value
        return node

    def link(self, output, socket):
        self.tree.links.new(output, socket)

    def texture(self, image, **properties):
        node = self.node("TexImage")
        node.image = image
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def move_uv(self, scale, shift=0.0, layer=0):
        uv = self.mesh.uv_layers[layer].uv
        values = np.empty(2 * len(uv), np.float32)
        uv.foreach_get("vector", values)
        uv.foreach_set("vector", scale * values + shift)

    def mix(self, factor, one=RED, other=BLUE, blend="MIX"):
        node = self.node("Mix")
        node.data_type, node.blend_type = "RGBA", blend
        fraction, *colours = [i for i in node.inputs if not i.is_unavailable]
        for socket, value in zip((fraction, *colours), (factor, one, other), strict=True):
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, socket)
            else:
                socket.default_value = value
        return next(o for o in node.outputs if o.type == "RGBA")

    def attribute(self, domain, kind, name="painted", fraction=None):
        """Add an attribute that runs across the plane, red at one side and blue at the other."""
        made = self.mesh.attributes.new(name, kind, domain)
        x = np.array(
            [
                {
                    "POINT": lambda n: self.mesh.vertices[n].co.x,
                    "CORNER": lambda n: self.mesh.vertices[self.mesh.loops[n].vertex_index].co.x,
                    "FACE": lambda n: self.mesh.polygons[n].center.x,
                }[domain](n)
                for n in range(len(made.data))
            ]
        )
        fraction = np.clip(0.3 + 0.5 * x, 0.0, 1.0) if fraction is None else fraction
        if kind == "FLOAT":
            made.data.foreach_set("value", fraction.astype(np.float32))
        else:
            values = np.array(RED) + fraction[:, None] * (np.array(BLUE) - RED)
            made.data.foreach_set("color", values.astype(np.float32).ravel())

    def file(self, name, pixels, *, floats=False):
        """Write pixels, shape (SIDE, SIDE, 4), as they are, and return the path."""
        image = bpy.data.images.new(name, SIDE, SIDE, alpha=True, float_buffer=floats)
        image.colorspace_settings.name = "Non-Color"
        image.pixels.foreach_set(pixels.astype(np.float32).ravel())
        path = self.folder / f"{name}.{'exr' if floats else 'png'}"
        image.filepath_raw, image.file_format = str(path), "OPEN_EXR" if floats else "PNG"
        image.save()
        bpy.data.images.remove(image)
        return str(path)

    def image(self, pixels=None, *, floats=False, space="sRGB", name="shown"):
        pixels = picture() if pixels is None else pixels
        image = bpy.data.images.load(self.file(name, pixels, floats=floats))
        image.colorspace_settings.name = space
        return image


def picture(seed=1, level=1.0):
    """Return blocks of chance colours, brighter to one corner."""
    blocks = 0.3 + 0.7 * np.random.default_rng(seed).random((8, 8, 3))
    blocks *= np.linspace(0.5, 1.0, 8)[:, None, None]
    pixels = np.ones((SIDE, SIDE, 4))
    pixels[..., :3] = level * np.kron(blocks, np.ones((SIDE // 8, SIDE // 8, 1)))
    return pixels


def leaves():
    """Return a picture of which discs cover a part; what they leave is bright red."""
    pixels = picture(2)
    y, x = np.mgrid[:SIDE, :SIDE] % (SIDE // 2) - SIDE / 4 + 0.5
    bare = x * x + y * y > (0.9 * SIDE / 4) ** 2
    pixels[bare] = (1.0, 0.0, 0.0, 0.0)
    return pixels


def quarter_of_an_atlas(k):
    pixels = np.zeros((SIDE, SIDE, 4))
    pixels[..., 3] = 1.0
    pixels[: SIDE // 2, : SIDE // 2] = picture()[: SIDE // 2, : SIDE // 2]
    k.move_uv(0.5)
    return k.texture(k.image(pixels)).outputs[0], None


def tiled(k):
    k.move_uv(7.0)
    return k.texture(k.image()).outputs[0], None


def _beyond(extension):
    def kind(k):
        k.move_uv(2.6, -0.7)
        node = k.texture(k.image(), extension=extension)
        return node.outputs[0], None

    return kind


def udim(k):
    for tile, level in ((1001, 0.3), (1002, 0.9)):
        k.file(f"tile.{tile}", picture(level=level))
    image = bpy.data.images.load(str(k.folder / "tile.1001.png"))
    image.source = "TILED"
    image.filepath = str(k.folder / "tile.<UDIM>.png")
    if len(image.tiles) < 2:
        image.tiles.new(1002)
    uv = k.mesh.uv_layers[0].uv
    for point in uv:
        point.vector = (point.vector[0] * 1.5 + 0.5, point.vector[1])
    return k.texture(image).outputs[0], None


def second_uv_map(k):
    k.mesh.uv_layers.new(name="other")
    k.move_uv(0.25, 0.7, layer=1)
    node = k.texture(k.image())
    uv = k.node("UVMap")
    uv.uv_map = "other"
    k.link(uv.outputs[0], node.inputs["Vector"])
    return node.outputs[0], None


def uv_map_of_renders(k):
    k.mesh.uv_layers.new(name="other").active_render = True
    k.move_uv(0.25, 0.7, layer=1)
    return k.texture(k.image()).outputs[0], None


def uv_map_by_attribute(k):
    k.move_uv(0.25, 0.7)
    node, uv = k.texture(k.image()), k.node("Attribute")
    uv.attribute_name = k.mesh.uv_layers[0].name
    k.link(uv.outputs["Vector"], node.inputs["Vector"])
    return node.outputs[0], None


def missing_uv_map(k):
    node, uv = k.texture(k.image()), k.node("UVMap")
    uv.uv_map = "nowhere"
    k.link(uv.outputs[0], node.inputs["Vector"])
    return node.outputs[0], None


def _colours(domain, kind, *, named):
    def build(k):
        k.attribute(domain, kind)
        k.mesh.color_attributes.render_color_index = 0
        node = k.node("VertexColor")
        node.layer_name = "painted" if named else ""
        return node.outputs[0], None

    return build


def _mixed_by(domain):
    def build(k):
        k.attribute(domain, "FLOAT")
        node = k.node("Attribute")
        node.attribute_name = "painted"
        return k.mix(node.outputs["Factor"]), None

    return build


def attribute_that_is_missing(k):
    node = k.node("Attribute")
    node.attribute_name = "nowhere"
    return k.mix(node.outputs["Factor"]), None


def colour_into_factor(k):
    k.attribute("POINT", "FLOAT_COLOR")
    node = k.node("Attribute")
    node.attribute_name = "painted"
    return k.mix(node.outputs["Color"]), None


def leaf_atlas(k):
    node = k.texture(k.image(leaves()))
    return node.outputs[0], node.outputs[1]


def leaf_without_its_alpha(k):
    return k.texture(k.image(leaves())).outputs[0], None


def alpha_clipped(k):
    node, clip = k.texture(k.image(leaves())), k.node("Math")
    clip.operation = "GREATER_THAN"
    k.link(node.outputs[1], clip.inputs[0])
    return node.outputs[0], clip.outputs[0]


def sequence_at_frame_5(k):
    for frame in range(1, 9):
        k.file(f"frame_{frame:04d}", picture(frame, level=frame / 8))
    image = bpy.data.images.load(str(k.folder / "frame_0001.png"))
    image.source = "SEQUENCE"
    node = k.texture(image)
    user = node.image_user
    user.frame_duration, user.use_auto_refresh = 8, True
    bpy.context.scene.frame_set(5)
    return node.outputs[0], None


def sequence_that_starts_later(k):
    output, _ = sequence_at_frame_5(k)
    user = output.node.image_user
    user.frame_duration, user.frame_start, user.frame_offset = 3, 2, 1
    user.use_cyclic = True
    return output, None


def _space(space, *, floats=False):
    def build(k):
        return k.texture(k.image(floats=floats, space=space)).outputs[0], None

    return build


def mapped(k):
    node, move, place = k.texture(k.image()), k.node("Mapping"), k.node("TexCoord")
    for name, value in (
        ("Rotation", (0.1, 0.2, 0.7)),
        ("Scale", (1.7, 0.4, 1)),
        ("Location", (0.2, 0.1, 0)),
    ):
        move.inputs[name].default_value = value
    k.link(place.outputs["UV"], move.inputs["Vector"])
    k.link(move.outputs[0], node.inputs["Vector"])
    node.extension = "CLIP"
    return node.outputs[0], None


def by_object_coordinates(k):
    node, place = k.texture(k.image()), k.node("TexCoord")
    node.extension = "EXTEND"
    k.link(place.outputs["Object"], node.inputs["Vector"])
    return node.outputs[0], None


def by_position(k):
    node, place = k.texture(k.image(), extension="EXTEND"), k.node("NewGeometry")
    k.link(place.outputs["Position"], node.inputs["Vector"])
    return node.outputs[0], None


def box_projection(k):
    node, place = k.texture(k.image(), projection="BOX"), k.node("TexCoord")
    k.link(place.outputs["Object"], node.inputs["Vector"])
    return node.outputs[0], None


def checker(k):
    return k.node("TexChecker", Scale=3.4, Color1=RED, Color2=BLUE).outputs[0], None


def brick(k):
    node = k.node("TexBrick", Scale=3.4, Color1=RED, Color2=BLUE, Mortar=(0.9, 0.9, 0.2, 1.0))
    return node.outputs[0], None


def waves(k):
    node = k.node("TexWave", Scale=0.13)
    return k.mix(node.outputs[1]), None


def gradient(k):
    node, place = k.node("TexGradient"), k.node("TexCoord")
    k.link(place.outputs["Object"], node.inputs[0])
    return k.mix(node.outputs[1]), None


def ramp_of_noise(k):
    node, ramp = k.node("TexNoise", Scale=30.0, Detail=8.0), k.node("ValToRGB")
    k.link(node.outputs[0], ramp.inputs[0])
    stops = ramp.color_ramp.elements
    stops[0].position, stops[0].color = 0.45, RED
    stops[1].position, stops[1].color = 0.55, BLUE
    return ramp.outputs[0], None


def _cells(feature, **inputs):
    def build(k):
        node = k.node("TexVoronoi", Scale=60.0, **inputs)
        node.feature = feature
        return k.mix(node.outputs["Distance"]), None

    return build


def colours_of_cells(k):
    return k.node("TexVoronoi", Scale=60.0).outputs["Color"], None


def ramp_of_a_picture(k):
    node, ramp = k.texture(k.image()), k.node("ValToRGB")
    k.link(node.outputs[0], ramp.inputs[0])
    ramp.color_ramp.interpolation = "CONSTANT"
    stops = ramp.color_ramp.elements
    stops[0].color, stops[1].position, stops[1].color = RED, 0.2, BLUE
    return ramp.outputs[0], None


def generated_image(k):
    image = bpy.data.images.new("grid", 256, 256)
    image.generated_type = "COLOR_GRID"
    return k.texture(image).outputs[0], None


def packed_image(k):
    image = k.image()
    image.pack()
    Path(image.filepath).unlink()
    return k.texture(image).outputs[0], None


def missing_image(k):
    image = k.image()
    Path(image.filepath).unlink()
    return k.texture(image).outputs[0], None


def changed_colours(k):
    """A picture through nodes that change its colours."""
    colour = k.texture(k.image()).outputs[0]
    for kind, inputs in (
        ("HueSaturation", {"Hue": 0.7, "Saturation": 1.4, "Value": 0.8}),
        ("BrightContrast", {"Contrast": 0.3}),
        ("Gamma", {"Gamma": 1.7}),
        ("RGBCurve", {}),
    ):
        node = k.node(kind, **inputs)
        if kind == "RGBCurve":
            for curve, y in zip(node.mapping.curves, (0.6, 0.3, 0.5, 0.7), strict=True):
                curve.points.new(0.5, y)
            node.mapping.update()
        k.link(colour, node.inputs["Color"])
        colour = node.outputs[0]
    return colour, None


def _blended(blend):
    def build(k):
        one, other = k.texture(k.image()), k.texture(k.image(picture(5), name="other"))
        return k.mix(0.7, one.outputs[0], other.outputs[0], blend), None

    return build


def colour_of_object(k):
    bpy.context.object.color = RED
    return k.node("ObjectInfo").outputs["Color"], None


def reckoned(k):
    apart, scaled = k.node("SeparateColor"), k.node("Math")
    k.link(k.texture(k.image()).outputs[0], apart.inputs[0])
    scaled.operation = "MULTIPLY_ADD"
    scaled.inputs[1].default_value, scaled.inputs[2].default_value = 0.5, 0.2
    k.link(apart.outputs[0], scaled.inputs[0])
    held, ranged = k.node("Clamp", Min=0.25, Max=0.9), k.node("MapRange", From_Max=0.5, To_Min=0.9)
    k.link(scaled.outputs[0], held.inputs[0])
    k.link(apart.outputs[1], ranged.inputs[0])
    ranged.interpolation_type = "SMOOTHSTEP"
    joined, grey = k.node("CombineColor"), k.node("RGBToBW")
    k.link(k.texture(k.image(picture(3), name="other")).outputs[0], grey.inputs[0])
    for n, output in enumerate((held.outputs[0], ranged.outputs[0], grey.outputs[0])):
        k.link(output, joined.inputs[n])
    return joined.outputs[0], None


def turned_vectors(k):
    place, turn, scale = k.node("TexCoord"), k.node("VectorRotate", Angle=0.6), k.node("VectorMath")
    k.link(place.outputs["UV"], turn.inputs[0])
    scale.operation = "SCALE"
    scale.inputs["Scale"].default_value = 1.3
    k.link(turn.outputs[0], scale.inputs[0])
    node = k.texture(k.image(), extension="EXTEND")
    k.link(scale.outputs[0], node.inputs[0])
    inverted = k.node("Invert", Factor=0.7)
    k.link(node.outputs[0], inverted.inputs["Color"])
    return inverted.outputs[0], None


def muted(k):
    colour = k.texture(k.image()).outputs[0]
    node = k.node("Invert")
    k.link(colour, node.inputs["Color"])
    node.mute = True
    return node.outputs[0], None


def within_a_group(k):
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    for name, kind in (("A", "NodeSocketColor"), ("Share", "NodeSocketFloat")):
        group.interface.new_socket(name, in_out="INPUT", socket_type=kind)
    group.interface.new_socket("Colour", in_out="OUTPUT", socket_type="NodeSocketColor")
    start, end = (group.nodes.new(f"NodeGroup{x}") for x in ("Input", "Output"))
    inner = Kind(group, k.mesh, k.folder)
    group.links.new(inner.mix(start.outputs[1], start.outputs[0]), end.inputs[0])
    node = k.tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    k.link(k.texture(k.image()).outputs[0], node.inputs["A"])
    node.inputs["Share"].default_value = 0.3
    return node.outputs[0], None


KINDS = {
    kind.__name__: kind
    for kind in (
        quarter_of_an_atlas, tiled, udim, second_uv_map, uv_map_of_renders, uv_map_by_attribute,
        missing_uv_map, attribute_that_is_missing, colour_into_factor, leaf_atlas,
        leaf_without_its_alpha, alpha_clipped, sequence_at_frame_5, sequence_that_starts_later,
        mapped, by_object_coordinates, by_position, box_projection, checker, brick, waves, gradient,
        ramp_of_noise, colours_of_cells, ramp_of_a_picture, generated_image, packed_image,
        missing_image, changed_colours, colour_of_object, reckoned, turned_vectors, muted,
        within_a_group,
    )
} | {
    "cells": _cells("F1"),
    "cells_second": _cells("F2", Randomness=0.7),
    "cells_smooth": _cells("SMOOTH_F1"),
    "cells_edges": _cells("DISTANCE_TO_EDGE"),
    "beyond_mirror": _beyond("MIRROR"),
    "beyond_clip": _beyond("CLIP"),
    "beyond_extend": _beyond("EXTEND"),
    "colours_of_corners": _colours("CORNER", "BYTE_COLOR", named=True),
    "colours_of_points": _colours("POINT", "FLOAT_COLOR", named=True),
    "active_colours": _colours("CORNER", "BYTE_COLOR", named=False),
    "mixed_by_points": _mixed_by("POINT"),
    "mixed_by_faces": _mixed_by("FACE"),
    "non_colour": _space("Non-Color"),
    "float_linear": _space("Linear Rec.709", floats=True),
    "acescg": _space("ACEScg"),
    "float_acescg": _space("ACEScg", floats=True),
    "filmic": _space("Filmic sRGB"),
} | {f"blend_{name.lower()}": _blended(name) for name in (
    "MULTIPLY", "SCREEN", "OVERLAY", "DIFFERENCE", "LIGHTEN", "DODGE", "BURN", "SOFT_LIGHT",
    "HUE", "SATURATION", "COLOR", "VALUE",
)}  # fmt: skip
