"""Particles in a scene: where they are, how they move, and that they leave."""

from __future__ import annotations

import math
from dataclasses import replace

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import contents, marks, stored_settings
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.materials import bare_surfaces
from underwater_spectral.scene.terms import particles
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import realtime, scene_water, water_body
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes, snapshot
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.water.particles import (
    KINDS,
    ParticleCloud,
    SizeClass,
    particle_cloud,
)

CLOUDS = ("snow", "plankton", "bubbles", "silt")
PLAIN = SceneSettings(bands=3, diffuse_shadows=False, scene_floor=False)


def _plan(**changes):
    return render_plan.make_plan(replace(PLAIN, **changes))


def _add(scene, plan, depth=5.0):
    water = eevee_water(plan, scene, Eye(scene.camera, depth), np.eye(3))
    extent = water_body.water_extent(scene, water.column, depth)
    realtime.add_realtime(scene, water, extent)
    return water


def _seen(scene, *, everything=False):
    """Places (n, 3) and mean diameters (n,) by kind."""
    for item in marks.objects(scene):
        if marks.PARTICLES in item:
            for node in item.modifiers[0].node_group.nodes:
                if "In View Only" in node.inputs:
                    node.inputs["In View Only"].default_value = not everything
    bpy.context.view_layer.update()
    found = {}
    for shown in bpy.context.evaluated_depsgraph_get().object_instances:
        if shown.is_instance and marks.PARTICLES in shown.parent.original:
            place, scale = shown.matrix_world.translation, shown.matrix_world.to_scale()
            row = (*place, math.prod(scale) ** (1 / 3))
            found.setdefault(shown.parent.original[marks.PARTICLES], []).append(row)
    return {kind: (np.array(rows)[:, :3], np.array(rows)[:, 3]) for kind, rows in found.items()}


@pytest.fixture
def camera():
    item = scenes.add_camera(rotation=(math.pi / 2, 0.0, 0.0))
    item.location = (1.0, 2.0, -5.0)
    bpy.context.view_layer.update()
    return item


@pytest.mark.slow
def test_without_density_nothing_is_added():
    scene = scenes.varied_scene()
    _add(scene, _plan(particle_seed=7, drift_speed=1.0, particle_slope=3.5))
    assert not [i for i in marks.objects(scene) if marks.PARTICLES in i]
    groups = {g.bl_idname for g in bpy.data.node_groups}
    assert "GeometryNodeTree" not in groups
    own = {m.name for m in bpy.data.materials if m.name.startswith("UW")}
    assert own <= {bare_surfaces.NAME}


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_every_kind_comes_with_two_materials_and_leaves_no_trace():
    scene = scenes.varied_scene()
    bpy.context.view_layer.update()
    before = snapshot.snapshot()
    dry = {m.name for m in contents.materials(scene)}
    _add(scene, _plan(**dict.fromkeys(CLOUDS, 5.0)))
    kinds = {i[marks.PARTICLES] for i in marks.objects(scene) if len(i.modifiers)}
    assert kinds == set(CLOUDS)
    found = {m.name for m in contents.materials(scene)} - dry
    assert found == {"UW Particles", "UW Bubbles", bare_surfaces.NAME}
    scene_water.remove(scene)
    assert snapshot.differences(before, snapshot.snapshot()) == []


def test_numbers_and_sizes_are_those_of_the_cloud(camera):
    scene = bpy.context.scene
    plan = _plan(snow=20.0, particle_angle=1.0)
    _add(scene, plan)
    (cloud,) = particles.particles_of(plan.settings, plan.column).clouds
    wanted = particle_cloud(KINDS["snow"], 20.0, angle=1e-3, reach=cloud.classes[-1].side / 2)
    assert cloud.count == wanted.count > 500
    places, sizes = _seen(scene, everything=True)["snow"]
    eye = np.array(camera.location)
    for part in cloud.classes:
        of_class = (sizes > part.smallest * 1.001) & (sizes < part.largest * 0.999)
        away = np.abs(places[of_class] - eye)
        assert (away <= part.side / 2 + 1e-3).all()
        if part.count > 200 and part.side < 9.0:  # those in larger boxes are cut at the surface
            port = 4.0 / 3.0 * math.pi * 0.1**3 / part.side**3
            assert of_class.sum() == pytest.approx(part.count * (1.0 - port), rel=0.1)
    assert (np.linalg.norm(places - eye, axis=1) > 0.1).all()
    assert (places[:, 2] < 0.0).all()
    small = cloud.classes[0]
    drawn = np.sort(sizes[sizes < small.largest])
    fall = 1.0 - plan.settings.particle_slope  # of the numbers above a diameter
    middle = small.smallest * (0.5 * (1 + 2.0**fall)) ** (1 / fall)
    assert np.median(drawn) == pytest.approx(middle, rel=0.03)


@pytest.mark.slow
def test_only_what_the_camera_sees_is_there(camera):
    scene = bpy.context.scene
    _add(scene, _plan(snow=50.0))
    every, _ = _seen(scene, everything=True)["snow"]
    seen, _ = _seen(scene)["snow"]
    assert 0 < len(seen) < 0.1 * len(every)
    ahead = seen - np.array(camera.location)
    assert (ahead[:, 1] > 0).all()
    half = math.tan(camera.data.angle / 2) * 1.3
    assert np.abs(ahead[:, 0] / ahead[:, 1]).max() < half + 1e-3
    # None is lost that is in the picture.
    there = every - np.array(camera.location)
    inside = (there[:, 1] > 0) & (np.abs(there[:, 0]) < 0.9 * half / 1.3 * there[:, 1])
    aspect = scene.render.resolution_y / scene.render.resolution_x
    inside &= np.abs(there[:, 2]) < 0.9 * half / 1.3 * aspect * there[:, 1]
    assert {tuple(p) for p in every[inside].round(4)} <= {tuple(p) for p in seen.round(4)}


def test_they_drift_by_the_clock_and_stay_when_the_camera_moves(camera):
    scene = bpy.context.scene
    _add(scene, _plan(silt=40.0, particle_angle=1.0, drift_speed=0.1, drift_direction=90.0))
    scene.frame_set(1)
    first, sizes = _seen(scene, everything=True)["silt"]
    again, _ = _seen(scene, everything=True)["silt"]
    assert np.array_equal(first, again)
    scene.frame_set(1 + scene.render.fps)
    later, later_sizes = _seen(scene, everything=True)["silt"]
    rows = {round(float(s) * 1e9): p for p, s in zip(first, sizes, strict=True)}
    moves = np.array(
        [
            [*(p - rows[key]), s]
            for p, s in zip(later, later_sizes, strict=True)
            if s > 4e-4 and (key := round(float(s) * 1e9)) in rows
        ]
    )
    moves = moves[(np.abs(moves[:, :3]) < 0.35).all(axis=1)]  # the others came in on the far side
    assert len(moves) > 100
    assert np.median(moves[:, :2], axis=0) == pytest.approx([0.0, 0.1], abs=4e-3)
    sinking = moves[:, 2] - KINDS["silt"].rise(moves[:, 3])
    assert np.median(sinking) == pytest.approx(0.0, abs=4e-3)
    scene.frame_set(1)
    camera.location.x += 0.05
    moved, _ = _seen(scene, everything=True)["silt"]
    common = {tuple(p) for p in first.round(5)} & {tuple(p) for p in moved.round(5)}
    assert 0.6 * len(first) < len(common) < len(first)


def test_seeds_differ(camera):
    scene = bpy.context.scene
    _add(scene, _plan(plankton=10.0, particle_angle=1.0))
    one, _ = _seen(scene, everything=True)["plankton"]
    plan = _plan(plankton=10.0, particle_angle=1.0, particle_seed=1)
    water = eevee_water(plan, scene, Eye(scene.camera, 5.0), np.eye(3))
    assert realtime.fits(scene, water)
    realtime.set_values(scene, water)
    other, _ = _seen(scene, everything=True)["plankton"]
    assert not {tuple(p) for p in one.round(4)} & {tuple(p) for p in other.round(4)}


@pytest.mark.slow
def test_live_density_follows_its_keys(camera):
    scene = bpy.context.scene
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    water = scene.underwater
    water.bands, water.diffuse_shadows = 3, False
    for frame, number in ((1, 0.0), (11, 40.0)):
        water.snow = number
        water.keyframe_insert("snow", frame=frame)
    scene.frame_set(1)
    live.add(scene)
    assert _seen(scene) == {}
    scene.frame_set(11)
    assert live.update(scene, may_rebuild=False) is False
    assert live.update(scene)
    many = len(_seen(scene)["snow"][0])
    assert many > 100
    scene.frame_set(6)
    assert live.update(scene, may_rebuild=False)
    assert len(_seen(scene)["snow"][0]) == pytest.approx(many / 2, rel=0.25)
    scene.frame_set(1)
    assert live.update(scene, may_rebuild=False)
    assert _seen(scene) == {}
    live.remove(scene)
    assert not [b for b in bpy.data.node_groups if b.name.startswith("UW")]


def test_the_record_says_what_was_drawn():
    plan = _plan(snow_of_water=2.0, bubbles=1.0, water="jerlov:3C")
    found = particles.record(plan.settings, plan.column)["particles"]
    assert found["share_of_scattering_above_0.1_mm"] == pytest.approx(0.0594, rel=0.01)
    snow = found["kinds"]["snow"]
    assert snow["above_0.1_mm_per_litre"] == pytest.approx(2.0 * found["snow_of_water_per_litre"])
    assert set(found["kinds"]) == {"snow", "bubbles"}
    assert particles.record(_plan().settings, plan.column) == {}
    assert particles.particles_of(PLAIN, plan.column).clouds == ()


@pytest.mark.slow
def test_they_are_as_bright_in_eevee_as_in_cycles_and_named_in_layers(
    camera, tmp_path, monkeypatch
):
    """Balls of the size of hands stand for flocs, so that few pixels are enough."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    camera.location = (0.0, 0.0, -5.0)
    # Without shade, objects keep away nothing of the light that is scattered forward past them.
    plan = _plan(phase="hg:0.0", samples=16, sun_azimuth=90.0, layers="instance,material")
    kind = replace(KINDS["snow"], wander=0.0)
    part = SizeClass(0.2, 0.4, 6.0, 150, (0.0, 0.0))
    clouds = particles.ParticleTerm((ParticleCloud(kind, 1.0, 4.0, 1.0, (part,)),))
    monkeypatch.setattr(particles, "particles_of", lambda *_: clouds)
    extent = water_body.water_extent(scene, plan.column, 5.0)
    pictures, masks = [], []
    for opened in (
        engines.eevee_bands(scene, camera, plan, extent, 5.0),
        engines.cycles_bands(scene, camera, plan, extent, seed=0),
    ):
        with opened as engine:
            layers = engine.frame(plan, 5.0)(engine.passes[0], tmp_path / "a.exr")
            pictures.append(read_exr(tmp_path / "a.exr")[0].astype(np.float64))
        assert layers is not None
        for layer, name in (("instance", "UW Snow"), ("material", "UW Particles")):
            names = layers.header[f"{layer}s"]
            number = next(int(n) for n, text in names.items() if text == name)
            masks.append(layers[layer] == number)
        assert not [b for b in bpy.data.objects if b.name.startswith("UW")]
    assert all((mask == masks[0]).mean() > 0.99 for mask in masks)
    seen = masks[0]
    assert 0.05 < seen.mean() < 0.6
    eevee, cycles = (picture[seen].mean(axis=0) for picture in pictures)
    assert eevee == pytest.approx(cycles, rel=0.06)
