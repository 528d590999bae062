"""What objects stand on: the sand, and the solids laid on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree
from numpy.typing import ArrayLike, NDArray

from .shapes import Shape, joined

Array = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])


@dataclass
class Ground:
    """Where objects can stand.

    ``height`` gives z of the sand for arrays x and y; ``solids`` are in world
    space.
    """

    height: Callable[[ArrayLike, ArrayLike], Array]
    solids: list[Shape] = field(default_factory=list)
    _tree: BVHTree | None = None

    def add(self, solid: Shape) -> None:
        """Lay a rock or the like, in world space."""
        self.solids.append(solid)
        self._tree = None

    def tree(self) -> BVHTree:
        """Search tree over the solids."""
        if self._tree is None:
            solids = joined(self.solids)
            self._tree = BVHTree.FromPolygons(solids.vertices.tolist(), solids.triangles.tolist())
        return self._tree

    def sand(self, x: float, y: float) -> Array:
        """Point on the sand."""
        return np.array([x, y, float(self.height(x, y))])

    def below(self, x: float, y: float, start: float = 0.0) -> tuple[Array, Array, bool]:
        """Topmost point at (x, y) under z = `start`, its normal, and whether it is a solid."""
        sand = self.sand(x, y)
        point, normal, _, _ = self.tree().ray_cast(Vector((x, y, start)), Vector((0, 0, -1)))
        if point is None or point.z < sand[2]:
            return sand, UP, False
        return np.array(point), np.array(normal), True

    def facing(self, origin: ArrayLike, heading: ArrayLike) -> tuple[Array, Array] | None:
        """First solid seen from a point along a direction."""
        point, normal, _, _ = self.tree().ray_cast(Vector(origin), Vector(heading))
        return None if point is None else (np.array(point), np.array(normal))

    def clearance(self, point: ArrayLike, reach: float) -> float:
        """Distance to the nearest solid, at most `reach`."""
        distance = self.tree().find_nearest(Vector(point), reach)[3]
        return reach if distance is None else distance
