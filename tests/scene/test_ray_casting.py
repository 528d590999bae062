"""Rays through the meshes of a scene: as Blender's own, faster."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector
from underwater_spectral.scene.readers.ray_casting import Meshes
from underwater_spectral.tests.scene import scenes


def _add(name, data, location, scale=(1.0, 1.0, 1.0)):
    item = bpy.data.objects.new(name, data)
    item.location, item.scale, item.rotation_euler = location, scale, (0.3, 0.2, 0.1)
    bpy.context.scene.collection.objects.link(item)
    return item


def _crowd():
    """Cubes that share a mesh, a bent tube, instances, a flattened cube, and hidden objects."""
    cube = scenes._cube("cube", (0.0, 0.0, -5.0))
    random = np.random.default_rng(1)
    for index in range(30):
        _add(f"copy {index}", cube.data, random.normal(0, 6, 3), random.uniform(0.1, 2, 3))
    _add("mirrored", cube.data, (3.0, -3.0, 3.0), (-1.0, 2.0, 1.0))
    curve = bpy.data.curves.new("tube", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.4
    spline = curve.splines.new("POLY")
    spline.points.add(3)
    for point, at in zip(spline.points, random.normal(0, 5, (4, 3)), strict=True):
        point.co = (*at, 1.0)
    _add("tube", curve, (0.0, 0.0, 0.0))
    group = bpy.data.collections.new("group")
    group.objects.link(bpy.data.objects.new("part", cube.data))
    instancer = _add("instancer", None, (-6.0, 4.0, 2.0))
    instancer.instance_type, instancer.instance_collection = "COLLECTION", group
    _add("hidden", cube.data, (0.0, 0.0, 0.0), (9.0, 9.0, 9.0)).hide_viewport = True
    _add("hidden too", cube.data, (0.0, 0.0, 0.0), (9.0, 9.0, 9.0)).hide_set(True)
    _add("nothing", bpy.data.meshes.new("nothing"), (0.0, 0.0, 0.0))
    bpy.context.view_layer.update()
    return bpy.context.evaluated_depsgraph_get()


def _rays(count, spread=9.0):
    random = np.random.default_rng(2)
    w = random.normal(size=(count, 3))
    return random.normal(0, spread, (count, 3)), w / np.linalg.norm(w, axis=1)[:, None]


def test_hits_are_those_of_blender(empty_blender):
    depsgraph = _crowd()
    meshes = Meshes(depsgraph)
    origin, direction = _rays(600)
    endless = np.full(len(origin), math.inf)
    hits = meshes.first(origin, direction, endless)
    clear = meshes.clear(origin, direction, endless)
    seen = 0
    for o, w, hit, free in zip(origin, direction, hits, clear, strict=True):
        true, point, normal, *_ = empty_blender.ray_cast(depsgraph, Vector(o), Vector(w))
        assert true == (hit is not None) == (not free)
        if hit:
            seen += 1
            assert hit.distance == pytest.approx((point - Vector(o)).length, abs=1e-4)
            assert hit.normal.dot(Vector(w)) <= 0
            assert abs(hit.normal.dot(normal)) == pytest.approx(1.0, abs=1e-4)
    assert 50 < seen < 500


def test_limits_and_what_is_left_out(empty_blender):
    depsgraph = _crowd()
    origin, direction = _rays(300)
    endless = np.full(len(origin), math.inf)
    meshes = Meshes(depsgraph, [o for o in bpy.data.objects if o.name.startswith("copy")])
    all_hits = Meshes(depsgraph).first(origin, direction, endless)
    fewer = meshes.first(origin, direction, endless)
    assert sum(h is not None for h in fewer) < sum(h is not None for h in all_hits)
    far = np.array([h.distance if h else math.inf for h in fewer])
    for factor, met in ((0.99, False), (1.01, True)):
        limits = np.where(np.isfinite(far), far * factor, 1.0)
        near = meshes.first(origin, direction, limits)
        assert all((h is not None) == met for h, d in zip(near, far, strict=True) if d < math.inf)
        assert (meshes.clear(origin, direction, limits)[np.isfinite(far)] != met).all()


def test_a_cube_that_is_squeezed_flat_is_a_plane(empty_blender):
    flat = scenes._cube("flat", (0.0, 0.0, -2.0))
    flat.scale = (1.0, 1.0, 0.0)
    bpy.context.view_layer.update()
    meshes = Meshes(bpy.context.evaluated_depsgraph_get())
    down = np.array([[0.0, 0.0, -1.0]] * 2)
    hits = meshes.first(np.array([[0.2, 0.3, 0.0], [3.0, 0.0, 0.0]]), down, np.full(2, math.inf))
    assert hits[0].distance == pytest.approx(2.0)
    assert tuple(hits[0].normal) == pytest.approx((0.0, 0.0, 1.0))
    assert hits[1] is None


def test_a_face_has_the_colour_of_its_slot(empty_blender):
    cube = scenes._cube("cube", (0.0, 0.0, 0.0))
    colours = (0.8, 0.1, 0.2), (0.2, 0.7, 0.4)
    for colour in colours:
        cube.data.materials.append(scenes.principled("paint", (*colour, 1.0)))
    for polygon in cube.data.polygons:
        polygon.material_index = int(polygon.center.z > 0.5)
    bpy.context.view_layer.update()
    meshes = Meshes(bpy.context.evaluated_depsgraph_get(), (), "camera")
    origin = np.array([[0.1, 0.2, 5.0], [0.1, 0.2, -5.0]])
    hits = meshes.first(origin, -origin / 5.0 * [0, 0, 1], np.full(2, math.inf))
    np.testing.assert_allclose([hit.colour for hit in hits], colours[::-1], atol=1e-6)


def test_an_empty_scene_is_clear(empty_blender):
    meshes = Meshes(bpy.context.evaluated_depsgraph_get())
    origin, direction = _rays(3)
    assert meshes.clear(origin, direction, np.ones(3)).all()
    assert meshes.first(origin, direction, np.ones(3)) == [None] * 3
