"""A camera in a closed room, or before one, is named for EEVEE; in caves and the open it is not."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import marks
from underwater_spectral.scene.readers import enclosed_places, surroundings
from underwater_spectral.scene.viewport import live
from underwater_spectral.scene.water import occlusion
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import scenes


@pytest.fixture(autouse=True)
def _fine(registered, monkeypatch):
    monkeypatch.setattr(surroundings, "PROBES", 2000)
    monkeypatch.setattr(surroundings, "_COARSE", 60_000)
    return registered


def _box(low, high):
    middle = np.add(low, high) / 2.0
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=middle)
    bpy.context.object.scale = np.subtract(high, low)


def _hut(opening=0.7, thick=0.2):
    """A room of 4 × 3 × 2.8 m on sand at 9 m, with a window, and a hole in its roof."""
    t, hole = thick, opening / 2.0
    for x in (-t, 4.0):
        _box((x, 0.0, -9.0), (x + t, 3.0, -6.2))
    _box((-t, 3.0, -9.0), (4.0 + t, 3.0 + t, -6.2))
    left, sill = 2.0 - hole, -8.0
    _box((-t, -t, -9.0), (left, 0.0, -6.2))
    _box((left + opening, -t, -9.0), (4.0 + t, 0.0, -6.2))
    _box((left, -t, -9.0), (left + opening, 0.0, sill))
    if sill + opening < -6.2:
        _box((left, -t, sill + opening), (left + opening, 0.0, -6.2))
    _box((-t, -t, -6.2), (2.0 - hole, 3.0 + t, -6.0))
    _box((2.0 + hole, -t, -6.2), (4.0 + t, 3.0 + t, -6.0))
    _box((2.0 - hole, -t, -6.2), (2.0 + hole, 1.0, -6.0))
    _box((2.0 - hole, 1.0 + 2.0 * hole, -6.2), (2.0 + hole, 3.0 + t, -6.0))


def _cave():
    """A vault of 9 × 12 × 4 m that one enters through a mouth as wide and high."""
    for x in (-6.5, 4.5):
        _box((x, 0.0, -9.0), (x + 2.0, 12.0, -5.0))
    _box((-6.5, 12.0, -9.0), (6.5, 14.0, -5.0))
    _box((-6.5, 0.0, -5.0), (6.5, 14.0, -3.0))


def _arch():
    for x in (-4.0, 2.0):
        _box((x, 0.0, -9.0), (x + 2.0, 3.0, -5.5))
    _box((-4.0, 0.0, -5.5), (4.0, 3.0, -4.5))


def _reef():
    for x in range(-6, 7, 3):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=(x, 0.1 * x * x, -8.6))


def _said(build, at, turn=(1.5, 0.0, 0.0)):
    build()
    bpy.ops.mesh.primitive_plane_add(size=200.0, location=(0.0, 0.0, -9.0))
    camera, scene = scenes.add_camera(at, turn), bpy.context.scene
    bpy.context.view_layer.update()
    plan = make_plan(SceneSettings(bands=3, phase="hg:0.9"))
    around = surroundings.look_around(scene, camera, float(plan.column.attenuation.min()))
    weights = plan.reduction(-at[2]).weights
    table = occlusion.table_of(around, plan.bands, plan.solved_field(), weights, -at[2])
    return enclosed_places.notes(scene, camera, table, around)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("opening", "thick"), [(1.0, 0.05), (0.0, 0.2)])
def test_a_camera_in_a_house_is_named(opening, thick):
    (note,) = _said(lambda: _hut(opening, thick), (1.0, 0.6, -7.6))
    assert note.startswith("camera 'Camera' is in a closed room")
    assert "--engine cycles" in note


def test_a_camera_before_a_window_is_named():
    (note,) = _said(lambda: _hut(0.7), (2.0, -0.4, -7.6))
    assert note.startswith("camera 'Camera' sees into a closed room")


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("build", "at"),
    [
        (_cave, (0.0, 2.0, -7.5)),
        (_arch, (0.0, 0.5, -7.5)),
        (_reef, (0.0, -6.0, -7.5)),
        (_hut, (2.0, -7.0, -6.5)),
        (lambda: None, (0.0, 0.0, -7.5)),
    ],
    ids=["cave", "arch", "reef", "outside a house", "open"],
)
def test_wide_places_are_not(build, at):
    assert _said(build, at) == []


@pytest.mark.slow
def test_live_water_says_it_too():
    _hut()
    bpy.ops.mesh.primitive_plane_add(size=200.0, location=(0.0, 0.0, -9.0))
    scenes.add_camera((1.0, 0.6, -7.6), (1.5, 0.0, 0.0))
    assert any("closed room" in note for note in live.add(bpy.context.scene))
    sun = marks.suns(bpy.context.scene)[0].data
    assert sun.shadow_filter_radius == 0.0, "a filter lets the sun in where walls meet"
    bpy.context.scene.camera.location.y = -5.0
    bpy.context.view_layer.update()
    live.update(bpy.context.scene)
    sun = marks.suns(bpy.context.scene)[0].data
    assert sun.shadow_filter_radius == 1.0
