"""Objects mirrored in the surface from below: where they are and how bright, and when they cost."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene.engines import engines, planar_picture
from underwater_spectral.scene.engines.planar_picture import PlanarPictures
from underwater_spectral.scene.readers.mirrored_eye import mirrored_eye
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.occlusion import Cache
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.spectra.reflectance import emission_basis
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance

from . import scenes, snapshot

DEPTH, SIZE, FIELD = 1.5, 48, math.radians(50.0)
BALL, RADIUS, GLOW = np.array([0.3, 3.0, -0.6]), 0.25, 40.0
IN_WINDOW = np.array([0.3, 1.2, -0.8])
FLIPPED = np.array([1.0, 1.0, -1.0])
MIRRORED = BALL * FLIPPED
N = 1.34


def _camera(scene: bpy.types.Scene, towards: np.ndarray) -> bpy.types.Object:
    """A camera that looks a little beside a place, rolled."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -DEPTH)
    way = towards - np.array(camera.location)
    azimuth, rise = math.atan2(way[0], way[1]), math.asin(way[2] / np.linalg.norm(way))
    camera.rotation_euler = (math.pi / 2 + rise - 0.1, 0.15, -azimuth + 0.06)
    camera.data.angle = FIELD
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return camera


def _ball(place: np.ndarray = BALL) -> bpy.types.Object:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=RADIUS, location=place, segments=48, ring_count=24)
    bpy.context.object.data.materials.append(scenes.glow(GLOW))
    return bpy.context.object


def _plan(**options: object) -> render_plan.RenderPlan:
    chosen = {"surface": "flat", "sky": "clear", "illuminant": "clear-sky", "bands": 3}
    chosen |= {"diffuse_shadows": False, "samples": 8}
    return render_plan.make_plan(
        SceneSettings(**{"water": "jerlov:IB", "planar_reflections": True} | chosen | options)
    )


def _bands(scene, camera, plan) -> np.ndarray:
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as engine:
        return grey_scene.band_image(engine, plan, DEPTH)


def _directions(camera: bpy.types.Object) -> np.ndarray:
    along = (np.arange(SIZE) + 0.5 - SIZE / 2) * 2.0 * math.tan(FIELD / 2) / SIZE
    right, up = np.meshgrid(along, -along)
    turn = np.array(camera.matrix_world.to_3x3())
    v = np.stack([right, up, -np.ones_like(up)], axis=-1) @ turn.T
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _distance(v: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Length of the way by the surface to the ball, m, nan where it is not met."""
    along = v @ way
    off2 = way @ way - along**2
    return along - np.sqrt(np.where(off2 < RADIUS**2, RADIUS**2 - off2, np.nan))


def _seen(scene: bpy.types.Scene, camera: bpy.types.Object, glow: float, mode: str) -> np.ndarray:
    node = bpy.data.materials["glow"].node_tree.nodes["Emission"]
    node.inputs["Strength"].default_value = glow
    plan = _plan()
    if mode == "bands":
        return _bands(scene, camera, plan)
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    with (
        tempfile.TemporaryDirectory() as folder,
        engines.eevee_realtime(scene, camera, plan, extent, DEPTH) as engine,
    ):
        path = Path(folder, "picture.exr")
        engine.frame(plan, DEPTH)(engine.passes[0], path)
        return read_exr(path)[0].astype(np.float64)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "ball"),
    [
        ("bands", BALL),
        pytest.param("realtime", BALL, marks=pytest.mark.slow),
        pytest.param("bands", IN_WINDOW, marks=pytest.mark.slow),
    ],
)
def test_a_ball_is_mirrored_where_and_as_bright_as_it_should(empty_blender, mode, ball):
    """R e^{-c P} L, for the way P by the surface, at the mirror image of the ball."""
    scene, plan = empty_blender, _plan()
    camera = _camera(scene, ball * FLIPPED)
    scene.render.filter_size = 0.01
    _ball(ball)
    before = snapshot.snapshot()
    shining, dark = (_seen(scene, camera, glow, mode) for glow in (GLOW, 0.0))
    bpy.data.materials["glow"].node_tree.nodes["Emission"].inputs["Strength"].default_value = GLOW
    assert snapshot.differences(before, snapshot.snapshot()) == []
    v, column = _directions(camera), plan.column
    way = ball * FLIPPED + np.array([0.0, 0.0, DEPTH])
    P = _distance(v, way)
    R = fresnel_reflectance(v[..., 2], 1.0 / N)[..., None]
    c = column.absorption + column.scattering
    wanted = R * np.exp(-c * P[..., None]) * (emission_basis(plan.bands) @ ([GLOW] * 3))
    if mode == "realtime":
        wanted = plan.reduction(DEPTH).apply(wanted)
    gained = shining - dark
    towards = way / np.linalg.norm(way)
    whole = v @ towards > math.cos(0.8 * RADIUS / np.linalg.norm(way))
    assert whole.sum() > 20
    np.testing.assert_allclose(gained[whole], wanted[whole], rtol=0.02)
    # Within a tenth of a pixel, which is 1.1° wide.
    near = v @ towards > math.cos(2.5 * RADIUS / np.linalg.norm(way))
    found, due = (
        (image[near][:, 1:2] * v[near]).sum(axis=0) / image[near][:, 1].sum()
        for image in (gained, np.nan_to_num(wanted))
    )
    off = math.degrees(np.linalg.norm(found - due))
    assert off < 0.11, off


@pytest.mark.parametrize(
    ("place", "options", "wanted"),
    [
        (BALL, {}, True),
        (BALL, {"planar_reflections": False}, False),
        (BALL, {"surface": "none"}, False),
        (BALL, {"water": "jerlov:9C"}, False),
        ([0.3, 3.0, -60.0], {}, False),
        ([0.3, -9.0, -0.8], {}, False),
    ],
)
def test_only_where_objects_are_mirrored_there_is_anything_to_draw(
    empty_blender, place, options, wanted
):
    scene = empty_blender
    camera = _camera(scene, MIRRORED)
    _ball(np.array(place))
    bpy.context.view_layer.update()
    mirrored = PlanarPictures(scene, camera, Cache())
    assert planar_picture.may_show(camera, _plan(**options), (), mirrored) == wanted


def test_what_is_not_mirrored_is_said(empty_blender):
    camera = _camera(empty_blender, MIRRORED)

    def said(plan):
        pictures = PlanarPictures(empty_blender, camera, Cache())
        return planar_picture.notes(camera, plan, (), pictures)

    assert said(_plan(layers="J")) == []
    _ball(np.array(BALL))
    bpy.context.view_layer.update()
    assert said(_plan()) == []
    (note,) = said(_plan(layers="J"))
    assert "layers" in note
    assert said(_plan(surface="none")) == []
    assert said(_plan(layers="J", planar_reflections=False)) == []
    camera.location.z = 1.0
    bpy.context.view_layer.update()
    assert said(_plan(layers="J")) == []


def test_the_mirrored_eye_shows_points_where_their_mirror_images_are(empty_blender):
    camera = _camera(empty_blender, MIRRORED)
    eye = mirrored_eye(empty_blender, camera, 30.0, waves=False)
    v = _directions(camera)
    up = v[..., 2] > 0.2
    h, row, inside = eye.view.place(tuple((v[up] * [1.0, 1.0, -1.0]).T))
    assert inside.all()
    # Every pixel of the flat surface is one of the picture.
    rows, columns = np.nonzero(up)
    np.testing.assert_allclose(h - h[0], columns - columns[0], atol=1e-4)
    np.testing.assert_allclose(row - row[0], rows - rows[0], atol=1e-4)
