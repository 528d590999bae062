"""Pictures are shown through Blender's view as the curves say, and the view comes back."""

from __future__ import annotations

import json
from types import SimpleNamespace

import bpy
import numpy as np
import OpenImageIO as oiio
import pytest
from underwater_spectral.jobs import command_line, render_job
from underwater_spectral.scene import stored_settings, view_transform
from underwater_spectral.scene.viewport import live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra import tone
from underwater_spectral.uw_spectral.spectra.colour_rendering import srgb_encode

RAMP = np.linspace(0.0, 3.0, 512, dtype=np.float32)


@pytest.fixture(autouse=True)
def _registered(registered):
    return registered


def _written(path, curve, contrast="medium"):
    rgb = np.broadcast_to(RAMP[None, :, None], (2, len(RAMP), 3))
    view_transform.write_shown(path, rgb, curve, contrast)
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[0, :, 0] * 255


def _at(codes, value):
    return float(np.interp(value, RAMP, codes))


@pytest.mark.parametrize("name", tone.CAMERA_CURVES)
def test_camera_curves_are_shown_within_a_code_or_two(name, tmp_path):
    expected = srgb_encode(tone.camera_curve(name)(RAMP)) * 255
    assert np.abs(_written(tmp_path / "a.png", name) - expected).max() < 1.6


def test_standard_is_plain_and_others_are_not(tmp_path):
    plain = _written(tmp_path / "a.png", "standard")
    assert np.abs(plain - srgb_encode(RAMP) * 255).max() < 0.6
    agx = _written(tmp_path / "b.png", "agx")
    # AgX keeps grey, and rolls off what standard clips.
    assert _at(agx, 0.18) == pytest.approx(_at(plain, 0.18), abs=2)
    assert _at(agx, 1.0) < 205 < _at(agx, 2.9) < 240


@pytest.mark.parametrize("curve", tone.TONES)
def test_contrast_turns_about_grey(curve, tmp_path):
    codes = {c: _written(tmp_path / "a.png", curve, c) for c in ("very-low", "medium", "very-high")}
    for value, sign in ((0.03, -1), (0.6, 1)):
        at = [sign * _at(codes[c], value) for c in codes]
        assert at == sorted(at), value
        assert at[2] - at[0] > 25
    greys = [_at(c, 0.18) for c in codes.values()]
    assert max(greys) - min(greys) < 8


def test_every_tone_and_contrast_is_a_view_of_blender():
    view = bpy.context.scene.view_settings
    for name in tone.TONES:
        for contrast in tone.CONTRASTS:
            view_transform.show(view, name, contrast)
            assert view.use_curve_mapping == (name in tone.CAMERA_CURVES)
            assert (view.look == "None") == (contrast == "medium")


def _state(view):
    points = [(tuple(p.location), p.handle_type) for p in view.curve_mapping.curves[3].points]
    levels = tuple(view.curve_mapping.black_level), tuple(view.curve_mapping.white_level)
    values = view.view_transform, view.look, view.exposure, view.gamma, view.use_curve_mapping
    return values, points, levels


@pytest.mark.slow
def test_the_users_view_comes_back_even_with_a_curve_of_its_own():
    scene = bpy.context.scene
    scenes._cube("ball", (0.0, 6.0, -5.0))
    scenes.add_camera()
    bpy.context.view_layer.update()
    view = scene.view_settings
    view.view_transform, view.look = "AgX", "AgX - Punchy"
    view.exposure, view.gamma, view.use_curve_mapping = 0.5, 1.25, True
    curve = view.curve_mapping.curves[3]
    curve.points.new(0.3, 0.6)
    curve.points[1].handle_type = "VECTOR"
    view.curve_mapping.white_level = (2.0, 2.0, 2.0)
    view.curve_mapping.update()
    before = _state(view)
    scene.underwater.tone = "nikon-d7000"
    live.add(scene)
    assert (view.view_transform, view.use_curve_mapping) == ("Standard", True)
    scene.underwater.tone, scene.underwater.contrast = "agx", "high"
    assert (view.view_transform, view.look) == ("AgX", "AgX - High Contrast")
    assert (view.use_curve_mapping, view.exposure) == (False, 0.0)
    live.remove(scene)
    assert _state(view) == before


def test_how_a_picture_is_shown_changes_no_pass_and_stands_in_the_record(tmp_path):
    scene = bpy.context.scene
    scenes._cube("ball", (0.0, 6.0, -5.0))
    scenes.add_camera()
    scene.render.resolution_x, scene.render.resolution_y = 8, 8
    scene.underwater.phase, scene.underwater.samples = "hg:0.9", 1
    scene.underwater.bands = 3

    def rendered(*arguments):
        chosen = command_line.parse([*arguments, "--out", str(tmp_path), "--resume"])
        stored = command_line.merge(stored_settings.stored_settings(scene), chosen)
        for _ in render_job.render(scene, lambda: stored, command_line.job(chosen), print):
            pass
        record = json.loads((tmp_path / "0001.json").read_text())
        files = SimpleNamespace(
            exr=oiio.ImageBuf(str(tmp_path / "0001.exr")).get_pixels(oiio.FLOAT),
            png=oiio.ImageBuf(str(tmp_path / "0001.png")).get_pixels(oiio.FLOAT),
            times={p.name: p.stat().st_mtime_ns for p in (tmp_path / "passes").rglob("*.exr")},
        )
        return record["development"], files

    first, plain = rendered()
    assert (first["tone"], first["contrast"]) == ("standard", "medium")
    second, shown = rendered("--tone", "agx", "--contrast", "high")
    assert (second["tone"], second["contrast"]) == ("agx", "high")
    assert second["weights"] == first["weights"]
    np.testing.assert_array_equal(plain.exr, shown.exr)
    assert np.abs(plain.png - shown.png).max() > 0.02
    assert plain.times == shown.times
