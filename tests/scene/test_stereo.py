"""The eyes of a stereo camera, against Blender's own multi-view."""

from __future__ import annotations

import json
import math

import bpy
import numpy as np
import pytest
from mathutils import Euler
from underwater_spectral.jobs import batch
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.readers import stereo
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr


@pytest.fixture
def rig(empty_blender):
    """A bright box before a stereo camera that hangs on a scaled, turned parent."""
    scene = bpy.context.scene
    item = scenes._cube("box", (0.2, 6.0, -5.0))
    material = bpy.data.materials.new("light")
    material.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 1.0
    item.data.materials.append(material)
    camera = scenes.add_camera()
    camera.data.stereo.interocular_distance = 0.4
    camera.data.stereo.convergence_distance = 5.0
    camera.data.lens, camera.data.shift_x = 40.0, 0.05
    camera.scale = (2.0, 2.0, 2.0)
    camera.rotation_euler = Euler((math.radians(85), math.radians(10), math.radians(3)))
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.render.resolution_x, scene.render.resolution_y = 48, 27
    scene.render.resolution_percentage = 100
    scene.render.use_multiview, scene.render.views_format = True, "STEREO_3D"
    bpy.context.view_layer.update()
    return scene


def _rendered(scene, path):
    settings = scene.render.image_settings
    settings.media_type, settings.file_format = "IMAGE", "OPEN_EXR"
    settings.views_format = "INDIVIDUAL"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def _middle(path):
    """Middle of the light in a picture, x and y in pixels."""
    light = read_exr(path)[0][..., 0]
    assert light.std() > 0.1
    y, x = np.indices(light.shape)
    return np.array([(x * light).sum(), (y * light).sum()]) / light.sum()


@pytest.mark.slow_but_first
@pytest.mark.parametrize("pivot", ["CENTER", "LEFT", "RIGHT"])
@pytest.mark.parametrize("mode", ["OFFAXIS", "PARALLEL", "TOE"])
def test_eyes_see_what_blenders_multiview_shows(rig, tmp_path, mode, pivot):
    data = rig.camera.data.stereo
    data.convergence_mode, data.pivot = mode, pivot
    _rendered(rig, tmp_path / "both.exr")
    camera = rig.camera
    with stereo.two_eyes(rig):
        for side, eye in zip("LR", stereo.eyes_of(rig, camera), strict=True):
            rig.camera = eye
            _rendered(rig, tmp_path / f"{side}.exr")
            wanted, found = (_middle(tmp_path / f"{name}.exr") for name in (f"both_{side}", side))
            # A tenth of the distance between the eyes moves the box by 0.2 pixels or more.
            assert np.abs(wanted - found).max() < 0.1
        rig.camera = camera
    assert [item.name for item in rig.objects if item.type == "CAMERA"] == [camera.name]
    assert rig.render.use_multiview


def test_eyes_follow_an_animated_lens_and_shift(rig, tmp_path):
    """Another object has the name that an eye would get."""
    camera = rig.camera
    scenes._cube(f"{camera.name} left", (50.0, 0.0, 0.0))
    for frame, lens, shift in ((1, 40.0, 0.05), (11, 25.0, -0.15)):
        camera.data.lens, camera.data.shift_x = lens, shift
        camera.data.keyframe_insert("lens", frame=frame)
        camera.data.keyframe_insert("shift_x", frame=frame)
    for frame in (1, 11):
        rig.frame_set(frame)
        _rendered(rig, tmp_path / "both.exr")
        with stereo.two_eyes(rig):
            rig.frame_set(frame)
            for side, eye in zip("LR", stereo.eyes_of(rig, camera), strict=True):
                rig.camera = eye
                _rendered(rig, tmp_path / f"{side}.exr")
                wanted, found = (_middle(tmp_path / f"{x}.exr") for x in (f"both_{side}", side))
                assert np.abs(wanted - found).max() < 0.1
            rig.camera = camera
    assert camera.data.animation_data.drivers.values() == []


def test_a_job_renders_both_eyes(rig, tmp_path):
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    name, rig.camera.scale = rig.camera.name, (1.0, 1.0, 1.0)
    path = tmp_path / "stereo.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    options = [path, "--samples", 2, "--resolution", 16, 9, "--phase", "hg:0.8", "--bands", 3]
    options += ["--floor-depth", 9, "--out", tmp_path / "out"]
    assert batch.main([str(option) for option in options], inside_blender=False) == 0
    folders = [tmp_path / "out" / f"{name}_{side}" for side in stereo.SIDES]
    left, right = (json.loads(next(folder.glob("*.json")).read_text()) for folder in folders)
    assert left["development"] == right["development"]
    assert left["job"]["camera"] == f"{name} left"
    pictures = [read_exr(next(folder.glob("[0-9]*[0-9].exr")))[0] for folder in folders]
    assert pictures[0].shape == (9, 16, 3)
    assert not np.allclose(*pictures)
