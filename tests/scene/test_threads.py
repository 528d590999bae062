"""Hair, hair of particles and points as ribbons that face an eye."""

from __future__ import annotations

import math
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from underwater_spectral.node_groups.hair import HIDDEN
from underwater_spectral.scene.materials.wet_trees import surface_node
from underwater_spectral.scene.readers import unusable_places
from underwater_spectral.scene.readers.threads import visible_threads
from underwater_spectral.scene.terms.hair import HairTerm
from underwater_spectral.scene.water import frame_water, realtime, scene_water, water_body
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.scene import columns, scenes
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

EYE = (0.0, -40.0, 0.0)


def _area(surface) -> float:
    a, b, c = np.moveaxis(np.asarray(surface.corners), 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0 * surface.each)


def _only() -> object:
    found = list(visible_threads(bpy.context.evaluated_depsgraph_get()))
    assert len(found) == 1
    return found[0]


def _curves(count: int) -> bpy.types.Object:
    """Upright threads of .5 m in three parts, 4 mm wide, in rows."""
    hair = bpy.data.hair_curves.new("Hair")
    hair.add_curves([4] * count)
    rise = np.tile(np.linspace(0.0, 0.5, 4), count)
    places = np.stack([np.repeat(np.linspace(-1, 1, count), 4), 0.0 * rise, rise], axis=1)
    hair.points.foreach_set("position", places.astype(np.float32).ravel())
    radii = hair.attributes.get("radius") or hair.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(4 * count, 0.002, np.float32))
    item = bpy.data.objects.new("Hair", hair)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


@pytest.mark.parametrize("count", [300, 9000])
def test_hair_covers_its_length_times_its_width(count):
    _curves(count)
    assert _area(_only().ribbons(EYE)) == pytest.approx(count * 0.5 * 0.004, rel=0.02)


def test_hair_grows_with_its_object():
    item = _curves(300)
    item.matrix_world = Matrix.Scale(2.0, 4)
    bpy.context.view_layer.update()
    assert _area(_only().ribbons(EYE)) == pytest.approx(4.0 * 300 * 0.5 * 0.004, rel=0.02)


def test_hidden_hair_is_left_out():
    item = _curves(30)
    item.hide_render = True
    bpy.context.view_layer.update()
    assert not list(visible_threads(bpy.context.evaluated_depsgraph_get()))


def _points(count: int) -> bpy.types.Object:
    cloud = bpy.data.pointclouds.new("Points")
    cloud.resize(count)
    rng = np.random.default_rng(1)
    cloud.attributes["position"].data.foreach_set(
        "vector", rng.uniform(-1.0, 1.0, 3 * count).astype(np.float32)
    )
    radii = cloud.attributes.get("radius") or cloud.attributes.new("radius", "FLOAT", "POINT")
    radii.data.foreach_set("value", np.full(count, 0.03, np.float32))
    item = bpy.data.objects.new("Points", cloud)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    return item


def test_points_cover_their_discs():
    _points(500)
    assert _area(_only().ribbons(EYE)) == pytest.approx(500 * math.pi * 0.03**2, rel=0.02)


def test_hair_of_particles_covers_its_length_times_its_width():
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    item = bpy.context.object
    item.modifiers.new("Hair", "PARTICLE_SYSTEM")
    settings = item.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 2500, 0.3
    settings.root_radius, settings.tip_radius, settings.radius_scale = 1.0, 1.0, 0.004
    settings.display_step = 2
    bpy.context.view_layer.update()
    found = _only()
    assert found.each == 3.0
    assert _area(found.ribbons(EYE)) == pytest.approx(2500 * 0.3 * 0.008, rel=0.1)


@pytest.mark.parametrize("name", ["Hair", "Points"])
def test_a_place_that_is_not_finite_is_left_out_and_named(name):
    """The rest is as it was, and the water is as wide as without it."""
    if name == "Hair":
        data, whole = _curves(300).data, 300 * 0.5 * 0.004
    else:
        data, whole = _points(500).data, 500 * math.pi * 0.03**2
    data.attributes["position"].data[7].vector.z = math.nan
    data.update_tag()
    bpy.context.view_layer.update()
    surface = _only().ribbons(EYE)
    assert np.isfinite(surface.corners).all()
    assert _area(surface) == pytest.approx(whole, rel=0.02)
    (note,) = unusable_places.notes()
    assert f"points of '{name}'" in note
    reach = water_body.scene_reach(bpy.context.scene)
    assert 0.4 < reach.radius < 2.0


def _particles() -> bpy.types.Object:
    bpy.ops.mesh.primitive_plane_add()
    item = bpy.context.object
    settings = item.modifiers.new("Fur", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count = "HAIR", 10
    return item


@pytest.mark.parametrize("make", [lambda: _curves(3), _particles], ids=("curves", "particles"))
def test_hair_alone_is_told_what_it_hides_until_the_water_goes(make):
    scene, fur, rock = bpy.context.scene, scenes.principled("fur"), scenes.principled("rock")
    scenes.add_camera((0.0, 0.0, -2.0), (0.0, 0.0, 0.0))
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.materials.append(rock)
    assert HairTerm.read(SimpleNamespace(scene=scene)) is None
    make().data.materials.append(fur)
    assert HairTerm.read(SimpleNamespace(scene=scene)) is not None
    nodes = {node.name for node in fur.node_tree.nodes}
    column, phase = columns.grey_column(0.1, 0.1), parse_phase("hg:0.5").for_bands(np.ones(3))
    inputs = FrameInputs(terms=(HairTerm(),))
    water = frame_water.realtime_water(column, phase, 2.0, np.eye(3), inputs=inputs)
    realtime.add_realtime(scene, water, water_body.water_extent(scene, column, 2.0))
    surfaces = [surface_node(material.node_tree) for material in (fur, rock)]
    told, other = (surface.inputs[HIDDEN] for surface in surfaces)
    assert told.is_linked
    assert not other.is_linked
    assert other.default_value == 0.0
    scene_water.remove(scene)
    assert {node.name for node in fur.node_tree.nodes} == nodes
