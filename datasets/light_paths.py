"""What the water leaves of light on the way to the pixels of a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.imaging.resolved_optics import ResolvedOptics
from ..uw_spectral.transfer.radiance_field import distance_in_water
from .axes import inverse, world_to_opencv
from .camera import PinholeCamera

Array = NDArray[np.float64]


def extinction_to(
    optics: ResolvedOptics, camera: PinholeCamera, camera_to_world: ArrayLike, distances: ArrayLike
) -> tuple[Array, Array]:
    """Return mean extinction c before what is seen, 1/m, and the length of the water there, m.

    Their shapes are (height, width, n) and (height, width). ``camera_to_world``, shape (4, 4), is
    the pose in Blender's axes; ``distances``, shape (height, width), are Euclidean ranges, m; where
    they are infinite, the way ends at surface or floor.
    """
    pose = inverse(world_to_opencv(camera_to_world))
    down = -(camera.rays() @ pose[2, :3])
    depth = -float(pose[2, 3])
    z = np.asarray(distances, np.float64)
    far = ~np.isfinite(z)
    way = np.where(far, distance_in_water(depth, down, optics.column.floor_depth), z)
    ends = np.maximum(depth + down * way, 0.0)
    return optics.solved_field().extinction_between(depth, ends, scaled=False), way


def transmittance(
    optics: ResolvedOptics, camera: PinholeCamera, camera_to_world: ArrayLike, distances: ArrayLike
) -> Array:
    """Return the fraction exp(-c z) of light that arrives unscattered, shape (height, width, n).

    Arguments as of :func:`extinction_to`.
    """
    c, way = extinction_to(optics, camera, camera_to_world, distances)
    return np.exp(-c * way[..., None])
