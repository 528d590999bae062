"""The command line and the stored settings."""

from __future__ import annotations

import math
from dataclasses import fields

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import command_line
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.water.frame_water import realtime_water
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings, flag
from underwater_spectral.settings.water_settings import CONSTITUENTS
from underwater_spectral.uw_spectral.errors import InputError


@pytest.fixture
def registered():
    # A batch of an earlier test may have registered the properties in this process.
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()


def test_stored_settings_are_the_defaults(registered):
    assert stored_settings.stored_settings(bpy.context.scene) == SceneSettings()


def test_options_override_what_the_file_stores(registered, tmp_path):
    group = bpy.context.scene.underwater
    group.water, group.bands, group.refractive_index = "jerlov:3C", 12, 1.33
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    stored = stored_settings.stored_settings(bpy.context.scene)
    merged = command_line.merge(stored, command_line.parse(["--water", "jerlov:I"]))
    assert (merged.water, merged.bands, merged.refractive_index) == ("jerlov:I", 12, 1.33)


def test_number_of_bands_replaces_stored_wavelengths():
    stored = SceneSettings(wavelengths="450,550,650")
    assert command_line.merge(stored, command_line.parse(["--bands", "4"])).wavelengths == ""
    assert command_line.merge(stored, command_line.parse([])).wavelengths == "450,550,650"


def test_a_mode_decides_how_many_bands_if_nobody_does():
    default = SceneSettings()
    assert (default.in_mode("realtime").bands, default.in_mode("bands").bands) == (40, 8)
    assert SceneSettings(bands=5).in_mode("realtime").bands == 5
    assert SceneSettings(band_placement="optimised").in_mode("realtime").bands == 8
    assert default.in_mode("realtime").with_at_most(8).bands == 8
    listed = SceneSettings(wavelengths="450,550,650")
    assert listed.with_at_most(2) == listed


def test_scripts_that_ask_for_the_solved_field_go_on():
    default = SceneSettings()
    assert command_line.merge(default, command_line.parse(["--field", "solved"])) == default
    with pytest.raises(InputError, match=r"--field: invalid choice: 'closed-form'"):
        command_line.parse(["--field", "closed-form"])


def test_every_setting_is_an_option():
    options = command_line.parse(["--range", "420", "680"])
    assert command_line.merge(SceneSettings(), options).range_start == 420.0
    text = command_line.parser().format_help()
    for setting in fields(SceneSettings):
        assert flag(setting.name) in text


def test_help_names_every_kind_of_water():
    text = " ".join(command_line.parser().format_help().split())
    start = text.index("--water TEXT Water:")
    for form in ("jerlov:", "case:", "bio:", "file:", ".sb", "Kd"):
        assert form in text[start : start + 400], form


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--sun-zenith", "95"], "--sun-zenith: 95 is outside 0 to 89.9"),
        (["--bands", "-1"], "--bands: -1 is outside 0 to 512"),
        (["--bands", "nan"], "--bands"),
        (["--sky-radiance", "nan"], "--sky-radiance: nan is outside"),
        (["--surface", "rough"], "--surface"),
        (["--sky", "stormy"], "--sky"),
        (["--colour=red"], "unrecognized arguments: --colour=red; see --help"),
        (["--range", "700", "400"], "--range: 700 to 400 nm is empty"),
    ],
)
def test_bad_options_are_named(arguments, message):
    with pytest.raises(InputError, match=message):
        command_line.merge(SceneSettings(), command_line.parse(arguments))


AMOUNTS = (
    {"chlorophyll": 0.0, "cdom": 0.0, "minerals": 0.0, "detritus": 0.0},
    {"chlorophyll": 0.1, "cdom": 0.02, "minerals": 0.0, "detritus": 0.01},
    {"chlorophyll": 8.0, "cdom": 0.5, "minerals": 3.0, "detritus": 0.1},
    {"chlorophyll": 100.0, "cdom": 20.0, "minerals": 1e3, "detritus": 20.0},
)


def _of(amounts, **others):
    return make_plan(SceneSettings(water=CONSTITUENTS, bands=4, **amounts, **others))


def test_water_from_constituents():
    """As the bio: water of the same amounts; what may be animated changes no node."""
    shapes = set()
    for amounts in AMOUNTS:
        plan = _of(amounts, surface="flat", inelastic="all")
        text = ",".join(f"{k.replace('chlorophyll', 'chl')}={v}" for k, v in amounts.items())
        same = make_plan(SceneSettings(water=f"bio:{text}", bands=4, surface="flat"))
        np.testing.assert_array_equal(plan.column.absorption, same.column.absorption)
        np.testing.assert_array_equal(plan.column.scattering, same.column.scattering)
        shapes.add(repr(realtime_water(plan.column, plan.phase, 5.0, np.ones((3, 4))).shape))
        assert np.all(plan.emission().at([1.0], math.inf) >= 0)
    assert len(shapes) == 1


def test_amounts_need_water_from_constituents():
    with pytest.raises(InputError, match="--chlorophyll needs --water constituents"):
        command_line.merge(SceneSettings(), command_line.parse(["--chlorophyll", "2"]))
    options = command_line.parse(["--water", "constituents", "--cdom", "0.3"])
    merged = command_line.merge(SceneSettings(), options)
    assert (merged.water, merged.cdom, merged.chlorophyll) == ("constituents", 0.3, 1.0)
    stored = SceneSettings(water="constituents")
    assert command_line.merge(stored, command_line.parse(["--minerals", "4"])).minerals == 4.0


def test_amounts_are_animatable(registered):
    group = bpy.context.scene.underwater
    group.water = CONSTITUENTS
    for frame, value in ((1, 0.5), (11, 10.5)):
        for name in AMOUNTS[0]:
            setattr(group, name, value)
            assert group.keyframe_insert(name, frame=frame)
    bpy.context.scene.frame_set(6)
    found = stored_settings.stored_settings(bpy.context.scene)
    assert all(0.5 < getattr(found, name) < 10.5 for name in AMOUNTS[0])


@pytest.mark.parametrize("frames", ["a", "3-1", "1-x"])
def test_bad_frames_are_named(frames):
    with pytest.raises(InputError, match="--frames"):
        command_line.parse_numbers(frames)


def test_frames():
    assert command_line.parse_numbers("1-3, 7") == (1, 2, 3, 7)
    assert command_line.parse_numbers("-5--3") == (-5, -4, -3)
    assert command_line.parse_numbers("1-9:4") == (1, 5, 9)
    assert command_line.parse_numbers("") == ()
