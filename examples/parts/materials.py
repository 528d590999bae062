"""Materials: Principled BSDFs with image and procedural textures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import bpy

from . import textures
from .detail import Detail

Rgb = tuple[float, float, float]
Socket = bpy.types.NodeSocket


class Painter:
    """A new material and the few nodes the scene is painted with."""

    def __init__(self, name: str, color: Rgb = (0.5, 0.5, 0.5), **inputs: float) -> None:
        self.material = bpy.data.materials.new(name)
        self.tree = self.material.node_tree
        self.shader = next(n for n in self.tree.nodes if n.type == "BSDF_PRINCIPLED")
        self.shader.inputs["Base Color"].default_value = (*color, 1.0)
        for key, value in {"Roughness": 0.8, **inputs}.items():
            self.shader.inputs[key].default_value = value

    def node(self, kind: str, **properties: object) -> bpy.types.Node:
        """Add a node with properties set."""
        node = self.tree.nodes.new(kind)
        for key, value in properties.items():
            setattr(node, key, value)
        return node

    def link(self, source: Socket, target: Socket) -> None:
        """Connect two sockets."""
        self.tree.links.new(source, target)

    def set(self, name: str, source: Socket) -> None:
        """Feed an input of the Principled BSDF."""
        self.link(source, self.shader.inputs[name])

    def attribute(self, name: str, output: str = "Fac") -> Socket:
        """Read a vertex attribute."""
        return self.node("ShaderNodeAttribute", attribute_name=name).outputs[output]

    def coordinates(
        self, output: str = "Object", scale: float | tuple[float, float, float] = 1.0
    ) -> Socket:
        """Texture coordinates, scaled."""
        source = self.node("ShaderNodeTexCoord").outputs[output]
        mapping = self.node("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = scale if isinstance(scale, tuple) else (scale,) * 3
        self.link(source, mapping.inputs["Vector"])
        return mapping.outputs["Vector"]

    def noise(
        self,
        scale: float,
        low: float,
        high: float,
        detail: float = 3.0,
        stretch: tuple[float, float, float] = (1.0, 1.0, 1.0),
    ) -> Socket:
        """Noise in object space; values from low to high become 0 to 1."""
        noise = self.node("ShaderNodeTexNoise")
        noise.inputs["Scale"].default_value = scale
        noise.inputs["Detail"].default_value = detail
        self.link(self.coordinates(scale=stretch), noise.inputs["Vector"])
        return self.ramp(noise.outputs[0], low, high)

    def ramp(self, source: Socket, low: float, high: float) -> Socket:
        """Map low … high to 0 … 1, clamped."""
        node = self.node("ShaderNodeMapRange")
        node.inputs["From Min"].default_value = low
        node.inputs["From Max"].default_value = high
        self.link(source, node.inputs["Value"])
        return node.outputs["Result"]

    def mix(
        self, factor: Socket | float, a: Socket | Rgb, b: Socket | Rgb, blend: str = "MIX"
    ) -> Socket:
        """Mix two colours."""
        node = self.node("ShaderNodeMix", data_type="RGBA", blend_type=blend)
        for index, value in ((0, factor), (6, a), (7, b)):
            target = node.inputs[index]
            if isinstance(value, Socket):
                self.link(value, target)
            else:
                target.default_value = (*value, 1.0) if index else value
        return node.outputs[2]

    def bump(self, source: Socket, distance: float) -> None:
        """Bump the surface by a height texture, m."""
        node = self.node("ShaderNodeBump")
        node.inputs["Strength"].default_value = 0.8
        node.inputs["Distance"].default_value = distance
        self.link(source, node.inputs["Height"])
        self.set("Normal", node.outputs["Normal"])

    def image(self, image: bpy.types.Image, vector: Socket, projection: str = "FLAT") -> Socket:
        """Look an image up."""
        node = self.node("ShaderNodeTexImage", image=image, projection=projection)
        node.projection_blend = 0.3
        self.link(vector, node.inputs["Vector"])
        return node.outputs["Color"]


@dataclass(frozen=True)
class Materials:
    """The scene's materials, each made when first asked for."""

    seed: int
    detail: Detail

    @cached_property
    def sand(self) -> bpy.types.Material:
        """Carbonate sand: an image of grains, and stains of noise."""
        p = Painter("Sand", Roughness=0.95, **{"Specular IOR Level": 0.2})
        grain = p.image(
            textures.sand_grain(self.seed, self.detail.image_size), p.coordinates("UV", 1 / 0.9)
        )
        stained = p.mix(p.noise(0.55, 0.45, 0.75), grain, (0.80, 0.76, 0.66), "MULTIPLY")
        p.set("Base Color", stained)
        p.bump(grain, 0.004)
        return p.material

    @cached_property
    def rock(self) -> bpy.types.Material:
        """Reef rock under turf algae, with crusts of coralline algae and sponge."""
        p = Painter("Reef rock", Roughness=0.92, **{"Specular IOR Level": 0.25})
        base = p.mix(p.noise(5.0, 0.35, 0.68), (0.085, 0.065, 0.045), (0.25, 0.20, 0.14))
        turf = p.mix(p.noise(1.6, 0.50, 0.62), base, (0.13, 0.13, 0.045))
        crust = p.mix(p.noise(3.4, 0.555, 0.66, 10.0), turf, (0.30, 0.11, 0.14))
        spots = p.mix(p.noise(5.5, 0.645, 0.70, 8.0), crust, (0.42, 0.20, 0.05))
        p.set("Base Color", spots)
        p.bump(p.noise(14.0, 0.2, 0.8, 8.0), 0.05)
        return p.material

    @cached_property
    def limestone(self) -> bpy.types.Material:
        """Limestone: turf in the light; bare rock and crusts of sponge in the cave ("inside")."""
        p = Painter("Limestone", Roughness=0.93, **{"Specular IOR Level": 0.2})
        bare = p.mix(p.noise(1.3, 0.35, 0.68, 8.0), (0.22, 0.18, 0.14), (0.44, 0.39, 0.31))
        sponge = p.mix(p.noise(2.1, 0.62, 0.66, 8.0), bare, (0.36, 0.14, 0.06))
        dim = p.mix(p.noise(2.7, 0.62, 0.67, 10.0), sponge, (0.30, 0.13, 0.16))
        old = p.mix(p.noise(4.0, 0.35, 0.68, 6.0), (0.085, 0.07, 0.05), (0.25, 0.21, 0.15))
        turf = p.mix(p.noise(1.1, 0.45, 0.60, 6.0), old, (0.12, 0.13, 0.045))
        lit = p.mix(p.noise(2.3, 0.57, 0.66, 10.0), turf, (0.30, 0.12, 0.15))
        p.set("Base Color", p.mix(p.attribute("inside"), lit, dim))
        p.bump(p.noise(9.0, 0.2, 0.8, 10.0), 0.06)
        return p.material

    def branching(self, name: str, body: Rgb, tip: Rgb) -> bpy.types.Material:
        """Branching coral, paler where it grows (attribute "tip")."""
        p = Painter(name, Roughness=0.75, **{"Specular IOR Level": 0.3})
        occlusion = tuple(0.62 * c for c in body)
        skin = p.mix(p.noise(9.0, 0.35, 0.65), occlusion, body)
        p.set("Base Color", p.mix(p.attribute("tip"), skin, tip))
        p.bump(p.noise(160.0, 0.3, 0.7, 1.0), 0.003)
        return p.material

    def grooved(self, name: str, ridge: Rgb, groove: Rgb) -> bpy.types.Material:
        """Brain coral, another colour in the grooves (attribute "groove")."""
        p = Painter(name, Roughness=0.7, **{"Specular IOR Level": 0.35})
        skin = p.mix(p.noise(3.0, 0.35, 0.7), tuple(0.7 * c for c in ridge), ridge)
        p.set("Base Color", p.mix(p.ramp(p.attribute("groove"), 0.25, 0.8), skin, groove))
        return p.material

    @cached_property
    def massive(self) -> bpy.types.Material:
        """Massive coral: an image of polyps from six sides."""
        p = Painter("Porites", Roughness=0.8, **{"Specular IOR Level": 0.3})
        image = textures.coral_polyps(self.seed, self.detail.image_size)
        polyps = p.image(image, p.coordinates("Object", 3.2), "BOX")
        p.set("Base Color", p.mix(p.noise(2.5, 0.4, 0.7), polyps, (0.85, 0.95, 0.55), "MULTIPLY"))
        p.bump(polyps, 0.006)
        return p.material

    def plain(
        self, name: str, color: Rgb, mottle: float = 0.5, **inputs: float
    ) -> bpy.types.Material:
        """One colour, mottled by noise."""
        p = Painter(name, color, **inputs)
        dark = tuple((1 - mottle) * c for c in color)
        p.set("Base Color", p.mix(p.noise(18.0, 0.35, 0.65), dark, color))
        return p.material

    def hollow(self, name: str, color: Rgb) -> bpy.types.Material:
        """Tube sponge, dark inside (attribute "inside")."""
        p = Painter(name, color, Roughness=0.9, **{"Specular IOR Level": 0.1})
        skin = p.mix(p.noise(25.0, 0.35, 0.65), tuple(0.65 * c for c in color), color)
        p.set("Base Color", p.mix(p.attribute("inside"), skin, tuple(0.12 * c for c in color)))
        p.bump(p.noise(60.0, 0.3, 0.7), 0.01)
        return p.material

    @cached_property
    def fish(self) -> bpy.types.Material:
        """Scales in the colours of the species (attribute "scale_color")."""
        p = Painter("Fish scales", Roughness=0.38)
        p.set("Base Color", p.attribute("scale_color", "Color"))
        return p.material

    @cached_property
    def eye(self) -> bpy.types.Material:
        """Black and wet."""
        return Painter("Fish eye", (0.008, 0.008, 0.008), Roughness=0.08).material

    @cached_property
    def iron(self) -> bpy.types.Material:
        """Old iron: bare metal, rust brown, rough."""
        p = Painter("Rusted iron", Metallic=1.0)
        p.set(
            "Base Color",
            p.mix(p.noise(7.0, 0.40, 0.62, 6.0), (0.34, 0.31, 0.28), (0.24, 0.10, 0.04)),
        )
        p.set("Roughness", p.noise(7.0, -0.6, 0.9, 6.0))
        p.bump(p.noise(22.0, 0.2, 0.8, 6.0), 0.012)
        return p.material

    @cached_property
    def rust(self) -> bpy.types.Material:
        """Steel plates that have rusted for decades: flakes, streaks, turf, and crusts of lime."""
        p = Painter("Rust", Roughness=0.93, **{"Specular IOR Level": 0.2})
        flakes = p.mix(p.noise(3.5, 0.35, 0.66, 8.0), (0.075, 0.038, 0.024), (0.25, 0.10, 0.05))
        streaks = p.noise(1.6, 0.52, 0.68, 6.0, (2.2, 2.2, 0.35))
        rust = p.mix(streaks, flakes, (0.34, 0.14, 0.05))
        turf = p.mix(p.noise(0.45, 0.46, 0.66, 10.0), rust, (0.13, 0.125, 0.055))
        lime = p.mix(p.noise(2.6, 0.62, 0.67, 12.0), turf, (0.42, 0.36, 0.28))
        pink = p.mix(p.noise(3.7, 0.64, 0.69, 10.0), lime, (0.30, 0.12, 0.14))
        p.set("Base Color", pink)
        p.bump(p.noise(8.0, 0.2, 0.8, 10.0), 0.04)
        return p.material

    @cached_property
    def old_paint(self) -> bpy.types.Material:
        """What was white paint, over rust."""
        p = Painter("Old paint", Roughness=0.85, **{"Specular IOR Level": 0.25})
        rust = p.mix(p.noise(4.0, 0.35, 0.66, 8.0), (0.09, 0.045, 0.028), (0.27, 0.11, 0.05))
        paint = p.mix(p.noise(1.4, 0.40, 0.56, 8.0), (0.40, 0.39, 0.34), rust)
        turf = p.mix(p.noise(1.0, 0.52, 0.66, 8.0), paint, (0.14, 0.135, 0.06))
        p.set("Base Color", turf)
        p.bump(p.noise(8.0, 0.2, 0.8, 10.0), 0.02)
        return p.material

    @cached_property
    def planks(self) -> bpy.types.Material:
        """Waterlogged planks along the first axis of "uv", 17 cm wide."""
        p = Painter("Planks", Roughness=0.9, **{"Specular IOR Level": 0.2})
        seams = p.node("ShaderNodeTexWave", bands_direction="Y")
        # A wave of scale 1 is 2π/20 m long.
        seams.inputs["Scale"].default_value = 2 * math.pi / 20 / 0.17
        p.link(p.coordinates("UV"), seams.inputs["Vector"])
        grain = p.noise(5.0, 0.3, 0.7, 6.0, (0.15, 1.6, 1.6))
        wood = p.mix(grain, (0.075, 0.05, 0.032), (0.22, 0.155, 0.10))
        turf = p.mix(p.noise(1.2, 0.50, 0.64, 8.0), wood, (0.16, 0.15, 0.075))
        seam = p.ramp(seams.outputs["Fac"], 0.0, 0.10)
        p.set("Base Color", p.mix(seam, (0.018, 0.014, 0.010), turf))
        p.bump(seam, 0.012)
        return p.material

    @cached_property
    def aluminium(self) -> bpy.types.Material:
        """Anodised metal of the lamp and the checker's stand."""
        return Painter("Aluminium", (0.42, 0.43, 0.45), Metallic=1.0, Roughness=0.35).material

    @cached_property
    def bulb(self) -> bpy.types.Material:
        """Glowing bulb of the dive lamp."""
        p = Painter("Lamp bulb", (0.8, 0.8, 0.8), Roughness=0.3)
        p.shader.inputs["Emission Color"].default_value = (1.0, 0.80, 0.55, 1.0)
        p.shader.inputs["Emission Strength"].default_value = 12.0
        return p.material

    @cached_property
    def glass(self) -> bpy.types.Material:
        """Bottle-green glass of the fishing float."""
        p = Painter("Green glass", (0.55, 0.85, 0.66), Roughness=0.02, IOR=1.14)
        p.shader.inputs["Transmission Weight"].default_value = 1.0
        return p.material

    @cached_property
    def rope(self) -> bpy.types.Material:
        """Weathered hemp."""
        return self.plain("Rope", (0.30, 0.22, 0.11), Roughness=0.95)
