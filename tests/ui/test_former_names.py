"""Names of earlier versions in command lines, presets and manifests."""

from __future__ import annotations

from dataclasses import asdict, replace

import bpy
from underwater_spectral.jobs import command_line, manifest_files
from underwater_spectral.settings.scene_settings import SceneSettings, flag
from underwater_spectral.settings.setting import FORMER_NAMES
from underwater_spectral.tests.scene.manifests import small_manifest


def test_options_of_before_still_work_and_are_not_shown():
    options = ["--second-water", "jerlov:I", "--second-water-share", "0.25", "--mirrored-things"]
    chosen = command_line.merge(SceneSettings(), command_line.parser().parse_args(options))
    assert (chosen.second_water_fraction, chosen.planar_reflections) == (0.25, True)
    assert not any(flag(name) in command_line.parser().format_help() for name in FORMER_NAMES)


def test_a_preset_of_before_is_applied(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(
        "import bpy\nwater = bpy.context.scene.underwater\n"
        "water.mirrored_things = True\nwater.second_water_share = 0.25\n"
    )
    found = bpy.ops.underwater.apply_preset(
        filepath=str(path), menu_idname="UNDERWATER_PT_look_presets"
    )
    water = bpy.context.scene.underwater
    assert found == {"FINISHED"}
    assert water.planar_reflections
    assert water.second_water_fraction == 0.25
    assert "mirrored_things" in path.read_text(), "the user's file is left alone"


def test_a_manifest_of_before_is_read(tmp_path):
    chosen = replace(SceneSettings(), planar_reflections=True, second_water_fraction=0.25)
    path = tmp_path / "job.json"
    changes = {1: {"second_water_fraction": 0.5}}
    job = small_manifest(tmp_path, settings=asdict(chosen), changes=changes)
    manifest_files.write_manifest(path, job)
    text = path.read_text()
    for was, name in FORMER_NAMES.items():
        assert name in text
        text = text.replace(name, was)
    path.write_text(text)
    assert manifest_files.read_manifest(path).settings_of(1) == replace(
        chosen, second_water_fraction=0.5
    )
