"""A cloud whose density falls off from its middle as a Gaussian does, along three axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand, dot, error_function, normal_fraction

_HALF = math.sqrt(math.pi / 2.0)
_EDGE = 2.0
"""Standard deviations at which the outline of a blob is drawn: its density is e^-2 there."""
REACH = 3.5
"""Standard deviations beyond which nothing of a blob is left: 0.05 % of a path through it."""
_LEAST = 1e-12  # square of a way in standard deviations
FAR = 1e5
"""Length in m of a path that does not end."""


@dataclass(frozen=True, eq=False)
class RayInBlob:
    """A straight path, as the density along it is a Gaussian of the distance."""

    middle: Operand  #: Distance at which the density is largest, m.
    rate: Operand  #: Inverse of its standard deviation, 1/m.
    whole: Operand  #: Integral of the density over the endless path, m.
    nearly: bool = False  #: Whether fractions of it may err by 1.4e-4, in a third of the steps.

    def until(self, s: Operand, m: Mathematics = NUMPY) -> Operand:
        """Fraction of the integral that lies before a distance, 0 to 1."""
        if self.nearly:
            return normal_fraction((s - self.middle) * self.rate, m)
        x = (s - self.middle) * self.rate * math.sqrt(0.5)
        return 0.5 + 0.5 * error_function(x, m)

    def column(self, s: Operand, m: Mathematics = NUMPY) -> Operand:
        """Integral of the density over the first s metres, m."""
        return m.maximum(self.whole * (self.until(s, m) - self.until(0.0, m)), 0.0)


@dataclass(frozen=True, eq=False)
class GaussianBlob:
    """An ellipsoid of Gaussian density, 1 in its middle.

    Formulas run on arrays and build shader nodes.
    """

    middle: Sequence[Operand]  #: Place of its middle, m, z up.
    #: Rows of the matrix that turns a way in the world, m, into standard deviations along the
    #: blob's own axes.
    rows: Sequence[Operand]

    @classmethod
    def of_axes(cls, middle: ArrayLike, axes: ArrayLike) -> GaussianBlob:
        """Return the blob whose outline has three half axes, as columns, m.

        They go from the middle to where the density is e^-2.

        Raises
        ------
        InputError
            If an axis is zero, or all lie in a plane.
        """
        found = np.asarray(axes, dtype=np.float64)
        try:
            rows = _EDGE * np.linalg.inv(found)
        except np.linalg.LinAlgError as error:
            raise InputError("a cloud is flat; give it a size along each axis") from error
        if not np.all(np.isfinite(rows)):
            raise InputError("a cloud is flat; give it a size along each axis")
        place = [float(x) for x in np.asarray(middle)]
        return cls(tuple(place), tuple(float(x) for x in rows.ravel()))

    @property
    def size(self) -> float:
        """Geometric mean of the standard deviations along the axes, m."""
        return float(abs(np.linalg.det(np.reshape(self.rows, (3, 3)))) ** (-1.0 / 3.0))

    def own(self, way: Sequence[Operand]) -> list[Operand]:
        """Return a way in the world, m, in standard deviations along the own axes."""
        return [dot(self.rows[3 * i : 3 * i + 3], way) for i in range(3)]

    def place(self, point: Sequence[Operand]) -> list[Operand]:
        """Return a place in standard deviations from the middle."""
        return self.own([x - x0 for x, x0 in zip(point, self.middle, strict=True)])

    def density(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """Density at a place, 0 to 1.

        Examples
        --------
        >>> blob = GaussianBlob.of_axes((0, 0, -5), np.diag([1.0, 1.0, 2.0]))
        >>> [round(float(blob.density((0, 0, z))), 3) for z in (-5, -3)]
        [1.0, 0.135]
        """
        u = self.place(point)
        return m.exp(-0.5 * dot(u, u))

    def along(
        self,
        origin: Sequence[Operand],
        w: Sequence[Operand],
        m: Mathematics = NUMPY,
        *,
        nearly: bool = False,
    ) -> RayInBlob:
        """Return the density along a ray."""
        q = self.own(w)
        return self._along(origin, q, dot(q, q), m, nearly=nearly)

    def between(
        self, start: Sequence[Operand], way: Sequence[Operand], m: Mathematics = NUMPY
    ) -> Operand:
        """Integral of the density from a place over a way, m, which may be nothing.

        Within 3e-4 of that over the endless path.

        Examples
        --------
        >>> blob = GaussianBlob.of_axes((0, 0, -5), 2.0 * np.eye(3))
        >>> round(float(blob.between((0, -9, -5), (0, 9, 0))) / (np.pi / 2.0) ** 0.5, 3)
        1.0
        """
        q = self.own(way)
        ray = self._along(start, q, dot(q, q) + _LEAST, m, nearly=True)
        return ray.column(1.0, m) * m.sqrt(dot(way, way))

    def _along(
        self,
        origin: Sequence[Operand],
        q: Sequence[Operand],
        square: Operand,
        m: Mathematics,
        *,
        nearly: bool,
    ) -> RayInBlob:
        u = self.place(origin)
        middle = -dot(u, q) / square
        # What is nearest to the middle of the blob: differences of squares would lose digits.
        nearest = [a + b * middle for a, b in zip(u, q, strict=True)]
        rate = m.sqrt(square)
        whole = m.exp(-0.5 * dot(nearest, nearest)) * (_HALF * 2.0 / rate)
        return RayInBlob(middle, rate, whole, nearly)

    def outwards(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> list[Operand]:
        """Integrals of the density from a place along the six directions of the axes, m."""
        u, found = self.place(point), []
        squares = [x * x for x in u]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            # Length in the world of a standard deviation along the axis: rows are orthogonal.
            row = self.rows[3 * i : 3 * i + 3]
            whole = m.exp(-0.5 * (squares[j] + squares[k])) * (2.0 * _HALF / m.sqrt(dot(row, row)))
            before = 0.5 + 0.5 * error_function(u[i] * math.sqrt(0.5), m)
            found += [whole * before, whole * (1.0 - before)]
        return found
