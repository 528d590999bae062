"""What occlusion costs while objects move: seconds of all, of a frame, and of EEVEE's frame."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ..scene.water import occlusion
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.occlusion.occlusion_table import OcclusionTable
from ._drawing import drawing
from ._places import Place
from ._scenery import sized

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

    @classmethod
    def of(cls, do: Callable[[], object]) -> Seconds:
        """Seconds that something takes."""
        wall, cpu = time.perf_counter(), time.process_time()
        do()
        return cls(time.perf_counter() - wall, time.process_time() - cpu)


def moving(place: Place) -> list[object]:
    """Measure a place: seconds of the whole, and of frames with a fish, a diver and the camera.

    Last, the largest relative difference of the diver's light from what is solved for itself.
    """
    camera = place.open()
    plan, scene = place.plan(1, bands=_BANDS), bpy.context.scene
    field, cache = plan.solved_field(), occlusion.Cache()

    def frame(cache: occlusion.Cache = cache) -> OcclusionTable:
        around = cache.look(scene, camera, plan.column)
        weights = np.ones((3, len(plan.bands)))
        return occlusion.table_of(around, plan.bands, field, weights, 5.0, cache)

    whole = Seconds.of(frame)
    fish = next((item for item in scene.objects if item.name.startswith(_FISH)), None)
    of_fish = "" if fish is None else _moved(fish, frame)
    of_camera = _moved(camera, frame, 0.05 * _STEP)
    diver = _diver(camera)
    frame()
    of_diver = _moved(diver, frame)
    # Over what is not occluded.
    lights = [table.atlas[..., 0] / table.atlas[:, :, :1, :1, :1, 0]
              for table in (frame(), frame(occlusion.Cache()))]  # fmt: skip
    off = np.abs(lights[0] - lights[1]) / np.maximum(lights[1], _FAINT)
    return [place.name, whole, of_fish, of_diver, of_camera, f"{100 * float(off.max()):.3f} %"]


def _moved(
    item: bpy.types.Object, do: Callable[[], OcclusionTable], step: float = _STEP
) -> Seconds:
    """Return the middle one, by the clock, of frames in which an object moves sideways."""
    way, found = item.matrix_world.to_3x3().col[0].normalized(), []
    for _ in range(_FRAMES):
        item.location += step * way
        bpy.context.view_layer.update()
        found.append(Seconds.of(do))
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


def full_frame(place: Place) -> tuple[Seconds, Seconds]:
    """Render frames in which a fish moves, as a job does it, without water and with it."""
    place.open()
    scene = sized(SIZE)
    fish = next(item for item in scene.objects if item.name.startswith(_FISH))
    settings = SceneSettings(
        water="jerlov:IB", bands=_BANDS, surface="flat", sky="clear", samples=SAMPLES,
        diffuse_shadows=True, scene_floor=True,
    )  # fmt: skip
    return _of_eevee(fish, None), _of_eevee(fish, settings)


def _of_eevee(fish: bpy.types.Object, settings: SceneSettings | None) -> Seconds:
    frames = []
    with drawing(settings) as drawn:

        def draw() -> None:
            if settings is not None:
                drawn.change(settings)
            drawn.picture(SAMPLES)

        drawn.picture(SAMPLES)
        for _ in range(_PICTURES):
            fish.location.x += _STEP
            bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)
            frames.append(Seconds.of(draw))
    return min(frames, key=lambda seconds: seconds.wall)
