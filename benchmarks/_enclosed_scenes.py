"""Enclosed places on sand, of solids, sheets and planks, with small openings."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np

from ._occlusion_scenes import turned
from ._scenery import ball, block, ground, look_at, matt, post

_SAND, _WALL, _WOOD = (0.35, 0.32, 0.26), (0.4, 0.38, 0.33), (0.3, 0.2, 0.11)
_STEEL, _ROCK, _RED = (0.3, 0.33, 0.3), (0.25, 0.25, 0.23), (0.5, 0.12, 0.08)
_DEPTH = 9.0

type _Range = tuple[float, float]


def house(room: str) -> bpy.types.Object:
    """Fill a file with a house of rooms A to C, 4 × 3 × 2.8 m, and stand in one of them.

    Two doors, a window each in A and C, a hole of 1.2 × 1 m in B's roof, walls of .2 m.
    """
    t, high = 0.2, 2.8
    _wall("front", (-t, 12 + t), (-t, 0.0), (0.0, high), across=(1.4, 2.6), up=(0.9, 1.9))
    _wall("back", (-t, 12 + t), (3.0, 3 + t), (0.0, high))
    _wall("west", (-t, 0.0), (0.0, 3.0), (0.0, high))
    _wall("east", (12.0, 12 + t), (0.0, 3.0), (0.0, high), across=(0.9, 2.1), up=(0.9, 1.9))
    for name, x, door in (("AB", 4.0, (0.4, 1.3)), ("BC", 8.0, (1.7, 2.6))):
        _wall(name, (x - t / 2, x + t / 2), (0.0, 3.0), (0.0, high), across=door, up=(0.0, 2.0))
    _roof("roof", (-t, 12 + t), (-t, 3 + t), (high, high + t), (5.4, 6.6), (1.0, 2.0))
    block("table", (6.9, 2.3, 0.7 - _DEPTH), (1.2, 0.7, 0.06), _WOOD)
    ball((6.9, 2.3, 0.93 - _DEPTH), 0.2, _RED)
    block("chest", (3.2, 2.6, 0.3 - _DEPTH), (0.9, 0.5, 0.6), _WOOD)
    block("shelf", (10.0, 2.75, 1.2 - _DEPTH), (1.6, 0.4, 0.05), _RED)
    ground(-_DEPTH, _SAND)
    at, to = {
        "A": ((0.4, 0.5, 1.6), (4.0, 2.2, 1.1)),
        "B": ((4.5, 2.5, 1.6), (8.0, 0.9, 0.9)),
        "C": ((8.4, 0.4, 1.6), (12.0, 2.2, 1.2)),
    }[room]
    return _look(at, to)


def cabin() -> bpy.types.Object:
    """Fill a file with a steel cabin of 3 m, sheets of 2 cm, a door, and four portholes of .5 m."""
    t, high = 0.02, 2.4
    for name, (x, y) in {"west": (0.0, 1.5), "east": (3.0, 1.5), "north": (1.5, 3.0)}.items():
        size = (t, 3.0, high) if name != "north" else (3.0, t, high)
        block(name, (x, y, high / 2 - _DEPTH), size, _STEEL)
        wall = bpy.context.object
        for offset in (-0.8, 0.8) if name == "west" else (0.0,):
            _port(wall, (x, y + offset, 1.5 - _DEPTH), 0.25, along="Y" if name == "north" else "X")
    _wall("south", (0.0, 3.0), (-t, 0.0), (0.0, high), (0.3, 1.0), (0.0, 1.9), _STEEL)
    block("top", (1.5, 1.5, high - _DEPTH), (3.0, 3.0, t), _STEEL)
    block("bunk", (2.6, 1.6, 0.5 - _DEPTH), (0.7, 2.0, 0.1), _WOOD)
    ball((1.2, 2.3, 0.3 - _DEPTH), 0.3, _RED)
    ground(-_DEPTH, _SAND)
    return _look((0.35, 0.3, 1.5), (2.5, 2.6, 1.0))


def pipe() -> bpy.types.Object:
    """Fill a file with a pipe without thickness, 2 m wide and 14 m long, and stand in it."""
    bpy.ops.mesh.primitive_cylinder_add(
        radius=1.0, depth=14.0, vertices=48, end_fill_type="NOTHING",
        location=(0.0, 7.0, 0.7 - _DEPTH), rotation=(math.pi / 2, 0.0, 0.0),
    )  # fmt: skip
    bpy.context.object.data.materials.append(matt(_STEEL))
    ball((0.3, 5.5, 0.2 - _DEPTH), 0.2, _RED)
    ground(-_DEPTH, _SAND)
    return _look((0.1, 3.0, 0.9), (0.0, 9.0, 0.6))


def grotto() -> bpy.types.Object:
    """Fill a file with a rock that is hollow, with a mouth and a chimney, both crooked."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=1.0)
    rock = bpy.context.object
    rock.data.materials.append(matt(_ROCK))
    rock.scale, rock.location.z = (6.0, 6.0, 5.0), -_DEPTH
    _crumpled(rock, 0.06, 3)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=1.0)
    hollow = bpy.context.object
    hollow.scale, hollow.location = (3.2, 3.4, 2.6), (0.0, 0.0, 0.3 - _DEPTH)
    _crumpled(hollow, 0.09, 5)
    _cut(rock, hollow)
    for at, radius, turn in (
        ((0.4, -4.5, 1.0 - _DEPTH), 1.0, (math.radians(84.0), 0.0, 0.1)),
        ((-0.8, 0.9, 4.0 - _DEPTH), 0.6, (math.radians(12.0), math.radians(8.0), 0.0)),
    ):
        bpy.ops.mesh.primitive_cylinder_add(
            radius=radius, depth=5.0, vertices=24, location=at, rotation=turn
        )
        _cut(rock, bpy.context.object)
    ball((0.9, 1.4, 0.4 - _DEPTH), 0.4, _RED)
    ground(-_DEPTH, _SAND)
    return _look((1.3, -1.7, 1.2), (-0.7, 1.6, 1.0))


def shed() -> bpy.types.Object:
    """Fill a file with a shed of planks .2 m wide, 3 cm apart, with an open door."""
    for k in range(int(3.0 / 0.23)):
        at, high = 0.1 + 0.23 * k, 2.2
        for x in (0.0, 3.0):
            block(f"side {x} {k}", (x, at, high / 2 - _DEPTH), (0.03, 0.2, high), _WOOD)
        block(f"back {k}", (at, 3.0, high / 2 - _DEPTH), (0.2, 0.03, high), _WOOD)
        block(f"roof {k}", (at, 1.5, high - _DEPTH), (0.2, 3.0, 0.03), _WOOD)
    for k, at in enumerate(np.arange(1.2, 3.0, 0.23)):
        block(f"front {k}", (at, 0.0, high / 2 - _DEPTH), (0.2, 0.03, high), _WOOD)
    block("bench", (2.5, 1.8, 0.45 - _DEPTH), (0.5, 1.6, 0.05), _RED)
    ground(-_DEPTH, _SAND)
    return _look((0.5, 0.4, 1.5), (2.4, 2.5, 0.9))


def container() -> bpy.types.Object:
    """Fill a file with a steel container of 6 m that lies turned, a leaf of its door open."""
    origin, turn, t = (1.0, 2.0, -_DEPTH), 27.0, 0.03
    for name, at, size, colour in (
        ("left", (-1.2, 0.0, 1.3), (t, 6.0, 2.6), _RED),
        ("right", (1.2, 0.0, 1.3), (t, 6.0, 2.6), _RED),
        ("top", (0.0, 0.0, 2.6), (2.4, 6.0, t), _STEEL),
        ("end", (0.0, 3.0, 1.3), (2.4, t, 2.6), _STEEL),
        ("leaf", (-0.6, -3.0, 1.3), (1.2, t, 2.6), _STEEL),
        ("crate", (0.5, 1.6, 0.45), (0.9, 0.9, 0.9), _WOOD),
    ):
        block(name, turned(at, turn, origin), size, colour, turn)
    ground(-_DEPTH, _SAND)
    at, to = ((0.9, -2.4, 1.6), (-0.4, 2.8, 1.0))
    return look_at(turned(at, turn, origin), turned(to, turn, origin))


def vault() -> bpy.types.Object:
    """Fill a file with a hall of 6 m whose dome has an eye of 1 m, on eight piers, walls between.

    Two of the eight walls are open to half their height.
    """
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=3.4, segments=48, ring_count=24, location=(0.0, 0.0, 2.0 - _DEPTH)
    )
    dome = bpy.context.object
    dome.data.materials.append(matt(_WALL))
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=3.0, segments=48, ring_count=24, location=(0.0, 0.0, 2.0 - _DEPTH)
    )
    _cut(dome, bpy.context.object)
    block("below", (0.0, 0.0, 0.0 - _DEPTH), (8.0, 8.0, 4.0), _WALL)
    _cut(dome, bpy.context.object)
    _port(dome, (0.0, 0.0, 5.2 - _DEPTH), 0.5, along="Z")
    for k in range(8):
        angle = math.pi / 4 * k
        at = (3.2 * math.cos(angle), 3.2 * math.sin(angle), 1.0 - _DEPTH)
        post(at, 0.3, 2.0, _WALL)
        middle, low = angle + math.pi / 8, 1.0 if k in (1, 5) else 0.0
        side = (2.96 * math.cos(middle), 2.96 * math.sin(middle), 1.0 + low / 2 - _DEPTH)
        block(f"wall {k}", side, (0.25, 2.5, 2.0 - low), _WALL, math.degrees(middle))
    ball((-1.0, 0.8, 0.5 - _DEPTH), 0.5, _RED)
    ground(-_DEPTH, _SAND)
    return _look((1.8, -1.6, 1.5), (-1.2, 1.4, 1.6))


def hold() -> bpy.types.Object:
    """Fill a file with a ship's hold of 8 × 4 × 3 m, with two small hatches, tilted by 20°."""
    t = 0.1
    _roof("deck", (-4.0, 4.0), (-2.0, 2.0), (3.0, 3.0 + t), (-2.6, -1.6), (-0.5, 0.5))
    _roof("floor", (-4.0, 4.0), (-2.0, 2.0), (-t, 0.0), (0.0, 0.0), (0.0, 0.0))
    for y in (-2.0, 2.0 - t):
        up = (1.2, 2.1) if y < 0 else (1.0, 1.0)
        _wall(f"side {y}", (-4.0, 4.0), (y, y + t), (0.0, 3.0), (5.6, 6.4), up, _STEEL)
    for x in (-4.0, 4.0 - t):
        _wall(f"bulkhead {x}", (x, x + t), (-2.0, 2.0), (0.0, 3.0), (1.0, 1.0), colour=_STEEL)
    for k, at in enumerate([(1.6, 1.0, 0.4), (2.2, -0.6, 0.4), (-0.6, 1.2, 0.4)]):
        block(f"box {k}", (*at[:2], at[2] - _DEPTH), (0.8, 0.8, 0.8), _WOOD)
    camera = _look((-3.3, -1.2, 1.7), (2.0, 0.4, 1.0))
    root = bpy.data.objects.new("ship", None)
    root.location.z = -_DEPTH
    scene = bpy.context.scene
    scene.collection.objects.link(root)
    bpy.context.view_layer.update()
    for item in [x for x in scene.objects if x is not root]:
        item.parent, item.matrix_parent_inverse = root, root.matrix_world.inverted()
    root.rotation_euler = (math.radians(20.0), 0.0, math.radians(35.0))
    root.location.z += 0.8
    ground(-_DEPTH, _SAND)
    return camera


def _look(at: Sequence[float], to: Sequence[float]) -> bpy.types.Object:
    return look_at((*at[:2], at[2] - _DEPTH), (*to[:2], to[2] - _DEPTH), math.radians(80.0))


def _slab(name: str, x: _Range, y: _Range, z: _Range, colour: Sequence[float]) -> None:
    ranges = np.array([x, y, z])
    size = ranges[:, 1] - ranges[:, 0]
    if np.all(size > 0.0):
        block(name, ranges.mean(axis=1) - (0.0, 0.0, _DEPTH), size, colour)


def _wall(
    name: str, x: _Range, y: _Range, z: _Range, across: _Range = (1.0, 1.0),
    up: _Range = (1.0, 1.0), colour: Sequence[float] = _WALL,
) -> None:  # fmt: skip
    """Add an upright wall with an opening, told from its own lower corner."""
    along = 0 if x[1] - x[0] > y[1] - y[0] else 1
    start = (x, y)[along][0]
    left, right = across[0] + start, across[1] + start
    low, high = up[0] + z[0], up[1] + z[0]
    ends = ((x, y)[along][0], left), (left, right), (right, (x, y)[along][1])
    for number, end in enumerate(ends):
        xy = (end, y) if along == 0 else (x, end)
        for part in ((z[0], low), (high, z[1])) if number == 1 else (z,):
            _slab(f"{name} {number}", *xy, part, colour)


def _roof(name: str, x: _Range, y: _Range, z: _Range, hole_x: _Range, hole_y: _Range) -> None:
    for part_x, part_y in (
        ((x[0], hole_x[0]), y), ((hole_x[1], x[1]), y),
        (hole_x, (y[0], hole_y[0])), (hole_x, (hole_y[1], y[1])),
    ):  # fmt: skip
        _slab(name, part_x, part_y, z, _WALL)


def _port(wall: bpy.types.Object, at: Sequence[float], radius: float, along: str) -> None:
    turn = {"X": (0.0, math.pi / 2, 0.0), "Y": (math.pi / 2, 0.0, 0.0), "Z": (0.0, 0.0, 0.0)}
    bpy.ops.mesh.primitive_cylinder_add(
        radius=radius, depth=2.0, vertices=32, location=at, rotation=turn[along]
    )
    _cut(wall, bpy.context.object)


def _cut(solid: bpy.types.Object, cutter: bpy.types.Object) -> None:
    """Take a solid from another."""
    change = solid.modifiers.new("cut", "BOOLEAN")
    change.operation, change.object = "DIFFERENCE", cutter
    bpy.context.view_layer.update()
    with bpy.context.temp_override(object=solid, active_object=solid):
        bpy.ops.object.modifier_apply(modifier=change.name)
    bpy.data.objects.remove(cutter)


def _crumpled(item: bpy.types.Object, by: float, seed: int) -> None:
    """Move a ball's vertices along their ways by smooth noise, as a share of the radius."""
    random = np.random.default_rng(seed)
    waves, phases = random.normal(0.0, 3.0, (12, 3)), random.uniform(0.0, 6.28, 12)
    mesh = item.data
    at = np.empty(3 * len(mesh.vertices))
    mesh.vertices.foreach_get("co", at)
    at = at.reshape(-1, 3)
    rough = np.sin(at @ waves.T + phases).sum(axis=1) / math.sqrt(6.0)
    mesh.vertices.foreach_set("co", (at * (1.0 + by * rough)[:, None]).ravel())
    mesh.update()
