"""What is where in the cave: the rock, sand and rubble, life at its mouths, fish, cameras.

The tunnel runs along +y, from a mouth to the open water on the other side;
its roof has three holes.
"""

from __future__ import annotations

from functools import partial

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parts.builder import Builder
from ..parts.cameras import aim, camera
from ..parts.detail import Detail
from ..parts.fish import ANTHIAS, FUSILIER, SWEEPER
from ..parts.ground import UP
from ..parts.noise import fractal_noise, generator, gradient_noise
from ..parts.rocks import stone
from ..parts.sand import ripples, sand_mesh, smooth_step, stations
from ..parts.shapes import place, rotation_to, to_mesh
from .rock import LENGTH, SHAFTS, course, rock, swim_path

Array = NDArray[np.float64]

FLOOR_DEPTH = 16.0
"""Depth of the flat floor that the sand meets at its rim, m."""
HALF_WIDTH = 40.0
FRAMES = 48


def height(x: ArrayLike, y: ArrayLike, seed: int) -> Array:
    """Height z of the sand in metres, for arrays of one shape."""
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    rng = generator(seed, "cave sand")
    dunes = fractal_noise(flat / 3.8, rng, 3).reshape(x.shape)
    bend = gradient_noise(flat / 1.6, rng).reshape(x.shape)
    middle, _, wide, _ = course(np.clip(y, -LENGTH / 2, LENGTH / 2))
    # Sand banks up against the walls, and rubble lies under the holes.
    bank = 0.35 * smooth_step(0.4, 1.1, np.abs(x - middle) / wide)
    heap = sum(
        0.45 * np.exp(-((x - s.axis(-14.5)[0]) ** 2 + (y - s.axis(-14.5)[1]) ** 2) / 2.2)
        for s in SHAFTS
    )
    crests = ripples(0.9 * y + 0.3 * x + 0.3 * bend, 0.27, 0.03)
    outside = smooth_step(17, 30, np.hypot(x, y))
    rim = smooth_step(26, HALF_WIDTH - 4, np.maximum(np.abs(x), np.abs(y)))
    sand = -14.75 + 0.22 * dunes + (bank + heap) * (1 - outside) - 0.9 * outside
    return (sand + crests * (1 - smooth_step(18, 24, np.abs(y)))) * (1 - rim) - FLOOR_DEPTH * rim


class Cave(Builder):
    """Builds the scene, part by part."""

    def __init__(self, seed: int, detail: Detail) -> None:
        super().__init__(seed, detail, partial(height, seed=seed))

    def build(self) -> None:
        """Fill the scene."""
        self.raise_rock()
        self.lay_sand()
        self.strew_boulders()
        self.grow()
        self.release_fish()
        self.set_cameras()

    def raise_rock(self) -> None:
        """Raise the rock around the tunnel."""
        coarse = self.detail.coarser > 0
        shape = rock(self.seed, 1.75 if coarse else 1.0, 0 if coarse else 1)
        self.ground.add(shape)
        mesh = to_mesh(shape, "Rock", [self.materials.limestone])
        place(mesh, self.collection("Rocks"))

    def lay_sand(self) -> None:
        """Lay the sand, through the cave and around it."""
        factor = self.detail.floor_spacing**0.75
        across = stations((-HALF_WIDTH, HALF_WIDTH), 0.0, 4.5, 0.095 * factor, 0.06)
        along = stations((-HALF_WIDTH, HALF_WIDTH), 0.0, 19.0, 0.085 * factor, 0.06)
        shape = sand_mesh(self.ground.height, across, along)
        place(to_mesh(shape, "Seafloor", [self.materials.sand]), self.collection("Ground"))

    def strew_boulders(self) -> None:
        """Lay boulders along the walls and before the mouths, rubble under the holes."""
        rng = generator(self.seed, "boulders")
        shapes = [stone(self.seed, f"boulder {i}", self.detail.level(4)) for i in range(4)]
        meshes = [to_mesh(s, f"Boulder {i}", [self.materials.rock]) for i, s in enumerate(shapes)]
        for _ in range(60):
            y = rng.uniform(-23, 23)
            middle, _, wide, _ = course(np.clip(y, -LENGTH / 2, LENGTH / 2))
            side = rng.choice([-1, 1])
            x = float(middle + side * wide * rng.uniform(0.62, 1.05))
            scale = min(0.45 * (1 + rng.pareto(2.2)), 2.4)
            which, spin = int(rng.integers(4)), rng.uniform(0, 2 * np.pi)
            turn = rotation_to(UP + rng.normal(size=3) * 0.3, spin)
            foot = self.ground.sand(x, y) + UP * 0.12 * scale
            if np.linalg.norm(foot - swim_path(y)[0]) < 1.1 + 0.6 * scale:
                continue
            self.ground.add(shapes[which].moved(foot, turn, scale))
            place(meshes[which], self.collection("Rocks"), foot, turn, scale)
        stones = self.stones()
        for _ in range(max(self.few(120), 40)):
            if rng.uniform() < 0.6:
                shaft = SHAFTS[rng.integers(len(SHAFTS))]
                x, y = np.array(shaft.axis(-14.5)) + rng.normal(size=2) * 0.9
            else:
                y = rng.uniform(-20, 20)
                middle, _, wide, _ = course(np.clip(y, -LENGTH / 2, LENGTH / 2))
                x = float(middle + rng.choice([-1, 1]) * wide * rng.uniform(0.4, 1.0))
            scale = min(0.07 * (1 + rng.pareto(2.0)), 0.5)
            spin = rotation_to(UP + rng.normal(size=3) * 0.2, rng.uniform(0, 6.28))
            which = rng.integers(3)
            place(stones[which], self.collection("Rocks"), self.ground.sand(x, y), spin, scale)

    # Life

    def grow(self) -> None:
        """Let corals settle in the light, fans at the mouths, and sponges where it is dim."""
        rng = generator(self.seed, "growth")
        for _ in range(self.few(110)):
            # Onto the mound from above or from the open water before a mouth.
            if rng.uniform() < 0.4:
                origin = np.array([*rng.uniform((-13, -17), (13, 17)), -1.0])
                heading = -UP
            else:
                end = rng.choice([-1, 1])
                origin = np.array([rng.uniform(-9, 9), 24.0 * end, rng.uniform(-14, -7)])
                heading = np.array([rng.normal() * 0.25, -end, rng.normal() * 0.1])
            kinds = ["small brain", "small boulder", "bush", "small table", "sponge", "fan"]
            flank = ["fan", "fan", "sponge", "small boulder", "small brain"]
            self.settler(origin, heading, kinds, flank, rng, (0.6, 1.5))
        for _ in range(self.few(45)):
            # From where the diver swims, to the walls.
            y = rng.uniform(-15, 15)
            origin, heading = swim_path(y)[0], rng.normal(size=3)
            self.settler(origin, heading, ["sponge"], ["sponge", "fan"], rng, (0.35, 0.8))

    def settler(
        self,
        origin: Array,
        heading: Array,
        top: list[str],
        flank: list[str],
        rng: np.random.Generator,
        sizes: tuple[float, float],
    ) -> None:
        """Let one larva try to settle where a ray meets the rock."""
        kind_top, kind_flank = rng.choice(top), rng.choice(flank)
        scale, spin = rng.uniform(*sizes), rng.uniform(0, 2 * np.pi)
        hit = self.ground.facing(origin, heading)
        if hit is None:
            return
        foot, normal = hit
        low = foot[2] < self.ground.sand(foot[0], foot[1])[2] + 0.15
        free = np.linalg.norm(foot - swim_path(foot[1])[0]) > 1.2 + scale
        if low or not free or not self.has_room(foot, scale):
            return
        steep = normal[2] < 0.55
        kind = kind_flank if steep else kind_top
        if kind.startswith("small"):
            scale *= 0.5
        self.settle(kind, int(rng.integers(8)), foot, normal, scale, spin, 0.2 if steep else 0.75)

    def release_fish(self) -> None:
        """Release sweepers into the cavern, a school before the exit, anthias at the entrance."""

        def ball(t: Array) -> Array:
            return swim_path(4.2 + 2.2 * t) + np.stack([-1.7 + 0.6 * t, 0 * t, 1.2 + 0 * t], 1)

        def in_the_beam(t: Array) -> Array:
            return np.stack([-2.2 + 5.0 * t, 3.4 - 1.5 * t, -10.9 + 0.9 * t], axis=1)

        def pass_by(t: Array) -> Array:
            return np.stack([8.5 - 15 * t, 20.5 + 3.0 * t, -12.0 + 0.8 * np.sin(3 * t)], axis=1)

        def cloud(t: Array) -> Array:
            return np.stack([-4.2 + 2.4 * t, -19.3 + 0 * t, -10.2 + 0.3 * np.sin(6 * t)], axis=1)

        self.school(SWEEPER, 60, 0.14, ball, (0.55, 0.5, 0.32), 0.35)
        self.school(FUSILIER, 46, 0.32, pass_by, (0.7, 0.8, 0.5), 0.12)
        self.school(FUSILIER, 14, 0.42, in_the_beam, (0.5, 0.6, 0.45), 0.2, "in the beam")
        self.school(ANTHIAS, 24, 0.11, cloud, (0.5, 0.3, 0.3), 0.5)

    # Cameras

    def set_cameras(self) -> None:
        """Set the cameras; "Beams" is the active one, "Swim" swims through in 48 frames."""
        scene = bpy.context.scene
        eye = np.add(swim_path(-5.8)[0], (-0.5, 0, -0.5))
        scene.camera = camera("Beams", eye, np.add(swim_path(1.5)[0], (0.0, 0, 0.6)), 16.0)
        camera("Entrance", (-6.0, -26.0, -11.2), (-1.5, -15.0, -11.8), 20.0)
        swimmer = camera("Swim", *swimming(0.0), 20.0)
        swimmer.rotation_mode = "QUATERNION"
        scene.frame_start, scene.frame_end = 1, FRAMES
        before = None
        for frame in range(1, FRAMES + 1):
            aim(swimmer, *swimming((frame - 1) / (FRAMES - 1)))
            if before is not None:
                # Both signs are the same turn; only one is near the frame before.
                swimmer.rotation_quaternion.make_compatible(before)
            before = swimmer.rotation_quaternion.copy()
            swimmer.keyframe_insert("location", frame=frame)
            swimmer.keyframe_insert("rotation_quaternion", frame=frame)
        scene.frame_set(1)


def swimming(fraction: float) -> tuple[Array, Array]:
    """Where the swimmer is after a fraction of the way, and what they look at."""
    y = -LENGTH / 2 - 4.5 + (LENGTH + 4.0) * fraction
    ahead = swim_path(y + np.linspace(3.0, 9.0, 9)).mean(axis=0)
    return swim_path(y)[0], ahead
