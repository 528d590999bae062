"""A tiled basin as laboratories test cameras in: lane lines, targets in a row, a ladder.

The camera looks along +y from 1.3 m depth. The targets stand 2, 4, 6, 8 and 10 m from it.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..parts.builder import Builder
from ..parts.cameras import camera
from ..parts.detail import Detail
from ..parts.materials import Painter, Rgb
from ..parts.shapes import box, icosphere, joined, place, to_mesh, tube
from ..reef import color_checker

HALF_WIDTH, LENGTH, DEPTH = 3.0, 14.0, 2.5
BACK = -2.0
"""Where the wall behind the camera stands."""
EYE = 1.3
"""Depth of the camera."""
DISTANCES = (2.0, 4.0, 6.0, 8.0, 10.0)
_TILE = 0.15
_COLOURS: tuple[Rgb, ...] = (
    (0.70, 0.05, 0.04), (0.85, 0.40, 0.04), (0.80, 0.70, 0.08), (0.10, 0.45, 0.12), (0.80,) * 3,
)  # fmt: skip
_RADIUS = 0.22
_THICK = 0.2


class Pool(Builder):
    """Builds the tank, part by part."""

    def __init__(self, seed: int, detail: Detail) -> None:
        super().__init__(seed, detail, lambda x, _: np.full(np.shape(x), -DEPTH))

    def build(self) -> None:
        """Fill the scene."""
        self.tile_basin()
        self.set_targets()
        self.hang_ladder()
        main = camera("Pool", (0.6, 0.0, -EYE), (-0.1, 6.0, -1.75), 24.0)
        camera("Up", (0.0, 3.0, -2.3), (0.2, 5.5, -0.2), 18.0)
        bpy.context.scene.camera = main

    def tile_basin(self) -> None:
        """Lay floor and walls, and three dark lines."""
        basin = self.collection("Basin")
        length, middle = LENGTH - BACK, (LENGTH + BACK) / 2
        wide = 2 * HALF_WIDTH
        floor = box((wide, length, _THICK), (0, middle, -DEPTH - _THICK / 2))
        sides = [
            box((_THICK, length, DEPTH), (s * (HALF_WIDTH + _THICK / 2), middle, -DEPTH / 2))
            for s in (-1, 1)
        ]
        ends = [
            box((wide, _THICK, DEPTH), (0, y, -DEPTH / 2))
            for y in (BACK - _THICK / 2, LENGTH + _THICK / 2)
        ]
        tiles = [self.tiles("Tiles", (0.72, 0.76, 0.74))]
        place(to_mesh(joined([floor, *sides, *ends]), "Basin", tiles, False), basin)
        lines = [
            box((0.25, length - 2.0, 0.004), (x, middle, -DEPTH + 0.002)) for x in (-2.0, 0.0, 2.0)
        ]
        dark = [self.tiles("Lane tiles", (0.02, 0.035, 0.08))]
        place(to_mesh(joined(lines), "Lane lines", dark, False), basin)

    def tiles(self, name: str, color: Rgb) -> bpy.types.Material:
        """Glazed tiles with pale joints, no two quite alike."""
        p = Painter(name, color, Roughness=0.25)
        bricks = p.node("ShaderNodeTexBrick", offset=0.0)
        for key, value in (("Scale", 1.0), ("Mortar Size", 0.004), ("Bias", 0.0)):
            bricks.inputs[key].default_value = value
        bricks.inputs["Brick Width"].default_value = _TILE
        bricks.inputs["Row Height"].default_value = _TILE
        bricks.inputs["Color1"].default_value = (*color, 1.0)
        bricks.inputs["Color2"].default_value = (*(0.88 * c for c in color), 1.0)
        bricks.inputs["Mortar"].default_value = (0.45, 0.46, 0.44, 1.0)
        # The bricks lie in the plane of the first two coordinates: walls take their height.
        split = p.node("ShaderNodeSeparateXYZ")
        p.link(p.coordinates("Object"), split.inputs[0])
        side = p.node("ShaderNodeVectorMath", operation="ABSOLUTE")
        p.link(p.node("ShaderNodeNewGeometry").outputs["Normal"], side.inputs[0])
        facing = p.node("ShaderNodeSeparateXYZ")
        p.link(side.outputs[0], facing.inputs[0])
        x, y, z = split.outputs
        across = p.node("ShaderNodeMix")
        p.link(facing.outputs[0], across.inputs["Factor"])
        p.link(x, across.inputs[2])
        p.link(y, across.inputs[3])
        up = p.node("ShaderNodeMix")
        p.link(facing.outputs[2], up.inputs["Factor"])
        p.link(z, up.inputs[2])
        p.link(y, up.inputs[3])
        flat = p.node("ShaderNodeCombineXYZ")
        p.link(across.outputs[0], flat.inputs[0])
        p.link(up.outputs[0], flat.inputs[1])
        p.link(flat.outputs[0], bricks.inputs["Vector"])
        p.set("Base Color", bricks.outputs["Color"])
        return p.material

    def set_targets(self) -> None:
        """Stand a coloured ball on a rod at each distance, and the checker by the first."""
        objects = self.collection("Targets")
        ball = icosphere(self.detail.level(5))
        for index, (distance, color) in enumerate(zip(DISTANCES, _COLOURS, strict=True)):
            x, z = -1.5 + 0.55 * index, -1.65
            skin = Painter(f"Target {distance:g} m", color, Roughness=0.6).material
            rod = tube([(x, distance, -DEPTH), (x, distance, z)], 0.015, 6).with_material(1)
            shape = joined([ball.moved((x, distance, z), scale=_RADIUS), rod])
            place(
                to_mesh(shape, f"Target {distance:g} m", [skin, self.materials.aluminium]), objects
            )
        board = color_checker.color_checker(self.materials)
        place(board, objects, (0.95, 2.6, -DEPTH + 0.16), name="ColorChecker board")

    def hang_ladder(self) -> None:
        """Hang a ladder on the right wall."""
        x, y = HALF_WIDTH - 0.15, 5.0
        rails = [tube([(x, y + s, -1.9), (x, y + s, 0.5)], 0.022, 8) for s in (-0.25, 0.25)]
        rungs = [
            tube([(x, y - 0.25, z), (x, y + 0.25, z)], 0.018, 8)
            for z in (-1.7, -1.35, -1.0, -0.65, -0.3)
        ]
        steel = Painter("Steel", (0.6, 0.6, 0.6), Metallic=1.0, Roughness=0.25).material
        place(to_mesh(joined([*rails, *rungs]), "Ladder", [steel]), self.collection("Basin"))
