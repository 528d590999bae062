"""The button that adds a cloud, and what a plan keeps of it."""

from __future__ import annotations

import bpy
import pytest
from underwater_spectral.jobs import manifest_files
from underwater_spectral.scene.readers import clouds
from underwater_spectral.tests.scene.manifests import small_manifest


def test_the_button_puts_a_cloud_before_the_camera(registered):
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (1.0, 2.0, -8.0)
    registered.collection.objects.link(camera)
    registered.camera = camera
    bpy.context.view_layer.update()
    assert bpy.ops.underwater.add_cloud() == {"FINISHED"}
    bpy.context.view_layer.update()
    (found,) = clouds.records(registered)
    # The camera looks down.
    assert found["position"] == pytest.approx([1.0, 2.0, -11.0])
    assert (found["constituent"], found["concentration"]) == ("minerals", 10.0)
    assert bpy.context.view_layer.objects.active.name == found["name"]


def test_the_button_adds_bubbles_too(registered):
    assert bpy.ops.underwater.add_cloud(constituent="bubbles") == {"FINISHED"}
    item = bpy.context.view_layer.objects.active
    item.location.z = -4.0
    bpy.context.view_layer.update()
    (found,) = clouds.records(registered)
    assert found["name"].startswith("Bubble Cloud")
    assert (found["constituent"], found["unit"]) == ("bubbles", "l/m³")


def test_plumes_are_added_below_whitecaps_only(registered):
    registered.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    registered.collection.objects.link(registered.camera)
    registered.camera.location.z = -3.0
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="no foam; switch on"):
        bpy.ops.underwater.add_plumes()
    water = registered.underwater
    water.surface, water.raised_waves, water.whitecaps = "waves", True, True
    water.wind_speed, water.wave_resolution = 12.0, 128
    assert bpy.ops.underwater.add_plumes(count=2) == {"FINISHED"}
    assert len(clouds.marked(registered)) == 2


def test_a_manifest_keeps_the_clouds_of_each_frame(tmp_path):
    one = ({"name": "Silt", "concentration": 10.0},)
    planned = small_manifest(tmp_path, frames=3, clouds={2: one})
    path = tmp_path / "job.json"
    manifest_files.write_manifest(path, planned)
    read = manifest_files.read_manifest(path)
    assert [read.clouds_of(frame) for frame in (1, 2, 3)] == [(), one, one]


def test_a_manifest_without_clouds_says_nothing_of_them(tmp_path):
    path = tmp_path / "job.json"
    manifest_files.write_manifest(path, small_manifest(tmp_path))
    assert "clouds" not in path.read_text()
