"""What is where: the wreck heeled over on the sand, her cargo, growth, fish, cameras.

Her bow points to -x and a little to the camera, which looks along +y; her
port side with the breach is turned up and towards it.
"""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parts import props
from ..parts.builder import Builder
from ..parts.cameras import camera
from ..parts.detail import Detail
from ..parts.fish import ANTHIAS, FUSILIER, SWEEPER
from ..parts.ground import UP
from ..parts.noise import fractal_noise, generator, gradient_noise
from ..parts.sand import ripples, sand_mesh, smooth_step, stations
from ..parts.shapes import Shape, joined, place, rotation_to, to_mesh
from ..parts.solids import clipped, thickened
from . import hull

Array = NDArray[np.float64]

FLOOR_DEPTH = 22.5
"""Depth of the flat floor that the sand meets at its rim, m."""
HALF_WIDTH = 45.0
KEEL = np.array([0.0, 7.0, -22.65])
"""Where the middle of her keel lies."""
HEADING, HEEL, TRIM = np.radians((205.0, 15.0, 2.0))


def turn() -> Array:
    """Turn from the ship's space to the world: heeled to starboard, down by the stern."""
    c, s = np.cos(HEEL), np.sin(HEEL)
    heeled = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(TRIM), np.sin(TRIM)
    trimmed = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    c, s = np.cos(HEADING), np.sin(HEADING)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ trimmed @ heeled


TURN = turn()


def world(points: ArrayLike) -> Array:
    """Points of the ship in the world."""
    return np.asarray(points, float) @ TURN.T + KEEL


def aboard(points: ArrayLike) -> Array:
    """Points of the world in the ship's space."""
    return (np.asarray(points, float) - KEEL) @ TURN


def height(x: ArrayLike, y: ArrayLike, seed: int) -> Array:
    """Height z of the sand in metres, for arrays of one shape."""
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    rng = generator(seed, "wreck sand")
    dunes = fractal_noise(flat / 5.0, rng, 3).reshape(x.shape)
    bend = gradient_noise(flat / 1.8, rng).reshape(x.shape)
    along, across, _ = np.moveaxis(aboard(np.stack([x, y, 0 * x + KEEL[2]], axis=-1)), -1, 0)
    beside = np.hypot(np.maximum(np.abs(along) - 10, 0) * 0.8, across)
    # The current scours along her port side and banks sand up to starboard.
    scour = -0.45 * np.exp(-(((beside - 3.6) / 1.1) ** 2)) * (across > 0)
    bank = 0.55 * np.exp(-(((beside - 3.4) / 2.2) ** 2)) * (across < 0)
    # Inside her, it is only a drift in the lower corner.
    hold = -0.9 * (1 - smooth_step(1.9, 2.9, beside))
    crests = ripples(0.9 * y - 0.35 * x + 0.35 * bend, 0.30, 0.035)
    crests *= 1 - smooth_step(12, 17, np.hypot(x, y - 1))
    rim = smooth_step(26, HALF_WIDTH - 4, np.maximum(np.abs(x), np.abs(y)))
    sand = -22.0 - 0.012 * y + 0.25 * dunes + scour + bank + hold + crests
    return sand * (1 - rim) - FLOOR_DEPTH * rim


class Wreck(Builder):
    """Builds the scene, part by part."""

    def __init__(self, seed: int, detail: Detail) -> None:
        super().__init__(seed, detail, partial(height, seed=seed))

    def build(self) -> None:
        """Fill the scene."""
        self.lay_sand()
        self.sink_ship()
        self.stow_cargo()
        self.drop_anchor()
        self.grow()
        self.release_fish()
        self.set_cameras()

    def lay_sand(self) -> None:
        """Lay the sand."""
        f = self.detail.floor_spacing**0.8
        across = stations((-HALF_WIDTH, HALF_WIDTH), 0.0, 9.0, 0.085 * f, 0.06)
        along = stations((-HALF_WIDTH, HALF_WIDTH), -2.0, 7.0, 0.06 * f, 0.05)
        shape = sand_mesh(self.ground.height, across, along)
        place(to_mesh(shape, "Seafloor", [self.materials.sand]), self.collection("Ground"))

    def sink_ship(self) -> None:
        """Lay her on the sand."""
        m, d, seed = self.materials, self.detail, self.seed
        self.fit("Hull", hull.plating(seed, d), m.rust)
        self.fit("Frames", joined([hull.frames(seed, d), hull.rail_cap(d)]), m.rust, False)
        self.fit("Bulkheads", hull.bulkheads(d), m.rust, False)
        self.fit("Coamings", hull.coamings(), m.rust, False)
        self.fit("Deck", hull.deck(seed, d), m.planks, False)
        self.fit("Hold floor", hull.floor_of_hold(seed, d), m.planks, False)
        self.fit("Hatch boards", hull.hatch_boards(seed), m.planks, False)
        self.fit("Superstructure", hull.superstructure(d), m.old_paint, False)
        self.fit("Rigging", hull.rigging(seed, d), m.rust)

    def fit(
        self, name: str, shape: Shape, material: bpy.types.Material, smooth: bool = True
    ) -> None:
        """Fit a part of the ship, given in her space."""
        self.ground.add(Shape(world(shape.vertices), shape.triangles))
        mesh = to_mesh(shape, name, [material], smooth)
        place(mesh, self.collection("Ship"), KEEL, TURN)

    def stow_cargo(self) -> None:
        """Let crates and drums lie where they slid to, and where they fell out."""
        rng = generator(self.seed, "cargo")
        crate = to_mesh(props.crate(), "Crate", [self.materials.planks], False)
        drum = to_mesh(props.barrel(self.detail), "Drum", [self.materials.rust])
        objects = self.collection("Things")
        low = hull.CEILING
        for mesh, x, y, z, lean, spin, scale in (
            (crate, 6.6, -2.2, low, 0.0, 0.1, 1.0),
            (crate, 5.6, -2.3, low, 0.0, -0.2, 1.0),
            (crate, 6.2, -2.35, low + 0.8, 0.05, 0.5, 0.9),
            (crate, 4.4, -2.5, low, 0.0, 0.05, 0.85),
            (crate, 6.9, -0.7, low, 0.0, 0.7, 1.1),
            (crate, 1.2, -2.4, low, 0.0, 0.15, 1.1),
            (crate, 0.2, -2.3, low, 0.1, 0.4, 1.0),
            (crate, 0.7, -2.5, low + 0.9, 0.2, 0.9, 0.8),
            (crate, -1.2, -1.4, low, 0.0, 0.3, 1.2),
            (crate, -1.5, 0.3, low, 0.0, 1.1, 0.9),
            (crate, 3.3, -0.4, low, 0.35, 0.6, 0.8),
            (drum, 2.4, -2.5, low, 0.0, 0.0, 1.0),
            (drum, 3.0, -2.6, low, 0.0, 0.0, 1.0),
            (drum, 2.7, -1.4, low + 0.28, 1.57, 0.4, 1.0),
            (drum, 5.2, 0.4, low + 0.28, 1.57, 1.3, 1.0),
        ):
            tilted = rotation_to((np.sin(lean), 0, np.cos(lean)), spin)
            place(mesh, objects, world((x, y, z)), TURN @ tilted, scale)
        for mesh, x, y, lean, scale in (
            (crate, 4.9, 5.2, 0.25, 0.95),
            (crate, 2.3, 6.4, 0.5, 0.8),
            (drum, 6.3, 5.9, 1.45, 1.0),
            (drum, 3.6, 7.6, 1.3, 1.0),
            (drum, -3.0, 5.0, 1.5, 1.0),
        ):
            spot = world((x, y, 1.0))
            axis = rotation_to(UP, rng.uniform(0, 6.28)) @ (np.sin(lean), 0, np.cos(lean))
            foot = self.ground.sand(spot[0], spot[1]) - UP * 0.12 + UP * 0.3 * (lean > 1)
            place(mesh, objects, foot, rotation_to(axis, rng.uniform(0, 6.28)), scale)
        self.scatter_plates(rng)

    def scatter_plates(self, rng: np.random.Generator) -> None:
        """Scatter plates of her side and broken frames on the sand before the breach."""
        parts = []
        for _ in range(9):
            x, y = rng.uniform(0.5, 8.5), rng.uniform(4.2, 9.0)
            spot = world((x, y, 1.0))
            piece = plate(rng, 0.12 if self.detail.coarser == 0 else 0.3)
            lean = rotation_to(UP + rng.normal(size=3) * 0.22, rng.uniform(0, 6.28))
            parts.append(piece.moved(self.ground.sand(spot[0], spot[1]) + UP * 0.03, lean))
        debris = joined(parts)
        self.ground.add(debris)
        place(to_mesh(debris, "Plates", [self.materials.rust]), self.collection("Things"))

    def drop_anchor(self) -> None:
        """Let her anchor lie before the bow, on its chain from the hawse."""
        hawse = world(hull.skin(0.88, np.array(0.93)))
        x, y = np.add(hawse[:2], (0.9, -4.6))
        at = self.ground.sand(x, y)
        leaning = rotation_to((0.5, -0.35, 0.55), 0.6)
        size = 1.7
        mesh = to_mesh(props.anchor(self.detail), "Anchor", [self.materials.iron])
        place(mesh, self.collection("Things"), at + UP * 0.2, leaning, size)
        ring = at + UP * 0.2 + leaning @ (props.ANCHOR_RING * size)
        # It hangs from the hawse to the sand, and snakes to the ring.
        t = np.linspace(0, 1, 300)[:, None]
        touch = self.ground.sand(*np.add(hawse[:2], (-0.25, -1.0)))
        hanging = hawse + (touch - hawse) * t
        hanging[:, 2] = hawse[2] + (touch[2] - hawse[2]) * np.sin(np.pi / 2 * t[:, 0]) ** 0.8
        lying = touch + (ring - touch) * t
        lying[:, 0] += 0.7 * np.sin(2 * np.pi * t[:, 0])
        sand = self.ground.height(lying[:, 0], lying[:, 1]) + 0.03
        lying[:, 2] = sand + (ring[2] - sand) * smooth_step(0.85, 1.0, t[:, 0])
        self.lay_chain(np.concatenate([hanging, lying[1:]]), 2.2)

    # Life

    def grow(self) -> None:
        """Let corals settle on what stands out: rails, mast, house, and her upper side."""
        rng = generator(self.seed, "growth")
        for _ in range(self.few(650)):
            spot = rng.uniform((-12.5, -3.2, 0.5), (12.8, 3.4, 9.0))
            if rng.uniform() < 0.45:
                origin, heading = world(spot * (1, 1, 0) + (0, 0, 14)), -UP
            else:
                aside = rng.choice([-1, 1], p=[0.3, 0.7])
                origin = world(spot * (1, 0, 1) + (0, 9 * aside, 0))
                heading = TURN @ (rng.normal() * 0.2, -aside, rng.normal() * 0.15)
            kind = str(rng.choice(["sponge", "fan", "small brain", "bush", "small boulder"],
                p=[0.34, 0.24, 0.14, 0.10, 0.18]))  # fmt: skip
            scale, spin = rng.uniform(0.45, 1.15), rng.uniform(0, 2 * np.pi)
            hit = self.ground.facing(origin, heading)
            if hit is None:
                continue
            foot, normal = hit
            if normal @ heading > 0:
                normal = -normal
            low = foot[2] < self.ground.sand(foot[0], foot[1])[2] + 0.3
            if low or normal[2] < -0.2 or not self.has_room(foot, scale):
                continue
            if kind.startswith("small"):
                scale *= 0.4
            self.settle(kind, int(rng.integers(8)), foot, normal, scale, spin, 0.35)

    def release_fish(self) -> None:
        """Release a school over her deck, sweepers in the hold, anthias about the mast."""

        def over(t: Array) -> Array:
            return np.stack([10 - 17 * t, 4.5 + 3 * t, -15.3 + 0.7 * np.sin(3.2 * t)], axis=1)

        def held(t: Array) -> Array:
            return world(np.stack([0.5 + 5.5 * t, -0.8 + 0 * t, 2.5 + 0.3 * np.sin(5 * t)], 1))

        def about(t: Array) -> Array:
            return world(np.stack([8.6 + 1.4 * t, 0.8 + 0 * t, 7.0 + 2 * t], axis=1))

        self.school(FUSILIER, 60, 0.34, over, (0.6, 0.8, 0.45), 0.12)
        self.school(SWEEPER, 36, 0.15, held, (0.5, 0.45, 0.35), 0.35)
        self.school(ANTHIAS, 24, 0.12, about, (0.5, 0.4, 0.5), 0.5)

    # Cameras

    def set_cameras(self) -> None:
        """Set the three cameras; "Wreck" is the active one."""
        main = camera("Wreck", (-6.0, -6.6, -18.7), (-3.6, 5.0, -18.9), 16.0)
        x, z = hull.BREACH
        camera("Breach", world((x + 0.9, 8.2, z + 0.6)), world((x - 1.0, -2.0, z - 0.5)), 24.0)
        camera("Hold", world((-1.7, -1.6, 2.2)), world((4.6, 1.7, 2.4)), 16.0)
        bpy.context.scene.camera = main


def plate(rng: np.random.Generator, step: float) -> Shape:
    """Bent plate with a torn outline, about 1.5 m across."""
    size = rng.uniform(0.5, 1.1, 2)
    u, v = (np.arange(-s * 1.3, s * 1.3, step) for s in size)
    shape = sand_mesh(lambda x, _: 0 * x, u, v)
    points = shape.vertices
    torn = 1 - np.hypot(*(points[:, :2] / size).T) + 0.6 * gradient_noise(points / 0.6, rng)
    bend = 0.3 * rng.normal() * points[:, 0] ** 2 + 0.2 * gradient_noise(points / 0.8, rng)
    bent = Shape(points + UP * bend[:, None], shape.triangles)
    return thickened(clipped(bent, torn), 0.04)
