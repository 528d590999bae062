"""What occlusion costs while objects move: seconds of all, of a frame, and of EEVEE's frame."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.water import occlusion
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.occlusion.occlusion_table import OcclusionTable
from ._drawing import drawing
from ._places import Place

_FRAMES = 5
_STEP = 0.1  # m from frame to frame
_DIVER, _AHEAD = (0.9, 0.25, 0.25), 3.5  # half its sizes, and how far before the camera it swims, m
_FISH = "Butterflyfish"
SIZE, SAMPLES = (160, 90), 1
"""Of the pictures of :func:`full_frame`."""
_PICTURES = 3
_BANDS = 8
_FAINT = 0.02  # of the unoccluded light: differences of less are those of this


@dataclass(frozen=True)
class Seconds:
    """Seconds on the clock, and of both processors together."""

    wall: float
    cpu: float

    def __str__(self) -> str:
        return f"{self.wall:.2f}/{self.cpu:.2f}"


@dataclass(frozen=True)
class Moving:
    """A place: the whole, and frames in which a fish, a diver and the camera move.

    ``off`` is the largest relative difference of the diver's light from what is solved for itself.
    """

    name: str
    whole: Seconds
    fish: Seconds | None
    diver: Seconds
    camera: Seconds
    off: float

    def cells(self) -> list[object]:
        """Return the row of a table."""
        fish = "" if self.fish is None else self.fish
        off = f"{100 * self.off:.3f} %"
        return [self.name, self.whole, fish, self.diver, self.camera, off]


def moving(place: Place) -> Moving:
    """Measure a place."""
    camera = place.open()
    plan, scene = place.plan(1, bands=_BANDS), bpy.context.scene
    field, cache = plan.solved_field(), occlusion.Cache()

    def frame(cache: occlusion.Cache) -> OcclusionTable:
        around = cache.look(scene, camera, plan.column)
        weights = np.ones((3, len(plan.bands)))
        return occlusion.table_of(around, plan.bands, field, weights, 5.0, cache)

    whole = _timed(lambda: frame(cache))[0]
    swims = (item for item in scene.objects if item.name.startswith(_FISH))
    fish = next(swims, None)
    of_fish = None if fish is None else _middle(_moved(fish, lambda: frame(cache)))
    of_camera = _middle(_moved(camera, lambda: frame(cache), 0.05 * _STEP))
    diver = _diver(camera)
    frame(cache)
    of_diver = list(_moved(diver, lambda: frame(cache)))
    tables = frame(cache), frame(occlusion.Cache())
    off = _off(*tables)
    return Moving(
        place.name, whole, of_fish, _middle(iter(of_diver)), of_camera,
        float(off.max()),
    )  # fmt: skip


def _off(one: OcclusionTable, other: OcclusionTable) -> NDArray[np.float64]:
    outside = other.atlas[:, :1, :1, :1, 0]
    lights = [table.atlas[..., 0] / outside for table in (one, other)]
    off = np.abs(lights[0] - lights[1]) / np.maximum(lights[1], _FAINT)
    return off.astype(np.float64)


def _timed(do: Callable[[], OcclusionTable]) -> tuple[Seconds, OcclusionTable]:
    wall, cpu = time.perf_counter(), time.process_time()
    found = do()
    return Seconds(time.perf_counter() - wall, time.process_time() - cpu), found


def _moved(
    item: bpy.types.Object, do: Callable[[], OcclusionTable], step: float = _STEP
) -> Iterator[Seconds]:
    """Seconds of frames in which an object moves sideways."""
    way = item.matrix_world.to_3x3().col[0].normalized()
    for _ in range(_FRAMES):
        item.location += step * way
        bpy.context.view_layer.update()
        yield _timed(do)[0]


def _middle(found: Iterator[Seconds]) -> Seconds:
    """Return the frame in the middle, by the clock."""
    return sorted(found, key=lambda seconds: seconds.wall)[_FRAMES // 2]


def _diver(camera: bpy.types.Object) -> bpy.types.Object:
    """Put a body as large as a diver before a camera, across its view."""
    matrix = camera.matrix_world
    at = matrix.translation - _AHEAD * matrix.to_3x3().col[2].normalized()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=at)
    item = bpy.context.object
    item.scale, item.rotation_euler = _DIVER, matrix.to_euler()
    bpy.context.view_layer.update()
    return item


@dataclass(frozen=True)
class FullFrame:
    """Seconds of a frame of EEVEE: of a plain picture, and of one with water and occlusion."""

    plain: Seconds
    water: Seconds


def full_frame(place: Place) -> FullFrame:
    """Render frames in which a fish moves, as a job does it, without water and with it."""
    place.open()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    fish = next(item for item in scene.objects if item.name.startswith(_FISH))
    settings = SceneSettings(
        water="jerlov:IB",
        bands=_BANDS,
        surface="flat",
        sky="clear",
        samples=SAMPLES,
        diffuse_shadows=True,
        scene_floor=True,
    )
    return FullFrame(*(_of_eevee(fish, chosen) for chosen in (None, settings)))


def _of_eevee(fish: bpy.types.Object, settings: SceneSettings | None) -> Seconds:
    with tempfile.TemporaryDirectory() as folder, drawing(settings) as drawn:
        picture, frames = Path(folder, "frame.exr"), []
        drawn.picture(picture, SAMPLES)
        for _ in range(_PICTURES):
            fish.location.x += _STEP
            bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)
            wall, cpu = time.perf_counter(), time.process_time()
            if settings is not None:
                drawn.change(settings)
            drawn.picture(picture, SAMPLES)
            frames.append(Seconds(time.perf_counter() - wall, time.process_time() - cpu))
    return min(frames, key=lambda seconds: seconds.wall)
