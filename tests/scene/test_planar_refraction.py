"""Objects in the air seen through the surface from below: where they are, and how bright."""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene, surface_views
from underwater_spectral.scene.engines import engines, planar_picture
from underwater_spectral.scene.engines.planar_picture import PlanarPictures
from underwater_spectral.scene.readers import mirrored_eye
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.spectra.reflectance import emission_basis, uplift_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.surface.refraction import (
    apparent_height,
    direction_in_air,
    fresnel_reflectance,
)
from underwater_spectral.uw_spectral.transfer.above_water import light_in_air

from . import scenes, snapshot

DEPTH, SIZE, FIELD, N = 1.5, 48, math.radians(40.0), 1.34
BALL, RADIUS, GLOW = np.array([0.5, 2.4, 1.3]), 0.4, 40.0
LEVEL = (0.0, 0.0, 1.0)


def _camera(scene: bpy.types.Scene, towards: np.ndarray, depth: float = DEPTH) -> bpy.types.Object:
    """A camera that looks a little beside a place, rolled."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -depth)
    way = towards - np.array(camera.location)
    azimuth, rise = math.atan2(way[0], way[1]), math.asin(way[2] / np.linalg.norm(way))
    camera.rotation_euler = (math.pi / 2 + rise + 0.03, 0.1, -azimuth + 0.05)
    camera.data.angle = FIELD
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.filter_size = 0.01
    bpy.context.view_layer.update()
    return camera


def _seeming(place: np.ndarray, depth: float = DEPTH) -> np.ndarray:
    """Where a place in the air seems to be."""
    rise = apparent_height(math.hypot(*place[:2]), place[2], depth, N)
    return np.array([place[0], place[1], rise])


def _ball(material: bpy.types.Material) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, location=BALL, segments=48, ring_count=24)
    bpy.context.object.data.shade_smooth()
    bpy.context.object.data.materials.append(material)


def _matt(name: str, grey: float) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (grey, grey, grey, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return material


def _plan(**options: object) -> render_plan.RenderPlan:
    chosen = {"surface": "flat", "sky": "clear", "illuminant": "clear-sky", "bands": 3}
    chosen |= {"diffuse_shadows": False, "samples": 8}
    return render_plan.make_plan(SceneSettings(**{"water": "jerlov:IB"} | chosen | options))


def _bands(scene, camera, plan) -> np.ndarray:
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as engine:
        return grey_scene.band_image(engine, plan, DEPTH)


def _realtime(scene, camera, plan) -> np.ndarray:
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, DEPTH) as engine,
    ):
        path = Path(folder, "picture.exr")
        engine.frame(plan, DEPTH)(engine.passes[0], path)
        return read_exr(path)[0].astype(np.float64)


class _Rays:
    """The rays of a camera's pixels, out into the air, to the ball."""

    def __init__(self, camera: bpy.types.Object, finer: int = 1) -> None:
        size = SIZE * finer
        along = (np.arange(size) + 0.5 - size / 2) * 2.0 * math.tan(FIELD / 2) / size
        right, up = np.meshgrid(along, -along)
        turn = np.array(camera.matrix_world.to_3x3())
        v = np.stack([right, up, -np.ones_like(up)], axis=-1) @ turn.T
        self.w = v / np.linalg.norm(v, axis=-1, keepdims=True)
        self.P = DEPTH / self.w[..., 2:]
        self.out = self.w * self.P - [0.0, 0.0, DEPTH]
        parts = tuple(self.w[..., i] for i in range(3))
        self.air = np.stack(direction_in_air(parts, LEVEL, N), axis=-1)

    def hit(self, radius: float = RADIUS) -> tuple[np.ndarray, np.ndarray]:
        """Whether the ball is met, and its normal there."""
        off = BALL - self.out
        along = (off * self.air).sum(axis=-1)
        gap = radius**2 - ((off * off).sum(axis=-1) - along**2)
        met = self.out + self.air * (along - np.sqrt(np.maximum(gap, 0.0)))[..., None]
        return gap > 0, (met - BALL) / radius

    def transmittance(self, plan: render_plan.RenderPlan) -> np.ndarray:
        """What arrives of radiance in the air: (1 - R) n² e^{-c P}."""
        c = plan.column.absorption + plan.column.scattering
        R = fresnel_reflectance(self.w[..., 2:], 1.0 / N)
        return (1.0 - R) * N**2 * np.exp(-c * self.P)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["bands", pytest.param("realtime", marks=pytest.mark.slow)])
def test_a_glowing_ball_is_seen_where_and_as_bright_as_it_should(empty_blender, mode):
    scene, plan = empty_blender, _plan()
    camera = _camera(scene, _seeming(BALL))
    _ball(scenes.glow(GLOW))
    strength = bpy.data.materials["glow"].node_tree.nodes["Emission"].inputs["Strength"]
    draw = _bands if mode == "bands" else _realtime
    before, seen = snapshot.snapshot(), []
    for glow in (0.0, GLOW):
        strength.default_value = glow
        seen.append(draw(scene, camera, plan))
    assert snapshot.differences(before, snapshot.snapshot()) == []
    gained = seen[1] - seen[0]
    rays = _Rays(camera)
    wanted = rays.transmittance(plan) * (emission_basis(plan.bands) @ ([GLOW] * 3))
    if mode == "realtime":
        wanted = plan.reduction(DEPTH).apply(wanted)
    whole = rays.hit(0.8 * RADIUS)[0]
    assert whole.sum() > 60
    np.testing.assert_allclose(gained[whole], wanted[whole], rtol=0.02)
    # Its edges are where they should be: middle and size, in pixels of 0.8°.
    cover = grey_scene.blocks(_Rays(camera, 8).hit()[0][..., None] * 1.0, 8)[..., 0]
    found = np.clip(gained[..., 1] / np.maximum(wanted[..., 1], 1e-3), 0.0, 1.0)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    for at in (rows, columns):
        off = (found * at).sum() / found.sum() - (cover * at).sum() / cover.sum()
        assert abs(off) < 0.15, off
    assert abs(found.sum() / cover.sum() - 1.0) < 0.03


@pytest.mark.slow
def test_a_matt_ball_has_the_sun_and_sky_of_the_air_on_its_own_normals(empty_blender):
    scene = empty_blender
    plan = _plan(sky="uniform", sun_zenith=50.0, sun_azimuth=60.0, floor_reflectance="0")
    camera = _camera(scene, _seeming(BALL))
    _ball(_matt("white", 0.8))
    colour = bpy.data.materials["white"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    seen = []
    for grey in (0.0, 0.8):
        colour.default_value = (grey, grey, grey, 1.0)
        seen.append(_bands(scene, camera, plan))
    rays, light = _Rays(camera), light_in_air(plan.column, plan.solved_field(16))
    _, normal = rays.hit()
    sun, up = np.array(plan.column.skylight.sun), normal[..., 2:]
    cosine, other = -(normal @ sun), -(normal @ (sun * [1.0, 1.0, -1.0]))
    E = np.maximum(cosine, 0.0)[..., None] * light.sun + (0.5 + 0.5 * up) * light.sky
    R = fresnel_reflectance(-sun[2], N)
    E = E + (0.5 - 0.5 * up) * (light.mirrored * light.sky + light.leaving)
    E = E + np.maximum(other, 0.0)[..., None] * R * light.sun
    reflectance = uplift_basis(plan.bands) @ ([0.8] * 3)
    wanted = rays.transmittance(plan) * reflectance / math.pi * E
    ratio = (seen[1] - seen[0]) / np.where(wanted > 0.0, wanted, 1.0)
    lit = rays.hit(0.9 * RADIUS)[0] & (cosine > 0.1)
    assert lit.sum() > 40
    np.testing.assert_allclose(ratio[lit], 1.0, atol=0.03)
    occluded = rays.hit(0.9 * RADIUS)[0] & (cosine < -0.05)
    assert occluded.sum() > 20
    np.testing.assert_allclose(ratio[occluded], 1.0, atol=0.03)


@pytest.mark.slow
def test_a_post_that_pierces_the_surface_is_whole(empty_blender):
    scene, plan = empty_blender, _plan()
    foot = np.array([0.1, 0.8, 0.0])
    camera = _camera(scene, foot)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.08, depth=3.0, location=foot, vertices=24)
    bpy.context.object.data.materials.append(scenes.glow(GLOW))
    image = _bands(scene, camera, plan)[..., 1]
    along = foot + np.linspace(-0.4, 0.5, 60)[:, None] * LEVEL
    seem = np.array([_seeming(p) if p[2] > 0 else p for p in along])
    turn = np.array(camera.matrix_world.to_3x3())
    x, y, z = ((seem + np.array([0.0, 0.0, DEPTH])) @ turn).T
    focal = SIZE / 2 / math.tan(FIELD / 2)
    columns, rows = SIZE / 2 - focal * x / z, SIZE / 2 + focal * y / z
    inside = (np.abs(columns - SIZE / 2) < SIZE / 2) & (np.abs(rows - SIZE / 2) < SIZE / 2)
    assert inside.sum() > 40
    on_post = image[rows[inside].astype(int), columns[inside].astype(int)]
    beside = image[:, :4].max()
    assert on_post.min() > 10.0 * beside
    # Fresnel and n² at the surface, no more.
    assert on_post.max() < 2.2 * on_post.min()


@pytest.mark.parametrize(
    ("place", "options", "wanted"),
    [
        (BALL, {}, True),
        (BALL, {"surface": "none"}, False),
        (BALL, {"layers": "J"}, False),
        (BALL * [1.0, 1.0, -1.0], {}, False),
        (BALL * [1.0, -1.0, 1.0], {}, False),
    ],
)
def test_only_where_objects_are_seen_in_the_air_there_is_anything_to_draw(
    empty_blender, place, options, wanted
):
    scene, plan = empty_blender, _plan(**options)
    camera = _camera(scene, _seeming(BALL))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, location=place)
    bpy.context.view_layer.update()
    shown = PlanarPictures(scene, camera, Cache())
    assert planar_picture.may_show_air(scene, camera, plan, (), shown) == wanted


def test_what_is_not_refracted_is_said(empty_blender):
    scene = empty_blender
    camera = _camera(scene, BALL)
    said = planar_picture.notes_of_air
    assert said(scene, camera, _plan(layers="J"), ()) == []
    _ball(_matt("white", 0.8))
    bpy.context.view_layer.update()
    assert said(scene, camera, _plan(), ()) == []
    (note,) = said(scene, camera, _plan(layers="J"), ())
    assert "layers" in note
    camera.location.z = 3.0
    bpy.context.view_layer.update()
    assert said(scene, camera, _plan(), ()) == []


def test_cycles_lights_what_is_seen_through_the_surface_by_the_sun_of_the_air(empty_blender):
    """A wall that faces the sun, seen from clear water."""
    scene = empty_blender
    plan = _plan(sky="uniform", sun_zenith=50.0, sun_azimuth=90.0, floor_reflectance="0")
    # So little water that what it scatters does not matter.
    place, depth = np.array([0.0, 1.2, 1.0]), 0.2
    camera = _camera(scene, _seeming(place, depth), depth)
    scene.render.resolution_x = scene.render.resolution_y = 8
    camera.data.angle = 0.05
    camera.rotation_euler[1] = 0.0
    bpy.ops.mesh.primitive_plane_add(size=1.0, location=place, rotation=(math.pi / 2, 0.0, 0.0))
    bpy.context.object.data.materials.append(_matt("white", 0.8))
    colour = bpy.data.materials["white"].node_tree.nodes["Diffuse BSDF"].inputs["Color"]
    many = replace(plan, settings=replace(plan.settings, samples=128))
    extent = water_body.water_extent(scene, plan.column, depth)
    before = snapshot.snapshot()
    seen = []
    for grey in (0.0, 0.8):
        colour.default_value = (grey, grey, grey, 1.0)
        with engines.cycles_bands(scene, camera, many, extent, seed=1) as engine:
            seen.append(grey_scene.band_image(engine, many, depth).mean(axis=(0, 1)))
    assert snapshot.differences(before, snapshot.snapshot()) == []
    light = light_in_air(plan.column, plan.solved_field(16))
    turn = np.array(camera.matrix_world.to_3x3())
    w = -turn[:, 2]
    P = depth / w[2]
    c = plan.column.absorption + plan.column.scattering
    transmittance = (1.0 - fresnel_reflectance(w[2], 1.0 / N)) * N**2 * np.exp(-c * P)
    # Its surface does not mirror the sun.
    E = light.sun * math.sin(math.radians(50.0))
    E = E + (light.sky * (1.0 + light.mirrored) + light.leaving) / 2
    wanted = transmittance * (uplift_basis(plan.bands) @ ([0.8] * 3)) / math.pi * E
    np.testing.assert_allclose(seen[1] - seen[0], wanted, rtol=0.03)


def test_what_moves_near_the_surface_may_come_out_in_a_job(empty_blender):
    scene = empty_blender
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(0.0, 2.0, -1.0))
    ball = bpy.context.object
    bpy.context.view_layer.update()
    assert not mirrored_eye.may_rise(scene, 10)
    ball.keyframe_insert("location", frame=1)
    assert mirrored_eye.may_rise(scene, 10)
    assert not mirrored_eye.may_rise(scene, 1)
    ball.animation_data_clear()
    ball.modifiers.new("armature", "ARMATURE")
    assert mirrored_eye.may_rise(scene, 10)
    ball.modifiers.clear()
    ball.location.z = 0.0
    bpy.context.view_layer.update()
    assert mirrored_eye.may_rise(scene, 1)


def test_a_material_with_a_displacement_of_its_own_is_said(empty_blender):
    scene, plan = empty_blender, _plan()
    camera = _camera(scene, _seeming(BALL))
    material = _matt("rough", 0.5)
    tree = material.node_tree
    displaced = tree.nodes.new("ShaderNodeDisplacement")
    output = tree.get_output_node("EEVEE")
    tree.links.new(displaced.outputs[0], output.inputs["Displacement"])
    _ball(material)
    before = snapshot.snapshot()
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as engine:
        assert any("'rough' is displaced; above the water" in note for note in engine.notes)
    assert snapshot.differences(before, snapshot.snapshot()) == []


@pytest.mark.slow
def test_waves_let_a_hull_ripple_as_in_cycles():
    """The picture of a flat surface is off by 2.6 in the mean, by 10.6 in 95 %."""
    (place,) = (x for x in surface_views.WINDOW if x.name == "hull, 1.5 m, wind 5 m/s")
    place = replace(place, samples=64)
    _, off, noise = surface_views.window_errors(place, lambda _, make: make())
    assert off.mean() - noise.mean() < 0.9
    assert np.quantile(off, 0.95) < 3.5
