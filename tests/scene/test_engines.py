"""EEVEE through the batch: bands and real time give the same picture, and resume."""

from __future__ import annotations

import json

import bpy
import numpy as np
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.jobs import batch
from underwater_spectral.scene.engines import eevee_frames, engines
from underwater_spectral.scene.water import water_body
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr, read_spectral_exr


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def test_bands_and_real_time_agree(tmp_path):
    grey_scene.build_scene(5.0, 36, 27)
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    common = [blend, "--engine", "eevee", "--phase", "hg:0.8", "--bands", 3, "--samples", 4]
    common += ["--floor-depth", 8, "--floor-reflectance", 0.3, "--white-balance", "depth"]
    assert _run(*common, "--mode", "bands", "--out", tmp_path / "bands") == 0
    assert _run(*common, "--mode", "realtime", "--out", tmp_path / "realtime") == 0
    assert not (tmp_path / "realtime" / "0001_spectral.exr").exists()
    bands, realtime = (
        np.maximum(read_exr(tmp_path / mode / "0001.exr")[0], 0.0) for mode in ("bands", "realtime")
    )
    assert np.median(np.abs(realtime - bands) / bands.max()) < 2e-3
    assert np.abs(realtime - bands).mean() < 5e-3 * bands.mean()
    radiance, found, _ = read_spectral_exr(tmp_path / "bands" / "0001_spectral.exr")
    assert len(found) == 3
    assert np.isfinite(radiance).all()
    assert radiance.min() >= 0
    stamp = (tmp_path / "bands" / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns
    again = [*common, "--mode", "bands", "--out", tmp_path / "bands", "--resume"]
    assert _run(*again, "--sensor", "ARRI D21") == 0
    assert (tmp_path / "bands" / "passes" / "0001" / "pass_00.exr").stat().st_mtime_ns == stamp
    record = json.loads((tmp_path / "bands" / "0001.json").read_text())
    assert [p["seconds"] for p in record["passes"]] == [None]


def test_each_frame_is_computed_once(monkeypatch):
    scene, camera = bpy.context.scene, grey_scene.build_scene(5.0, 36, 27)
    plan = render_plan.make_plan(SceneSettings(phase="hg:0.8", bands=3, diffuse_shadows=False))
    asked = []

    def with_waves(scene, plan, water):
        asked.append(scene.frame_current)
        return water

    monkeypatch.setattr(eevee_frames, "with_waves", with_waves)
    extent = water_body.WaterExtent(50.0, 50.0)
    for engine_of in (engines.eevee_bands, engines.eevee_realtime):
        scene.frame_set(1)
        with engine_of(scene, camera, plan, extent, 5.0) as engine:
            engine.frame(plan, 5.0)
            scene.frame_set(2)
            engine.frame(plan, 5.0)
    assert asked == [1, 2, 1, 2]
