"""Cubic cells in a box, for voxels and for probes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Grid:
    """Cubic cells in a box.

    Raises
    ------
    InputError
        If there is no cell, or a number is not finite.

    Examples
    --------
    >>> grid = Grid((0.0, 0.0, -2.0), 0.5, (4, 4, 4))
    >>> grid.position([1.0, 0.25, -2.0])
    array([ 1.5,  0. , -0.5])
    """

    lower: tuple[float, float, float]  #: Its lowest corner, m; x, y horizontal, z up.
    cell: float  #: Edge of a cell, m.
    shape: tuple[int, int, int]  #: Cells along each axis.
    #: A corner of cells, m, from which places on a lattice are counted.
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (0 < self.cell < math.inf and min(self.shape) > 0 and np.isfinite(self.lower).all()):
            raise InputError(
                f"grid: cells of {self.cell:g} m, {self.shape} of them from {self.lower}; all "
                "must be finite, and there must be some"
            )

    @classmethod
    def around(cls, low: ArrayLike, high: ArrayLike, cells: int, least: float) -> Grid:
        """Return about so many cells, no smaller than ``least`` m, that fill a box."""
        low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        size = np.maximum(high - low, least)
        cell = max((float(size.prod()) / cells) ** (1 / 3), least)
        shape = _cells(size, cell)
        # A flat box has fewer cells across than its volume says.
        while shape.prod() > max(cells, 1):
            cell *= 1.05
            shape = _cells(size, cell)
        lower = (low + high - shape * cell) / 2.0
        nx, ny, nz = (int(n) for n in shape)
        return cls(_three(lower), cell, (nx, ny, nz))

    @classmethod
    def on_lattice(
        cls,
        low: ArrayLike,
        high: ArrayLike,
        cell: float,
        block: int = 1,
        anchor: ArrayLike = (0.0, 0.0, 0.0),
    ) -> Grid:
        """Return cells of the lattice through a point that hold a box, in whole blocks.

        A box that moves a little has the same cells; one that moves more shares most of them.

        ``anchor`` is a corner of cells, m; ``block`` tells how many come and go together,
        horizontally.
        """
        cells, slack, origin = np.array([block, block, 1]), 1e-4, np.asarray(anchor, np.float64)
        first = np.floor(np.subtract(low, origin) / (cells * cell) + slack) * cells
        last = np.ceil(np.subtract(high, origin) / (cells * cell) - slack) * cells
        shape = np.maximum(last - first, 1.0).astype(np.intp)
        nx, ny, nz = (int(n) for n in shape)
        return cls(_three(origin + first * cell), cell, (nx, ny, nz), _three(origin))

    def finer(self, parts: int) -> Grid:
        """Return the box with so many cells along each of these.

        Examples
        --------
        >>> Grid((0.0, 0.0, 0.0), 0.5, (2, 1, 1)).finer(2).shape
        (4, 2, 2)
        """
        nx, ny, nz = (parts * n for n in self.shape)
        return Grid(self.lower, self.cell / parts, (nx, ny, nz), self.anchor)

    @property
    def first(self) -> tuple[int, int, int]:
        """Place of the first cell on the lattice."""
        ends = zip(self.lower, self.anchor, strict=True)
        x, y, z = (round((low - anchor) / self.cell) for low, anchor in ends)
        return x, y, z

    @property
    def count(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @property
    def upper(self) -> Array:
        """The highest corner, m."""
        return np.asarray(self.lower) + self.cell * np.asarray(self.shape)

    def centres(self) -> Array:
        """Middles of the cells, shape (count, 3); the last axis varies fastest."""
        axes = [
            low + self.cell * (np.arange(n) + 0.5)
            for low, n in zip(self.lower, self.shape, strict=True)
        ]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return points.reshape(-1, 3).astype(np.float64)

    def position(self, points: ArrayLike) -> Array:
        """Places of points (..., 3) in cells, 0 in the middle of the first."""
        return (np.asarray(points, np.float64) - self.lower) / self.cell - 0.5

    def index(self, points: ArrayLike) -> NDArray[np.intp]:
        """Cell of each point (..., 3), the nearest for those outside."""
        places = np.rint(self.position(points)).astype(np.intp)
        return self.flat(np.clip(places, 0, np.asarray(self.shape) - 1))

    def flat(self, places: NDArray[np.intp]) -> NDArray[np.intp]:
        """Number of the cell at whole places (..., 3)."""
        _, ny, nz = self.shape
        return (places[..., 0] * ny + places[..., 1]) * nz + places[..., 2]

    def inside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie in the box."""
        points = np.asarray(points, np.float64)
        return ((points >= self.lower) & (points < self.upper)).all(axis=-1)

    def exit_distance(self, origin: Array, direction: Array) -> Array:
        """Distance along rays (..., 3) from inside to the side of the box, m."""
        slope = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
        side = np.where(slope > 0, self.upper, np.asarray(self.lower))
        return np.maximum(((side - origin) / slope).min(axis=-1), 0.0)


def _cells(size: Array, cell: float) -> NDArray[np.intp]:
    """Cells that a box takes along each axis."""
    return np.maximum(np.ceil(size / cell - 1e-9).astype(np.intp), 1)


def _three(values: Sequence[float] | Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z
