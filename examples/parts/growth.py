"""The corals and sponges that settle in the scenes: a few meshes of each kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import bpy

from . import corals
from .detail import Detail
from .materials import Materials
from .shapes import Shape, to_mesh

Skin = bpy.types.Material


@dataclass
class Growth:
    """Meshes of corals, each kind made when first asked for."""

    seed: int
    detail: Detail
    materials: Materials
    made: dict[str, list[bpy.types.Mesh]] = field(default_factory=dict)

    def meshes(self, kind: str) -> list[bpy.types.Mesh]:
        """Return the meshes of a kind."""
        if kind not in self.made:
            self.made[kind] = self.recipes[kind]()
        return self.made[kind]

    @property
    def recipes(self) -> dict[str, Callable[[], list[bpy.types.Mesh]]]:
        """How each kind is made."""
        return {
            "staghorn": lambda: [to_mesh(s, "Staghorn cream", [self.cream]) for s in self.staghorn],
            "blue staghorn": lambda: [to_mesh(self.staghorn[0], "Staghorn blue", [self.blue])],
            "bush": lambda: [to_mesh(s, "Staghorn bush cream", [self.cream]) for s in self.bushes],
            "blue bush": lambda: [to_mesh(self.bushes[1], "Staghorn bush blue", [self.blue])],
            "table": lambda: [
                to_mesh(corals.table(self.seed, f"table {i}", self.detail, 700), name, [skin])
                for i, (name, skin) in enumerate(
                    [("Table", self.plates[0]), ("Table green", self.plates[1])]
                )
            ],
            "small table": lambda: [
                to_mesh(
                    corals.table(self.seed, f"small table {i}", self.detail, 200),
                    f"Small {skin.name.lower()}",
                    [skin],
                )
                for i, skin in enumerate(self.plates)
            ],
            "brain": lambda: self.brains("brain", "Brain", 6),
            "small brain": lambda: self.brains("small", "Small brain", 4),
            "boulder": lambda: self.boulders("boulder", "Porites", 5),
            "small boulder": lambda: self.boulders("small", "Small Porites", 3),
            "fan": lambda: [
                to_mesh(
                    corals.sea_fan(self.seed, f"fan {name}", self.detail),
                    f"Sea fan {name}",
                    [self.materials.plain(f"Sea fan {name}", color, 0.3)],
                )
                for name, color in (("violet", (0.32, 0.07, 0.33)), ("red", (0.62, 0.09, 0.04)))
            ],
            "sponge": lambda: [
                to_mesh(
                    corals.tube_sponge(self.seed, f"sponge {name}", self.detail),
                    f"Tube sponge {name}",
                    [self.materials.hollow(f"Tube sponge {name}", color)],
                )
                for name, color in (("yellow", (0.70, 0.46, 0.04)), ("purple", (0.30, 0.14, 0.36)))
            ],
        }

    # Skins and shapes that several kinds share

    @cached_property
    def cream(self) -> Skin:
        """Cream staghorn coral."""
        return self.materials.branching("Staghorn cream", (0.40, 0.25, 0.09), (0.80, 0.72, 0.55))

    @cached_property
    def blue(self) -> Skin:
        """Blue staghorn coral."""
        return self.materials.branching("Staghorn blue", (0.16, 0.15, 0.30), (0.55, 0.58, 0.85))

    @cached_property
    def plates(self) -> tuple[Skin, Skin]:
        """Brown and green table coral."""
        skin = self.materials.branching
        return (
            skin("Table coral", (0.26, 0.17, 0.075), (0.62, 0.52, 0.30)),
            skin("Table coral green", (0.12, 0.19, 0.07), (0.50, 0.58, 0.30)),
        )

    @cached_property
    def grooved(self) -> dict[str, Skin]:
        """Olive and ochre brain coral."""
        skin = self.materials.grooved
        return {
            "olive": skin("Brain coral olive", (0.34, 0.30, 0.08), (0.07, 0.16, 0.05)),
            "ochre": skin("Brain coral ochre", (0.46, 0.25, 0.08), (0.16, 0.10, 0.05)),
        }

    @cached_property
    def staghorn(self) -> list[Shape]:
        """Thickets."""
        return [corals.staghorn(self.seed, f"staghorn {i}", self.detail, 10) for i in range(3)]

    @cached_property
    def bushes(self) -> list[Shape]:
        """Small thickets."""
        return [corals.staghorn(self.seed, f"bush {i}", self.detail, 5) for i in range(2)]

    def brains(self, part: str, name: str, level: int) -> list[bpy.types.Mesh]:
        """Brain corals in their two skins."""
        fine = self.detail.level(level)
        return [
            to_mesh(corals.brain(self.seed, f"{part} {c}", fine), f"{name} {c}", [skin])
            for c, skin in self.grooved.items()
        ]

    def boulders(self, part: str, name: str, level: int) -> list[bpy.types.Mesh]:
        """Massive coral."""
        shape = corals.boulder(self.seed, part, self.detail.level(level))
        return [to_mesh(shape, name, [self.materials.massive])]
