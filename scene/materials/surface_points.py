"""Places on a surface at which a material is evaluated."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

Array = NDArray[np.float64]
_GENERALISED_GOLDEN = {2: 1.324717957244746, 3: 1.2207440846057596}


def spread(count: int, axes: int = 2) -> Array:
    """Points that fill the unit square or cube evenly, shape (count, axes).

    The sequences R2 and R3 of M. Roberts, "The unreasonable effectiveness of quasirandom sequences"
    (2018).
    """
    steps = _GENERALISED_GOLDEN[axes] ** -(1.0 + np.arange(axes))
    return (0.5 + np.arange(count)[:, None] * steps) % 1.0


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on a square of which nothing else is known: all of a picture, no attributes."""

    count: int = 512
    item: bpy.types.Object | None = None  #: What they are on.
    place: Matrix = field(default_factory=Matrix)  #: Of the object, or of its instance.

    @property
    def has_mesh(self) -> bool:
        """Whether they are on a mesh, so that what they lack is not there."""
        return False

    def uv(self, name: str = "") -> Array | None:
        """Return coordinates of a UV map, that of renders without a name, shape (n, 3)."""
        return None if name else np.pad(spread(self.count), ((0, 0), (0, 1)))

    def attribute(self, name: str) -> Array | None:
        """Return an attribute, shape (n, 1), (n, 3) or (n, 4); the colours without a name."""
        del name
        return None

    def generated(self) -> Array | None:
        """Return places in the mesh's own box, shape (n, 3)."""
        return self.uv()

    def local(self) -> Array | None:
        """Return places in the object's space, shape (n, 3)."""
        return None

    def normal(self) -> Array | None:
        """Return normals in the object's space, shape (n, 3)."""
        return None
