"""The button writes what --bundle writes; workers render files that were saved with live water."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import batch
from underwater_spectral.jobs.manifest_files import read_manifest
from underwater_spectral.quality.methods import METHODS
from underwater_spectral.scene.session import is_live
from underwater_spectral.scene.viewport import live
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
ROOT = Path(__file__).resolve().parents[2]


def _scene(folder: Path) -> bpy.types.Scene:
    scene = bpy.context.scene
    item = scenes._cube("ball", (0.0, 6.0, -5.0))
    item.data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    water, panel = scene.underwater, scene.underwater_panel
    water.phase, water.bands, water.samples, water.sensor = "hg:0.924", 6, 2, "ARRI D21"
    water.surface, water.diffuse_shadows = "none", False  # quick to build
    panel.quality, panel.output = "REFERENCE", str(folder / "out")
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    return scene


def _save(folder: Path) -> str:
    path = str(folder / "reef.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    return path


def _batch(*arguments: object) -> None:
    command = [sys.executable, str(ROOT / "render_bands.py"), *map(str, arguments)]
    subprocess.run(command, check=True)


@pytest.mark.slow
def test_the_button_writes_what_the_option_writes(tmp_path):
    scene = _scene(tmp_path)
    live.add(scene)
    path = _save(tmp_path)
    assert bpy.ops.underwater.farm_bundle(directory=str(tmp_path / "panel")) == {"FINISHED"}
    assert is_live(scene)
    _batch(path, "--out", tmp_path / "out", "--bundle", tmp_path / "option")
    names = sorted(item.name for item in (tmp_path / "panel").iterdir())
    assert len(names) == 6
    for name in names:
        panel, option = ((tmp_path / which / name).read_bytes() for which in ("panel", "option"))
        assert panel == option, name
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_worker_renders_a_file_that_holds_live_water(tmp_path):
    scene = _scene(tmp_path)
    dry = _save(tmp_path)
    _batch(dry, "--out", tmp_path / "dry")
    live.add(scene)
    path = _save(tmp_path)
    manifest = tmp_path / "bundle" / "manifest.json"
    assert bpy.ops.underwater.farm_bundle(directory=str(manifest.parent)) == {"FINISHED"}
    _batch(path, "--from", manifest)
    _batch(path, "--from", manifest, "--develop")
    for name in ("0001.exr", "0001_spectral.exr", "passes/0001/pass_01.exr"):
        pixels = [read_exr(tmp_path / folder / name)[0] for folder in ("dry", "out")]
        assert np.array_equal(*pixels), name


@pytest.mark.parametrize("state", ["unsaved", "changed", "no camera"])
def test_what_a_farm_could_not_render_is_refused(tmp_path, state):
    scene = _scene(tmp_path)
    if state != "unsaved":
        if state == "no camera":
            bpy.data.objects.remove(scene.camera)
        _save(tmp_path)
    if state == "changed":
        bpy.ops.ed.undo_push(message="an edit")
        bpy.ops.object.add()
    message = {"unsaved": "never saved", "changed": "not saved"}
    message |= {"no camera": "no active camera"}
    with pytest.raises(RuntimeError, match=message[state]):
        bpy.ops.underwater.farm_bundle(directory=str(tmp_path / "bundle"))
    assert not (tmp_path / "bundle").exists()


@pytest.mark.parametrize("quality", [name.upper() for name in METHODS])
def test_flamenco_gets_passes_and_options_of_the_panel(tmp_path, quality):
    scene = _scene(tmp_path)
    panel = scene.underwater_panel
    panel.quality, panel.denoise, scene.underwater.bands = quality, quality == "REFERENCE", 7
    panel.animation = False
    path, manifest = _save(tmp_path), tmp_path / "manifest.json"
    count, options = panel.pass_count, panel.job_options.split()
    assert json.dumps(count)  # a plain number, as Flamenco sends it
    arguments = [path, *options, "--out", str(tmp_path), "--plan", str(manifest)]
    assert batch.main(arguments, inside_blender=False) == 0
    planned = read_manifest(manifest)
    assert count == len(planned.passes) > 0
    method = METHODS[quality.lower()]
    assert (planned.output.engine, planned.output.mode) == (method.engine, method.mode)
    assert planned.output.denoise == (quality == "REFERENCE")
