"""Files of other versions are brought here, or left alone."""

from __future__ import annotations

import bpy
from underwater_spectral.ui import migration


def test_a_file_without_a_version_is_migrated_on_load(tmp_path):
    water = bpy.context.scene.underwater
    water.water, water.second_water_fraction = "jerlov:III", 0.5
    path = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    scene = bpy.context.scene
    assert scene.underwater_panel.version == migration.VERSION
    assert scene.underwater.water == "jerlov:III"
    assert scene.underwater.second_water_fraction == 0.0


def test_steps_run_once_and_in_order():
    scene = bpy.context.scene
    scene.underwater.water = "jerlov:I"
    ran = []
    steps = [lambda _, i=i: ran.append(i) for i in range(3)]
    scene.underwater_panel.version = 1
    migration.migrate(scene, steps)
    migration.migrate(scene, steps)
    assert ran == [1, 2]
    assert scene.underwater_panel.version == 3


def test_scenes_without_water_and_newer_files_are_left_alone():
    scene = bpy.context.scene
    migration.migrate(scene)
    assert scene.underwater_panel.version == 0
    scene.underwater.water = "jerlov:I"
    scene.underwater_panel.version = migration.VERSION + 1
    migration.migrate(scene)
    assert scene.underwater_panel.version == migration.VERSION + 1
    assert migration.is_newer(scene)


def test_an_appended_scene_is_migrated(tmp_path):
    bpy.context.scene.name = "sea"
    bpy.context.scene.underwater.water = "jerlov:9C"
    path = str(tmp_path / "old.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.append(filepath=f"{path}/Scene/sea", directory=f"{path}/Scene/", filename="sea")
    appended = bpy.data.scenes["sea"]
    assert appended.underwater.water == "jerlov:9C"
    assert appended.underwater_panel.version == migration.VERSION


def test_switches_and_turbidity_of_version_1_keep_their_meaning():
    scene = bpy.context.scene
    water, panel = scene.underwater, scene.underwater_panel
    water.water, panel.version = "jerlov:III", 1
    stored, of_panel = water.bl_system_properties_get(), panel.bl_system_properties_get()
    # As version 1 stored them: words by their places, and a name of its own.
    stored["diffuse_shadows"], stored["turbidity"] = 0, 1.75
    of_panel["shafts"] = True
    water.keyframe_insert("scattering_factor", frame=3)
    (curve,) = migration._curves(scene)
    curve.data_path = "underwater.turbidity"
    migration.migrate(scene)
    assert (water.diffuse_shadows, water.shafts) == (True, True)
    assert water.scattering_factor == 1.75
    assert curve.data_path == "underwater.scattering_factor"
    assert "turbidity" not in water.bl_system_properties_get()


def test_names_of_version_2_are_carried_on():
    scene = bpy.context.scene
    water, panel = scene.underwater, scene.underwater_panel
    water.water, water.second_water, panel.version = "jerlov:III", "jerlov:I", 2
    stored = water.bl_system_properties_get()
    stored["second_water_share"], stored["mirrored_things"] = 0.25, True
    water.keyframe_insert("second_water_fraction", frame=3)
    (curve,) = migration._curves(scene)
    curve.data_path = "underwater.second_water_share"
    migration.migrate(scene)
    assert (water.second_water_fraction, water.planar_reflections) == (0.25, True)
    assert curve.data_path == "underwater.second_water_fraction"
    assert not {"second_water_share", "mirrored_things"} & set(
        water.bl_system_properties_get().keys()
    )
    assert panel.version == migration.VERSION


def test_a_fraction_without_a_second_water_in_version_0_means_nothing():
    water = bpy.context.scene.underwater
    water.water = "jerlov:III"
    water.bl_system_properties_get()["second_water_share"] = 0.5
    migration.migrate(bpy.context.scene)
    assert water.second_water_fraction == 0.0
