"""Every item, preset and limit gives a scene that can be computed; undo and files keep it."""

from __future__ import annotations

import functools
import math
import re
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import bpy
import numpy as np
import pytest
from underwater_spectral.datasets.outputs import RAW_FILES
from underwater_spectral.scene import stored_settings
from underwater_spectral.settings.known_words import known_words, suggestions
from underwater_spectral.settings.render_plan import plan_of, quiet
from underwater_spectral.settings.scene_settings import SETTINGS, SceneSettings
from underwater_spectral.settings.setting import SECTIONS
from underwater_spectral.tests.scene import scenes
from underwater_spectral.ui import (
    migration,
    object_panels,
    panels,
    presets,
    previews,
    section_panels,
)
from underwater_spectral.ui import property_group as panel_group
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.housing import GLASSES
from underwater_spectral.uw_spectral.imaging.layers import LAYERS
from underwater_spectral.uw_spectral.spectra.colour_rendering import WHITE_BALANCES
from underwater_spectral.uw_spectral.spectra.sensor import list_sensors
from underwater_spectral.uw_spectral.spectra.tone import CONTRASTS, TONES
from underwater_spectral.uw_spectral.transfer.sky import SKIES
from underwater_spectral.uw_spectral.transfer.water_column import SURFACES
from underwater_spectral.uw_spectral.water.optical_properties import JERLOV_SOURCES, JERLOV_TYPES

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
    for setting in SETTINGS.values():
        if not isinstance(setting.default, str | bool):
            yield from ((setting.name, value) for value in setting.limits)


# Limits that contradict the setting beside them: the message says so.
_REFUSED = {
    ("range_start", 830): "is empty",
    ("range_end", 300): "is empty",
    ("range_end", 830): "nm",  # beyond the tables of the water
    ("sunlight", 0): "no light",  # at night something else must shine
    ("bands", 1): "too saturated",  # one band has no colour to balance
}


@pytest.mark.slow_but_first
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
    for setting in SETTINGS.values():
        yield from ((setting.name, value) for value in setting.choices)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("name", "value"), list(_choices()))
def test_every_choice(name, value):
    setattr(bpy.context.scene.underwater, name, value)
    _plan()


def test_choices_are_those_of_the_optics():
    ours = {name: tuple(setting.choices) for name, setting in SETTINGS.items() if setting.choices}
    assert ours == {
        "water_source": JERLOV_SOURCES, "surface": SURFACES, "sky": SKIES,
        "irradiance": ("auto", "below", "above"), "white_balance": WHITE_BALANCES, "tone": TONES,
        "contrast": CONTRASTS, "band_placement": ("equal", "optimised"),
        "forward_peak": ("bounded", "exact"),
        "port_glass": tuple(GLASSES), "raw": ("none", *RAW_FILES),
    }  # fmt: skip


def test_every_row_of_the_table_is_whole():
    for name, setting in SETTINGS.items():
        assert setting.label, name
        assert len(setting.text) > 8, name
        assert not setting.text.endswith("."), name
        assert setting.section in SECTIONS, name
        assert set(setting.needs) <= set(SETTINGS), name
        assert setting.engine in {"", "eevee", "cycles"}, name
        shown = bpy.context.scene.underwater.bl_rna.properties[name]
        assert shown.name.startswith(setting.label), name
        assert name == "contrast" or all(all(words) for words in setting.choices.values()), name
        if not isinstance(setting.default, str | bool):
            low, high = setting.soft_limits or setting.limits
            assert setting.limits[0] <= low <= setting.default <= high <= setting.limits[1], name


@pytest.mark.parametrize(
    ("name", "count"),
    [("water", 16), ("sensor", 90), ("illuminant", 4), ("phase", 8), ("filter", 5)],
)
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_every_word_that_is_suggested_can_be_used(name, count):
    words = known_words(SETTINGS[name].known)
    assert len(words) >= count
    for word, text in words if name != "sensor" else words[::9]:
        assert text
        setattr(bpy.context.scene.underwater, name, word)
        _plan()


def test_suggestions_hold_what_is_written():
    search = suggestions("waters")
    assert [word for word, _ in search(None, None, "balt")] == ["case:baltic"]
    assert len(search(None, None, "jerlov:II")) == len(known_words("waters"))
    assert len(search(None, None, "jerlov:i")) == 5
    assert dict(suggestions("emissions")(None, None, "led"))["led-warm"] == "Warm white LED"


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", ["jerlov:5C", "jerlov:IB", "constituents"])
@pytest.mark.parametrize("metres", [5.0, 1.5])
def test_visibility_is_reached_without_a_symbol(water, metres):
    """By a black object that fades: the range is that of the read-outs."""
    scene = bpy.context.scene
    scene.underwater.water = water
    scene.underwater_panel.visibility = metres
    assert previews.compute(scene).readouts.visibility == pytest.approx(metres, rel=5e-3)
    assert scene.underwater_panel.visibility == pytest.approx(metres, rel=5e-3)
    assert scene.underwater.concentration > 0.1


def test_the_sun_by_elevation_and_bearing():
    """Sunlight that travels to -x comes from the east."""
    water, panel = bpy.context.scene.underwater, bpy.context.scene.underwater_panel
    for azimuth, bearing in ((180.0, 90.0), (-90.0, 0.0), (0.0, 270.0), (90.0, 180.0)):
        water.sun_azimuth = azimuth
        assert math.degrees(panel.bearing) == pytest.approx(bearing, abs=1e-3)
        panel.bearing = math.radians(bearing)
        assert water.sun_azimuth == pytest.approx(azimuth, abs=1e-3)
    panel.elevation = math.radians(60.0)
    assert water.sun_zenith == pytest.approx(30.0, abs=1e-4)
    panel.elevation = 0.0
    assert water.sun_zenith == pytest.approx(89.9, abs=1e-3)


def test_layers_are_tick_boxes():
    water, panel = bpy.context.scene.underwater, bpy.context.scene.underwater_panel
    assert panel.layers == set()
    panel.layers = {"RANGE", "D"}
    assert water.layers == "D,range"
    water.layers = "all"
    assert len(panel.layers) == len(LAYERS)
    panel.layers = set()
    assert water.layers == "none"


@pytest.mark.parametrize("name", ["gallery", "quality"])
def test_every_item_of_the_panel(name):
    panel = bpy.context.scene.underwater_panel
    if name == "gallery":
        items = [f"JERLOV_{water}" for water in JERLOV_TYPES]
    else:
        items = panel.bl_rna.properties[name].enum_items.keys()
    for item in items:
        setattr(panel, name, item)
        assert getattr(panel, name) == item
        _plan()


def test_gallery_and_setting_are_one():
    scene = bpy.context.scene
    scene.underwater.water = "jerlov:7C"
    assert scene.underwater_panel.gallery == "JERLOV_7C"
    scene.underwater_panel.gallery = "JERLOV_IA"
    assert scene.underwater.water == "jerlov:IA"


def test_a_camera_that_looks_nowhere_is_said_where_pictures_are():
    """It was raised where the panel is drawn."""
    scene = bpy.context.scene
    scene.camera = scenes.add_camera()
    scene.camera.scale = 0.0, 0.0, 0.0
    bpy.context.view_layer.update()
    assert "looks nowhere" in previews.compute(scene).error
    assert previews.of_scene(scene).readouts is None


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
    for drawn in (panels, object_panels, section_panels):  # it measures the window
        monkeypatch.setattr(drawn, "say", lambda *_: None)
    bpy.context.scene.underwater.water = water
    bpy.context.scene.underwater_panel.quality = quality
    shown = []

    class Layout(MagicMock):
        def prop(self, data, name, **_):
            assert name in data.bl_rna.properties, name
            shown.append(name)

        def prop_enum(self, data, name, _, **__):
            self.prop(data, name)

        def _get_child_mock(self, **_):
            return self

    for panel in panels.CLASSES:
        drawn = SimpleNamespace(layout=Layout())
        for name in ("section", "apart", "popover"):
            setattr(drawn, name, getattr(panel, name, None))
        for name in ("column", "before", "draw_settings", "after"):
            if hasattr(panel, name):
                setattr(drawn, name, functools.partial(getattr(panel, name), drawn))
        panel.draw(drawn, bpy.context)
    assert {"inelastic", "layers", "visibility"} <= set(shown)
    values = bpy.context.scene.underwater
    for name, setting in SETTINGS.items():
        of_engine = setting.engine in ("", "cycles" if quality == "REFERENCE" else "eevee")
        wanted = of_engine and setting.applies(values)
        if name not in {"exposure", "water"}:  # the meter; constituents have no name
            assert (name in shown) == wanted, name
    assert ("chlorophyll" in shown) == (water == "constituents")
    assert ("denoise" in shown) == (quality == "REFERENCE")
    assert ("forward_peak" in shown) == (quality == "REFERENCE")
    switches = {"shafts", "diffuse_shadows"} & set(shown)
    assert len(switches) == (0 if quality == "REFERENCE" else 2)


def test_the_manual_has_a_row_for_every_panel():
    rows = (ROOT / "docs" / "artist.md").read_text().split("## How to read the panel")[1]
    for panel in panels.CLASSES:
        assert hasattr(panel, "bl_parent_id") == (f"\n| {panel.bl_label} | " in rows), panel


def test_the_documents_count_the_sensors():
    text = (ROOT / "docs" / "researcher.md").read_text()
    count = {kind: len(list_sensors(kind)) for kind in ("camera", "film", "observer")}
    assert count["observer"] == 4
    assert f"{count['camera']} cameras, {count['film']} films and four observers" in text


def test_files_of_every_kind_are_in_the_browser():
    ours = bpy.ops.underwater
    patterns = [
        operator.get_rna_type().properties["filter_glob"].default.split(";")
        for operator in (ours.open_water, ours.open_sensor)
    ]
    assert patterns == [["*.csv", "*.txt", "*.sb", "*.env"], ["*.csv", "*.json", "*.txt"]]


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


def test_a_look_holds_every_setting_of_the_picture(tmp_path, monkeypatch):
    """All but how it is rendered; what has been changed since comes back."""
    held = set(presets.KINDS["look"].settings)
    device = {"filter", "raw", "iso", "full_well", "read_noise", "receptors", "false_colour"}
    picture = {n for n, s in SETTINGS.items() if s.section not in ("quality", "housing")}
    assert held == picture - device
    monkeypatch.setattr(bpy.utils, "user_resource", lambda *_, path, **__: _made(tmp_path / path))
    monkeypatch.setattr(
        bpy.utils, "preset_paths", lambda folder: [str(tmp_path / "presets" / folder)]
    )
    water = bpy.context.scene.underwater
    changed = {"wind_speed": 9.0, "snow": 30.0, "sunlight": 0.5, "inelastic": "raman",
               "sensor": "ARRI D21", "caustics": 0.5, "concentration": 2.0}  # fmt: skip
    for name, value in changed.items():
        setattr(water, name, value)
    bpy.ops.underwater.look_preset_add(name="my bay")
    for name in changed:
        water.property_unset(name)
    presets.apply("look", "my bay")
    assert {name: getattr(water, name) for name in changed} == changed


def test_factory_looks_leave_nothing_as_it_was():
    """But the camera: who has chosen one keeps it."""
    for path in presets.names("look").values():
        text = path.read_text(encoding="utf-8")
        given = set(re.findall(r"^water\.(\w+) = ", text, re.MULTILINE))
        assert given == set(presets.KINDS["look"].settings) - {"sensor"}, path.name


def _made(folder: Path) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    return str(folder)


@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
def test_every_sensor():
    names = list_sensors()
    assert len(names) >= 90
    for name in names:
        bpy.context.scene.underwater.sensor = name
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
    scene.underwater.wind_speed = 9.0
    bpy.ops.ed.undo_push(message="wind")
    assert bpy.ops.underwater.reset_section("EXEC_DEFAULT", True, section="waves") == {"FINISHED"}
    assert bpy.context.scene.underwater.wind_speed == before.wind_speed
    bpy.ops.ed.undo()
    assert bpy.context.scene.underwater.wind_speed == 9.0
    bpy.ops.ed.undo()
    assert stored_settings.stored_settings(bpy.context.scene) == before
    bpy.ops.ed.redo()
    assert bpy.context.scene.underwater.wind_speed == 9.0


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


def test_the_waves_panel_says_what_heights_do_not_show(monkeypatch):
    lines = []
    for drawn in (panels, object_panels, section_panels):
        monkeypatch.setattr(drawn, "say", lambda _, text, *__: lines.append(text))
    water, panel = bpy.context.scene.underwater, SimpleNamespace(layout=MagicMock())
    water.surface = "waves"
    section_panels.WavesPanel.after(panel, bpy.context)
    assert lines == []
    water.raised_waves = True
    section_panels.WavesPanel.after(panel, bpy.context)
    assert all(line.startswith("Waves with height: ") for line in lines)
    for part in ("no caustics", "level surface", "behind a trough", "no waterline"):
        assert sum(part in line for line in lines) == 1
