"""What must not change the light among objects: where a scene stands, its names, what is far away.

No picture is drawn: what EEVEE looks up is compared at the places that the camera sees and along
its rays.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix
from underwater_spectral.scene.readers import surroundings
from underwater_spectral.scene.terms.occlusion import table_of
from underwater_spectral.scene.water import occlusion
from underwater_spectral.scene.water.term import Eye, SceneFrame
from underwater_spectral.uw_spectral.occlusion.fitted_cells import FittedCells

from . import scene as laws

ACROSS, DOWN = 24, 13
SAME = 1e-4, 1e-3
"""Mean and 99 % of the difference where all cells lie as they did: single precision of places."""
SUMS = 1e-3, 1e-2
"""Where surfaces come in another order, and the means of voxels are added up in that."""
GRAZED = 2e-3, 2.5e-2
"""Where other samples stand for a seabed: single sides of it may be in the sun or not."""
SAMPLES = 2e-2, 3e-1
"""Where other samples stand for the same surfaces: single voxels at their edges may be others."""
ALIGNED = 5e-3, 5e-2
"""What is wanted where cells or directions lie otherwise in the scene."""


@pytest.fixture(autouse=True)
def _probes(monkeypatch):
    monkeypatch.setattr(surroundings, "PROBES", 3000)
    monkeypatch.setattr(surroundings, "_COARSE", 120_000)


def _seen(scene: bpy.types.Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Camera, places that it sees, or far on the way, and their normals, zero in open water."""
    camera, depsgraph = scene.camera, bpy.context.evaluated_depsgraph_get()
    right, _, left, top = (
        camera.matrix_world @ corner for corner in camera.data.view_frame(scene=scene)
    )
    eye = camera.matrix_world.translation
    places, normals = [], []
    for j, i in np.ndindex(DOWN, ACROSS):
        at = top + (right - top) * ((i + 0.5) / ACROSS) + (left - top) * ((j + 0.5) / DOWN)
        ray = (at - eye).normalized()
        hit, place, normal, *_ = scene.ray_cast(depsgraph, eye, ray, distance=60.0)
        places.append(place if hit else eye + 30.0 * ray)
        normals.append(normal if hit else (0.0, 0.0, 0.0))
    return np.array(eye), np.array(places), np.array(normals)


def read(scene: bpy.types.Scene, azimuth: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Ratios of the light on surfaces and of paths, by pixel, (DOWN, ACROSS)."""
    bpy.context.view_layer.update()
    plan, cache = laws.plan(sun_azimuth=azimuth), occlusion.Cache(of_job=True)
    around = cache.look(scene, scene.camera, plan.column, ())
    eye = Eye(scene.camera, laws.DEPTH)
    table = table_of(SceneFrame(scene, plan, eye, cache, plan), around)
    origin, places, normals = _seen(scene)
    length = np.linalg.norm(places - origin, axis=1)
    ways = (places - origin) / length[:, None]
    on = np.ones(len(places))
    hit = normals.any(axis=1)
    on[hit] = table.on_patches(places[hit], normals[hit])[:, 0]
    rate = float(plan.column.attenuation.min())
    along = table.along(np.broadcast_to(origin, places.shape), ways, length, rate)[:, 0]
    return on.reshape(DOWN, ACROSS), along.reshape(DOWN, ACROSS)


def off(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Relative difference of two sets of ratios, mean and 99 %."""
    apart = np.abs(one - other) / np.maximum((one + other) / 2.0, 0.02)
    return float(apart.mean()), float(np.quantile(apart, 0.99))


def _nothing(_: bpy.types.Scene) -> None:
    pass


def _moved(scene: bpy.types.Scene) -> None:
    _place(scene, Matrix.Translation((123.0, -77.0, 0.0)))


def _place(scene: bpy.types.Scene, by: Matrix, *, camera: bool = True) -> None:
    for item in scene.objects:
        if camera or item.type != "CAMERA":
            item.matrix_world = by @ item.matrix_world


def _turned(scene: bpy.types.Scene) -> None:
    _place(scene, Matrix.Rotation(math.pi / 2, 4, "Z"))


def _mirrored(scene: bpy.types.Scene) -> None:
    _place(scene, Matrix.Diagonal((-1.0, 1.0, 1.0, 1.0)), camera=False)


def _far_away(_: bpy.types.Scene) -> None:
    bpy.ops.mesh.primitive_cube_add(size=9.0, location=(300.0, 200.0, -6.0))


def _larger_seabed(scene: bpy.types.Scene) -> None:
    scene.objects["sand"].scale = (10.0, 10.0, 1.0)


def _finer(_: bpy.types.Scene) -> None:
    for item in laws.meshes():
        modifier = item.modifiers.new("finer", "SUBSURF")
        modifier.subdivision_type = "SIMPLE"
        modifier.levels = modifier.render_levels = 2


def _joined(_: bpy.types.Scene) -> None:
    items = laws.meshes()
    with bpy.context.temp_override(
        active_object=items[0], selected_editable_objects=items, selected_objects=items
    ):
        bpy.ops.object.join()


def _renamed_and_reversed(scene: bpy.types.Scene) -> None:
    for number, item in enumerate(reversed(laws.meshes())):
        scene.collection.objects.unlink(item)
        item.name = item.data.name = f"object {number}"
        scene.collection.objects.link(item)


def _own_materials(_: bpy.types.Scene) -> None:
    for item in laws.meshes():
        item.data.materials[0] = item.data.materials[0].copy()


def _instanced(scene: bpy.types.Scene) -> None:
    """Objects become those of a collection that an empty shows."""
    collection = bpy.data.collections.new("shown")
    for item in laws.meshes():
        scene.collection.objects.unlink(item)
        collection.objects.link(item)
    empty = bpy.data.objects.new("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(empty)


LAWS: dict[str, tuple[Callable[[bpy.types.Scene], None], tuple[float, float], float, bool]] = {
    "built again": (_nothing, SAME, 0.0, False),
    "moved": (_moved, SAME, 0.0, False),
    "far object": (_far_away, SAME, 0.0, False),
    "own materials": (_own_materials, SAME, 0.0, False),
    "renamed and reversed": (_renamed_and_reversed, SUMS, 0.0, False),
    "joined": (_joined, SUMS, 0.0, False),
    "instanced": (_instanced, SUMS, 0.0, False),
    "larger seabed": (_larger_seabed, GRAZED, 0.0, False),
    "finer": (_finer, SAMPLES, 0.0, False),
    "mirrored": (_mirrored, ALIGNED, 180.0, True),
    "turned": (_turned, ALIGNED, 90.0, False),
}
"""What is done to the scene, what may differ, the azimuth of the sun then, and whether what is seen
is mirrored."""


@pytest.fixture(scope="module")
def known() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {}


BROKEN = {
    "mirrored": "on surfaces 2.3 % in the mean and 37 % at 99 %: 64 directions are not mirrored",
    "turned": "on surfaces 2.6 % in the mean and 37 % at 99 %: half with 256 directions of a probe",
}


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=BROKEN[name]))
        if name in BROKEN
        else name
        for name in LAWS
    ],
)
def test_occlusion_does_not_depend_on(name, known, record_property):
    if not known:
        known["as it is"] = read(laws.build())
    before = known["as it is"]
    change, bounds, azimuth, mirrored = LAWS[name]
    scene = laws.build()
    change(scene)
    after = read(scene, azimuth)
    if mirrored:
        after = tuple(x[:, ::-1] for x in after)
    found = [off(one, other) for one, other in zip(before, after, strict=True)]
    record_property("differences", str(found))
    for mean, most in found:
        assert mean <= bounds[0], found
        assert most <= bounds[1], found
    # An error of a tenth that depends on what was changed is seen.
    assert off(before[0], 1.1 * after[0])[0] > bounds[0]
    assert before[0].min() < 0.7, "there is occlusion"


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("thick", "turn", "most", "by_fit"),
    [
        # Cells do not reach through walls of two voxels along the axes.
        *((thick, (0.0, 0.0, 0.0), 1e-3, thick != 0.2) for thick in (0.05, 0.2, 0.3)),
        # Cells beside oblique walls are fitted to a percent or two of the light behind these.
        (0.05, (0.0, 0.0, 27.0), 0.01, True),
        (0.2, (10.0, 0.0, 35.0), 0.03, True),
        (0.2, (0.0, 0.0, 43.0), 0.01, True),
    ],
    ids=["sheets", "walls", "thick walls", "turned sheets", "tilted", "a camera close to a wall"],
)
def test_a_sealed_room_is_dark(thick, turn, most, by_fit, monkeypatch):
    """A box that was cut let light into its corners, and an eye in a wall's voxel into all."""
    monkeypatch.setattr(surroundings, "PROBES", 6000)  # they hold all of it
    scene = laws.build()
    middle = Matrix.Translation((0.0, 0.0, -6.0))
    by = middle @ Euler(np.radians(turn)).to_matrix().to_4x4() @ middle.inverted()
    for wall in laws.seal(thick):
        wall.matrix_world = by @ wall.matrix_world
    on, along = read(scene)
    assert max(on.max(), along.max()) < most
    assert np.median(on) < 1e-3
    monkeypatch.setattr(FittedCells, "fit_faces", lambda *_: None)
    assert (read(scene)[0].max() > 0.01) == by_fit, "cells are fitted to what is seen"
