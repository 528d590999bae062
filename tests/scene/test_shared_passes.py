"""Bands that share a pass of Cycles."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.benchmarks import grey_scene
from underwater_spectral.scene.engines import engines
from underwater_spectral.scene.water import water_body
from underwater_spectral.scene.water.cycles_phase import cycles_phases
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
DEPTH = 2.0


def _plan(water, **changes):
    common = {"bands": 3, "floor_depth": 6.0, "samples": 4, "range_start": 460.0}
    return make_plan(SceneSettings(water=f"jerlov:{water}", **(common | changes)))


def test_passes_are_shared_where_that_is_wanted():
    assert _plan("3C").passes == [(0, 1, 2)]
    assert _plan("IA").passes == [(0,), (1,), (2,)]
    assert _plan("3C", share_passes=False).passes == [(0,), (1,), (2,)]
    assert _plan("IA", phase="hg:0.8", share_passes=False).passes == [(0, 1, 2)]
    plan = _plan("3C")
    for values in (*cycles_phases(plan)[0].fractions, *cycles_phases(plan)[0].shapes):
        assert not np.ptp(values, axis=-1).any()


def test_a_pass_of_a_later_frame_is_split_where_its_water_differs(tmp_path):
    """The passes of a job are those of its first frame; the water may be animated."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(DEPTH, 16, 9)
    scene, turbid, clear = bpy.context.scene, _plan("3C"), _plan("IA")
    extent = water_body.water_extent(scene, clear.column, DEPTH)
    with engines.cycles_bands(scene, camera, turbid, extent, seed=1) as engine:
        (shared,) = engine.passes
        for plan in (turbid, clear):
            render = engine.frame(plan, DEPTH)
            render(shared, tmp_path / "shared.exr")
            found = read_exr(tmp_path / "shared.exr")[0]
            assert found.shape[-1] == 3
            for band in shared if plan is clear else ():
                render((band,), tmp_path / "alone.exr")
                alone = read_exr(tmp_path / "alone.exr")[0]
                np.testing.assert_array_equal(found[..., band], alone[..., 0])


@pytest.mark.slow
def test_shared_passes_are_as_bright_as_single_ones():
    """Means of a picture by band, within noise."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = grey_scene.build_scene(DEPTH, 36, 27)
    means = []
    for fraction in (True, False):
        images = [
            grey_scene.cycles_image(_plan("3C", share_passes=fraction), camera, 256, seed)
            for seed in (1, 2)
        ]
        mean = np.mean(images, axis=(0, 1, 2))
        variance = ((images[0] - images[1]) ** 2).mean(axis=(0, 1)) / 4.0 / images[0][..., 0].size
        means.append((mean, np.sqrt(variance)))
    (one, noise), (other, own_noise) = means
    allowed = 3.0 * np.hypot(noise, own_noise)
    assert np.all(np.abs(one - other) < allowed + 0.005 * other)
    assert np.all(allowed < 0.1 * other)
