"""The surfaces of a scene as samples that are close enough to fill voxels.

Objects and instances count as renders show them, what they are made of by its mean colour.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.last_used import LastUsed
from ...uw_spectral.occlusion.filled_voxels import NO_SAMPLES, FilledVoxels, Samples
from ...uw_spectral.occlusion.triangles import cut_across, quartered
from .mesh_parts import MeshArrays, MeshCache
from .visible_meshes import OPAQUE, VisibleMesh, visible_meshes

_PER_CELL = 12.0  # samples of a surface that crosses a cell, where its triangles are small
_ODD = np.random.default_rng(1).integers(0, 1 << 64, 6, np.uint64) | np.uint64(1)
"""Factors that mix the bits of places."""
_SMALLEST = 1e-20
_SLICES, _WIDTH = 64, 0.6  # of what is narrow, at once; of a spacing
_ENOUGH = 64  # triangles that are all looked at
_THINNEST = 0.05  # coverage of surfaces that occlude
_CLOSED = 0.1  # of the area of a closed mesh is left where its faces are added up
_DEEPEST = 48  # halvings of a triangle's edges, of which only what is near costs

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Triangles:
    """A visible mesh in its place."""

    arrays: MeshArrays
    place: NDArray[np.float32]
    colours: Array  #: Base colours of its parts, (c, 3).
    coverage: Array  #: Fractions of light that these stop, (c,).
    #: Materials and those of their nodes that the colours would need.
    unknown: tuple[tuple[str, tuple[str, ...]], ...] = ()

    @functools.cached_property
    def key(self) -> bytes:
        """What differs where the triangles or their colours do."""
        known = self.arrays.digest + self.place.tobytes() + self.colours.tobytes()
        return known + self.coverage.tobytes() + repr(self.unknown).encode()

    def is_opaque(self, some: slice) -> NDArray[np.bool_]:
        """Which of some triangles count as whole."""
        return (self.coverage >= OPAQUE)[self.arrays.parts[some]]

    @property
    def corners(self) -> NDArray[np.float32]:
        """Corners of the triangles, shape (t, 3, 3), m."""
        return self.corners_of(slice(None))

    def corners_of(self, some: slice) -> NDArray[np.float32]:
        """Corners of some of the triangles."""
        corners = self.arrays.vertices[self.arrays.triangles[some]]
        return corners @ self.place[:3, :3].T + self.place[:3, 3]

    @functools.cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner of the box around it, m."""
        flat = self.corners.reshape(-1, 3)
        return flat.min(axis=0).astype(np.float64), flat.max(axis=0).astype(np.float64)

    @functools.cached_property
    def is_closed(self) -> bool:
        """Whether its faces add up to little of their area, seen from above."""
        up = _across(self.corners)[:, 2].astype(np.float64)
        return bool(abs(up.sum()) <= _CLOSED * np.abs(up).sum())

    @functools.cached_property
    def turned_out(self) -> float:
        """Sign by which normals of the order of corners look outward, those of sheets as shown."""
        corners = self.corners
        if not self.is_closed:
            return float(np.copysign(1.0, np.linalg.det(self.place[:3, :3])))
        centres = corners.mean(axis=1, dtype=np.float64)
        centres -= centres.mean(axis=0)
        return float(np.copysign(1.0, (centres * _across(corners)).sum()))

    @functools.cached_property
    def lowest_above(self) -> float:
        """Height in m of the lowest corner; of a closed object, of the faces that look up."""
        corners = self.corners
        heights = corners[:, :, 2]
        if self.is_closed:
            heights = heights[self.turned_out * _across(corners)[:, 2] > 0.0]
        return float(heights.min(initial=np.inf))


def _across(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    return _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _cross(one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    (a, b, c), (u, v, w) = one.T, other.T
    return np.stack([b * w - c * v, c * u - a * w, a * v - b * u], axis=1)


def _longest(one: NDArray[np.float32], other: NDArray[np.float32]) -> NDArray[np.float32]:
    """Longest extent of edges along an axis."""
    extent = np.maximum(np.maximum(np.abs(one), np.abs(other)), np.abs(one - other))
    x, y, z = extent.T
    return np.maximum(np.maximum(x, y), z)


def visible_triangles(
    depsgraph: bpy.types.Depsgraph,
    leave_out: Collection[bpy.types.Object] = (),
    samples: SampleCache | None = None,
) -> Iterator[Triangles]:
    """Yield every mesh that casts shadows in renders, instances included, but what is left out.

    So do nets and leaves, in part: see :attr:`Triangles.coverage`.
    """
    samples = samples or SampleCache()
    for shown in visible_meshes(depsgraph, leave_out, "shadow", samples.meshes, _THINNEST):
        colours = np.array([mean.colour for mean in shown.means])
        coverage = np.array([mean.coverage for mean in shown.means])
        place = np.array(shown.place, dtype=np.float32)
        yield samples.surface(Triangles(shown.arrays, place, colours, coverage, _unknown(shown)))


def _unknown(shown: VisibleMesh) -> tuple[tuple[str, tuple[str, ...]], ...]:
    parts = zip(shown.arrays.slots, shown.means, strict=True)
    unknown = [(shown.materials[slot], mean.unknown) for slot, mean in parts if mean.unknown]
    return tuple((material.name, nodes) for material, nodes in unknown if material is not None)


def sampled(shown: Triangles, low: Array, high: Array, spacing: float) -> Samples:
    """Sample a mesh in a box, at least once in every cell of ``spacing`` m that it crosses."""
    lowest, highest = shown.bounds
    if (highest < low).any() or (lowest > high).any():
        return NO_SAMPLES
    corners, parts = shown.corners, shown.arrays.parts
    # Whatever the box, so that the same places have the same samples.
    more = 1.0
    if len(corners) > _ENOUGH:
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        twice = np.linalg.norm(_cross(one, other), axis=1)
        keep = _some(shown.arrays, twice, spacing)
        keep |= _longest(one, other) > spacing / 2.0
        corners, parts = corners[keep], parts[keep]
        more = float(twice.sum()) / max(float(twice[keep].sum()), _SMALLEST)
    points, normals, colours, areas, extents, coverage = [], [], [], [], [], []
    for level in range(_DEEPEST):
        first, second, third = np.moveaxis(corners, 1, 0)
        highest = np.maximum(np.maximum(first, second), third)
        lowest = np.minimum(np.minimum(first, second), third)
        within = (highest >= low).all(axis=1) & (lowest <= high).all(axis=1)
        corners, parts = corners[within], parts[within]
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        across = _cross(one, other)
        size = np.linalg.norm(across, axis=1)
        small = (_longest(one, other) <= spacing) | (level == _DEEPEST - 1)
        points.append(corners[small].mean(axis=1))
        normals.append(
            shown.turned_out * across[small] / np.maximum(size[small], _SMALLEST)[:, None]
        )
        colours.append(shown.colours[parts[small]])
        coverage.append(shown.coverage[parts[small]])
        areas.append(size[small] * (more / 2.0))
        extent = (highest - lowest)[within][small]
        extents.append(extent if more == 1.0 else np.full_like(extent, np.inf))
        if small.all():
            break
        # Quarters of what is long and narrow would be much narrower than need be.
        longest, width = _longest(one, other), _WIDTH * spacing
        narrow = ~small & (size < longest * width)
        wide = ~small & ~narrow
        counts = np.minimum(np.ceil(longest[narrow] / width), _SLICES).astype(np.intp)
        slices, of = cut_across(corners[narrow], counts)
        corners = np.concatenate([quartered(corners[wide]), slices])
        parts = np.concatenate([np.tile(parts[wide], 4), parts[narrow][of]])
    parts = points, normals, colours, areas, extents, coverage
    found = Samples(*(np.concatenate(x).astype(np.float64) for x in parts))
    flat = (found.normals**2).sum(axis=1) < 0.5
    found.normals[flat] = [0.0, 0.0, 1.0]
    return found


class SampleCache:
    """Meshes that have not changed since they were read, and their samples."""

    def __init__(self) -> None:
        self.meshes = MeshCache()
        self.voxels, self.without_floor = FilledVoxels(), FilledVoxels()
        self.middle: tuple[float, float, float] | None = None
        """From which the cells of all frames are counted: that of the first."""
        self._objects = LastUsed[bytes, Triangles]()
        self._samples = LastUsed[bytes, Samples]()

    def next_frame(self) -> None:
        """Forget what was not asked for since the last time."""
        for known in self._all:
            known.next_frame()

    def __len__(self) -> int:
        return sum(map(len, self._all))

    def __bool__(self) -> bool:
        return True

    @property
    def _all(self) -> tuple[LastUsed[Any, Any], ...]:
        return self.meshes, self.voxels, self.without_floor, self._objects, self._samples

    def surface(self, shown: Triangles) -> Triangles:
        """Return one that is the same, with what is known of it already."""
        return self._objects.get(shown.key, lambda: shown)

    def sampled(self, shown: Triangles, low: Array, high: Array, spacing: float) -> Samples:
        """Return what :func:`sampled` returns."""
        key = shown.key + low.tobytes() + high.tobytes() + np.float64(spacing).tobytes()
        return self._samples.get(key, lambda: sampled(shown, low, high, spacing))


def _some(arrays: MeshArrays, size: NDArray[np.floating], spacing: float) -> NDArray[np.bool_]:
    """Which triangles are enough for their area; ``size`` is twice that of each.

    They are drawn by where they are, so that it does not matter in which order a mesh has them.
    """
    wanted = _PER_CELL * float(size.sum()) / 2.0 / spacing**2 + 64.0
    if wanted >= len(size):
        return np.ones(len(size), dtype=bool)
    corners = arrays.vertices[arrays.triangles]
    ends = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1) + np.float32(0.0)
    drawn = (ends.view(np.uint32) * _ODD).sum(axis=1, dtype=np.uint64)
    for shift in (31, 29):
        drawn = (drawn ^ (drawn >> np.uint64(shift))) * _ODD[0]
    return (drawn >> np.uint64(32)) < 2.0**32 * wanted / len(size)
