"""Views from the air: EEVEE against the formulas, and scenes that get everything back."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.node_groups.realtime_air import AirShape
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.terms.view_from_air import AirTerm
from underwater_spectral.scene.water import (
    realtime,
    refraction_displacement,
    scene_water,
    water_body,
)
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.surface.refraction import (
    apparent_depth,
    fresnel_reflectance,
    seen_from_air,
)
from underwater_spectral.uw_spectral.transfer.above_water import leaving_fraction, light_in_air

from . import scenes, snapshot

HEIGHT, FLOOR, N, SIZE = 2.0, 4.0, 1.34, 48
ANGLE = math.radians(60.0)  # of the view, from straight down
FIELD = math.radians(70.0)
BALL, GLOW = np.array([0.4, 2.2, -2.0]), 40.0


def _camera(scene: bpy.types.Scene) -> bpy.types.Object:
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, HEIGHT), (ANGLE, 0.0, 0.0)
    camera.data.angle = FIELD
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return camera


def _ball() -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.1, location=BALL, segments=16, ring_count=8)
    bpy.context.object.data.materials.append(scenes.glow(GLOW))


def _paint_white(scene: bpy.types.Scene) -> None:
    """Give the last object a matt white, and the picture few pixels."""
    material = bpy.data.materials.new("white")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (0.8, 0.8, 0.8, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    scene.render.resolution_x = scene.render.resolution_y = 12
    bpy.context.view_layer.update()


def _plan(**options: object) -> render_plan.RenderPlan:
    chosen = {"surface": "flat", "sky": "clear", "illuminant": "clear-sky", "bands": 3}
    chosen |= {"floor_depth": FLOOR, "floor_reflectance": "0.3", "diffuse_shadows": False}
    return render_plan.make_plan(SceneSettings(water="jerlov:IB", samples=4, **chosen | options))


def _directions() -> np.ndarray:
    along = (np.arange(SIZE) + 0.5 - SIZE / 2) * 2.0 * math.tan(FIELD / 2) / SIZE
    right, up = np.meshgrid(along, -along)
    ahead = np.array([0.0, math.sin(ANGLE), -math.cos(ANGLE)])
    lift = np.array([0.0, math.cos(ANGLE), math.sin(ANGLE)])
    v = right[..., None] * [1.0, 0.0, 0.0] + up[..., None] * lift + ahead
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@pytest.mark.slow
def test_eevee_draws_sky_floor_and_objects_where_and_as_they_seem(empty_blender):
    scene, plan = empty_blender, _plan()
    camera = _camera(scene)
    _ball()
    before = snapshot.snapshot()
    extent = water_body.water_extent(scene, plan.column, 0.0)
    with engines.eevee_bands(scene, camera, plan, extent, 0.0) as engine:
        image = grey_scene.band_image(engine, plan, 0.0)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    v = _directions()
    parts = tuple(v[..., i, None] for i in range(3))
    sky = plan.column.skylight
    up = v[..., 2] > 0.02
    wanted = np.broadcast_to(sky.radiance(parts), image.shape)
    np.testing.assert_allclose(image[up], wanted[up], rtol=5e-3)
    # Below the horizon, and off the ball and its shadow: mirrored sky and light of the water.
    place = BALL - [0.0, 0.0, HEIGHT]
    place[2] = -HEIGHT - apparent_depth(np.hypot(*place[:2]), -BALL[2], HEIGHT, N)
    towards = place / np.linalg.norm(place)
    near = v @ towards
    R, w, mirrored = seen_from_air(parts, (0.0, 0.0, 1.0), N)
    flat = tuple(np.broadcast_to(component, (SIZE, SIZE, 1)).ravel() for component in w)
    below = plan.solved_field(16).radiance(0.0, flat).reshape(image.shape)
    seen = R * sky.radiance(mirrored) + leaving_fraction(R, N) * below
    free = (v[..., 2] < -0.1) & (near < math.cos(math.radians(20.0)))
    off = image[free] / seen[free] - 1.0
    assert np.median(np.abs(off)) < 0.02
    assert np.quantile(np.abs(off), 0.95) < 0.05
    # The ball is where refraction puts it; without, it would be 7 pixels lower.
    bright = np.maximum(image[..., 1] - seen[..., 1], 0.0) * (near > math.cos(math.radians(15.0)))
    bright[bright < 0.3 * bright.max()] = 0.0
    found = (bright[..., None] * v).sum(axis=(0, 1))
    found /= np.linalg.norm(found)
    assert math.degrees(math.acos(min(float(found @ towards), 1.0))) < 0.5


def test_large_faces_are_divided_while_the_water_is_there(empty_blender):
    scene, plan = empty_blender, _plan(floor_depth=0.0)
    camera = _camera(scene)
    bpy.ops.mesh.primitive_plane_add(size=40.0, location=(0.0, 0.0, -3.0))
    ground = bpy.context.object
    ground.data.materials.append(bpy.data.materials.new("ground"))
    before = snapshot.snapshot()
    water = eevee_water(plan, scene, Eye(camera, 0.0), np.ones((3, 3)))
    assert AirShape in water.shape
    realtime.add_realtime(scene, water, water_body.water_extent(scene, plan.column, 0.0))
    (modifier,) = ground.modifiers
    assert 40.0 / 2**modifier.render_levels < 1.5
    assert ground.material_slots[0].material.displacement_method == "DISPLACEMENT"
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_a_camera_below_has_neither(empty_blender):
    scene, plan = empty_blender, _plan()
    camera = _camera(scene)
    camera.location.z = -1.0
    bpy.context.view_layer.update()
    assert not eevee_water(plan, scene, Eye(camera, 1.0), np.ones((3, 3))).term(AirTerm)


@pytest.mark.parametrize("height", [0.01, pytest.param(-0.01, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_a_camera_at_the_surface_shows_both_worlds(empty_blender, height):
    scene, plan = empty_blender, _plan(floor_depth=0.0, sky="uniform")
    camera = _camera(scene)
    camera.location.z, camera.rotation_euler.x = height, math.pi / 2
    bpy.context.view_layer.update()
    extent = water_body.water_extent(scene, plan.column, 0.0)
    few = replace(plan, settings=replace(plan.settings, samples=1))
    with engines.eevee_bands(scene, camera, few, extent, 0.0) as engine:
        image = grey_scene.band_image(engine, few, 0.0)
    level = plan.column.sky_radiance
    np.testing.assert_allclose(image[:15], np.broadcast_to(level, image[:15].shape), rtol=5e-3)
    rows = SIZE / 2 * (1.0 + height / 0.1 / math.tan(FIELD / 2))
    below = image[math.ceil(rows) + 2 :]
    assert (np.abs(below / level - 1.0).max(axis=-1) > 0.1).all()


def test_cycles_lights_objects_in_the_air_by_the_sun_and_sky_of_the_air(empty_blender):
    scene, plan = empty_blender, _plan(sky="uniform", phase="hg:0.9", sun_zenith=50.0)
    camera = _camera(scene)
    camera.location.z, camera.rotation_euler.x, camera.data.angle = 3.0, 0.0, 0.2
    bpy.ops.mesh.primitive_plane_add(size=4.0, location=(0.0, 0.0, 1.0))
    _paint_white(scene)
    before = snapshot.snapshot()
    extent = water_body.water_extent(scene, plan.column, 0.0)
    many = replace(plan, settings=replace(plan.settings, samples=64))
    with engines.cycles_bands(scene, camera, many, extent, seed=1) as engine:
        image = grey_scene.band_image(engine, many, 0.0)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    light = light_in_air(plan.column)
    wanted = 0.8 / math.pi * (light.sun * math.cos(math.radians(50.0)) + light.sky)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), wanted, rtol=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("height", [1.0, 0.3])
def test_eevee_lights_objects_in_the_air_by_the_sun_and_sky_of_the_air(empty_blender, height):
    """A wall that faces the sun and the camera; the sun is drawn from elsewhere.

    An upright wall faces the mirrored sun as it does the sun, and half of what comes from below.
    """
    scene = empty_blender
    plan = _plan(sky="uniform", phase="hg:0.9", sun_zenith=50.0, sun_azimuth=80.0)
    camera = _camera(scene)
    camera.location.z, camera.rotation_euler.x, camera.data.angle = height, math.pi / 2, 0.1
    bpy.ops.mesh.primitive_plane_add(
        size=1.0, location=(0.0, 3.0, height), rotation=(math.pi / 2, 0.0, 0.0)
    )
    _paint_white(scene)
    extent = water_body.water_extent(scene, plan.column, 0.0)
    with engines.eevee_bands(scene, camera, plan, extent, 0.0) as engine:
        image = grey_scene.band_image(engine, plan, 0.0)
    light = light_in_air(plan.column, plan.solved_field(16))
    R = fresnel_reflectance(math.cos(math.radians(50.0)), N)
    cosine = math.sin(math.radians(50.0)) * math.sin(math.radians(80.0))
    below = (light.sky * light.mirrored + light.leaving) / 2
    wanted = 0.8 / math.pi * (light.sun * cosine * (1.0 + R) + light.sky / 2 + below)
    np.testing.assert_allclose(image[6, 6], wanted, rtol=0.02)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("in_air", [True, False])
def test_undersides_are_lit_from_the_water_as_cycles_does_it(empty_blender, in_air):
    """A small board level over the water, seen from right below it."""
    scene = empty_blender
    plan = _plan(sky="uniform", phase="hg:0.9", sun_zenith=50.0)
    camera = _camera(scene)
    depth = 0.0 if in_air else 0.2
    # Rays along the seam of two triangles may find neither.
    camera.location = (0.02, 0.03, 0.5 if in_air else -depth)
    camera.rotation_euler.x = math.pi
    camera.data.angle = 0.05
    bpy.ops.mesh.primitive_plane_add(size=0.3, location=(0.0, 0.0, 1.5), rotation=(math.pi, 0, 0))
    _paint_white(scene)
    seen = []
    colour = bpy.data.materials["white"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    many = replace(plan, settings=replace(plan.settings, samples=1500))
    extent = water_body.water_extent(scene, plan.column, depth)
    for grey in (0.0, 0.8):
        colour.default_value = (grey, grey, grey, 1.0)
        with engines.cycles_bands(scene, camera, many, extent, seed=1) as engine:
            seen.append(grey_scene.band_image(engine, many, depth).mean(axis=(0, 1)))
    # Its surface does not mirror the sun.
    light = light_in_air(plan.column, plan.solved_field(16))
    transmittance = 1.0
    if not in_air:
        c = plan.column.absorption + plan.column.scattering
        transmittance = N**2 * (1.0 - fresnel_reflectance(1.0, N)) * np.exp(-c * depth)
    wanted = transmittance * 0.8 / math.pi * (light.leaving + light.mirrored * light.sky)
    np.testing.assert_allclose(seen[1] - seen[0], wanted, rtol=0.03)


@pytest.mark.parametrize("kind", ["plain", "viewport", "renders", "instances", "many"])
def test_what_is_bent_has_no_more_faces_than_a_scene_can_bear(kind):
    """A subdivision of the user's comes before the one that is added: 4 million faces."""
    bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, -5.0))
    item, count = bpy.context.object, 1
    if kind in {"viewport", "renders"}:
        modifier = item.modifiers.new("Own", "SUBSURF")
        modifier.subdivision_type = "SIMPLE"
        modifier.render_levels = 4
        modifier.levels = 4 if kind == "viewport" else 1
    if kind == "instances":
        count = 40
        inner = bpy.data.collections.new("inner")
        inner.objects.link(item)
        bpy.context.scene.collection.objects.unlink(item)
        for k in range(count):
            empty = bpy.data.objects.new("empty", None)
            empty.instance_type, empty.instance_collection = "COLLECTION", inner
            empty.location.x = 0.1 * k
            bpy.context.scene.collection.objects.link(empty)
    if kind == "many":
        for k in range(40):
            bpy.ops.mesh.primitive_plane_add(size=80.0, location=(0.0, 0.0, -5.0 - k))
    bpy.context.view_layer.update()
    refraction_displacement.subdivide(bpy.context.scene, (0.0, 0.0, 1.0))
    meshes = [x for x in bpy.data.objects if x.type == "MESH"]
    faces = [len(x.data.polygons) * 4 ** sum(m.render_levels for m in x.modifiers) for x in meshes]
    assert max(faces) > 4000, "they are subdivided"
    assert max(faces) <= 300_000
    assert sum(faces) * count <= 1_000_000
