"""Things in the water: what light they keep away, and what they send back.

Surfaces are kept as voxels (:mod:`.voxels`). At points of a coarser grid the light that
arrives is gathered along rays through them (:mod:`.probes`), compared with that of the
undisturbed water (:mod:`.disturbed_light`), and kept as a few numbers that a renderer looks
up (:mod:`.shade_table`).
"""

from .disturbed_light import DisturbedLight
from .grid import Grid
from .probes import Rays, cast
from .shade_table import ShadeTable, without_shade
from .voxels import SurfaceVoxels, voxelise

__all__ = [
    "DisturbedLight",
    "Grid",
    "Rays",
    "ShadeTable",
    "SurfaceVoxels",
    "cast",
    "voxelise",
    "without_shade",
]
