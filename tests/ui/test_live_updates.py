"""Live water follows once for many changes, and at once for a single one."""

from __future__ import annotations

from types import SimpleNamespace

import bpy
import pytest
from underwater_spectral.scene.viewport import changes, live
from underwater_spectral.scene.water import realtime
from underwater_spectral.tests.scene import scenes
from underwater_spectral.ui import handlers, live_updates, migration, presets
from underwater_spectral.uw_spectral.errors import InputError

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)


@pytest.fixture
def scene():
    scenes._cube("ball", (0.0, 6.0, -5.0)).data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    water = bpy.context.scene.underwater
    water.phase, water.surface, water.bands = "mixture", "flat", 3
    bpy.context.view_layer.update()
    live.add(bpy.context.scene)
    return bpy.context.scene


@pytest.fixture
def work(scene, monkeypatch):
    """What the water does from here on, in order."""
    done = []
    for name, what in (("set_values", "values"), ("add_realtime", "nodes")):
        real = getattr(realtime, name)

        def spy(*arguments, _real=real, _what=what):
            before = len(done)
            notes = _real(*arguments)
            done[before:] = [_what]  # new nodes get their values, too
            return notes

        monkeypatch.setattr(realtime, name, spy)
    return done


@pytest.fixture
def window(monkeypatch):
    """Blender with a window, as far as updates see it; call it to let Blender be idle."""
    waiting = []
    timers = SimpleNamespace(
        register=lambda function, **_: waiting.append(function),
        unregister=waiting.remove,
        is_registered=waiting.__contains__,
    )
    monkeypatch.setattr(
        live_updates,
        "bpy",
        SimpleNamespace(app=SimpleNamespace(background=False, timers=timers), data=bpy.data),
    )

    def idle():
        count = len(waiting)
        while waiting:
            assert waiting.pop()() is None
        return count

    return idle


PRESETS = [
    pytest.param(
        kind, name, marks=() if (kind == "look") == (name == "first") else pytest.mark.slow
    )
    for kind in presets.KINDS
    for name in ("first", "last")
]


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("kind", "which"), PRESETS)
def test_a_preset_is_one_update(scene, work, kind, which):
    names = list(presets.names(kind))
    # Floors come and go: Harbour has one, Blue hole has none.
    chosen = {"look": {"first": "Harbour", "last": "Blue hole"}}.get(
        kind, {"first": names[0], "last": names[-1]}
    )[which]
    if chosen == "Blue hole":
        scene.underwater.floor_depth = 9.0
        work.clear()
    presets.apply(kind, chosen)
    assert work == (["nodes"] if kind == "look" else ["values"])


def test_the_menu_of_presets_is_a_transaction():
    for kind, made in presets.KINDS.items():
        panel = made.panel
        assert panel.preset_operator == "underwater.apply_preset"
        assert panel.preset_operator_defaults == {"menu_idname": panel.__name__}, kind


@pytest.mark.slow
def test_a_preset_that_fails_is_reported_and_followed(scene, work, tmp_path):
    path = tmp_path / "broken.py"
    path.write_text('import bpy\nbpy.context.scene.underwater.water = "jerlov:I"\n1 / 0\n')
    menu = presets.KINDS["water"].panel.__name__
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        bpy.ops.underwater.apply_preset(filepath=str(path), menu_idname=menu)
    assert work == ["values"]
    assert not live_updates.is_waiting()


@pytest.mark.slow
def test_auto_is_one_update(scene, work):
    scene.underwater_panel.target_delta_e = 10.0
    water = scene.underwater
    water.bands, water.surface, water.diffuse_shadows = 8, "flat", True
    work.clear()
    assert bpy.ops.underwater.auto() == {"FINISHED"}
    assert (water.bands, water.surface, water.diffuse_shadows) == (0, "flat", False)
    assert len(work) == 1


@pytest.mark.slow
def test_undo_brings_the_water_back_without_work(scene, work):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="start")
    presets.apply("look", "Harbour")
    bpy.ops.ed.undo_push(message="harbour")
    work.clear()
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert (scene.underwater.water, scene.underwater.floor_depth) == ("jerlov:IB", 0.0)
    assert live.update(scene, may_rebuild=False)
    assert work == []
    bpy.ops.ed.redo()
    assert live.update(bpy.context.scene, may_rebuild=False)
    assert work == []


@pytest.mark.slow
def test_undo_to_settings_that_the_water_had_not_followed_is_one_update(scene, work, window):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="start")
    scene.underwater.water, scene.underwater.sun_zenith = "jerlov:II", 50.0
    bpy.ops.ed.undo_push(message="set, Blender not idle yet")
    window()
    presets.apply("look", "Harbour")
    bpy.ops.ed.undo_push(message="harbour")
    work.clear()
    bpy.ops.ed.undo()
    assert bpy.context.scene.underwater.water == "jerlov:II"
    assert work == ["values"]


@pytest.mark.slow
def test_loading_an_old_file_is_one_update(scene, work):
    water = scene.underwater
    with live_updates.transaction():
        water.second_water_fraction, scene.underwater_panel.version = 0.5, 0
        water.bl_system_properties_get()["turbidity"] = 1.75
    work.clear()
    handlers._loaded()
    assert (water.second_water_fraction, water.scattering_factor) == (0.0, 1.75)
    assert scene.underwater_panel.version == migration.VERSION
    assert work == ["values"]


def test_a_script_in_background_is_followed_at_once(scene, work):
    scene.underwater.water = "jerlov:II"
    assert work == ["values"]
    scene.underwater.shafts = True
    assert work == ["values", "nodes"]


@pytest.mark.slow
def test_a_block_inside_another_ends_with_it_and_errors_end_both(scene, work):
    with live_updates.transaction():
        with live_updates.transaction():
            scene.underwater.water = "jerlov:II"
        scene.underwater.scattering_factor = 2.0
        assert work == []
    assert work == ["values"]
    with pytest.raises(InputError), live_updates.transaction():
        scene.underwater.water = "jerlov:III"
        raise InputError("no")
    assert work == ["values", "values"]
    scene.underwater.water = "jerlov:IB"
    assert len(work) == 3


@pytest.mark.slow
def test_a_window_updates_once_it_is_idle(scene, work, window):
    edits = {"water": "jerlov:II", "sun_zenith": 50.0}, {"water": "jerlov:I", "shafts": True}
    for changed, expected in zip(edits, ("values", "nodes"), strict=True):
        before = work.copy()
        for name, value in changed.items():
            setattr(scene.underwater, name, value)
        bpy.context.view_layer.update()  # the edit handler leaves the work to the timer
        assert work == before
        assert window() == 1
        # Occlusion may follow, once nothing has changed for a moment.
        assert work[len(before) :] in ([expected], [expected, "values"])
        assert not changes.is_stale(scene)
    before = work.copy()
    presets.apply("camera", "ARRI D21 daylight")
    assert work[len(before) :] in (["values"], ["values", "values"])
    window()
    assert not changes.is_stale(scene)


@pytest.mark.slow
def test_a_render_takes_in_what_a_window_has_not(scene, work, window):
    scene.underwater.water = "jerlov:II"
    handlers._render_begins(scene)
    assert work == ["values"]
    assert window() == 1
    assert work == ["values"]


def test_unregistering_forgets_what_waits(scene, window):
    scene.underwater.water = "jerlov:II"
    assert live_updates.is_waiting()
    live_updates.cancel()
    assert window() == 0
