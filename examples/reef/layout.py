"""What stands where: a foreground, a sand channel that leads into the blue, reef on both sides.

The camera looks along +y. Depths follow from the seafloor; nothing floats
because every foot is found by casting a ray onto what is already there.
"""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np
from numpy.typing import NDArray

from ..parts import props
from ..parts.builder import Builder
from ..parts.cameras import camera
from ..parts.detail import Detail
from ..parts.fish import ANTHIAS, BUTTERFLYFISH, FUSILIER
from ..parts.ground import UP
from ..parts.noise import generator
from ..parts.rocks import bommie
from ..parts.shapes import normalised, place, rotation_to, to_mesh
from . import color_checker
from .seafloor import height, seafloor

Array = NDArray[np.float64]

# Name, x, y, half axes, how far the middle stands above the sand, larvae that try to settle.
BOMMIES = (
    ("near left", -2.45, 4.7, (0.90, 0.80, 0.80), 0.35, 280),
    ("outcrop", -1.75, 2.85, (0.62, 0.45, 0.22), 0.02, 160),
    ("left", -5.1, 7.6, (1.40, 1.10, 1.10), 0.55, 110),
    ("right ledge", 3.15, 5.9, (1.25, 0.75, 0.50), 0.18, 280),
    ("right", 5.9, 9.2, (1.40, 1.10, 1.10), 0.50, 130),
    ("distant", -1.7, 14.5, (1.80, 1.40, 1.50), 0.80, 80),
    ("far left", -10.5, 15.5, (2.60, 2.00, 1.50), 0.60, 40),
    ("far right", 9.5, 19.0, (2.80, 2.00, 1.60), 0.70, 40),
)
NEAR = ("near left", "right ledge")
# What settles on tops and on flanks, with its chance, and the scale of each kind.
TOP = {
    "bush": 3,
    "blue bush": 1,
    "small table": 2,
    "small brain": 2,
    "small boulder": 2,
    "fan": 0.6,
    "sponge": 1.0,
}
FLANK = {
    "small table": 1.5,
    "small brain": 2,
    "small boulder": 2,
    "fan": 1.6,
    "sponge": 2.2,
    "bush": 0.7,
}
SIZE = {
    "bush": 0.75,
    "blue bush": 0.7,
    "small table": 0.75,
    "small brain": 0.36,
    "small boulder": 0.42,
    "fan": 0.7,
    "sponge": 0.75,
}
CHECKER_AT = (0.92, 2.85)
CHECKER_TILT = np.radians(16.0)


def fractions(chances: dict[str, float]) -> Array:
    """Return the chances as fractions of 1."""
    weights = np.array(list(chances.values()), float)
    return weights / weights.sum()


class Reef(Builder):
    """Builds the scene, part by part."""

    def __init__(self, seed: int, detail: Detail) -> None:
        super().__init__(seed, detail, partial(height, seed=seed))

    def build(self) -> None:
        """Fill the scene."""
        self.lay_seafloor()
        self.lay_rocks()
        self.compose_corals()
        self.crowd_corals()
        self.leave_props()
        self.release_fish()
        self.set_cameras()

    # Ground

    def lay_seafloor(self) -> None:
        """Lay the sand."""
        mesh = to_mesh(seafloor(self.seed, self.detail), "Seafloor", [self.materials.sand])
        place(mesh, self.collection("Ground"))

    def lay_rocks(self) -> None:
        """Set the bommies and strew stones about their feet."""
        rocks = self.collection("Rocks")
        for name, x, y, size, above, _ in BOMMIES:
            level = 6 if name in NEAR else 5
            shape = bommie(self.seed, name, self.detail.level(level), size)
            location = self.ground.sand(x, y) + UP * above
            self.ground.add(shape.moved(location))
            place(to_mesh(shape, f"Bommie {name}", [self.materials.rock]), rocks, location)
        rng = generator(self.seed, "stones")
        stones = self.stones()
        for _ in range(self.few(150)):
            _, x, y, size, _, _ = BOMMIES[rng.integers(0, 5)]
            angle, out = rng.uniform(0, 2 * np.pi), 1.0 + rng.exponential(0.22)
            x, y = x + size[0] * out * np.cos(angle), y + size[1] * out * np.sin(angle)
            scale = min(0.05 * (1 + rng.pareto(2.0)), 0.45)
            spin = rotation_to(UP + rng.normal(size=3) * 0.15, rng.uniform(0, 6.28))
            if self.ground.below(x, y)[2] or not self.clear_of_view(x, y, 0.5):
                continue
            place(stones[rng.integers(3)], rocks, self.ground.sand(x, y), spin, scale)

    def clear_of_view(self, x: float, y: float, margin: float) -> bool:
        """Whether (x, y) leaves the checker and the view of it free."""
        return not (abs(x - CHECKER_AT[0]) < 0.35 + margin and -0.5 < y < CHECKER_AT[1] + 0.35)

    # Corals

    def compose_corals(self) -> None:
        """Plant the corals that the picture is made of."""
        rng = generator(self.seed, "foreground")
        # Foreground left: a thicket of staghorn that frames the view.
        for x, y, scale in (
            (-1.55, 2.50, 1.15),
            (-1.20, 2.80, 0.9),
            (-1.80, 2.95, 1.25),
            (-1.35, 3.15, 1.0),
            (-2.15, 2.75, 1.2),
        ):
            self.plant("staghorn", int(rng.integers(3)), x, y, scale, rng.uniform(0, 6.28))
        self.plant("sponge", 0, -1.08, 2.98, 0.75, 0.8)
        self.plant("small brain", 1, -1.42, 2.36, 0.32, 0.8)
        self.plant("small boulder", 0, -0.92, 3.3, 0.3, 0.8)
        # Near left bommie: table on top, brain on its shoulder.
        self.plant("table", 0, -2.30, 4.45, 1.25, 0.4, 0.9)
        self.plant("brain", 1, -1.50, 4.15, 0.62, 0.3)
        # Right: brain coral beside the checker, ledge with tables and blue staghorn.
        self.plant("brain", 0, 1.95, 3.75, 0.95, 1.0, 1.0)
        self.plant("table", 1, 2.55, 5.6, 1.15, 1.0, 0.9)
        self.plant("table", 0, 3.55, 5.9, 1.35, 2.2, 0.9)
        self.plant("blue staghorn", 0, 2.2, 5.1, 0.9, 0.5)
        self.plant("boulder", 0, -0.75, 6.6, 1.0, 0.0, 1.0)
        self.plant("boulder", 0, -0.15, 7.1, 0.6, 2.0, 1.0)
        # Fans face the camera, from the flanks into the current.
        for variant, x, z, scale in ((0, -1.75, -5.35, 1.0), (1, 2.55, -5.75, 0.9)):
            self.hang("fan", variant, x, z, scale)

    def hang(self, kind: str, variant: int, x: float, z: float, scale: float) -> None:
        """Fix a coral to the rock that the main camera sees at (x, z) from the front."""
        hit = self.ground.facing((x, 0.0, z), (0, 1, 0))
        if hit is None or hit[0][1] > 12:
            return
        foot, normal = hit
        axis = normalised(normal * 0.35 + UP)
        turn = rotation_to(axis, 0.35 if x < 0 else -0.35)
        mesh = self.growth.meshes(kind)[variant]
        place(mesh, self.collection("Corals"), foot - normal * 0.02, turn, scale)

    def crowd_corals(self) -> None:
        """Let smaller corals settle wherever the rocks leave room."""
        rng = generator(self.seed, "crowd")
        for _, cx, cy, half, above, tries in BOMMIES:
            middle = self.ground.sand(cx, cy) + UP * above
            for _ in range(self.few(tries)):
                # From above onto the top, or from outside onto the flanks.
                angle, out = rng.uniform(0, 2 * np.pi), np.sqrt(rng.uniform()) * 1.2
                aside = np.array([np.cos(angle), np.sin(angle), 0.0])
                if rng.uniform() < 0.5:
                    origin, heading = middle + half * aside * out + UP * 4, -UP
                else:
                    origin = middle + 4 * aside + UP * half[2] * rng.uniform(-0.5, 0.9)
                    heading = -aside
                hit = self.ground.facing(origin, heading)
                steep = hit is not None and hit[1][2] < 0.55
                kinds = FLANK if steep else TOP
                kind = list(kinds)[rng.choice(len(kinds), p=fractions(kinds))]
                scale = SIZE[kind] * rng.uniform(0.6, 1.25)
                spin, variant = rng.uniform(0, 2 * np.pi), int(rng.integers(8))
                if hit is None or np.hypot(*(hit[0] - middle)[:2]) > 1.6 * max(half[:2]):
                    continue
                foot, normal = hit
                low = foot[2] < self.ground.sand(foot[0], foot[1])[2] + 0.12
                if low or not self.has_room(foot, scale) or normal[2] < -0.15:
                    continue
                if kind == "fan":
                    spin = rng.normal() * 0.5
                self.settle(kind, variant, foot, normal, scale, spin, 0.45 if steep else 0.75)

    # Objects people left

    def leave_props(self) -> None:
        """Leave the checker, the anchor on its chain, the float, and the lamp."""
        objects = self.collection("Things")
        m, d = self.materials, self.detail
        c, s = np.cos(CHECKER_TILT), np.sin(CHECKER_TILT)
        lean = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
        # Facing the camera: turned about z by its bearing.
        bearing = -np.arctan2(CHECKER_AT[0], CHECKER_AT[1])
        cb, sb = np.cos(bearing), np.sin(bearing)
        self.checker_turn = np.array([[cb, -sb, 0], [sb, cb, 0], [0, 0, 1]]) @ lean
        self.checker_foot = self.ground.sand(*CHECKER_AT) + UP * 0.06
        board = color_checker.color_checker(m)
        place(board, objects, self.checker_foot, self.checker_turn, name="ColorChecker board")
        back = self.checker_turn @ (0, color_checker.THICKNESS, 0.8 * color_checker.HEIGHT)
        top = self.checker_foot + back
        behind = self.checker_foot + self.checker_turn @ np.array([0, 1.0, 0]) * 0.30
        foot = self.ground.sand(behind[0], behind[1]) - UP * 0.05
        place(to_mesh(props.board_strut(top, foot), "Checker strut", [m.aluminium], False), objects)

        at = self.ground.sand(0.75, 6.1)
        turn = rotation_to((-0.55, -0.25, 0.62), 0.6)
        place(to_mesh(props.anchor(d), "Anchor", [m.iron]), objects, at + UP * 0.12, turn)
        ring = at + UP * 0.12 + turn @ (props.ANCHOR_RING - (0, 0, 0.02))
        hover = ring + np.array([0.22, 0.3, 0.98])
        place(to_mesh(props.rope(ring, hover - UP * 0.18, d), "Rope", [m.rope]), objects)
        place(to_mesh(props.glass_float(d), "Glass float", [m.glass, m.rope]), objects, hover)

        self.hang_chain(ring)

        lamp = to_mesh(props.lamp(d), "Dive lamp", [m.aluminium, m.bulb])
        at = self.ground.sand(0.28, 3.15) + UP * 0.04
        place(lamp, objects, at, rotation_to((0, 0, 1), np.radians(-128)))

    def hang_chain(self, ring: Array) -> None:
        """Let a chain hang from the anchor's ring and snake over the sand to the camera."""
        t = np.linspace(0, 1, 400)
        swing = np.stack([ring[0] - 0.55 * t + 0.22 * np.sin(7 * t) * t, ring[1] - 2.6 * t**1.5], 1)
        sand = height(swing[:, 0], swing[:, 1], self.seed) + 0.015
        sag = np.exp(-np.linalg.norm(swing - swing[0], axis=1) / 0.11)
        line = np.stack(
            [*swing.T, sand + (ring[2] - sand) * sag - 1.4 * np.clip(t - 0.86, 0, 1)], axis=1
        )
        self.lay_chain(line)

    # Fish

    def release_fish(self) -> None:
        """Release a school across the channel, a cloud over the table coral, and a pair."""

        def stream(t: Array) -> Array:
            x, y = 5.8 - 5.0 * t, 9.8 - 6.4 * t + 2.2 * t**2
            return np.stack([x, y, -4.3 + 0.45 * np.sin(2.9 * t)], axis=1)

        def cloud(t: Array) -> Array:
            x, y = -2.6 + 0.9 * t, 4.35 - 0.3 * t
            return np.stack([x, y, -4.72 + 0.15 * np.sin(6 * t)], axis=1)

        self.school(FUSILIER, 58, 0.29, stream, (0.40, 0.50, 0.24), 0.12)
        self.school(ANTHIAS, 18, 0.10, cloud, (0.25, 0.22, 0.13), 0.5)
        for spot, heading in (
            ((1.55, 4.5, -5.25), (-0.9, -0.2, 0.05)),
            ((1.85, 4.62, -5.12), (-0.85, -0.3, 0.0)),
        ):
            self.swim(BUTTERFLYFISH, 0, np.array(spot), np.array(heading), 0.19)

    # Cameras

    def set_cameras(self) -> None:
        """Set the three cameras; "Reef" is the active one."""
        main = camera("Reef", (0.0, 0.0, -4.95), (0.05, 8.0, -5.9), 25.0)
        camera("Up", (-0.75, 3.9, -5.75), (-0.45, 6.4, -3.6), 16.0)
        middle = self.checker_foot + self.checker_turn @ (0, 0, color_checker.HEIGHT / 2)
        face = self.checker_turn @ np.array([0, -1.0, 0])
        camera("ColorChecker", middle + face * 1.10, middle, 50.0)
        bpy.context.scene.camera = main
