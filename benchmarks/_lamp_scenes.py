"""Scenes that lamps shine in, for pictures and for paths of light."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

from ..scene.water import lamp_rigs
from ..validation import lamp_room
from ._places import Place
from ._scenery import ball, block, camera_at, example, ground

DEPTH = 15.0
_PATHS, _IN_TURBID = 40_000, 240_000  # of a block, in I, and in what scatters more
FIELD_OF_VIEW = math.radians(70)
SAMPLES = 256
"""Of Cycles, in IB."""
_ABOVE_SAND = 1.2
# Middles and sizes in m, seen from the camera, and colours.
_SAND = (0.5, 0.42, 0.3)
_BALL, _BALL_RADIUS, _RED = (0.6, 3.2, -0.5), 0.6, (0.6, 0.08, 0.05)
_BOX, _BOX_SIZE, _WHITE = (-1.3, 4.2, -0.7), 1.0, (0.8, 0.8, 0.8)
FISH, FISH_AXES, _GREY = (0.1, 4.4, 0.0), (0.42, 0.14, 0.21), (0.3, 0.3, 0.35)
_DIVERS_Y = 4.3
# Of a diver who hangs upright, the tank behind: middles and half axes beside that distance.
_BODY = (
    ((0.0, 0.0, 0.25), (0.22, 0.14, 0.36)),
    ((0.0, 0.0, 0.72), (0.11, 0.13, 0.14)),
    ((-0.13, 0.0, -0.4), (0.09, 0.1, 0.42)),
    ((0.13, 0.0, -0.4), (0.09, 0.1, 0.42)),
    ((-0.33, 0.0, 0.25), (0.06, 0.08, 0.32)),
    ((0.33, 0.0, 0.25), (0.06, 0.08, 0.32)),
)
_GEAR = (
    ((0.0, 0.22, 0.3), (0.09, 0.09, 0.3)),
    ((-0.13, 0.1, -0.85), (0.1, 0.26, 0.02)),
    ((0.13, 0.1, -0.85), (0.1, 0.26, 0.02)),
)
_NEOPRENE = (0.05, 0.05, 0.06)
_NET_AT, _NET_REACH, _MESH, _CORD = 4.4, 0.9, 0.3, 0.02
TOWARDS = math.pi / 2  # a lamp that is turned so about x shines along y
type _Solid = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class LitPlace(Place):
    """A place with lamps, by night unless its settings say otherwise.

    ``room`` is the same for paths of light.
    """

    settings: Mapping[str, object] = field(default_factory=lambda: {"sunlight": 0.0})
    room: lamp_room.Room | None = None

    @property
    def paths(self) -> int:
        """How many there are for each block."""
        return _PATHS if self.water == "I" else _IN_TURBID


def sand_room() -> bpy.types.Object:
    """Make sand, a ball, a box and open water, seen from 1.2 m above the sand."""
    camera = camera_at((0.0, 0.0, -DEPTH), (TOWARDS, 0.0, 0.0), FIELD_OF_VIEW)
    ground(-DEPTH - _ABOVE_SAND, _SAND)
    ball(_seen(_BALL), _BALL_RADIUS, _RED)
    block("box", _seen(_BOX), (_BOX_SIZE,) * 3, _WHITE)
    return camera


def _seen(place: Sequence[float]) -> Vector:
    return Vector(place) - Vector((0.0, 0.0, DEPTH))


def _for_paths(
    balls: Sequence[_Solid] = (), boxes: Sequence[_Solid] = (), colour: Sequence[float] = _GREY
) -> lamp_room.Room:
    ellipsoids = [(_BALL, (_BALL_RADIUS,) * 3), *balls]
    blocks = [(_BOX, (_BOX_SIZE / 2.0,) * 3), *boxes]
    colours = [_SAND, _RED, *[colour] * len(balls), _WHITE, *[colour] * len(boxes)]
    balls_of, boxes_of = (
        np.array([(*at, *half) for at, half in kind]) for kind in (ellipsoids, blocks)
    )
    return lamp_room.Room(-_ABOVE_SAND, balls_of, boxes_of, np.array(colours))


def _cords() -> list[_Solid]:
    """Middles and half sizes of the cords of a net."""
    places = np.arange(-_NET_REACH, _NET_REACH + _MESH / 2.0, _MESH)
    upright = [((x, _NET_AT, 0.0), (_CORD, _CORD, _NET_REACH)) for x in places]
    return upright + [((0.0, _NET_AT, z), (_NET_REACH, _CORD, _CORD)) for z in places]


def _diver() -> tuple[list[_Solid], list[_Solid]]:
    """Ellipsoids and boxes of a diver."""
    body, gear = (
        [((x, _DIVERS_Y + y, z), half) for (x, y, z), half in parts] for parts in (_BODY, _GEAR)
    )
    return body, gear


def add_lamp(
    place: Sequence[float], turn: Sequence[float], lumens: float = 8000.0, cone: float = 70.0
) -> None:
    """Add a spot of a cone in degrees at a place seen from the camera, turned from down."""
    light = bpy.data.lights.new("Lamp", "SPOT")
    light.spot_size, light.spot_blend = math.radians(cone), 0.4
    light.energy, light.shadow_soft_size = lumens, 0.03
    chosen = light.underwater
    chosen.spectrum, chosen.unit = "led", "lm"
    item = bpy.data.objects.new("Lamp", light)
    item.location = _seen(place)
    item.rotation_euler = turn
    bpy.context.scene.collection.objects.link(item)


def vehicle() -> bpy.types.Object:
    """Fill a file with two lamps beside the camera and two above it that shine outwards."""
    camera = sand_room()
    for side in (-1.0, 1.0):
        add_lamp((side, 0.0, -0.2), (TOWARDS, 0.0, math.atan2(side, 5.0)))
        add_lamp((side * 0.5, 0.0, 0.6), (TOWARDS - 0.15, 0.0, -side * 0.3))
    return camera


def torch(place: Sequence[float], turned: float, lumens: float = 3000.0) -> bpy.types.Object:
    camera = sand_room()
    add_lamp(place, (TOWARDS, 0.0, turned), lumens, 50.0)
    return camera


def strobes() -> bpy.types.Object:
    camera = sand_room()
    for side in (-1.0, 1.0):
        add_lamp((side * 1.2, 0.3, 0.5), (TOWARDS - 0.25, 0.0, side * 0.4), 20000.0, 100.0)
    return camera


def behind(
    lamp: Sequence[float], balls: Sequence[_Solid], boxes: Sequence[_Solid] = (),
    colour: Sequence[float] = _GREY,
) -> bpy.types.Object:  # fmt: skip
    """Put a lamp that shines to the camera behind balls and boxes."""
    camera = sand_room()
    add_lamp(lamp, (TOWARDS, 0.0, math.pi), 8000.0, 90.0)
    for place, axes in balls:
        ball(_seen(place), axes, colour)
    for place, half in boxes:
        block("part", _seen(place), 2.0 * np.array(half), colour)
    return camera


def _wreck(file: Path) -> bpy.types.Object:
    bpy.ops.wm.open_mainfile(filepath=str(file))
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    lamp_rigs.add_rig(scene, "rov2", scene.camera)
    return scene.camera


_SCENES: tuple[tuple[str, Callable[[], bpy.types.Object], Sequence[str]], ...] = (
    ("torch across", partial(torch, (0.9, 5.0, 0.5), 0.75 * math.pi), ("I", "II", "III", "3C")),
    ("torch along", partial(torch, (0.25, 0.0, -0.1), 0.0, 8000.0), ("II",)),
    ("torch against", partial(torch, (-0.5, 6.0, 0.4), math.pi + 0.15), ("II",)),
    ("strobe pair", strobes, ("II",)),
    ("vehicle with four lamps", vehicle, ("I",)),
)


def places(folder: Path) -> list[LitPlace]:
    """Return the places; ``folder`` is for scenes that are built once."""
    room = _for_paths()
    found = [
        LitPlace(f"{name}, {water}", build, water, room=room)
        for name, build, waters in _SCENES
        for water in waters
    ]
    fish, net = ([(FISH, FISH_AXES)],), ((), _cords())
    found += [
        LitPlace(f"lamp behind a {name}, {water}", partial(behind, lamp, *solids), water,
                 room=_for_paths(*solids))
        for name, lamp, solids, water in (
            ("fish", (0.0, 5.2, 0.1), fish, "I"),
            ("fish", (0.0, 5.2, 0.1), fish, "II"),
            ("net", (0.05, 5.2, 0.1), net, "I"),
            ("net", (0.05, 5.2, 0.1), net, "II"),
            ("diver", (0.1, 5.4, 0.4), (*_diver(), _NEOPRENE), "II"),
        )
    ]  # fmt: skip
    wreck = example(folder / "wreck_draft.blend", "wreck", "draft")
    by_cycles = [
        LitPlace("vehicle and sun, IB", vehicle, "IB", settings={"sunlight": 0.05}),
        LitPlace("wreck by night, IB", partial(_wreck, wreck), "IB"),
    ]
    return found + [replace(place, samples=SAMPLES) for place in by_cycles]
