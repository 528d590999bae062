"""A slab's shadow in the water, drawn by the froxels, against the integral."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import realtime
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.bands import Bands
from underwater_spectral.uw_spectral.path_radiance import solve_path_radiance
from underwater_spectral.uw_spectral.phase import parse_phase
from underwater_spectral.uw_spectral.water_column import WaterColumn

DEPTH, SLAB_DEPTH, GAIN = 5.0, 0.5, 100.0
# Corners of the slab: x across, y ahead.
LEFT, RIGHT, NEAR, FAR = -1.5, 1.5, 3.0, 60.0


def _slab() -> None:
    mesh = bpy.data.meshes.new("Slab")
    corners = ((LEFT, NEAR), (RIGHT, NEAR), (RIGHT, FAR), (LEFT, FAR))
    mesh.from_pydata([(x, y, -SLAB_DEPTH) for x, y in corners], [], [(0, 1, 2, 3)])
    mesh.materials.append(bpy.data.materials.new("Slab"))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Slab", mesh))


@pytest.mark.slow
def test_shadow_of_a_slab(tmp_path):
    a, b = np.array([0.05, 0.075, 0.15]), np.full(3, 0.1)
    down = np.array([0.0, 0.0, -1.0])
    column = WaterColumn(
        Bands.uniform(3), a, b, 1.0, 1.0, down, 0.0, math.inf, 0.0, "none", 1.0
    )  # fmt: skip
    phase = parse_phase("hg:0.8").for_bands(b)
    view = probe.View(DEPTH, 90.0, 60.0, square=None)
    weights = GAIN * np.eye(3)
    water = realtime.realtime_water(column, phase, DEPTH, weights, shafts=True)
    unshadowed = probe.expected(column, phase, view, weights)[0]
    _slab()
    seen = probe.render(water, view, tmp_path / "a.exr", samples=8)

    rays = view.rays()
    v, step = np.linspace(0.0, water.shafts.end, 8001, retstep=True)
    x, ahead, up = (rays[..., i, None] * v for i in range(3))
    depth = DEPTH - up
    dark = (x > LEFT) & (x < RIGHT) & (ahead > NEAR) & (ahead < FAR) & (depth > SLAB_DEPTH)
    closed = solve_path_radiance(column.light_field(phase), phase, DEPTH, column.sun_direction)
    w = tuple(rays[..., i, None, None] for i in range(3))
    light = closed.single_scattering_at(np.maximum(depth, 0.0)[..., None], w, v[:, None])
    lost = GAIN * step * np.einsum("ijv,ijvn->ijn", dark & (depth > 0), light)

    with np.errstate(divide="ignore", invalid="ignore"):
        to_slab = np.where(rays[..., 2] > 0, (DEPTH - SLAB_DEPTH) / rays[..., 2], np.nan)
    hidden = (np.abs(rays[..., 0] * to_slab) < RIGHT + 0.3) & (rays[..., 1] * to_slab > NEAR - 0.5)
    shadow = ~hidden & (lost[..., 0] > 0.02 * unshadowed[..., 0])
    assert shadow.sum() > 50
    error = np.abs(seen - (unshadowed - lost)) / (unshadowed - lost)
    assert error[shadow].mean() <= 0.03
