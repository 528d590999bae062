"""Objects in the water: what light they keep away, and what they send back.

Surfaces are kept as voxels (:mod:`.voxels`). At points of a coarser grid the light that
arrives is gathered along rays through them (:mod:`.probes`), compared with that of the
unoccluded water (:mod:`.probe_irradiance`), and kept as a few numbers that a renderer looks
up (:mod:`.occlusion_table`).
"""

from .grid import Grid
from .occlusion_table import OcclusionTable, without_occlusion
from .probe_irradiance import ProbeIrradiance
from .probes import Rays, cast
from .voxels import SurfaceVoxels, voxelise

__all__ = [
    "Grid",
    "OcclusionTable",
    "ProbeIrradiance",
    "Rays",
    "SurfaceVoxels",
    "cast",
    "voxelise",
    "without_occlusion",
]
