"""How finely the scene is meshed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Detail:
    """Mesh resolution; the composition is the same in every detail.

    Parameters
    ----------
    coarser : int
        Subdivision levels taken from every sphere.
    sides : int
        Sides of a branch; other round objects follow it.
    floor_spacing : float
        Factor on the spacing of the seafloor's vertices.
    density : float
        Fraction of the twigs, pebbles and small corals that are built.
    image_size : int
        Pixels along the edge of a texture.
    """

    coarser: int
    sides: int
    floor_spacing: float
    density: float
    image_size: int

    def level(self, level: int) -> int:
        """Subdivision level of a sphere in this detail."""
        return max(1, level - self.coarser)


DETAILS = {
    "draft": Detail(3, 3, 13.0, 0.08, 128),
    "panel": Detail(2, 5, 4.0, 0.25, 256),
    "full": Detail(0, 7, 1.0, 1.0, 1024),
}
