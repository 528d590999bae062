"""What stands where: a foreground, a sand channel that leads into the blue, reef on both sides.

The camera looks along +y. Depths follow from the seafloor; nothing floats
because every foot is found by casting a ray onto what is already there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import ArrayLike, NDArray

from . import color_checker, corals, props
from .cameras import camera
from .detail import Detail
from .fish import ANTHIAS, BUTTERFLYFISH, FUSILIER, SPECIES, Species, fish
from .materials import Materials
from .noise import generator
from .rocks import bommie, stone
from .seafloor import height, seafloor
from .shapes import Shape, joined, normalised, place, rotation_to, to_mesh

Array = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])

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


def shares(chances: dict[str, float]) -> Array:
    """Return the chances as shares of 1."""
    weights = np.array(list(chances.values()), float)
    return weights / weights.sum()


@dataclass
class Ground:
    """Where things can stand: the sand, and the rocks laid so far."""

    seed: int
    rocks: list[Shape] = field(default_factory=list)
    _tree: BVHTree | None = None

    def add(self, rock: Shape) -> None:
        """Lay a rock, in world space."""
        self.rocks.append(rock)
        self._tree = None

    def tree(self) -> BVHTree:
        """Search tree over the rocks."""
        if self._tree is None:
            rocks = joined(self.rocks)
            self._tree = BVHTree.FromPolygons(rocks.vertices.tolist(), rocks.triangles.tolist())
        return self._tree

    def sand(self, x: float, y: float) -> Array:
        """Point on the sand."""
        return np.array([x, y, float(height(x, y, self.seed))])

    def below(self, x: float, y: float) -> tuple[Array, Array, bool]:
        """Topmost point at (x, y), its normal, and whether it is rock."""
        sand = self.sand(x, y)
        point, normal, _, _ = self.tree().ray_cast(Vector((x, y, 0.0)), Vector((0, 0, -1)))
        if point is None or point.z < sand[2]:
            return sand, UP, False
        return np.array(point), np.array(normal), True

    def facing(self, origin: ArrayLike, heading: ArrayLike) -> tuple[Array, Array] | None:
        """First rock seen from a point along a direction."""
        point, normal, _, _ = self.tree().ray_cast(Vector(origin), Vector(heading))
        return None if point is None else (np.array(point), np.array(normal))


class Reef:
    """Builds the scene, part by part."""

    def __init__(self, seed: int, detail: Detail) -> None:
        self.seed, self.detail = seed, detail
        self.materials = Materials(seed, detail)
        self.ground = Ground(seed)
        self.taken: list[tuple[Array, float]] = []

    def build(self) -> None:
        """Fill the scene."""
        self.lay_seafloor()
        self.lay_rocks()
        self.grow_corals()
        self.leave_props()
        self.release_fish()
        self.set_cameras()

    def collection(self, name: str) -> bpy.types.Collection:
        """Return a new collection in the scene."""
        new = bpy.data.collections.new(name)
        bpy.context.scene.collection.children.link(new)
        return new

    def level(self, level: int) -> int:
        """Subdivision level in this detail."""
        return max(1, level - self.detail.coarser)

    def few(self, count: int) -> int:
        """How many of many in this detail."""
        return max(1, round(count * self.detail.density))

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
            shape = bommie(self.seed, name, self.level(level), size)
            location = self.ground.sand(x, y) + UP * above
            self.ground.add(shape.moved(location))
            place(to_mesh(shape, f"Bommie {name}", [self.materials.rock]), rocks, location)
        rng = generator(self.seed, "stones")
        stones = [
            to_mesh(
                stone(self.seed, f"stone {i}", self.level(3)), f"Stone {i}", [self.materials.rock]
            )
            for i in range(3)
        ]
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

    def grow_corals(self) -> None:
        """Grow the corals: those of the composition first, then the crowd."""
        m, d, seed = self.materials, self.detail, self.seed
        cream = m.branching("Staghorn cream", (0.40, 0.25, 0.09), (0.80, 0.72, 0.55))
        blue = m.branching("Staghorn blue", (0.16, 0.15, 0.30), (0.55, 0.58, 0.85))
        plate = m.branching("Table coral", (0.26, 0.17, 0.075), (0.62, 0.52, 0.30))
        green = m.branching("Table coral green", (0.12, 0.19, 0.07), (0.50, 0.58, 0.30))
        skins = {
            "olive": m.grooved("Brain coral olive", (0.34, 0.30, 0.08), (0.07, 0.16, 0.05)),
            "ochre": m.grooved("Brain coral ochre", (0.46, 0.25, 0.08), (0.16, 0.10, 0.05)),
        }
        staghorn = [corals.staghorn(seed, f"staghorn {i}", d, 10) for i in range(3)]
        bushes = [corals.staghorn(seed, f"bush {i}", d, 5) for i in range(2)]
        tables = [corals.table(seed, f"table {i}", d, 700) for i in range(2)]
        small_tables = [corals.table(seed, f"small table {i}", d, 200) for i in range(2)]
        self.kinds: dict[str, list[bpy.types.Mesh]] = {
            "staghorn": [to_mesh(s, "Staghorn cream", [cream]) for s in staghorn],
            "blue staghorn": [to_mesh(staghorn[0], "Staghorn blue", [blue])],
            "bush": [to_mesh(s, "Staghorn bush cream", [cream]) for s in bushes],
            "blue bush": [to_mesh(bushes[1], "Staghorn bush blue", [blue])],
            "table": [
                to_mesh(tables[0], "Table", [plate]),
                to_mesh(tables[1], "Table green", [green]),
            ],
            "small table": [
                to_mesh(shape, f"Small {skin.name.lower()}", [skin])
                for shape, skin in zip(small_tables, (plate, green), strict=True)
            ],
            "brain": [
                to_mesh(corals.brain(seed, f"brain {c}", self.level(6)), f"Brain {c}", [skin])
                for c, skin in skins.items()
            ],
            "small brain": [
                to_mesh(corals.brain(seed, f"small {c}", self.level(4)), f"Small brain {c}", [skin])
                for c, skin in skins.items()
            ],
            "boulder": [
                to_mesh(corals.boulder(seed, "boulder", self.level(5)), "Porites", [m.massive])
            ],
            "small boulder": [
                to_mesh(corals.boulder(seed, "small", self.level(3)), "Small Porites", [m.massive])
            ],
            "fan": [
                to_mesh(
                    corals.sea_fan(seed, f"fan {name}", d),
                    f"Sea fan {name}",
                    [m.plain(f"Sea fan {name}", color, 0.3)],
                )
                for name, color in (("violet", (0.32, 0.07, 0.33)), ("red", (0.62, 0.09, 0.04)))
            ],
            "sponge": [
                to_mesh(
                    corals.tube_sponge(seed, f"sponge {name}", d),
                    f"Tube sponge {name}",
                    [m.hollow(f"Tube sponge {name}", color)],
                )
                for name, color in (("yellow", (0.70, 0.46, 0.04)), ("purple", (0.30, 0.14, 0.36)))
            ],
        }
        self.corals = self.collection("Corals")
        self.compose_corals()
        self.crowd_corals()

    def plant(
        self,
        kind: str,
        variant: int,
        x: float,
        y: float,
        scale: float,
        spin: float,
        upright: float = 0.75,
    ) -> None:
        """Plant a coral on what is at (x, y); `upright` from along the normal (0) to up (1)."""
        foot, normal, _ = self.ground.below(x, y)
        self.settle(kind, variant, foot, normal, scale, spin, upright)

    def settle(
        self,
        kind: str,
        variant: int,
        foot: Array,
        normal: Array,
        scale: float,
        spin: float,
        upright: float,
    ) -> None:
        """Let a coral settle at a point of the ground, a little sunk in."""
        meshes = self.kinds[kind]
        axis = normalised(normal * (1 - upright) + UP * upright)
        self.taken.append((foot, scale))
        foot = foot - axis * 0.03 * scale - normal * 0.02 * scale
        place(meshes[variant % len(meshes)], self.corals, foot, rotation_to(axis, spin), scale)

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
        place(self.kinds[kind][variant], self.corals, foot - normal * 0.02, turn, scale)

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
                kind = list(kinds)[rng.choice(len(kinds), p=shares(kinds))]
                scale = SIZE[kind] * rng.uniform(0.6, 1.25)
                spin, variant = rng.uniform(0, 2 * np.pi), int(rng.integers(8))
                if hit is None or np.hypot(*(hit[0] - middle)[:2]) > 1.6 * max(half[:2]):
                    continue
                foot, normal = hit
                low = foot[2] < self.ground.sand(foot[0], foot[1])[2] + 0.12
                room = all(np.linalg.norm(foot - o) > 0.34 * (scale + s) for o, s in self.taken)
                if low or not room or normal[2] < -0.15:
                    continue
                if kind == "fan":
                    spin = rng.normal() * 0.5
                self.settle(kind, variant, foot, normal, scale, spin, 0.45 if steep else 0.75)

    # Things people left

    def leave_props(self) -> None:
        """Leave the checker, the anchor on its chain, the float, and the lamp."""
        things = self.collection("Things")
        m, d = self.materials, self.detail
        c, s = np.cos(CHECKER_TILT), np.sin(CHECKER_TILT)
        lean = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
        # Facing the camera: turned about z by its bearing.
        bearing = -np.arctan2(CHECKER_AT[0], CHECKER_AT[1])
        cb, sb = np.cos(bearing), np.sin(bearing)
        self.checker_turn = np.array([[cb, -sb, 0], [sb, cb, 0], [0, 0, 1]]) @ lean
        self.checker_foot = self.ground.sand(*CHECKER_AT) + UP * 0.06
        board = color_checker.color_checker(m)
        place(board, things, self.checker_foot, self.checker_turn, name="ColorChecker board")
        back = self.checker_turn @ (0, color_checker.THICKNESS, 0.8 * color_checker.HEIGHT)
        top = self.checker_foot + back
        behind = self.checker_foot + self.checker_turn @ np.array([0, 1.0, 0]) * 0.30
        foot = self.ground.sand(behind[0], behind[1]) - UP * 0.05
        place(to_mesh(props.board_strut(top, foot), "Checker strut", [m.aluminium], False), things)

        at = self.ground.sand(0.75, 6.1)
        turn = rotation_to((-0.55, -0.25, 0.62), 0.6)
        place(to_mesh(props.anchor(d), "Anchor", [m.iron]), things, at + UP * 0.12, turn)
        ring = at + UP * 0.12 + turn @ (props.ANCHOR_RING - (0, 0, 0.02))
        hover = ring + np.array([0.22, 0.3, 0.98])
        place(to_mesh(props.rope(ring, hover - UP * 0.18, d), "Rope", [m.rope]), things)
        place(to_mesh(props.glass_float(d), "Glass float", [m.glass, m.rope]), things, hover)

        self.hang_chain(ring, things)

        lamp = to_mesh(props.lamp(d), "Dive lamp", [m.aluminium, m.bulb])
        at = self.ground.sand(0.28, 3.15) + UP * 0.04
        place(lamp, things, at, rotation_to((0, 0, 1), np.radians(-128)))

    def hang_chain(self, ring: Array, things: bpy.types.Collection) -> None:
        """Let a chain hang from the anchor's ring and snake over the sand to the camera."""
        link = to_mesh(props.chain_link(self.detail), "Chain link", [self.materials.iron])
        t = np.linspace(0, 1, 400)
        swing = np.stack([ring[0] - 0.55 * t + 0.22 * np.sin(7 * t) * t, ring[1] - 2.6 * t**1.5], 1)
        sand = height(swing[:, 0], swing[:, 1], self.seed) + 0.015
        sag = np.exp(-np.linalg.norm(swing - swing[0], axis=1) / 0.11)
        line = np.stack(
            [*swing.T, sand + (ring[2] - sand) * sag - 1.4 * np.clip(t - 0.86, 0, 1)], axis=1
        )
        along = np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
        pitch = props.LINK_PITCH
        for number in range(int(along[-1] / pitch)):
            ends = [[np.interp((number + e) * pitch, along, c) for c in line.T] for e in (0, 1)]
            heading = normalised(np.subtract(ends[1], ends[0]))
            left = normalised(np.cross(UP, heading))
            # Links alternate between flat and on edge; on sand the latter lean over.
            up = np.cross(heading, left) if number % 2 else normalised(left + 0.3 * UP)
            up = normalised(up - heading * (up @ heading))
            turn = np.stack([heading, np.cross(up, heading), up], axis=1)
            place(link, things, np.mean(ends, axis=0), turn)

    # Fish

    def release_fish(self) -> None:
        """Release a school across the channel, a cloud over the table coral, and a pair."""
        self.swimmers = self.collection("Fish")
        skin = [self.materials.fish, self.materials.eye]
        self.fish = {
            s.name: [
                to_mesh(fish(s, phase, self.detail), s.name, skin) for phase in (0.0, 2.1, 4.2)
            ]
            for s in SPECIES
        }

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

    def swim(
        self, species: Species, variant: int, spot: Array, heading: Array, length: float
    ) -> None:
        """Put one fish into the water."""
        along = normalised(heading)
        left = normalised(np.cross(UP, along))
        turn = np.stack([along, left, np.cross(along, left)], axis=1)
        place(self.fish[species.name][variant], self.swimmers, spot, turn, length)

    def school(
        self,
        species: Species,
        count: int,
        length: float,
        path: Callable[[Array], Array],
        spread: Sequence[float],
        disorder: float,
    ) -> None:
        """Let fish swim along a path, none nearer than a body length to the next."""
        rng = generator(self.seed, species.name)
        spots: list[Array] = []
        while len(spots) < count:
            t = rng.beta(1.6, 1.4, 1)
            spot = path(t)[0] + rng.normal(size=3) * spread
            heading = (path(t + 0.02) - path(t - 0.02))[0]
            heading = normalised(heading) + rng.normal(size=3) * disorder * (1, 1, 0.5)
            clear = self.ground.tree().find_nearest(Vector(spot), length)[0] is None
            if clear and all(np.linalg.norm(spot - other) > 0.95 * length for other in spots):
                spots.append(spot)
                size = length * rng.uniform(0.85, 1.12)
                self.swim(species, int(rng.integers(3)), spot, heading, size)

    # Cameras

    def set_cameras(self) -> None:
        """Set the three cameras; "Reef" is the active one."""
        main = camera("Reef", (0.0, 0.0, -4.95), (0.05, 8.0, -5.9), 25.0)
        camera("Up", (-0.75, 3.9, -5.75), (-0.45, 6.4, -3.6), 16.0)
        middle = self.checker_foot + self.checker_turn @ (0, 0, color_checker.HEIGHT / 2)
        face = self.checker_turn @ np.array([0, -1.0, 0])
        camera("ColorChecker", middle + face * 1.10, middle, 50.0)
        bpy.context.scene.camera = main
