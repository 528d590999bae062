"""Scenes whose layers are known: targets before a level camera."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import bpy
import numpy as np

from ._scenery import camera_at, new_file

DEPTH = 5.0
GREY, BLACK = (0.5, 0.5, 0.5), (0.0, 0.0, 0.0)
NEAR, FAR = "Near", "Far"
BEFORE = 0.02
"""Metres of water before the near camera."""
_ANGLE = 0.5  # degrees: in strongly absorbing bands a few degrees up are brighter already
_COLUMNS, _ROWS = 8, 6
_FILLED = 0.7  # of a cell


def paint() -> bpy.types.Material:
    """Return a matt material of the colour of its object: one shader for all."""
    material = bpy.data.materials.new("paint")
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = (
        tree.nodes.new(kind) for kind in ("ShaderNodeBsdfDiffuse", "ShaderNodeOutputMaterial")
    )
    colour = tree.nodes.new("ShaderNodeObjectInfo").outputs["Color"]
    tree.links.new(colour, shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def square(
    name: str, place: Iterable[float], size: float, colour: Iterable[float],
    material: bpy.types.Material, turn: Iterable[float] = (math.pi / 2, 0.0, 0.0),
) -> bpy.types.Object:  # fmt: skip
    """Add a square that faces -y, or is turned otherwise."""
    half = size / 2
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, 0.0) for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    item.location, item.rotation_euler = tuple(place), tuple(turn)
    item.color = (*colour, 1.0)
    bpy.context.scene.collection.objects.link(item)
    return item


def _camera(name: str, place: Sequence[float]) -> bpy.types.Object:
    return camera_at(place, (math.pi / 2, 0.0, 0.0), math.radians(_ANGLE), name)


def targets(path: Path, ranges: Iterable[float], size: tuple[int, int] = (96, 72)) -> str:
    """Write a scene of black and grey squares, a pair at each range, all but level.

    The nearest lie in the outer rows. Another camera is :data:`BEFORE` the middle grey one.
    Returns the name of that square.
    """
    scene = new_file(size)
    seen = _camera(FAR, (0.0, 0.0, -DEPTH))
    material, distances = paint(), list(ranges)
    rows = sorted(range(_ROWS), key=lambda row: -abs(row + 0.5 - _ROWS / 2))
    tangent = math.tan(math.radians(_ANGLE) / 2)
    middle = f"grey {len(distances) // 2:02d}"
    cell = 2 * tangent / _COLUMNS
    for number, z in enumerate(distances):
        for place, (kind, colour) in enumerate((("black", BLACK), ("grey", GREY))):
            index = 2 * number + place
            across = (index % _COLUMNS + 0.5) * cell - tangent
            up = (rows[index // _COLUMNS] + 0.5 - _ROWS / 2) * cell
            ray = np.array([across, 1.0, up])
            name = f"{kind} {number:02d}"
            at = ray / np.linalg.norm(ray) * z + (0.0, 0.0, -DEPTH)
            square(name, at.tolist(), _FILLED * cell * z, colour, material)
            if name == middle:
                _camera(NEAR, (at - (0.0, BEFORE, 0.0)).tolist())
    scene.camera = seen
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return middle
