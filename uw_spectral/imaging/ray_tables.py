"""Water before the rays of one camera, tabulated so that a picture is a few look-ups a pixel.

Colours that arrive are linear in those of the surface, and what does that hangs on elevation and
distance alone. So does light on the way, but for a factor of the direction: it differs by azimuth
as it does at one distance, to 0.003 of white but where the sun itself is seen.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..table import Axis, Table
from ..transfer.channel_tables import LENGTHS
from ..transfer.pixel_parts import COLOURS
from .applied_water import AppliedWater, Array

ROWS, DISTANCES = 256, 1024
"""Elevations and distances of the tables; the nearest is taken."""
_ELEVATIONS, _TURNS, _EVERY = 65, 129, 32
_FINER = 2  # distances that are computed, for each of the channel tables
_MOST = 480  # pixels along a side of what varies slowly
_LAMP_NODES = 25, 37, 64  # over the rows, the columns and the distances
_LIGHTS, _CHANNELS = 2, 3
Single = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class SeenComponents:
    """What a picture is made of, in the sensor's channels, (h, w, 3) each: I = D + B + F."""

    J: Array
    D: Array
    B: Array
    F: Array

    def total(self, rows: slice = slice(None)) -> Single:
        """All of it in some rows, (3, r, w)."""
        total = self.D[rows] + self.B[rows] + self.F[rows]
        return np.ascontiguousarray(np.moveaxis(total, -1, 0), np.float32)


@dataclass(frozen=True, eq=False)
class RayTables:
    """Tables of a camera; make them with :func:`ray_tables`."""

    water: AppliedWater
    rays: Array  #: Unit vectors, z up, (h, w, 3).
    per_unit: float  #: Focal length, pixels.
    place: NDArray[np.int32]  #: Of a pixel's first distance, (h, w).
    #: By elevation and distance: factors on light on the way, B and F (2, c), what arrives of
    #: colours (c, k), and what they are there (c, k); one after the other, (24, ROWS DISTANCES).
    table: Single
    directions: Single  #: What those factors are on, (2, c, h, w).

    def index(self, P: Single, rows: slice = slice(None)) -> NDArray[np.intp]:
        """Place of pixels in the tables by distances of some rows, m."""
        lengths, scale = self.water.light.numbers.lengths, np.float32(_SCALE)
        place = np.float32(lengths.per_log) * np.log(P / np.float32(lengths.first) + 1) * scale
        nearest = np.minimum(place + np.float32(0.5), np.float32(DISTANCES - 1)).astype(np.int32)
        return (nearest + self.place[rows]).astype(np.intp)

    def total(self, colours: Single, P: Single, rows: slice = slice(None)) -> Single:
        """Channels of the picture of some rows in sun and sky, (3, r, w).

        Colours, (3, r, w), are linear Rec.709; distances P, (r, w), are in m.
        """
        index = self.index(P, rows)
        found, part = np.zeros((_CHANNELS, *P.shape), np.float32), np.empty(P.shape, np.float32)
        for c, channel in enumerate(found):
            factors = [*self.directions[:, c, rows], *colours]
            numbers = [c, _CHANNELS + c, *(6 + 3 * c + k for k in COLOURS)]
            for number, factor in zip(numbers, factors, strict=True):
                # Places are in the table; other modes than clip copy what they write.
                np.take(self.table[number], index, out=part, mode="clip")
                part *= factor
                channel += part
        far = np.isinf(P)
        if far.any():
            found[:, far] = self.open_water[rows][far].T
        return found

    def components(self, colours: Single, P: Single, *, blur: bool = False) -> SeenComponents:
        """Return all that the picture is made of, that of lamps too.

        ``blur`` is whether surfaces in view scatter forward; distances are infinite for none.
        """
        index = self.index(P)
        B, F = (
            np.stack([self.table[3 * i + c][index] * self.directions[i, c] for c in COLOURS], -1)
            for i in range(_LIGHTS)
        )
        D, J = (
            np.stack(
                [
                    sum(self.table[first + 3 * c + k][index] * colours[k] for k in COLOURS)
                    for c in range(_CHANNELS)
                ],
                axis=-1,
            )
            for first in (6, 15)
        )
        if blur:
            F = F + self._forward(J, P)
        if self.water.lamps is not None:
            lit = self._lamp_light(colours, P)
            J, D, B, F = (x + y for x, y in zip((J, D, B, F), lit, strict=True))
        there = np.isfinite(P)[..., None]
        J, D, F = (np.where(there, x, 0.0) for x in (J, D, F))
        return SeenComponents(J, D, np.where(there, B, self.open_water), F)

    @functools.cached_property
    def open_water(self) -> Array:
        """Channels where nothing is seen, (h, w, 3)."""
        step = _step(self.rays)
        some = self.rays[step // 2 :: step, step // 2 :: step]  # middles of blocks
        return _spread_out(self.water.open_water(some), self.rays.shape[:2])

    def _forward(self, J: Array, P: Single) -> Array:
        """See :meth:`AppliedWater.scattered_forward`; of blocks of pixels, for it varies slowly."""
        step = _step(self.rays)
        there = np.isfinite(P)
        count = _blocks(1.0 * there, step)
        known = count >= 0.5
        over = np.where(known, count, 1.0)
        mean = _blocks(np.where(there[..., None], J, 0.0), step) / over[..., None]
        near = np.where(known, _blocks(np.where(there, P, 0.0), step) / over, np.inf)
        w = _blocks(self.rays, step)
        w = w / np.linalg.norm(w, axis=-1, keepdims=True)
        found = self.water.scattered_forward(mean, w, near, self.per_unit / step)
        return _spread_out(found, P.shape)

    def _lamp_light(self, colours: Single, P: Single) -> Single:
        """Light of lamps, (J D B F, h, w, 3): :meth:`.AppliedWater.lamp_light`, looked up."""
        height, width = P.shape
        lengths, (rows, columns, count) = self.water.light.numbers.lengths, _LAMP_NODES
        place = lengths.place(P) * ((count - 1) / (LENGTHS - 1))
        table, column = self._lamp_table, np.arange(width) * ((columns - 1) / max(width - 1, 1))
        found = np.empty((4, height, width, 3), np.float32)
        for i, row in enumerate(np.arange(height) * ((rows - 1) / max(height - 1, 1))):
            low = min(int(row), rows - 2)
            here = table[low] + (row - low) * (table[low + 1] - table[low])
            path, surfaces = np.split(_interpolated(here, [column, place[i]]), [3], axis=-1)
            lit = colours[:, i] * self.water.lamp_decay(self.rays[i], lengths.held(P[i]))
            J, D, F = np.einsum("wpck,kw->pwc", surfaces.reshape(width, 3, 3, 3), lit)
            found[:, i] = J, D, path, F
        return found

    @functools.cached_property
    def _lamp_table(self) -> Array:
        """Light of lamps on the way and, over its decay, on surfaces J, D and F: (..., 30)."""
        height, width = self.rays.shape[:2]
        rows, columns, lengths = _LAMP_NODES
        at = np.meshgrid(
            np.linspace(0, height - 1, rows), np.linspace(0, width - 1, columns), indexing="ij"
        )
        w = _interpolated(self.rays, at)
        w = np.repeat((w / np.linalg.norm(w, axis=-1, keepdims=True))[:, :, None], lengths, 2)
        P = np.broadcast_to(_distances(self.water, lengths), w.shape[:-1])
        path, *surfaces = self.water.lamp_light(w, P)
        over = self.water.lamp_decay(w, P)[..., None, None]
        return np.concatenate(
            [path, *((x / over).reshape(*P.shape, -1) for x in surfaces)], axis=-1
        )


_SCALE = (DISTANCES - 1) / (LENGTHS - 1)


def ray_tables(water: AppliedWater, rays: Array, per_unit: float) -> RayTables:
    """Tabulate the water before a camera's rays (h, w, 3), of a focal length in pixels."""
    middle = rays.mean(axis=(0, 1))
    ahead = float(np.arctan2(middle[1], middle[0]))
    elevation = np.arcsin(np.clip(rays[..., 2], -1.0, 1.0))
    turn = np.arctan2(rays[..., 1], rays[..., 0]) - ahead
    turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
    elevations, high = _axis(elevation, _ELEVATIONS)
    turns, across = _axis(turn, _TURNS)
    w = _directions(elevations[:, None], ahead + turns)
    P = _distances(water, (LENGTHS - 1) * _FINER + 1)
    extinction = float(np.mean(water.light.numbers.extinction))
    # Where there is much of each: light on the way, and from beyond.
    ends = [np.full(w.shape[:2], depths / extinction) for depths in (3.0, 1.0)]
    of_directions = [_lights(water, w, end)[i] for i, end in enumerate(ends)]
    some = slice(_EVERY // 2, None, _EVERY)
    all_along = np.repeat(w[:, some, None], len(P), axis=2)
    light = _lights(water, all_along, np.broadcast_to(P, all_along.shape[:-1]))
    factors = []
    for found, known in zip(light, of_directions, strict=True):
        at = known[:, some, None]
        factors.append((found * at).sum(axis=1) / np.maximum((at * at).sum(axis=1), 1e-30))
    middle_turn = all_along[:, all_along.shape[1] // 2]
    here, left = water.colours(middle_turn, np.broadcast_to(P, middle_turn.shape[:-1]))
    parts = [*factors, *(x.reshape(*x.shape[:2], -1) for x in (left, here))]
    fine = np.meshgrid(
        np.linspace(0, _ELEVATIONS - 1, ROWS), np.linspace(0, len(P) - 1, DISTANCES), indexing="ij"
    )
    table = _interpolated(np.concatenate(parts, axis=-1), fine).reshape(ROWS * DISTANCES, -1)
    row = np.rint(high * ((ROWS - 1) / (_ELEVATIONS - 1))).astype(np.int32)
    directions = [_interpolated(x, (high, across)) for x in of_directions]
    return RayTables(
        water, rays, per_unit, row * np.int32(DISTANCES),
        np.ascontiguousarray(table.T, np.float32),
        np.ascontiguousarray(np.moveaxis(np.stack(directions), -1, 1), np.float32),
    )  # fmt: skip


def _lights(water: AppliedWater, w: Array, P: Array) -> tuple[Array, Array]:
    seen = water.unlit(w, P)
    return np.asarray(seen.path), np.asarray(seen.forward_scattered)


def _axis(values: Array, count: int) -> tuple[Array, Array]:
    """So many nodes over the range of values, and the places of these among them."""
    low, high = float(values.min()), max(float(values.max()), float(values.min()) + 1e-6)
    return np.linspace(low, high, count), (values - low) * ((count - 1) / (high - low))


def _directions(elevation: Array, azimuth: Array) -> Array:
    along = np.cos(elevation)
    parts = along * np.cos(azimuth), along * np.sin(azimuth), np.sin(elevation)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def _distances(water: AppliedWater, count: int) -> Array:
    """So many distances, spaced as those of the channel tables, m."""
    lengths = water.light.numbers.lengths
    place = np.linspace(0.0, LENGTHS - 1.0, count)
    return lengths.first * np.expm1(place / lengths.per_log)


def _step(rays: Array) -> int:
    return -(-max(rays.shape[:2]) // _MOST)


def _blocks(values: Array, step: int) -> Array:
    """Means of blocks of pixels; the last ones may be smaller."""
    if step == 1:
        return values
    starts = [np.arange(0, side, step) for side in values.shape[:2]]
    sums = np.add.reduceat(np.add.reduceat(values, starts[0], axis=0), starts[1], axis=1)
    sizes = [np.diff([*start, side]) for start, side in zip(starts, values.shape, strict=False)]
    count = sizes[0][:, None] * sizes[1]
    return sums / count.reshape(count.shape + (1,) * (values.ndim - 2))


def _spread_out(values: Array, shape: tuple[int, ...]) -> Array:
    """Values of blocks at all pixels, between their middles linear."""
    places = [
        np.clip((np.arange(side) + 0.5) * (count / side) - 0.5, 0.0, count - 1.0)
        for side, count in zip(shape, values.shape, strict=False)
    ]
    return _interpolated(values, np.meshgrid(*places, indexing="ij"))


def _interpolated(values: Array, places: Sequence[Array]) -> Array:
    """Values (..., n) at places among the entries of each axis but the last."""
    axes = [Axis(f"axis {i}", count) for i, count in enumerate(values.shape[:-1])]
    given = {axis.name: at[..., None] for axis, at in zip(axes, places, strict=True)}
    return np.asarray(Table(values, tuple(axes)).at(**given))
