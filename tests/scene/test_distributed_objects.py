"""Objects on the seabed, and schools."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray
from underwater_spectral.node_groups.node_mathematics import MARK
from underwater_spectral.scene.distributed_objects import PRESETS, distribute
from underwater_spectral.uw_spectral.errors import InputError

Array = NDArray[np.float64]
RADIUS = 12.0


@pytest.fixture
def objects() -> bpy.types.Collection:
    """Three small meshes in a collection that the scene does not show, and a camera at 3 m."""
    found = bpy.data.collections.new("objects")
    for number in range(3):
        mesh = bpy.data.meshes.new(f"thing {number}")
        mesh.from_pydata([(0, 0, 0), (0.1, 0, 0), (0, 0, 0.3)], [], [(0, 1, 2)])
        found.objects.link(bpy.data.objects.new(mesh.name, mesh))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (2.0, 1.0, -3.0), (math.pi / 2, 0.0, 0.0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    bpy.context.view_layer.update()
    return found


def seabed(size: float, lean: float = 0.0) -> bpy.types.Object:
    """A plane at 8 m below the middle of what is filled, about x."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=(2.0, 7.0, -8.0), rotation=(lean, 0, 0))
    return bpy.context.object


def matrices(item: bpy.types.Object) -> Array:
    """Where its instances are, (n, 4, 4)."""
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    return np.array([
        i.matrix_world.copy()
        for i in graph.object_instances
        if i.is_instance and i.parent.original == item
    ])  # fmt: skip


def standing(objects: bpy.types.Collection, preset: str = "rocks", **changes: float) -> Array:
    """Scatter them, and return where they are."""
    return matrices(distribute(bpy.context.scene, objects, preset, **changes))


def test_they_stand_on_the_seabed_about_the_place_that_is_looked_at(
    objects: bpy.types.Collection,
) -> None:
    """As many as the density says, and none off the round."""
    seabed(60.0)
    found = standing(objects, Density=3.0, Clumps=0.0)
    np.testing.assert_allclose(found[:, 2, 3], -8.0, atol=1e-4)
    out = np.hypot(found[:, 0, 3] - 2.0, found[:, 1, 3] - 7.0)
    assert RADIUS - 0.3 < out.max() <= RADIUS
    wanted = 3.0 * math.pi * RADIUS**2
    assert abs(len(found) - wanted) < 4.0 * math.sqrt(wanted)
    sizes = np.linalg.norm(found[:, :3, 0], axis=1)
    assert 0.3 <= sizes.min() < 0.35
    assert 1.45 < sizes.max() <= 1.5


def test_a_larger_seabed_and_another_camera_change_nothing_and_the_seed_does(
    objects: bpy.types.Collection,
) -> None:
    """The place is that of the object, once it is there."""
    ground = seabed(60.0)
    item = distribute(bpy.context.scene, objects, "corals")
    before = matrices(item)
    ground.scale *= 40.0
    bpy.context.scene.camera.location.x += 5.0
    np.testing.assert_allclose(matrices(item), before, atol=1e-3)
    bpy.context.scene.camera.location.x -= 5.0
    bpy.context.view_layer.update()
    np.testing.assert_allclose(standing(objects, "corals"), before, atol=1e-3)
    other = standing(objects, "corals", Seed=1)
    assert other.shape != before.shape or np.abs(other - before).max() > 1.0


@pytest.mark.parametrize(("lean", "stands"), [(0.4, True), (0.6, False)])
def test_on_slopes_they_lean_as_far_as_they_are_told_and_not_on_steeper_ones(
    objects: bpy.types.Collection, lean: float, stands: bool
) -> None:
    """Half a radian is the steepest."""
    seabed(200.0, lean)
    found = standing(objects, Steepest=0.5, Clumps=0.0)
    assert (len(found) > 0) == stands
    if stands:
        z = found[:, :3, 2] / np.linalg.norm(found[:, :3, 2], axis=1, keepdims=True)
        np.testing.assert_allclose(z, [[0.0, -math.sin(lean), math.cos(lean)]] * len(z), atol=1e-4)
        upright = standing(objects, Steepest=0.5, Clumps=0.0, Upright=1.0)
        np.testing.assert_allclose(upright[:, :2, 2], 0.0, atol=1e-4)


def test_patches_leave_ground_bare(objects: bpy.types.Collection) -> None:
    """Fewer, nearer to each other than as many that stand evenly."""
    seabed(60.0)
    even = standing(objects, "meadow", Clumps=0.0)
    some = standing(objects, "meadow", Clumps=0.7)
    assert 0.2 < len(some) / len(even) < 0.8
    cells = [
        np.histogram2d(x[:, 0, 3], x[:, 1, 3], bins=12, range=[[-6, 10], [-1, 15]])[0].ravel()
        for x in (even, some)
    ]
    assert (cells[0] > 0).all()
    assert (cells[1] == 0).mean() > 0.1


def test_fish_swim_as_fast_as_they_are_told_and_look_where_they_swim(
    objects: bpy.types.Collection,
) -> None:
    """A frame of 1/24 s, round the place that is looked at."""
    scene = bpy.context.scene
    item = distribute(scene, objects, "school", Wander=0.0, Breadth=0.0)
    scene.frame_set(10)
    before = matrices(item)
    scene.frame_set(11)
    after = matrices(item)
    way = (after - before)[:, :3, 3] * scene.render.fps
    assert len(way) == PRESETS["school"]["Number"]
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), 0.6, rtol=1e-2)
    ahead = before[:, :3, 1] / np.linalg.norm(before[:, :3, 1], axis=1, keepdims=True)
    np.testing.assert_allclose(way / 0.6, ahead, atol=0.02)
    np.testing.assert_allclose(
        np.hypot(before[:, 0, 3] - 2.0, before[:, 1, 3] - 7.0), 6.0, rtol=1e-3
    )
    assert np.ptp(before[:, 2, 3]) < 1.0


def test_what_cannot_be_scattered_is_told(objects: bpy.types.Collection) -> None:
    """No seabed, nothing to scatter, too many; and none leaves anything behind."""
    scene = bpy.context.scene
    with pytest.raises(InputError, match="no seabed below"):
        distribute(scene, objects, "corals")
    seabed(60.0)
    with pytest.raises(InputError, match="nothing to scatter"):
        distribute(scene, None, "corals")
    with pytest.raises(InputError, match="lower density"):
        distribute(scene, objects, "corals", Density=1e4)
    assert not bpy.data.node_groups


def test_it_is_the_users_own(objects: bpy.types.Collection) -> None:
    """Nothing of it is marked as the water's."""
    seabed(60.0)
    item = distribute(bpy.context.scene, objects, "corals")
    tree = item.modifiers[0].node_group
    assert not any(MARK in each for each in (item, item.data, tree, *tree.nodes))


@pytest.mark.slow
@pytest.mark.usefixtures("registered")
def test_the_button_sets_them_on_what_is_selected_and_wets_them(
    objects: bpy.types.Collection,
) -> None:
    """In live water: their material is one of the scene's then."""
    seabed(60.0)
    bpy.ops.mesh.primitive_plane_add(size=60.0, location=(2.0, 7.0, -9.0))
    material = bpy.data.materials.new("thing")
    for item in objects.objects:
        item.data.materials.append(material)
    assert bpy.ops.underwater.add_water() == {"FINISHED"}
    nodes = len(material.node_tree.nodes)
    bpy.context.view_layer.objects.active.select_set(True)
    assert bpy.ops.underwater.distribute(collection="objects", seed=2) == {"FINISHED"}
    found = matrices(bpy.data.objects["Scattered Corals"])
    np.testing.assert_allclose(found[:, 2, 3], -9.0, atol=1e-4)
    assert len(material.node_tree.nodes) > nodes
    assert bpy.ops.underwater.remove_water() == {"FINISHED"}
    assert len(material.node_tree.nodes) == nodes
    assert len(matrices(bpy.data.objects["Scattered Corals"])) == len(found)
    with pytest.raises(RuntimeError, match="nothing to scatter"):
        bpy.ops.underwater.distribute(preset="rocks", collection="")
