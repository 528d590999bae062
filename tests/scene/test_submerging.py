"""Lowering a scene: everything goes down by the same distance, whatever holds it."""

from __future__ import annotations

import math

import bpy
import pytest
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene.viewport import submerging
from underwater_spectral.tests.scene import scenes

DISTANCE = 7.0


@pytest.fixture
def scene(registered):
    return bpy.context.scene


def _empty(name, place=(1.0, 2.0, 3.0), collection=None):
    item = bpy.data.objects.new(name, None)
    item.location = place
    (collection or bpy.context.scene.collection).objects.link(item)
    return item


def _held(kind, **properties):
    """An object that is held by another one."""
    target, item = _empty("target", (0.0, 1.0, 2.0)), _empty("held")
    constraint = item.constraints.new(kind)
    constraint.target = target
    for name, value in properties.items():
        setattr(constraint, name, value)
    return item


def _child(turn=0.0, scale=1.0, hidden=False):
    parent, child = _empty("parent"), _empty("child")
    parent.rotation_euler, parent.scale = (turn, 0.0, 0.0), (scale,) * 3
    bpy.context.view_layer.update()
    child.parent = parent
    child.matrix_parent_inverse = parent.matrix_world.inverted()
    parent.hide_viewport = parent.hide_render = hidden


def _outside_parent():
    """A parent that is in no scene does not move; its child does."""
    parent = bpy.data.objects.new("outside", None)
    parent.rotation_euler, parent.scale = (math.pi / 2, 0.0, 0.3), (2.0, 2.0, 2.0)
    _empty("child").parent = parent


def _path():
    curve = bpy.data.curves.new("path", "CURVE")
    curve.dimensions, curve.use_path = "3D", True
    spline = curve.splines.new("POLY")
    spline.points.add(1)
    spline.points[1].co = (4.0, 1.0, 2.0, 1.0)
    target = bpy.data.objects.new("path", curve)
    bpy.context.scene.collection.objects.link(target)
    follower = _empty("follower")
    made = follower.constraints.new("FOLLOW_PATH")
    made.target, made.use_curve_follow = target, True
    camera = scenes.add_camera((0.0, 0.0, 4.0))
    camera.constraints.new("CHILD_OF").target = follower


def _keyed(name):
    item = _empty("keyed")
    for frame, z in ((1, 2.0), (20, 5.0)):
        getattr(item, name)[2] = z
        item.keyframe_insert(name, frame=frame)


def _armature():
    data = bpy.data.armatures.new("rig")
    rig = bpy.data.objects.new("rig", data)
    rig.location.z = 2.0
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = data.edit_bones.new("bone")
    bone.tail = (0.0, 1.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    child = _empty("on a bone")
    child.parent, child.parent_type, child.parent_bone = rig, "BONE", "bone"


def _instanced():
    """Objects of a collection that is in the scene, and instanced there too."""
    part = bpy.data.collections.new("part")
    bpy.context.scene.collection.children.link(part)
    _empty("in part", collection=part)
    scenes._cube("cube", (0.0, 6.0, 1.0))
    cube = bpy.data.objects["cube"]
    bpy.context.scene.collection.objects.unlink(cube)
    part.objects.link(cube)
    item = _empty("instancer")
    item.instance_type, item.instance_collection = "COLLECTION", part


def _left_out():
    part = bpy.data.collections.new("left out")
    bpy.context.scene.collection.children.link(part)
    _empty("excluded", collection=part)
    item = _held("CHILD_OF")
    bpy.context.scene.collection.objects.unlink(item)
    part.objects.link(item)
    bpy.context.view_layer.layer_collection.children["left out"].exclude = True


KINDS = {
    "plain": lambda: _empty("plain"),
    "child": _child,
    "child of what is turned and scaled": lambda: _child(1.0, 3.0),
    "child of what is hidden": lambda: _child(hidden=True),
    "child of what is in no scene": _outside_parent,
    "child of": lambda: _held("CHILD_OF"),
    "copied location": lambda: _held("COPY_LOCATION"),
    "copied location, half": lambda: _held("COPY_LOCATION", influence=0.5),
    "copied location, added": lambda: _held("COPY_LOCATION", use_offset=True),
    "copied transforms": lambda: _held("COPY_TRANSFORMS"),
    "tracks": lambda: _held("TRACK_TO"),
    "keeps its distance": lambda: _held("LIMIT_DISTANCE", distance=0.5),
    "path, camera on it": _path,
    "keyed": lambda: _keyed("location"),
    "keyed delta": lambda: _keyed("delta_location"),
    "on a bone": _armature,
    "instanced": _instanced,
    "left out": _left_out,
}


def _places(layer):
    layer.update()
    found = {}
    for one in layer.depsgraph.object_instances:
        name = f"{one.object.name} {one.parent.name if one.parent else ''}"
        found[name] = one.matrix_world.translation.copy()
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_everything_goes_down_once(scene, kind):
    KINDS[kind]()
    layer = scene.view_layers.new("all")
    hidden = [item for item in scene.objects if item.hide_viewport]
    for item in hidden:
        item.hide_viewport = False
    before = _places(layer)
    for item in hidden:
        item.hide_viewport = True
    assert before
    for _ in range(2):
        assert submerging.lower(scene, DISTANCE / 2.0) == []
    assert all(item.hide_viewport for item in hidden)
    for item in hidden:
        item.hide_viewport = False
    after = _places(layer)
    assert before.keys() == after.keys()
    for name, place in before.items():
        moved = after[name] - place
        assert tuple(moved) == pytest.approx((0.0, 0.0, -DISTANCE), abs=3e-3), name
    assert submerging.lower(scene, -DISTANCE) == []
    for name, place in _places(layer).items():
        assert tuple(place) == pytest.approx(tuple(before[name]), abs=3e-3), name


def test_what_cannot_follow_is_named(scene):
    driven = _empty("driven")
    driven.driver_add("delta_location", 2).driver.expression = "1.0"
    outside = bpy.data.objects.new("outside", None)
    held = _empty("held")
    held.constraints.new("COPY_LOCATION").target = outside
    other = bpy.data.scenes.new("other")
    other.collection.objects.link(_empty("shared"))
    notes = submerging.lower(scene, DISTANCE)
    assert len(notes) == 3
    assert any("'held' went 0 m" in n and "'Copy Location' holds it" in n for n in notes)
    assert any("'driven' went 0 m" in n and "driver" in n for n in notes)
    assert any("'shared'" in n and "'other'" in n for n in notes)
    assert held.delta_location.z == 0.0


def test_an_added_floor_keeps_its_distance(scene):
    scenes.add_camera((0.0, 0.0, 3.0))
    scenes._cube("cube", (0.0, 6.0, 1.0))
    scene.underwater.floor_depth = 4.0
    scene.underwater.keyframe_insert("floor_depth", frame=1)
    bpy.context.view_layer.update()
    assert bpy.ops.underwater.submerge(depth=5.0) == {"FINISHED"}
    assert scene.underwater.floor_depth == pytest.approx(12.0)
    scene.frame_set(1)
    assert scene.underwater.floor_depth == pytest.approx(12.0)
    assert scene.camera.matrix_world.translation.z == pytest.approx(-5.0)
    assert not any(MARK in item for item in scene.objects)
