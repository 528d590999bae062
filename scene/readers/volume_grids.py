"""Densities of volume objects, read by geometry nodes: of files, sequences and modifiers alike."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups.node_mathematics import new_group
from ...uw_spectral.clouds.density_grid import DensityGrid, node_counts
from ...uw_spectral.clouds.solved_cloud import Cloud
from ...uw_spectral.errors import InputError

DENSITY = "density"
"""Name of the grid that is read."""
_NAME, _FOUND = "UW Reading", "found"
_FINEST = 3  # places along each side of a cell whose mean its node gets
_NOTHING = np.zeros((4, 4, 4)), np.full(3, -0.5), np.full(3, 1.0 / 3.0)
_NONE = f"it has no grid named {DENSITY!r} at this frame, and EEVEE draws none"

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Read:
    """Density at nodes in an object's own space, and which frame of it."""

    frame: float
    density: Array
    low: Array
    cell: Array


class GridCache:
    """Densities that were read; in a job, where nothing changes within a frame, once a frame."""

    def __init__(self, *, of_job: bool = False) -> None:
        self._of_job = of_job
        self._read: dict[str, _Read] = {}
        self._placed: dict[str, DensityGrid] = {}

    def of(
        self,
        scene: bpy.types.Scene,
        found: Sequence[tuple[bpy.types.Object, Cloud]],
        *,
        unchanged: bool = False,
    ) -> tuple[list[Cloud], list[str]]:
        """Return clouds of volume objects with their grids, and what to say of the others.

        ``unchanged``: what was read of this frame still holds. InputError names an object that is
        flat.
        """
        clouds, notes = [], []
        for item, cloud in found:
            try:
                own = self._own(scene, item, unchanged=unchanged)
                if own is None:
                    # There may be some at another frame, with the same nodes of the shaders.
                    notes.append(f"cloud {item.name!r}: {_NONE}")
                    own = _Read(scene.frame_current_final, *_NOTHING)
                grid = self._place(item, own)
            except InputError as error:
                raise InputError(f"cloud {item.name!r}: {error}") from error
            clouds.append(replace(cloud, blob=grid.blob(), grid=grid))
        names = {item.name_full for item, _ in found}
        self._read = {name: own for name, own in self._read.items() if name in names}
        return clouds, notes

    def _own(
        self, scene: bpy.types.Scene, item: bpy.types.Object, *, unchanged: bool
    ) -> _Read | None:
        known, frame = self._read.get(item.name_full), scene.frame_current_final
        if known is not None and known.frame == frame and (unchanged or self._of_job):
            return known
        read = read_density(scene, item)
        if read is None:
            self._read.pop(item.name_full, None)
            return None
        self._read[item.name_full] = own = _Read(frame, *read)
        return own

    def _place(self, item: bpy.types.Object, own: _Read) -> DensityGrid:
        """Put a density into the world; the same value for the same."""
        place = np.array(item.matrix_world, dtype=np.float64)
        axes = place[:3, :3] * own.cell
        grid = DensityGrid(own.density, place[:3, :3] @ own.low + place[:3, 3], axes).wet()
        self._placed[item.name_full] = grid = grid.or_known(self._placed.get(item.name_full))
        return grid


def read_density(
    scene: bpy.types.Scene, item: bpy.types.Object
) -> tuple[Array, Array, Array] | None:
    """Read the density of a volume object at its scene's current frame; None without such a grid.

    Returns means about the nodes of its box, which has a margin of one, shape (nx, ny, nz); and in
    the object's own space the first node and the distance of nodes along each axis, shape (3,).
    """
    seen = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
    geometry = seen.evaluated_geometry()  # holds what it has
    found = None if geometry.volume is None else _grid(geometry.volume)
    if found is None:
        return None
    scale = np.linalg.norm(np.array(item.matrix_world)[:3, :3], axis=0)
    box = np.array(seen.bound_box, dtype=np.float64)
    low, high = box.min(0), box.max(0)
    if not np.all(high > low):
        return None
    counts = node_counts((high - low) * scale)
    cell = (high - low) / (np.array(counts) - 3.0)
    low = low - cell
    voxel = np.linalg.norm(np.array(found.matrix_object)[:3, :3], axis=0)
    finer = [int(n) for n in np.clip(np.ceil(cell / voxel - 0.5), 1, _FINEST)]
    # Places of each cell lie evenly about its node.
    ways = [
        start + step * (np.arange(n * parts) - 0.5 * (parts - 1)) / parts
        for start, step, n, parts in zip(low, cell, counts, finer, strict=True)
    ]
    values = _sampled(scene, item, np.stack(np.meshgrid(*ways, indexing="ij"), axis=-1))
    nx, ny, nz = counts
    parts = values.reshape(nx, finer[0], ny, finer[1], nz, finer[2])
    density = np.maximum(parts.mean((1, 3, 5), dtype=np.float64), 0.0)
    for axis in range(3):
        np.moveaxis(density, axis, 0)[[0, -1]] = 0.0
    return density, low, cell


def _grid(volume: bpy.types.Volume) -> bpy.types.VolumeGrid | None:
    if not volume.grids.is_loaded:
        volume.grids.load()
    return next((grid for grid in volume.grids if grid.name == DENSITY), None)


def _sampled(scene: bpy.types.Scene, item: bpy.types.Object, places: Array) -> NDArray[np.float32]:
    """Look up a grid at places in its object's own space, in a scene of its own."""
    with _points(places.reshape(-1, 3)) as points, _reading(scene, item, points) as layer:
        layer.update()
        seen = points.evaluated_get(layer.depsgraph)
        values = np.empty(len(seen.data.vertices), np.float32)
        seen.data.attributes[_FOUND].data.foreach_get("value", values)
    return values


@contextlib.contextmanager
def _points(places: Array) -> Iterator[bpy.types.Object]:
    mesh = bpy.data.meshes.new(_NAME)
    mesh.vertices.add(len(places))
    mesh.vertices.foreach_set("co", places.astype(np.float32).ravel())
    item = bpy.data.objects.new(_NAME, mesh)
    try:
        yield item
    finally:
        bpy.data.objects.remove(item)
        bpy.data.meshes.remove(mesh)


@contextlib.contextmanager
def _reading(
    scene: bpy.types.Scene, item: bpy.types.Object, points: bpy.types.Object
) -> Iterator[bpy.types.ViewLayer]:
    """Let points look up an object's grid at the current frame of its scene."""
    tree = _build(item)
    points.modifiers.new(tree.name, "NODES").node_group = tree
    own = bpy.data.scenes.new(_NAME)
    own.frame_current, own.frame_subframe = scene.frame_current, scene.frame_subframe
    own.collection.objects.link(points)
    try:
        yield own.view_layers[0]
    finally:
        bpy.data.scenes.remove(own)
        bpy.data.node_groups.remove(tree)


def _build(item: bpy.types.Object) -> bpy.types.NodeTree:
    tree = new_group(_NAME, "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("OUTPUT", "INPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    given, shown, named, looked, stored, end, here = (
        tree.nodes.new(kind)
        for kind in (
            "NodeGroupInput",
            "GeometryNodeObjectInfo",
            "GeometryNodeGetNamedGrid",
            "GeometryNodeSampleGrid",
            "GeometryNodeStoreNamedAttribute",
            "NodeGroupOutput",
            "GeometryNodeInputPosition",
        )
    )
    shown.transform_space = "ORIGINAL"
    shown.inputs["Object"].default_value = item
    named.inputs["Name"].default_value = DENSITY
    stored.inputs["Name"].default_value = _FOUND
    for one, other in (
        (shown.outputs["Geometry"], named.inputs["Volume"]),
        (named.outputs["Grid"], looked.inputs["Grid"]),
        (here.outputs[0], looked.inputs["Position"]),
        (given.outputs[0], stored.inputs["Geometry"]),
        (looked.outputs["Value"], stored.inputs["Value"]),
        (stored.outputs[0], end.inputs[0]),
    ):
        tree.links.new(one, other)
    return tree
