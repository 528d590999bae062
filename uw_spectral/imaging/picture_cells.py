"""What a picture shows about each distance: its darkest, its mean, and open water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..occlusion.point_spread import spread
from ..water.phase import PhaseFunction

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_CELL = 4  # pixels along the side
_EVEN = 1.25  # longest over shortest distance within a cell
_FINE = 256  # pixels along a side for what is around
_DISTANCES, _FEWEST = 7, 25  # bins of distance, at one elevation; cells in each at least
_ELEVATION, _AZIMUTH = math.radians(12.0), math.radians(20.0)  # bins of directions
_STEEPEST = math.radians(40.0)
_DARKEST = 0.01  # of the cells of a bin
_BINS = 5
_SPREAD = 1.5  # 95 % of the distances over 5 % of them
_CLEAR = 0.03, 0.001  # standard deviation at least: of a value, and of the largest


@dataclass(frozen=True, eq=False)
class SeenPicture:
    """What a camera saw, how far away and where.

    Raises
    ------
    InputError
        If shapes differ, or a distance is not positive.
    """

    #: Of the camera's channels, linear, without the black level, (h, w, 3); NaN where clipped.
    values: Array
    distances: Array  #: Euclidean, m, (h, w); infinite for open water, NaN where unknown.
    directions: Array  #: Unit vectors away from the camera, z up, (h, w, 3).

    def __post_init__(self) -> None:
        shape = self.distances.shape
        if self.values.shape != (*shape, 3) or self.directions.shape != (*shape, 3):
            raise InputError(
                f"fit: a picture of shape {self.values.shape} needs distances and directions of "
                f"its pixels, not of shape {shape} and {self.directions.shape}"
            )
        if (self.distances <= 0).any():
            raise InputError("fit: distances must be above 0, or NaN where they are unknown")


@dataclass(frozen=True, eq=False)
class Values:
    """Values of three channels, each with what it may be off, at a distance along a direction."""

    value: Array  #: (n, 3).
    sd: Array  #: (n, 3).
    P: Array  #: m, (n,); infinite for open water.
    w: Array  #: (n, 3).
    #: Fraction of what each of k phase functions scatters that stays within surfaces, (n, k).
    cover: Array


@dataclass(frozen=True, eq=False)
class Bins:
    """What is seen about distances, at elevations: the darkest and the mean; and open water."""

    dark: Values
    mean: Values
    open: Values


def bins_of(seen: SeenPicture, phases: Sequence[PhaseFunction]) -> Bins:
    """Return what a picture shows in water of some phase functions; of what is steep nothing.

    Raises
    ------
    InputError
        If few of its pixels have a distance, or all about the same.
    """
    cells = _Cells.of(seen, phases)
    near = np.isfinite(cells.P)
    if not near.any():
        raise InputError(
            "fit: no part of the picture is unclipped and has even depth; give one that is neither "
            "black nor white, linear, with depth of the same view"
        )
    low, high = np.quantile(cells.P[near], (0.05, 0.95))
    if high < _SPREAD * low:
        raise InputError(
            f"fit: all that is seen is {low:.3g} to {high:.3g} m away; a picture tells the water "
            f"by distances that differ {_SPREAD:g} times at least"
        )
    dark, mean, opened = [], [], []
    elevation = np.arcsin(np.clip(cells.w[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(cells.w[:, 0], cells.w[:, 1])
    row, column = np.rint(elevation / _ELEVATION), np.rint(azimuth / _AZIMUTH)
    level = np.abs(elevation) < _STEEPEST
    scale = np.maximum(np.median(cells.chosen, axis=0), 1e-30)
    brightness = (cells.chosen / scale).sum(axis=1)
    for number in np.unique(row[level]):
        here = np.flatnonzero((row == number) & level & near)
        here = here[np.argsort(cells.P[here], kind="stable")]
        for members in np.array_split(here, max(min(_DISTANCES, len(here) // _FEWEST), 1)):
            if len(members) >= _FEWEST:
                order = members[np.argsort(brightness[members], kind="stable")]
                rank = math.ceil(_DARKEST * len(members))
                dark.append((members, order[rank - 1 : rank]))
                mean.append((members, members))
        for turn in np.unique(column):
            places = np.flatnonzero((row == number) & (column == turn) & level & ~near)
            if len(places) >= _FEWEST:
                opened.append((places, places))
    if len(dark) < _BINS:
        raise InputError(
            f"fit: the picture shows {len(dark)} distances well enough, {_BINS} are needed; give a "
            "larger one, or denser depth"
        )
    return Bins(cells.values(dark), cells.values(mean), cells.values(opened))


@dataclass(frozen=True, eq=False)
class _Cells:
    """Means of half of a cell's pixels, by which it is chosen, and of the others, which are read.

    So that what noise darkens is not taken for dark.
    """

    chosen: Array  #: (n, 3).
    read: Array
    P: Array
    w: Array
    cover: Array  #: (n, k).

    @classmethod
    def of(cls, seen: SeenPicture, phases: Sequence[PhaseFunction]) -> _Cells:
        height, width = (side // _CELL for side in seen.distances.shape)

        def cut(x: Array) -> Array:
            parts = x[: height * _CELL, : width * _CELL].reshape(height, _CELL, width, _CELL, -1)
            return np.moveaxis(parts, 2, 1).reshape(height * width, _CELL * _CELL, -1)

        P, values = cut(seen.distances)[..., 0], cut(seen.values)
        even = np.isfinite(P).all(axis=1)
        even[even] = P[even].max(axis=1) < _EVEN * P[even].min(axis=1)
        kept = (even | np.isinf(P).all(axis=1)) & np.isfinite(values).all(axis=(1, 2))
        chess = np.add.outer(np.arange(_CELL), np.arange(_CELL)).ravel() % 2 == 0
        chosen, read = (values[kept][:, half].mean(axis=1) for half in (chess, ~chess))
        w = _unit(cut(seen.directions)[kept].mean(axis=1))
        cover = cut(_cover(seen, phases))[kept].mean(axis=1)
        return cls(chosen, read, P[kept].mean(axis=1), w, cover)

    def values(self, groups: list[tuple[Places, Places]]) -> Values:
        """Values of groups of cells; what they are off by is seen in the others beside them."""
        if not groups:
            none = np.empty((0, 3))
            return Values(none, none, np.empty(0), none, none)
        floor = _CLEAR[1] * float(self.read.max())
        rows = []
        for members, places in groups:
            value = self.read[places].mean(axis=0)
            off = np.median(np.abs(self.chosen[members] - self.read[members]), axis=0)
            noise = off / (0.6745 * math.sqrt(2.0 * len(places)))
            sd = np.sqrt(noise**2 + np.square(_CLEAR[0] * value) + floor**2)
            P, w, cover = (x[places].mean(axis=0) for x in (self.P, self.w, self.cover))
            rows.append((value, sd, P, _unit(w), cover))
        return Values(*(np.array(column) for column in zip(*rows, strict=True)))


def _cover(seen: SeenPicture, phases: Sequence[PhaseFunction]) -> Array:
    """What surfaces cover around all pixels, as phase functions scatter forward, (h, w, k)."""
    height, width = seen.distances.shape
    step = math.ceil(max(height, width) / _FINE)
    there = np.isfinite(seen.distances[::step, ::step])
    w = seen.directions[height // 2, width // 2 - step], seen.directions[height // 2, width // 2]
    per_unit = 1.0 / max(float(np.linalg.norm(w[1] - w[0])), 1e-4)
    up, left = (side // 2 for side in there.shape)
    shown = np.pad(1.0 * there, [(up, up), (left, left)], mode="edge")
    found = np.stack([spread(shown, phase, per_unit) for phase in phases], axis=-1)
    found = found[up : up + len(there), left : left + there.shape[1]].clip(0.0, 1.0)
    return found.repeat(step, axis=0).repeat(step, axis=1)[:height, :width]


def _unit(w: Array) -> Array:
    return w / np.linalg.norm(w, axis=-1, keepdims=True)
