"""Metals mirror the light of the water."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.node_groups import realtime_surface
from underwater_spectral.scene import contents
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.materials import material_kinds
from underwater_spectral.scene.terms.eevee_water import eevee_water
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.term import Eye
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.transfer.highlights import halfway, round_highlight

DEPTH, NEAR = 6.0, 0.2


def _metal(colour=1.0, roughness=0.0):
    material = scenes.principled("metal", (colour, colour, colour, 1.0))
    shader = material.node_tree.nodes["Principled BSDF"].inputs
    shader["Metallic"].default_value, shader["Roughness"].default_value = 1.0, roughness
    return material


def _on_plate(scene, plan, turn, tilt, roughness=0.0):
    """What a white mirror close to the camera throws on, and its normal."""
    scene.camera = camera = scenes.add_camera((0.0, 0.0, -DEPTH), (math.pi / 2, 0.0, 0.0))
    camera.data.angle = math.radians(4.0)
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    bpy.ops.mesh.primitive_plane_add(size=0.2, location=(0.0, NEAR, -DEPTH))
    plate = bpy.context.object
    plate.rotation_euler = (math.pi / 2 - math.radians(tilt), 0.0, math.radians(turn) / 2)
    plate.data.materials.append(_metal(roughness=roughness))
    bpy.context.view_layer.update()
    shader = plate.active_material.node_tree.nodes["Principled BSDF"].inputs
    extent = water_body.water_extent(scene, plan.column, DEPTH)
    found = []
    for colour in (1.0, 0.0):
        shader["Base Color"].default_value = (colour, colour, colour, 1.0)
        with engines.eevee_bands(scene, camera, plan, extent, DEPTH) as engine:
            found.append(grey_scene.band_image(engine, plan, DEPTH).mean(axis=(0, 1)))
    n = np.array(plate.matrix_world.to_3x3().col[2])
    assert n[1] < 0
    return found[0] - found[1], n


def _plan(samples):
    """The sun is behind the plates, so that no highlight is in them."""
    return render_plan.make_plan(
        SceneSettings(
            water="jerlov:II",
            bands=3,
            samples=samples,
            surface="flat",
            sky="uniform",
            phase="hg:0.9",
            sun_azimuth=270.0,
            sun_zenith=60.0,
            diffuse_shadows=False,
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turn", "tilt"),
    [
        (50.0, 20.0),
        pytest.param(0.0, 45.0, marks=pytest.mark.slow),
        pytest.param(-70.0, -40.0, marks=pytest.mark.slow),
    ],
)
def test_a_mirror_shows_the_water_that_it_faces(empty_blender, turn, tilt):
    """A plate close to the camera, against the solver along the mirrored ray."""
    plan = _plan(4)
    seen, n = _on_plate(empty_blender, plan, turn, tilt)
    direction = tuple(np.array([x]) for x in np.array([0.0, 1.0, 0.0]) - 2.0 * n[1] * n)
    L = plan.solved_field(16).radiance(DEPTH, direction).ravel()
    # So near, no light is scattered out of the view.
    wanted = L * np.exp(-NEAR * plan.column.absorption)
    low = L * np.exp(-NEAR * plan.column.attenuation)
    assert (seen < 1.02 * wanted).all()
    assert (seen > 0.98 * low).all()


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.5, 0.8])
def test_a_rough_mirror_shows_the_mean_of_the_water_that_its_facets_face(empty_blender, roughness):
    """The same plate, against the solver in all directions and GGX's facets."""
    plan = _plan(32)
    seen, n = _on_plate(empty_blender, plan, 0.0, 15.0, roughness)
    turned = (np.arange(48) + 0.5) * math.pi / 24
    z, angle = np.meshgrid(np.sqrt((np.arange(24) + 0.5) / 24), turned)
    side = np.cross(n, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    r = np.sqrt(1.0 - z * z)[..., None]
    w = z[..., None] * n + r * np.cos(angle)[..., None] * side
    w = (w + r * np.sin(angle)[..., None] * np.cross(n, side)).reshape(-1, 3).T
    eye = (0.0, -1.0, 0.0)
    fraction = round_highlight(n, eye, halfway(eye, w), w, roughness**4)
    L = plan.solved_field(16).radiance(DEPTH, tuple(w))
    # What white facets throw from one to another comes as the rest does.
    wanted = fraction @ L / fraction.sum() * np.exp(-NEAR * plan.column.absorption)
    low = wanted * np.exp(-NEAR * plan.column.scattering)
    assert (seen < 1.03 * wanted).all()
    assert (seen > 0.97 * low).all()


def test_only_scenes_with_mirrors_pay_for_them(empty_blender):
    scene = empty_blender
    scenes.add_camera((0.0, 0.0, -DEPTH))
    item = scenes._cube("thing", (0.0, 4.0, -DEPTH))
    item.data.materials.append(scenes.principled("paint"))
    plan = render_plan.make_plan(SceneSettings(bands=3, diffuse_shadows=False))
    assert not eevee_water(plan, scene, Eye(scene.camera, DEPTH), np.eye(3)).shape.mirrors
    shader = item.active_material.node_tree.nodes["Principled BSDF"].inputs["Metallic"]
    shader.keyframe_insert("default_value", frame=1)
    assert eevee_water(plan, scene, Eye(scene.camera, DEPTH), np.eye(3)).shape.mirrors
    item.active_material.node_tree.animation_data_clear()
    assert not material_kinds.kinds(contents.materials(scene)).mirrors
    shader.default_value = 0.5
    assert eevee_water(plan, scene, Eye(scene.camera, DEPTH), np.eye(3)).shape.mirrors


def test_live_water_follows_what_becomes_a_mirror(registered):
    scene = registered
    scenes.add_camera((0.0, 0.0, -DEPTH))
    item = scenes._cube("thing", (0.0, 4.0, -DEPTH))
    item.data.materials.append(scenes.principled("paint"))
    scene.underwater.diffuse_shadows = False
    bpy.context.view_layer.update()
    live.add(scene)
    bpy.context.view_layer.update()

    def mirrors():
        nodes = item.active_material.node_tree.nodes
        return any(realtime_surface.MIRRORED in node.inputs for node in nodes)

    shader = item.active_material.node_tree.nodes["Principled BSDF"].inputs["Metallic"]
    assert not mirrors()
    for value in (1.0, 0.0):
        shader.default_value = value
        item.active_material.node_tree.update_tag()
        bpy.context.view_layer.update()
        assert mirrors() == bool(value)
    live.remove(scene)
