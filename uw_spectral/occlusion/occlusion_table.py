"""Probe irradiance as a table that a renderer looks up: what is in it, where, and its use.

Ratios to the unoccluded light are kept as numbers that all bands share: their mean, and how they
differ from it along two spectra; beside these is how much of the sun is seen. Both are kept for the
directions of :mod:`.view_directions`; what lies between is mixed, of patches by about the
unoccluded light of each, for that is what a ratio stands for.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import Axis, Table, discrete_axis
from ..transfer.channel_tables import ON_PATH, SPECTRA
from . import view_directions as views
from .fitted_cells import NUMBERS, FittedCells
from .grid import Array, Grid
from .probe_irradiance import FADE, ProbeIrradiance

IRRADIANCE, SCATTERED = 0, 1
"""On patches, and of the light scattered along a ray."""
STEPS = 4
"""Places along a ray that are looked at."""
OFF_SURFACE = 0.7
"""Cells from a patch to the place that is looked up for it, along its normal."""
_SUNLIT = 3  # which number of an entry is the sun's
_RING = 1  # cells around the grid, of the light beyond it
_LEAST = 1e-6
_DARK = 0.02  # fraction of the light at which its colour is not told any more
_DIM = 0.03  # fraction of the light below which errors of its colour are not relative
_FIFTHS = 5
_OPEN = (1.0, 0.0, 0.0, 1.0)  # without occlusion


@dataclass(frozen=True)
class OcclusionBox:
    """Where the table lies, and what its ratios are mixed with; numbers or node values."""

    #: Middle of the first cell of the grid, m; one cell around it has the light beyond.
    lower: Sequence[Operand]
    per_metre: Operand  #: Cells in a metre.
    last: Sequence[Operand]  #: Number of the last cell of the table along each axis.
    slope: Operand  #: How much more of the unoccluded light is from above than below, -1 to 1.
    reach: Operand  #: Distance that :data:`STEPS` are spread over, m.
    forward_scattering: Operand  #: Of :attr:`.ProbeIrradiance.forward_scattering`, 1/m.

    @property
    def axes(self) -> tuple[Axis, ...]:
        """Axes of the table: what is kept, of which direction, and its cells."""
        cells = (Axis(name, n + 1.0) for name, n in zip("zyx", self.last[::-1], strict=True))
        return discrete_axis("kind", 2), discrete_axis("tile", views.COUNT), *cells

    def place(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> list[Operand]:
        """Position of a point among the cells of the table; far away is its border."""
        places = []
        for x, low, last in zip(point, self.lower, self.last, strict=True):
            at = (x - low) * self.per_metre
            inside = m.clamp(at, 0.0, last - 2.0 * _RING)
            off = at - inside
            places.append(inside + _RING + off / (m.absolute(off) + FADE))
        return places

    def mixed(
        self,
        kind: int,
        w: Sequence[Operand],
        tile: Callable[[Operand], Operand],
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Mix the three tiles around a unit vector.

        ``kind`` is :data:`IRRADIANCE` or :data:`SCATTERED`; ``tile`` looks one up, by its number.
        """
        parts = [tile(number) * fraction for number, fraction in views.around(w, m)]
        total = parts[0] + parts[1] + parts[2]
        return total if kind == SCATTERED else total * (1.0 / self.light(w, m))

    def turned(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Fraction of sunlight scattered once at depth y that is occluded as the rest is."""
        return 1.0 - m.exp(-self.forward_scattering * y)

    def light(self, w: Sequence[Operand], m: Mathematics = NUMPY) -> Operand:
        """About the unoccluded light on patches that face unit vectors, over that on level ones.

        Mixed like tiles it is itself.
        """
        return views.height(w, m) * self.slope + 1.0


def step(k: Operand, P: Operand, reach: Operand, m: Mathematics = NUMPY) -> Operand:
    """Distance of step k, from 0, of a ray of length P, m; they are denser close to the camera."""
    middle = (k + 0.5) / STEPS
    return m.minimum(P, reach) * (middle * middle)


def arriving(k: Operand, s: Operand, rate: Operand, m: Mathematics = NUMPY) -> Operand:
    """What step k, at distance s, brings to the camera of light that falls off at a rate, 1/m."""
    # Each stands for a length in proportion to the root of its distance.
    return (2.0 * k + 1.0) * m.exp(-rate * s)


def mean_along(total: Operand, weights: Operand, m: Mathematics = NUMPY) -> Operand:
    """Mean along a ray, of sums over its steps: of what each brings of the light, and in all."""
    return total / m.maximum(weights, _LEAST)


@dataclass(frozen=True, eq=False)
class OcclusionTable:
    """Ratios of n bands at the cells of a grid; make it with :func:`occlusion_table`."""

    grid: Grid
    box: OcclusionBox
    #: Mean over the bands, fractions of two spectra, and that of the sun that is seen, of patches
    #: times :meth:`OcclusionBox.light`, (2, COUNT, nz + 2, ny + 2, nx + 2, NUMBERS).
    atlas: NDArray[np.float32]
    spectra: Array  #: Of patches, and from :data:`.ON_PATH` on of rays, (SPECTRA, n).

    def on(self, centres: Array, others: Array) -> OcclusionTable:
        """Return the table, which has bands at some centres, on others, between them linear."""
        if np.array_equal(centres, others):
            return self
        spectra = [np.interp(others, centres, spectrum) for spectrum in self.spectra]
        return dataclasses.replace(self, spectra=np.array(spectra))

    @functools.cached_property
    def typical(self) -> Array:
        """What is left of light on patches, over its mean, where it is dull and colourful, (2, n).

        Means of the fifths of the patches that lie on either end of the first spectrum.

        Examples
        --------
        >>> without_occlusion(3).typical.tolist()
        [[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]
        """
        inner = slice(_RING, -_RING)
        mean, *fractions, _ = np.moveaxis(self.atlas[IRRADIANCE, :, inner, inner, inner], -1, 0)
        lit = mean > _DARK * mean.max(axis=(1, 2, 3), keepdims=True)
        if not lit.any():  # as in water that scatters nothing, whose patches face no sun
            return np.ones((2, self.spectra.shape[1]))
        some = np.stack([part[lit] / mean[lit] for part in fractions])
        ends = np.array_split(some[:, some[0].argsort(kind="stable")], _FIFTHS, axis=1)
        found = np.stack([ends[0].mean(axis=1), ends[-1].mean(axis=1)], dtype=np.float64)
        return np.maximum(1.0 + found @ self.spectra[:ON_PATH], _DARK)

    def mixed(self, kind: int, points: Array, w: Array) -> Array:
        """Numbers of :attr:`atlas` at points (m, 3) for unit vectors (m, 3), (m, NUMBERS)."""
        of_points, of_w = ([part[:, None] for part in along.T] for along in (points, w))
        place = dict(zip("xyz", self.box.place(of_points), strict=True))
        table = Table(self.atlas, self.box.axes)
        return self.box.mixed(kind, of_w, lambda tile: table.at(kind=kind, tile=tile, **place))

    def on_patches(self, points: Array, normal: Array) -> Array:
        """Numbers of the light on surfaces (m, 3), of which places beside them tell."""
        return self.mixed(IRRADIANCE, points + normal * OFF_SURFACE / self.box.per_metre, normal)

    def along(self, origin: Array, w: Array, P: Array, rate: float | Array) -> Array:
        """Numbers of the light of paths that falls off at a rate, 1/m, (m, NUMBERS)."""
        total, weights = np.zeros((len(P), NUMBERS)), np.zeros((len(P), 1))
        for k in range(STEPS):
            s = step(k, P, self.box.reach)[:, None]
            weight = arriving(k, s, rate)
            total += weight * self.mixed(SCATTERED, origin + w * s, w)
            weights += weight
        return np.asarray(mean_along(total, weights))


def occlusion_table(
    light: ProbeIrradiance,
    extinction: Array,
    importance: Array,
    *,
    beyond: float = 0.0,
    enclosed: bool = True,
) -> OcclusionTable:
    """Tabulate probe irradiance.

    ``extinction`` is without the forward peak, 1/m; ``importance`` how bright the water is in each
    band. So far ``beyond`` the sides of the grid, m, it is occluded as there, and then nothing is.
    ``enclosed``: it is looked at from where little of the open is seen.
    """
    grid = light.grid
    nx, ny, nz = grid.shape
    size = float(np.linalg.norm(grid.upper - np.asarray(grid.lower)))
    fraction = importance / max(float(importance.sum()), float(np.finfo(np.float64).tiny))
    if not fraction.sum() > 0:
        fraction = np.full(len(importance), 1.0 / len(importance))
    box = OcclusionBox(
        tuple(low + grid.cell / 2.0 for low in grid.lower),
        1.0 / grid.cell,
        _last(grid),
        light.slope,
        min(4.0 / max(float(extinction.min()), _LEAST), 2.0 * size),
        float(light.forward_scattering @ fraction),
    )
    weight = box.light([*views.NORMALS.T])
    ratios = np.stack([light.irradiance * weight[:, None], light.scattered])
    mean = ratios @ fraction
    root = np.sqrt(np.maximum(fraction, _LEAST))
    rest = (ratios - mean[..., None]) * root
    tiles, spectra = np.zeros((*mean.shape, NUMBERS)), np.zeros((SPECTRA, len(fraction)))
    tiles[..., 0] = mean
    for kind, first in ((IRRADIANCE, 0), (SCATTERED, ON_PATH)):
        # Errors of dark places are relative.
        ways = _main_ways(rest[kind] / np.maximum(mean[kind], _DIM)[..., None], ON_PATH)
        tiles[kind, ..., 1 : 1 + len(ways)] = rest[kind] @ ways.T
        spectra[first : first + len(ways)] = ways / root
    # The sun is the same in every tile, so that mixing leaves it.
    tiles[..., _SUNLIT] = light.sunlit[:, None] * np.stack([weight, np.ones(views.COUNT)])[:, None]
    atlas = tiles.transpose(0, 2, 1, 3).reshape(2, views.COUNT, nx, ny, nz, NUMBERS)
    open_water = np.tile(_OPEN, (2, views.COUNT, 1))
    open_water[IRRADIANCE] *= weight[:, None]
    comes = math.exp(-beyond * float(extinction @ fraction))
    ring = comes * open_water + (1.0 - comes) * _sides(atlas, light.valid)
    # What reaches out of the top is dark inside, and its own top lies beyond.
    inside = ~light.valid.reshape(nx, ny, nz)[:, :, -1]
    atlas[:, :, inside, -1] = ring[:, :, None]
    atlas = _ringed(atlas, ring)
    if light.solution is not None:
        fitted = FittedCells(light.solution.known.rays, enclosed=enclosed)
        fitted.fit_faces(atlas[IRRADIANCE], tiles[IRRADIANCE], OFF_SURFACE * grid.cell)
        fitted.fit_water(atlas[SCATTERED], tiles[SCATTERED])
    return OcclusionTable(
        grid, box, np.ascontiguousarray(atlas.transpose(0, 1, 4, 3, 2, 5), np.float32), spectra
    )


def _main_ways(rest: NDArray[np.floating], count: int) -> NDArray[np.floating]:
    """The spectra (k, n), count or fewer, that bring the least error."""
    _, vectors = np.linalg.eigh(np.tensordot(rest, rest, axes=([0, 1], [0, 1])))
    return vectors[:, ::-1].T[:count]


def _last(grid: Grid) -> tuple[float, ...]:
    return tuple(n + 2.0 * _RING - 1.0 for n in grid.shape)


def _sides(atlas: Array, valid: NDArray[np.bool_]) -> Array:
    """Mean of the water at the upright sides of a grid (2, COUNT, nx, ny, nz, NUMBERS)."""
    sides = np.zeros(atlas.shape[2:5], bool)
    sides[[0, -1]] = sides[:, [0, -1]] = True
    water = sides & valid.reshape(sides.shape)
    return atlas[:, :, water if water.any() else sides].mean(axis=2)


def _ringed(atlas: Array, beyond: Array) -> Array:
    """Put cells with the light beyond (2, COUNT, NUMBERS) around those of a grid."""
    nx, ny, nz = (n + 2 * _RING for n in atlas.shape[2:5])
    ringed = np.tile(beyond[:, :, None, None, None], (1, 1, nx, ny, nz, 1))
    inner = slice(_RING, -_RING)
    ringed[:, :, inner, inner, inner] = atlas
    return ringed


def without_occlusion(bands: int) -> OcclusionTable:
    """Return the table of water with nothing in it.

    Examples
    --------
    >>> table = without_occlusion(3)
    >>> table.mixed(SCATTERED, np.zeros((1, 3)), np.array([[0.6, 0.0, 0.8]])).round(6)
    array([[1., 0., 0., 1.]])
    """
    grid = Grid((-0.5, -0.5, -0.5), 1.0, (1, 1, 1))
    box = OcclusionBox((0.0, 0.0, 0.0), 1.0, _last(grid), 0.0, 1.0, 0.0)
    atlas = np.tile(np.array(_OPEN, np.float32), (2, views.COUNT, 3, 3, 3, 1))
    return OcclusionTable(grid, box, atlas, np.zeros((SPECTRA, bands)))
