"""Every item, preset and limit gives a scene that can be computed; undo and files keep it."""

from __future__ import annotations

import functools
import math
from dataclasses import fields
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import stored_settings
from underwater_spectral.settings.render_plan import plan_of, quiet
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.ui import migration, panels, presets, previews
from underwater_spectral.ui import property_group as panel_group
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.sensor import list_sensors
from underwater_spectral.uw_spectral.water.optical_properties import JERLOV_TYPES

DEPTH = 0.5
ROOT = Path(__file__).resolve().parents[2]


def _plan():
    """Plan, development and path radiance of the scene: finite numbers, all of them."""
    chosen = stored_settings.stored_settings(bpy.context.scene)
    plan = plan_of(chosen)
    view = plan.viewpoint(min(DEPTH, 0.5 * (chosen.floor_depth or math.inf)))
    with quiet():
        weights = view.reduction.weights
    assert weights.shape == (3, len(plan.bands))
    assert np.isfinite(weights).all()
    assert np.isfinite(view.background).all()
    assert plan.settings == chosen
    return plan


def _limits():
    for setting in fields(SceneSettings):
        if not isinstance(setting.default, str | bool):
            low, high = setting.metadata["limits"]
            yield from ((setting.name, value) for value in (low, high))


# Limits that contradict the setting beside them: the message says so.
_REFUSED = {
    ("range_start", 830): "is empty",
    ("range_end", 300): "is empty",
    ("range_end", 830): "nm",  # beyond the tables of the water
    ("sunlight", 0): "no light",  # at night something else must shine
    ("bands", 1): "too saturated",  # one band has no colour to balance
}


@pytest.mark.parametrize(("name", "value"), list(_limits()))
def test_every_limit(name, value):
    group = bpy.context.scene.underwater
    setattr(group, name, int(value) if isinstance(getattr(group, name), int) else value)
    refused = _REFUSED.get((name, value))
    if refused:
        with pytest.raises(InputError, match=refused):
            _plan()
        return
    _plan()


def _choices():
    for setting in fields(SceneSettings):
        yield from ((setting.name, value) for value in setting.metadata["choices"])


@pytest.mark.parametrize(("name", "value"), list(_choices()))
def test_every_choice(name, value):
    setattr(bpy.context.scene.underwater, name, value)
    _plan()


@pytest.mark.parametrize("name", ["gallery", "second_water", "phase", "light", "quality"])
def test_every_item_of_the_panel(name):
    panel = bpy.context.scene.underwater_panel
    if name == "gallery":
        items = [f"JERLOV_{water}" for water in JERLOV_TYPES]
    else:
        items = panel.bl_rna.properties[name].enum_items.keys()
    for item in items:
        before = stored_settings.stored_settings(bpy.context.scene)
        setattr(panel, name, item)
        if item in {"OTHER", "FILE"}:
            assert stored_settings.stored_settings(bpy.context.scene) == before
        else:
            assert getattr(panel, name) == item
        _plan()


def test_gallery_and_setting_are_one():
    scene = bpy.context.scene
    scene.underwater.water = "jerlov:7C"
    assert scene.underwater_panel.gallery == "JERLOV_7C"
    scene.underwater_panel.gallery = "JERLOV_IA"
    assert scene.underwater.water == "jerlov:IA"


def test_water_from_constituents_and_its_inelastic_light():
    water, panel = bpy.context.scene.underwater, bpy.context.scene.underwater_panel
    panel.from_constituents = True
    assert water.water == "constituents"
    panel.inelastic = {"RAMAN", "CDOM"}
    assert water.inelastic == "raman,cdom"
    for name in ("chlorophyll", "cdom", "minerals", "detritus"):
        for value in (0.0, 1e9, 0.5):
            setattr(water, name, value)
            _plan()
    assert _plan().excitation is not None
    pictures = previews.compute(bpy.context.scene)
    assert not pictures.error
    assert 0 < pictures.inelastic < 0.2
    water.inelastic = "all"
    assert panel.inelastic == {"RAMAN", "CHLOROPHYLL", "CDOM"}
    panel.inelastic = set()
    assert previews.compute(bpy.context.scene).inelastic is None
    panel.from_constituents = False
    assert (water.water, water.inelastic) == ("jerlov:IB", "")


@pytest.mark.parametrize(
    ("water", "quality"),
    [("constituents", "REALTIME"), ("jerlov:IB", "BANDS"), ("file:none.csv", "REFERENCE")],
)
def test_the_panel_names_properties_that_exist(water, quality, monkeypatch):
    """Drawing onto a layout that only looks them up; a window is not needed."""
    monkeypatch.setattr(panels, "_say", lambda *_: None)  # it measures the window
    bpy.context.scene.underwater.water = water
    bpy.context.scene.underwater_panel.quality = quality
    shown = []

    class Layout(MagicMock):
        def prop(self, data, name, **_):
            assert name in data.bl_rna.properties, name
            shown.append(name)

        def _get_child_mock(self, **_):
            return self

    for panel in panels.CLASSES:
        drawn = SimpleNamespace(layout=Layout())
        for name in ("column", "_named"):
            if hasattr(panel, name):
                setattr(drawn, name, functools.partial(getattr(panel, name), drawn))
        panel.draw(drawn, bpy.context)
    assert "inelastic" in shown
    assert ("chlorophyll" in shown) == (water == "constituents")
    assert ("denoise" in shown) == (quality == "REFERENCE")
    assert ("forward_peak" in shown) == (quality == "REFERENCE")
    switches = {"field", "shafts", "diffuse_shadows"} & set(shown)
    assert len(switches) == (0 if quality == "REFERENCE" else 3)


def test_the_manual_has_a_row_for_every_panel():
    rows = (ROOT / "docs" / "artist.md").read_text().split("## How to read the panel")[1]
    for panel in panels.CLASSES:
        assert hasattr(panel, "bl_parent_id") == (f"\n| {panel.bl_label} | " in rows), panel


def test_the_manual_of_the_batch_counts_the_sensors():
    text = (ROOT / "docs" / "pipeline.md").read_text()
    count = {kind: len(list_sensors(kind)) for kind in ("camera", "film", "observer")}
    assert count["observer"] == 4
    assert f"| {count['camera']} cameras, {count['film']} films and four observers (" in text


def test_files_of_every_kind_are_in_the_browser():
    ours = bpy.ops.underwater
    patterns = [
        operator.get_rna_type().properties["filter_glob"].default.split(";")
        for operator in (ours.open_water, ours.open_sensor)
    ]
    assert patterns == [["*.csv", "*.txt", "*.sb"], ["*.csv", "*.json", "*.txt"]]


def test_exposure_is_metered_or_by_hand():
    scene = bpy.context.scene
    panel = scene.underwater_panel
    assert panel.meter == "LIGHT"
    panel.stops = 1.5
    assert scene.underwater.exposure == "1.5"
    assert panel.meter == "FIXED"
    for meter, text in (("LIGHT", "auto"), ("PICTURE", "auto-picture"), ("FIXED", "0")):
        panel.meter = meter
        assert (scene.underwater.exposure, panel.meter) == (text, meter)


@pytest.mark.parametrize("kind", presets.KINDS)
def test_every_preset(kind):
    names = presets.names(kind)
    for name in names:
        presets.apply(kind, name)
        _plan()
    if kind == "water":
        assert {f"Jerlov {water}" for water in JERLOV_TYPES} <= set(names)
    if kind == "look":
        looks = {"Tropical reef", "Blue hole", "North Sea", "Harbour", "Deep dive"}
        assert looks <= set(names)


def test_an_unknown_preset_is_named():
    with pytest.raises(InputError, match="Tropical reef"):
        presets.apply("look", "Tropical ref")


def test_own_preset_round_trip(tmp_path, monkeypatch):
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, path, **__: _made(tmp_path / path))
    monkeypatch.setattr(
        bpy.utils, "preset_paths", lambda folder: [str(tmp_path / "presets" / folder)]
    )
    water = bpy.context.scene.underwater
    water.water, water.scattering_factor, water.floor_depth = "jerlov:5C", 2.5, 7.0
    bpy.ops.underwater.look_preset_add(name="my bay")
    water.water, water.scattering_factor, water.floor_depth = "jerlov:I", 1.0, 0.0
    presets.apply("look", "my bay")
    assert (water.water, water.scattering_factor, water.floor_depth) == ("jerlov:5C", 2.5, 7.0)
    bpy.ops.underwater.look_preset_add(name="my bay", remove_name=True)
    assert presets.names("look") == {}


def _made(folder: Path) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    return str(folder)


@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_every_sensor():
    names = list_sensors()
    assert len(names) >= 90
    for name in names:
        assert bpy.ops.underwater.choose_sensor(sensor=name) == {"FINISHED"}
        assert bpy.context.scene.underwater.sensor == name
        _plan()


@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_panel_and_record_say_what_a_film_is():
    water = bpy.context.scene.underwater
    for name, said in (("Kodak Portra 400", True), ("ARRI D21", False)):
        water.sensor = name
        shown = previews.compute(bpy.context.scene).sensor
        assert ("characteristic curve" in shown) == said
        assert any("characteristic curve" in note for note in _plan().notes) == said


def test_undo_returns_to_the_state_before():
    bpy.context.preferences.edit.use_global_undo = True
    scene = bpy.context.scene
    bpy.ops.ed.undo_push(message="start")
    before = stored_settings.stored_settings(scene)
    assert bpy.ops.underwater.choose_sensor("EXEC_DEFAULT", True, sensor="ARRI D21") == {"FINISHED"}
    assert bpy.context.scene.underwater.sensor == "ARRI D21"
    bpy.ops.ed.undo()
    assert stored_settings.stored_settings(bpy.context.scene) == before
    bpy.ops.ed.redo()
    assert bpy.context.scene.underwater.sensor == "ARRI D21"


def test_save_and_reload_keeps_everything(tmp_path):
    scene = bpy.context.scene
    presets.apply("look", "Harbour")
    panel = scene.underwater_panel
    panel.quality, panel.output, panel.animation = "REFERENCE", "//elsewhere", True
    migration.stamp(scene)
    before = stored_settings.stored_settings(scene)
    path = str(tmp_path / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    assert stored_settings.stored_settings(bpy.context.scene) == SceneSettings()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert stored_settings.stored_settings(bpy.context.scene) == before
    panel = bpy.context.scene.underwater_panel
    assert (panel.quality, panel.output, panel.animation) == ("REFERENCE", "//elsewhere", True)
    assert panel.version == migration.VERSION
    job = panel_group.job(bpy.context.scene)
    assert (job.engine, job.mode, job.out) == ("cycles", "bands", tmp_path / "elsewhere")
