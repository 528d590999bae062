"""How finely the scene is meshed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Detail:
    """Mesh resolution; the composition is the same in every detail.

    ``coarser`` is subdivision levels taken from every sphere; ``sides`` those of a branch, which
    other round objects follow; ``floor_spacing`` a factor on the spacing of the seafloor's
    vertices; ``density`` the fraction of the twigs, pebbles and small corals that are built;
    ``image_size`` pixels along the edge of a texture.
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
