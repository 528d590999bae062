"""The compositor develops bands as numpy does."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.jobs import development
from underwater_spectral.tests.scene import snapshot
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.spectral_image import write_rgb_exr


@pytest.mark.parametrize(("count", "per_pass"), [(1, 3), (3, 3), (8, 3), (8, 1), (32, 3)])
def test_compositor_equals_numpy(tmp_path, count, per_pass):
    random = np.random.default_rng(count)
    bands = Bands.uniform(count)
    passes = bands.packed(per_pass)
    radiance = random.lognormal(sigma=3.0, size=(9, 16, count)).astype(np.float32)
    weights = random.normal(size=(3, count))
    paths = []
    for number, indices in enumerate(passes):
        filled = list(indices) + [indices[-1]] * (3 - len(indices))
        paths.append(tmp_path / f"{number}.exr")
        write_rgb_exr(paths[-1], radiance[..., filled])
    before = snapshot.snapshot()
    found = development.develop(paths, weights, passes)
    assert snapshot.differences(before, snapshot.snapshot()) == []
    expected = radiance.astype(np.float64) @ weights.T
    scale = np.abs(radiance.astype(np.float64)) @ np.abs(weights).T
    assert np.max(np.abs(found - expected) / scale) <= 1e-5


def test_development_leaves_nothing_behind_on_failure(tmp_path, monkeypatch):
    def full(*_):
        raise InputError("no room")

    monkeypatch.setattr(development, "write_float_exr", full)
    before = len(bpy.data.scenes), len(bpy.data.images), len(bpy.data.node_groups)
    write_rgb_exr(tmp_path / "0.exr", np.ones((2, 2, 3)))
    for name, message in (("0.exr", "no room"), ("not_there.exr", r"not_there\.exr")):
        with pytest.raises(Exception, match=message):
            development.develop([tmp_path / name], np.ones((3, 3)), [(0, 1, 2)])
    assert before == (len(bpy.data.scenes), len(bpy.data.images), len(bpy.data.node_groups))
