"""An orthographic camera: every pixel has an eye of its own on the camera's plane."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.readers import cameras
from underwater_spectral.scene.water import frame_water
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tests.node_groups.test_realtime_groups import _column
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.pixel_parts import (
    COLOURS,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

WIDTH, DISTANCE, DEPTH = 8.0, 4.0, 6.0
VIEW = probe.View(
    DEPTH, turn=60.0, square=((-8.0, -0.5, -DISTANCE), (16.0, 0.0, 0.0), (0.0, 8.0, 0.0))
)


def test_distance_is_along_the_axis(tmp_path):
    a, b = np.array([0.05, 0.1, 0.3]), np.array([0.2, 0.25, 0.3])
    lobes = parse_phase("hg:0.8").for_bands(b)
    column = _column(3, a, b, surface="flat", floor_depth=np.inf, zenith=20.0)
    scene = bpy.context.scene
    camera = probe.place(VIEW)
    camera.data.type, camera.data.ortho_scale = "ORTHO", WIDTH
    frame = cameras.orthographic_frame(scene, camera)
    assert frame[2] == pytest.approx(WIDTH)
    water = frame_water.realtime_water(column, lobes, DEPTH, np.eye(3))
    seen = probe.render(
        dataclasses.replace(water, inputs=FrameInputs(frame=frame)), VIEW, tmp_path / "a.exr"
    )

    h, width = seen.shape[:2]
    x = frame[0] + (np.arange(width) + 0.5) / width * frame[2]
    up = (frame[1] + (h - 0.5 - np.arange(h)) / h * frame[3])[:, None] + 0.0 * x
    turn = np.array(VIEW.matrix.to_3x3())
    w = [np.full((h, width, 1), part) for part in -turn[:, 2]]
    y_o = DEPTH - (turn[2, 1] * up)[..., None]
    ray = along_rays(water.projected, water.field.sun, w)
    sky = dataclasses.replace(column.skylight, level=1.0)
    wanted = ray.open_water(y_o, w, SurfaceAbove(sky, column.refractive_index)).total
    P, one = np.full(y_o.shape, DISTANCE), np.ones(y_o.shape)
    normal = turn[:, 2]
    facing = max(-float(normal @ column.sun_direction), 0.0)
    surface = SurfaceMaterial(COLOURS, [one * c * facing / math.pi for c in probe.COLOR],
                  [one * c for c in probe.COLOR])  # fmt: skip
    y = np.maximum(y_o - w[2] * P, 0.0)
    normals = [one * part for part in normal]
    leaving = ray.leaving(surface, y, normals, P)
    on_it = ray.surface(y_o, y, w, P, SeenObject(leaving)).total
    inside = up > -0.3
    assert seen[inside] == pytest.approx(on_it[inside], rel=3e-3)
    outside = up < -0.7
    assert outside.sum() > 50
    assert seen[outside] == pytest.approx(wanted[outside], rel=3e-3)
