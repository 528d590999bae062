"""What every builder of a scene can do: lay sand, strew stones, let corals settle and fish swim."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import bpy
import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import props
from .detail import Detail
from .fish import Species, fish
from .ground import UP, Ground
from .growth import Growth
from .materials import Materials
from .noise import generator
from .rocks import stone
from .shapes import normalised, place, rotation_to, to_mesh

Array = NDArray[np.float64]


class Builder:
    """Builds a scene, part by part; ``height`` is z of the sand for arrays x and y, m."""

    def __init__(
        self, seed: int, detail: Detail, height: Callable[[ArrayLike, ArrayLike], Array]
    ) -> None:
        self.seed, self.detail = seed, detail
        self.materials = Materials(seed, detail)
        self.ground = Ground(height)
        self.growth = Growth(seed, detail, self.materials)
        self.taken: list[tuple[Array, float]] = []
        self._collections: dict[str, bpy.types.Collection] = {}
        self._fish: dict[str, list[bpy.types.Mesh]] = {}

    def build(self) -> None:
        """Fill the scene."""
        raise NotImplementedError

    def collection(self, name: str) -> bpy.types.Collection:
        """Return a collection of the scene, made when first asked for."""
        if name not in self._collections:
            self._collections[name] = bpy.data.collections.new(name)
            bpy.context.scene.collection.children.link(self._collections[name])
        return self._collections[name]

    def few(self, count: int) -> int:
        """How many of many in this detail."""
        return max(1, round(count * self.detail.density))

    def stones(self) -> list[bpy.types.Mesh]:
        """Three loose stones, about 1 m across."""
        return [
            to_mesh(
                stone(self.seed, f"stone {i}", self.detail.level(3)),
                f"Stone {i}",
                [self.materials.rock],
            )
            for i in range(3)
        ]

    # Corals

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
        meshes = self.growth.meshes(kind)
        axis = normalised(normal * (1 - upright) + UP * upright)
        self.taken.append((foot, scale))
        foot = foot - axis * 0.03 * scale - normal * 0.02 * scale
        turn = rotation_to(axis, spin)
        place(meshes[variant % len(meshes)], self.collection("Corals"), foot, turn, scale)

    def has_room(self, foot: Array, scale: float) -> bool:
        """Whether a coral of this scale touches no other."""
        return all(np.linalg.norm(foot - o) > 0.34 * (scale + s) for o, s in self.taken)

    # Objects

    def lay_chain(self, line: Array, size: float = 1.0) -> None:
        """Lay a chain along a line of shape (n, 3), its links `size` times those of an anchor."""
        link = to_mesh(props.chain_link(self.detail), "Chain link", [self.materials.iron])
        along = np.append(0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
        pitch = props.LINK_PITCH * size
        for number in range(int(along[-1] / pitch)):
            ends = [[np.interp((number + e) * pitch, along, c) for c in line.T] for e in (0, 1)]
            heading = normalised(np.subtract(ends[1], ends[0]))
            left = normalised(np.cross(UP, heading))
            # Links alternate between flat and on edge; on sand the latter lean over.
            up = np.cross(heading, left) if number % 2 else normalised(left + 0.3 * UP)
            up = normalised(up - heading * (up @ heading))
            turn = np.stack([heading, np.cross(up, heading), up], axis=1)
            place(link, self.collection("Things"), np.mean(ends, axis=0), turn, size)

    # Fish

    def swim(
        self, species: Species, variant: int, spot: Array, heading: Array, length: float
    ) -> None:
        """Put one fish into the water."""
        if species.name not in self._fish:
            skin = [self.materials.fish, self.materials.eye]
            self._fish[species.name] = [
                to_mesh(fish(species, phase, self.detail), species.name, skin)
                for phase in (0.0, 2.1, 4.2)
            ]
        along = normalised(heading)
        left = normalised(np.cross(UP, along))
        turn = np.stack([along, left, np.cross(along, left)], axis=1)
        place(self._fish[species.name][variant], self.collection("Fish"), spot, turn, length)

    def school(
        self,
        species: Species,
        count: int,
        length: float,
        path: Callable[[Array], Array],
        spread: Sequence[float],
        disorder: float,
        part: str | None = None,
    ) -> None:
        """Let fish swim along a path, none nearer than a body length to the next.

        `part` names the random stream, by default the species.
        """
        rng = generator(self.seed, part or species.name)
        spots: list[Array] = []
        while len(spots) < count:
            t = rng.beta(1.6, 1.4, 1)
            spot = path(t)[0] + rng.normal(size=3) * spread
            heading = (path(t + 0.02) - path(t - 0.02))[0]
            heading = normalised(heading) + rng.normal(size=3) * disorder * (1, 1, 0.5)
            clear = self.ground.clearance(spot, length) >= length
            if clear and all(np.linalg.norm(spot - other) > 0.95 * length for other in spots):
                spots.append(spot)
                size = length * rng.uniform(0.85, 1.12)
                self.swim(species, int(rng.integers(3)), spot, heading, size)
