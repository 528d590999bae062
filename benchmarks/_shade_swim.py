"""How steady shade is while a camera swims: what changes from frame to frame but the view."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import shade
from ..scene.render_plan import RenderPlan
from ..scene.surroundings import Surroundings, look_around
from ..uw_spectral.shade.shade_table import (
    ON_PATCH,
    SCATTERED,
    STEPS,
    ShadeTable,
    along_ray,
    step,
)
from ..uw_spectral.shade.voxels import SurfaceVoxels

_ACROSS, _DOWN = 32, 18
_DARK = 0.02  # of the undisturbed light: changes of less light than that are not seen

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """What a frame's camera sees, and the shade then.

    Attributes
    ----------
    eye : array, shape (3,)
    ways, normals : array, shape (m, 3)
        Of its rays, and of what they meet.
    distance : array, shape (m,)
    met : array of bool, shape (m,)
    table : ShadeTable
    """

    eye: Array
    ways: Array
    normals: Array
    distance: Array
    met: NDArray[np.bool_]
    table: ShadeTable


def views(plan: RenderPlan, camera: bpy.types.Object, frames: Sequence[int]) -> Iterator[View]:
    """Compute the shade of each frame by itself."""
    scene = bpy.context.scene
    clearest, field = float(plan.column.attenuation.min()), plan.solved_field()
    weights = plan.reduction(-camera.matrix_world.translation.z).weights
    for number in frames:
        scene.frame_set(number)
        around = look_around(scene, camera, clearest)
        depth = -float(around.eyes[0, 2])
        table = shade.table_of(around, plan.bands, field, weights, depth)
        yield _view(around, camera, table)


def changes(one: View, other: View, rate: float) -> tuple[Array, Array]:
    """Relative change from a frame's shade to another's, both seen by the other's camera.

    Parameters
    ----------
    one, other : View
    rate : float
        At which the water's light falls off along a ray, 1/m.

    Returns
    -------
    along, on : array
        Of the light along rays, and on the surfaces that they meet.
    """
    along = [_along(table, other, rate) for table in (one.table, other.table)]
    on = [_on(table, other) for table in (one.table, other.table)]
    return _relative(*along), _relative(*on)


def _relative(one: Array, other: Array) -> Array:
    return np.abs(other - one) / np.maximum((one + other) / 2.0, _DARK)


def _along(table: ShadeTable, view: View, rate: float) -> Array:
    P, reach = view.distance, table.box.reach
    found = [
        table.mixed(SCATTERED, view.eye + view.ways * step(k, P, reach)[:, None], view.ways)[:, 0]
        for k in range(STEPS)
    ]
    return np.asarray(along_ray(found, rate, P, reach))


def _on(table: ShadeTable, view: View) -> Array:
    points = (view.eye + view.ways * view.distance[:, None])[view.met]
    normals = view.normals[view.met]
    return table.mixed(ON_PATCH, points + 0.7 * table.grid.cell * normals, normals)[:, 0]


def _view(around: Surroundings, camera: bpy.types.Object, table: ShadeTable) -> View:
    x, y = np.meshgrid(*((np.arange(n) + 0.5) / n - 0.5 for n in (_ACROSS, _DOWN)))
    half = 2.0 * np.tan(camera.data.angle / 2.0)
    ways = np.stack([half * x, half * y * _DOWN / _ACROSS, np.full(x.shape, -1.0)], axis=-1)
    ways = ways.reshape(-1, 3) / np.linalg.norm(ways.reshape(-1, 3), axis=1, keepdims=True)
    ways = ways @ np.array(camera.matrix_world)[:3, :3].T
    found = around.under_things()
    voxels: SurfaceVoxels = around.coarse if found is None else found[0]
    eyes = np.broadcast_to(around.eyes[0], ways.shape)
    distance, number = voxels.trace(eyes, ways)
    normals = np.zeros_like(ways)
    normals[number >= 0] = voxels.normal[number[number >= 0]]
    normals *= np.where((normals * ways).sum(axis=1) > 0, -1.0, 1.0)[:, None]
    return View(around.eyes[0], ways, normals, distance, number >= 0, table)
