"""What is not finite in a scene changes nothing else, and is named; a camera is refused."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from underwater_spectral.scene.readers import cameras, lamps, surroundings, unusable_places
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.errors import InputError


def _vertex(value):
    def spoil(item):
        item.data.vertices[5].co.z = value

    return spoil


def _place(name, value):
    def spoil(item):
        getattr(item, name).x = value

    return spoil


def _key(item):
    item.shape_key_add(name="Basis")
    key = item.shape_key_add(name="torn")
    key.data[3].co.x, key.value = math.nan, 1.0


def _matrix(item):
    item.matrix_world = Matrix([[math.nan] * 4] * 4)


def _instances(item):
    inner = bpy.data.collections.new("torn")
    inner.objects.link(item)
    empty = bpy.data.objects.new("empty", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", inner
    empty.location.y = math.inf
    for holder in item.users_collection:
        if holder != inner:
            holder.objects.unlink(item)
    bpy.context.scene.collection.objects.link(empty)


def _seen():
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    around = surroundings.look_around(scene, scene.camera, 0.1)
    number = around.coarse.number >= 0
    return water_body.scene_reach(scene), around.ground, around.coarse.grid, number


SPOILT = {
    "NaN vertex": _vertex(math.nan),
    "infinite vertex": _vertex(math.inf),
    "far vertex": _vertex(1e30),
    "NaN place": _place("location", math.nan),
    "far place": _place("location", 1e30),
    "infinite scale": _place("scale", math.inf),
    "shape key": _key,
    "matrix": _matrix,
    "instance": _instances,
}


@pytest.mark.parametrize("name", SPOILT)
def test_what_is_not_finite_is_left_out_and_named(name):
    scenes.add_camera((0.0, 0.0, -3.0))
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(0.0, 0.0, -5.0))
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(-4.0, 6.0, -4.0))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=(2.0, 4.0, -4.5))
    item = bpy.context.object
    whole = _seen()
    assert unusable_places.notes() == []
    SPOILT[name](item)
    torn = _seen()
    assert torn[:3] == whole[:3]
    # At most the ball is away, or a part of it.
    assert 0 <= (whole[3] ^ torn[3]).sum() < 60
    (note,) = unusable_places.notes()
    assert "'Sphere'" in note


@pytest.mark.parametrize("part", ["place", "power"])
def test_a_lamp_that_is_not_finite_is_dark_and_named(part, properties):
    lamp = bpy.data.objects.new("Torch", bpy.data.lights.new("Torch", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    lamp.location.z = -4.0
    if part == "place":
        lamp.location.x = math.nan
    else:
        lamp.data.energy = math.nan
    bpy.context.view_layer.update()
    found = lamps.plan_lamps(bpy.context.scene, make_plan(SceneSettings(bands=3)))
    assert not any(np.any(x.intensity) for x in found.lamps)
    assert any("'Torch'" in note and "not finite" in note for note in found.notes)


@pytest.mark.parametrize("name", ["location", "rotation_euler"])
def test_a_camera_that_is_not_finite_is_refused(name):
    camera = scenes.add_camera()
    getattr(camera, name).x = math.nan
    with pytest.raises(InputError, match=r"camera 'Camera': its place or direction at frame 1"):
        cameras.camera_depth(camera, math.inf)
