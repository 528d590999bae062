"""What people expect of a panel: reset, preferences, help, languages, objects to grab."""

from __future__ import annotations

import ast
import math
import re
from dataclasses import fields
from pathlib import Path

import bpy
import pytest
from mathutils import Vector
from underwater_spectral import registration
from underwater_spectral.jobs.progress import time_left
from underwater_spectral.quality.methods import METHODS
from underwater_spectral.scene import stored_settings
from underwater_spectral.scene.viewport import first_settings, live
from underwater_spectral.settings.scene_settings import SETTINGS, SceneSettings
from underwater_spectral.settings.setting import SECTIONS
from underwater_spectral.tests.scene import scenes
from underwater_spectral.ui import (
    added_objects,
    help_pages,
    operators,
    panels,
    preferences,
    presets,
    previews,
    sections,
    translations,
)

UI = Path(sections.__file__).parent


def test_every_setting_is_in_one_section():
    listed = sections.settings_of(*SECTIONS)
    assert sorted(listed) == sorted(setting.name for setting in fields(SceneSettings))


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_is_reset_and_the_others_are_not(section):
    water = bpy.context.scene.underwater
    changed = {"floor_depth": 9.0, "water": "jerlov:3C", "sun_zenith": 60.0, "bands": 4,
               "sensor": "ARRI D21", "wind_speed": 9.0, "sunlight": 0.5}  # fmt: skip
    for name, value in changed.items():
        setattr(water, name, value)
    assert bpy.ops.underwater.reset_section(section=section) == {"FINISHED"}
    for name, value in changed.items():
        if name in sections.settings_of(section):
            assert getattr(water, name) == getattr(SceneSettings(), name)
            assert not water.is_property_set(name)
        else:
            assert getattr(water, name) == pytest.approx(value)


def test_the_tab_can_be_named():
    assert panels.MainPanel.bl_category == "Underwater"
    panels.move_to("Sea")
    assert {cls.bl_category for cls in panels.CLASSES} == {"Sea"}
    assert all(cls.is_registered for cls in panels.CLASSES)
    panels.move_to(preferences.tab())
    assert panels.MainPanel.bl_category == "Underwater"


def test_preferences_are_those_of_a_new_scene(monkeypatch):
    class Stored:
        folder, quality, tab = "//dives", "BANDS", "Sea"

    scene = bpy.context.scene
    scenes.add_camera()
    bpy.context.view_layer.update()
    monkeypatch.setattr(operators.preferences, "stored", Stored)
    monkeypatch.setattr(first_settings, "start", lambda *_: [])
    bpy.ops.underwater.add_water()
    panel = scene.underwater_panel
    assert (panel.output, panel.quality) == ("//dives", "BANDS")
    assert preferences.tab() == "Sea"


def test_f1_finds_every_setting_and_button():
    prefix, pairs = help_pages.manual_map()
    text = Path(prefix.removeprefix("file://")).read_text(encoding="utf-8")
    assert {f"bpy.types.underwaterproperties.{s.name}" for s in fields(SceneSettings)} <= {
        key for key, _ in pairs
    }
    for _, anchor in pairs:
        assert f'id="{anchor.removeprefix("#")}"' in text
    for _, name, words in help_pages.entries():
        assert name
        assert words, name
    assert help_pages.manual_map in list(bpy.utils._manual_map)


def test_no_label_is_left_without_its_translations():
    rows = translations.rows()
    assert all(len(row) == 1 + len(translations.LANGUAGES) for row in rows)
    assert all(all(row) for row in rows)
    names = [row[0] for row in rows]
    assert len(set(names)) == len(names)
    # What the panel's code shows as titles of sections and as buttons.
    titles = {cls.bl_label for cls in panels.CLASSES}
    buttons = {cls.bl_label for cls in operators.CLASSES[:6]}
    assert titles | buttons <= set(names)
    shown = {
        node.value
        for path in UI.glob("*.py")
        if path.name != "translations.py"
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }
    shown |= {setting.label for setting in SETTINGS.values()}
    shown |= {section.title for section in SECTIONS.values()}
    shown |= {method.label for method in METHODS.values()}
    for stored in (bpy.types.Light, bpy.types.Material, bpy.types.Object):
        group = stored.bl_rna.properties["underwater"].fixed_type
        shown |= {prop.name for prop in group.properties}
        choices = [prop for prop in group.properties if prop.type == "ENUM"]
        shown |= {item.name for prop in choices for item in prop.enum_items}
    assert [name for name in names if name not in shown] == []


def test_blender_gets_them_for_words_and_buttons():
    """The module bpy is built without languages: what it would look up is compared."""
    known = translations.catalogue()
    assert set(known) == set(translations.LANGUAGES)
    for context in ("*", "Operator"):
        assert known["de"][context, "Add Water"] == "Wasser einfüllen"
        assert known["ja"][context, "Reef"] == "サンゴ礁"
        assert known["de"][context, "Bubbles (1/l)"] == "Blasen (1/l)"


def test_the_sun_follows_its_handle_with_drivers_that_need_no_script():
    scene = bpy.context.scene
    scenes.add_camera()
    scene.underwater.sun_zenith, scene.underwater.sun_azimuth = 40.0, 70.0
    bpy.context.view_layer.update()
    assert bpy.ops.underwater.add_sun_handle() == {"FINISHED"}
    handle = scene.objects[added_objects.SUN]
    bpy.context.view_layer.update()
    seen = scene.evaluated_get(bpy.context.evaluated_depsgraph_get())
    chosen = stored_settings.stored_settings(seen)
    assert (chosen.sun_zenith, chosen.sun_azimuth) == pytest.approx((40.0, 70.0), abs=1e-3)
    assert all(d.driver.is_simple_expression for d in scene.animation_data.drivers)
    handle.location = (-3.0, 0.0, 3.0)
    bpy.context.view_layer.update()
    seen = scene.evaluated_get(bpy.context.evaluated_depsgraph_get())
    chosen = stored_settings.stored_settings(seen)
    assert (chosen.sun_zenith, chosen.sun_azimuth) == pytest.approx((45.0, 0.0), abs=1e-3)
    assert not bpy.ops.underwater.add_sun_handle.poll()


def test_live_water_follows_the_handle():
    scene = bpy.context.scene
    scenes.add_camera()
    bpy.context.view_layer.update()
    live.add(scene)
    bpy.ops.underwater.add_sun_handle()
    sun = next(o for o in scene.objects if o.get("uw_sun"))
    scene.objects[added_objects.SUN].location = (0.0, -8.0, 2.0)
    bpy.context.view_layer.update()
    direction = sun.rotation_quaternion.to_matrix() @ Vector((0, 0, -1))
    # From the south, low, refracted upwards.
    assert direction.y > 0.6
    assert abs(direction.x) < 1e-3
    assert direction.z < -math.cos(math.radians(50))


def test_the_time_that_is_left():
    assert time_left(30.0, 3, 14) == "0:02:20 left"
    assert time_left(7200.0, 1, 2) == "4:00:00 left"
    assert re.fullmatch(r"\d+:\d\d:\d\d left", time_left(0.0, 0, 5))


def test_a_new_registration_finds_its_tab():
    registration.unregister()
    registration.register()
    assert panels.MainPanel.bl_category == "Underwater"


def test_every_factory_look_has_its_picture():
    for path in presets.names("look").values():
        previews.thumbnail("look", path.stem)  # icons have no numbers without a window
        picture = previews._states[-1].images[f"look {path.stem}"]
        assert tuple(picture.image_size) == (96, 60), path.stem
    assert previews.thumbnail("look", "nowhere") == 0
    sizes = [path.stat().st_size for path in (UI / "thumbnails").rglob("*.png")]
    assert len(sizes) == len(presets.names("look"))
    assert sum(sizes) < 150_000
