"""A cloud whose density is known at the nodes of a box, and linear between them."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..table import Axis, Lookup, Table, discrete_axis
from .gaussian_blob import GaussianBlob, RayInBlob

STEPS = 40
"""Steps in which a ray is followed through a grid."""
BLOCK = (512, 256)
"""Columns and rows of the nodes of a grid, slices side by side."""
WAYS = np.array(
    [*np.eye(3), *-np.eye(3), *((np.array(list(np.ndindex(2, 2, 2))) - 0.5) * 2.0 / math.sqrt(3.0))]
)
WEIGHTS = np.array([1.0 / 15.0] * 6 + [3.0 / 40.0] * 8)
"""Directions along axes and diagonals, and their fractions of a mean over all (Lebedev's rule)."""
LAMP_NODES = 24
"""Nodes along each side of a box that know what is between them and lamps."""
_LAMP_STEPS = 40
_MOST_LAMPS = 64  # of which a grid keeps what is between
_MOST = 64
"""Nodes along the longest side of a box."""
_EMPTY = 1e-9  # m, of matter along a ray
_STILL = 1e-6  # nodes per metre
_THINNEST = 1e-3  # of a node, so that no blob is flat

Array = NDArray[np.float64]


def box_axes(counts: Sequence[Operand]) -> tuple[Axis, ...]:
    """Return the axes of a box with so many nodes along its own x, y and z."""
    x, y, z = (Axis(name, count) for name, count in zip("xyz", counts, strict=True))
    return z, y, x


LAMP_BOX = box_axes((LAMP_NODES,) * 3)


@dataclass(frozen=True, eq=False)
class Grid:
    """A box of nodes.

    Formulas run on arrays and build shader nodes.
    """

    corner: Sequence[Operand]  #: Place of the first node, m, z up.
    #: Rows of the matrix that turns a way in the world, m, into nodes along the box's own axes.
    rows: Sequence[Operand]
    counts: Sequence[Operand]  #: Nodes along each axis.
    #: Density, its integral from there to the sun, and the length of matter, both m, that lets
    #: through what escapes from there, see :func:`escape_column`.
    nodes: Lookup
    lamps: Lookup | None = None  #: Integral of the density from there to each lamp, m.
    shining: int = 0  #: How many lamps it knows.

    def own(self, way: Sequence[Operand]) -> list[Operand]:
        """Return a way in the world, m, in nodes along the own axes."""
        return [dot(self.rows[3 * i : 3 * i + 3], way) for i in range(3)]

    def at(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> Sequence[Operand]:
        """Return the three numbers at a place, or what is nearest to it in the box."""
        x, y, z = self._held(point, m)
        return self.nodes.at(x=x, y=y, z=z)

    def _held(self, point: Sequence[Operand], m: Mathematics) -> list[Operand]:
        """Return a place in nodes, or the nearest of the box."""
        u = self.own([x - x0 for x, x0 in zip(point, self.corner, strict=True)])
        last = [count - 1.0 for count in self.counts]
        return [m.clamp(x, 0.0, end) for x, end in zip(u, last, strict=True)]

    def crossing(
        self, origin: Sequence[Operand], w: Sequence[Operand], m: Mathematics = NUMPY
    ) -> tuple[Operand, Operand]:
        """Distances at which a line enters and leaves the box, m; the first is larger beside it."""
        u = self.own([x - x0 for x, x0 in zip(origin, self.corner, strict=True)])
        entry, end = None, None
        for x, rate, count in zip(u, self.own(w), self.counts, strict=True):
            rate = m.select(m.less(m.absolute(rate), _STILL), _STILL, rate)
            one, other = -x / rate, (count - 1.0 - x) / rate
            near, far = m.minimum(one, other), m.maximum(one, other)
            entry = near if entry is None else m.maximum(entry, near)
            end = far if end is None else m.minimum(end, far)
        return entry, end

    def steps(
        self, origin: Sequence[Operand], w: Sequence[Operand], P: Operand, m: Mathematics = NUMPY
    ) -> tuple[Operand, Operand]:
        """Return where the steps through the box begin on a path of length P, and their length."""
        entry, end = self.crossing(origin, w, m)
        start = m.clamp(entry, 0.0 * P, P)
        return start, (m.maximum(m.minimum(end, P), start) - start) / STEPS

    def towards_sun(
        self, point: Sequence[Operand], back: Sequence[Operand], m: Mathematics = NUMPY
    ) -> Operand:
        """Integral of the density from a place towards the sun, m."""
        entry, end = self.crossing(point, back, m)
        start = m.maximum(entry, 0.0 * entry)
        _, column, _ = self.at([x + d * start for x, d in zip(point, back, strict=True)], m)
        return m.less(start, end) * column

    def from_lamp(
        self, number: Operand, lamp: Sequence[Operand], way: Sequence[Operand],
        m: Mathematics = NUMPY,
    ) -> Operand:  # fmt: skip
        """Integral of the density from a lamp over a way, m; 0 from one that is not known."""
        assert self.lamps is not None, "there are lamps"
        point, back = [x + d for x, d in zip(lamp, way, strict=True)], [-d for d in way]
        entry, end = self.crossing(point, back, m)
        start = m.maximum(entry, 0.0 * entry)
        u = self._held([x + d * start for x, d in zip(point, back, strict=True)], m)
        x, y, z = (
            at * ((LAMP_NODES - 1.0) / (n - 1.0)) for at, n in zip(u, self.counts, strict=True)
        )
        known = m.minimum(number, self.shining - 1.0)
        column = self.lamps.at(lamp=known, x=x, y=y, z=z) * m.less(number, self.shining - 0.5)
        # Nothing is between them if the box begins beyond the lamp.
        return m.less(start, m.minimum(end, 1.0)) * column


def ray_of(column: Operand, first: Operand, second: Operand, m: Mathematics) -> RayInBlob:
    """Return the Gaussian of a density's integrals along a ray, times distance to 0, 1 and 2."""
    mass = m.maximum(column, _EMPTY)
    middle = first / mass
    spread = m.sqrt(m.maximum(second / mass - middle * middle, _EMPTY))
    return RayInBlob(middle, 1.0 / spread, column, nearly=True)


@dataclass(frozen=True, eq=False)
class DensityGrid:
    """Density of a cloud at the nodes of a box in the world."""

    density: Array  #: Not negative, zero at the outermost nodes, (nx, ny, nz).
    corner: Array  #: Place of the first node, m, z up, (3,).
    axes: Array  #: Ways in m to the next node along each axis, as columns, (3, 3).

    @property
    def counts(self) -> tuple[int, int, int]:
        """Nodes along each axis."""
        x, y, z = self.density.shape
        return x, y, z

    @property
    def rows(self) -> Array:
        """Of :class:`Grid`, shape (3, 3)."""
        try:
            return np.linalg.inv(self.axes)
        except np.linalg.LinAlgError as error:
            raise InputError("a cloud is flat; give it a size along each axis") from error

    def places(self) -> Array:
        """Places of the nodes, m, shape (nx, ny, nz, 3)."""
        return self.corner + np.moveaxis(np.indices(self.counts), 0, -1) @ self.axes.T

    def or_known(self, known: DensityGrid | None) -> DensityGrid:
        """Return one that is the same, or what is known of one that only stands elsewhere."""
        if known is None or not all(
            np.array_equal(getattr(self, x), getattr(known, x)) for x in ("density", "axes")
        ):
            return self
        if np.array_equal(self.corner, known.corner):
            return known
        vars(self)["outwards"] = known.outwards
        return self

    def lit(self, sun: ArrayLike, transport: float, lamps: Sequence[Sequence[float]] = ()) -> Grid:
        """Return what formulas need of it.

        ``transport`` is that of :func:`escape_column`; ``sun`` the unit direction of sunlight.
        """
        found = (
            self.density,
            self.column_towards(-np.asarray(sun, dtype=np.float64)),
            escape_column(self.outwards, transport),
        )
        axes = *box_axes(self.counts), discrete_axis("number", len(found))
        nodes = Table(np.stack(found, axis=-1).swapaxes(0, 2)[..., None], axes)
        place = list(self.corner), list(self.rows.ravel()), self.counts
        if not lamps:
            return Grid(*place, nodes)
        columns = np.array([self.column_to(tuple(lamp)).T for lamp in lamps])
        by_lamp = Table(columns[..., None], (discrete_axis("lamp", len(lamps)), *LAMP_BOX))
        return Grid(*place, nodes, by_lamp, len(lamps))

    def wet(self) -> DensityGrid:
        """Return the same with nothing above the water."""
        below = self.places()[..., 2] < 0.0
        return DensityGrid(self.density * below, self.corner, self.axes)

    def blob(self) -> GaussianBlob:
        """Return the blob of the same middle and spread along each axis."""
        mass = self.density.sum()
        u = np.indices(self.counts).reshape(3, -1)
        weight = self.density.ravel() / mass if mass > 0 else np.full(u.shape[1], 1.0 / u.shape[1])
        middle = u @ weight
        spread = np.sqrt(((u - middle[:, None]) ** 2) @ weight + _THINNEST)
        return GaussianBlob.of_axes(self.corner + self.axes @ middle, self.axes * (2.0 * spread))

    def column_towards(self, direction: ArrayLike) -> Array:
        """Integral of the density from each node along a direction, m, by the trapezoidal rule."""
        way = self.rows @ np.asarray(direction, dtype=np.float64)
        along = int(np.argmax(np.abs(way)))
        density = np.moveaxis(self.density, along, 0)
        sides = np.delete(way, along) / abs(way[along])
        if way[along] < 0:
            density = density[::-1]
        total, last = 0.5 * density, len(density) - 1
        for step in range(1, last + 1):
            # All places of a slice look at the same place of one that is so many slices farther.
            moved = density[step:]
            for axis, side in enumerate(sides, 1):
                moved = _shifted(moved, step * side, axis)
            total[: last + 1 - step] += moved
        total = total[::-1] if way[along] < 0 else total
        return np.moveaxis(total, 0, along) / abs(way[along])

    def column_to(self, lamp: tuple[float, ...]) -> Array:
        """Integral of the density from some nodes to a lamp, m, shape (n, n, n).

        There are :data:`LAMP_NODES` along each axis; for a lamp it is computed once.
        """
        if lamp not in self._to_lamps:
            if len(self._to_lamps) >= _MOST_LAMPS:
                self._to_lamps.clear()
            self._to_lamps[lamp] = self._column_to(lamp)
        return self._to_lamps[lamp]

    @functools.cached_property
    def _to_lamps(self) -> dict[tuple[float, ...], Array]:
        return {}

    def _column_to(self, lamp: tuple[float, ...]) -> Array:
        last = np.array(self.counts) - 1.0
        some = np.moveaxis(np.indices((LAMP_NODES,) * 3), 0, -1) * (last / (LAMP_NODES - 1.0))
        way = self.rows @ (np.asarray(lamp, dtype=np.float64) - self.corner) - some
        ahead = np.where(np.abs(way) < _STILL, _STILL, way)
        # Until the box ends, or the lamp is met.
        end = np.minimum(np.where(ahead > 0, last - some, some) / np.abs(ahead), 1.0).min(axis=-1)
        density = Table(self.density.T[..., None], box_axes(self.counts))
        total = np.zeros((*some.shape[:3], 1))
        for step in range(_LAMP_STEPS):
            u = some + way * (end * ((step + 0.5) / _LAMP_STEPS))[..., None]
            total += density.at(**{name: u[..., i : i + 1] for i, name in enumerate("xyz")})
        return total[..., 0] * end * np.linalg.norm(way @ self.axes.T, axis=-1) / _LAMP_STEPS

    @functools.cached_property
    def outwards(self) -> Array:
        """Integrals from each node along :data:`WAYS` of the box, m, shape (14, nx, ny, nz)."""
        own = self.axes / np.linalg.norm(self.axes, axis=0)
        return np.array([self.column_towards(own @ way) for way in WAYS])


def _shifted(values: Array, by: float, axis: int) -> Array:
    """Values that many places farther along an axis, linear between them, zero outside."""
    low = math.floor(by)
    near, far = (_moved(values, low + beyond, axis) for beyond in (0, 1))
    return near + (by - low) * (far - near)


def _moved(values: Array, by: int, axis: int) -> Array:
    out, count = np.zeros_like(values), values.shape[axis]
    if abs(by) >= count:
        return out
    ahead, behind = [slice(None)] * values.ndim, [slice(None)] * values.ndim
    ahead[axis] = slice(max(by, 0), count + min(by, 0))
    behind[axis] = slice(max(-by, 0), count - max(by, 0))
    out[tuple(behind)] = values[tuple(ahead)]
    return out


def escape_column(outwards: Array, transport: float) -> Array:
    """Length of matter that lets through as much as what leaves to all sides does on average.

    ``outwards`` (14, ...) are integrals of the density along :data:`WAYS`, m; ``transport`` keeps
    light at density 1, 1/m.
    """
    if transport <= 0:
        return np.tensordot(WEIGHTS, outwards, 1)
    return -np.log(np.tensordot(WEIGHTS, np.exp(-transport * outwards), 1)) / transport


def node_counts(size: ArrayLike) -> tuple[int, int, int]:
    """Return how many nodes, a margin included, a box of a size gets along each axis.

    As many as a block has room for, at about the same distance along each axis.
    """
    lengths = np.asarray(size, dtype=np.float64)
    if not (np.all(np.isfinite(lengths)) and np.all(lengths > 0)):
        raise InputError("a cloud is flat; give it a size along each axis")
    for most in range(_MOST, 4, -1):
        counts = [max(int(n), 2) + 2 for n in np.ceil(lengths / lengths.max() * (most - 2))]
        across = BLOCK[0] // counts[0]
        if across and -(-counts[2] // across) * counts[1] <= BLOCK[1]:
            return counts[0], counts[1], counts[2]
    raise InputError("a cloud is flat; give it a size along each axis")
