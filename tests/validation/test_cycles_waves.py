"""Caustics and the surface from below in the Cycles reference, against numpy."""

from __future__ import annotations

import dataclasses
import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.engines import cycles_settings, exr_output
from underwater_spectral.scene.readers import moving_surface
from underwater_spectral.scene.water import (
    cycles_surface,
    cycles_water,
    pass_values,
    scene_water,
    water_body,
)
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.tests.scene import columns
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr
from underwater_spectral.uw_spectral.surface.caustics import caustic_pattern
from underwater_spectral.uw_spectral.surface.wave_patterns import under_waves
from underwater_spectral.uw_spectral.transfer.water_column import WAVES

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
WIDTH, HEIGHT, CAMERA = 48, 27, 0.5


def _plan(floor, **changes):
    """Nearly pure water, so that only the pattern makes the floor uneven."""
    values = {"wave_tile": 4.0, "wave_resolution": 64, "wave_seed": 3, "sun_azimuth": 160.0}
    settings = SceneSettings(surface="waves", bands=3, phase="hg:0.9", floor_depth=floor,
                             **(values | changes))  # fmt: skip
    plan = make_plan(settings)
    column = columns.grey_column(
        0.01, 1e-6, surface="waves", refractive_index=1.34, floor_depth=floor,
        floor_reflectance=0.05, sun_cosine=plan.column.sun_cosine,
        sun_direction=plan.column.sun_direction,
    )  # fmt: skip
    return dataclasses.replace(plan, column=column)


def _camera(scene):
    camera = bpy.data.objects.new("meter", bpy.data.cameras.new("meter"))
    camera.location, camera.data.angle = (0.0, 0.0, -CAMERA), math.radians(50)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    return camera


def _renders(scene, camera, plan, frames, path, samples=64):
    column = plan.column
    extent = water_body.WaterExtent(60.0, column.floor_depth + 1)
    cycles_water.add_water(
        scene, column, columns.layers_of(column, columns.henyey_greenstein(0.9)), extent
    )
    values = pass_values.PassValues.of_column(
        column, columns.layers_of(column, columns.henyey_greenstein(0.9))
    )
    options = {"samples": samples, "seed": 0}
    with cycles_settings.reference_settings(scene, camera, **options) as layer:
        scene.cycles.pixel_filter_type = "BOX"
        for frame in frames:
            scene.frame_set(frame)
            if plan.column.surface == WAVES:
                cycles_surface.move(scene, plan)
            values.apply(layer, (0, 1, 2))
            values.refresh(scene)
            exr_output.write_float_exr(scene, path)
            yield read_exr(path)[0].astype(np.float64)
    scene_water.remove(scene)


def _expected(plan, time):
    """Pattern of exactly the floor's depth, on the floor that the camera sees."""
    column, depth, sea = plan.column, plan.column.floor_depth, moving_surface.sea_of(plan.settings)
    pattern = caustic_pattern(sea.components(), column.sun_direction, depth, time, 256)
    step = 2 * math.tan(math.radians(25)) / WIDTH * (depth - CAMERA) / 4
    x = (np.arange(4 * WIDTH) + 0.5 - 2 * WIDTH) * step
    y = (2 * HEIGHT - np.arange(4 * HEIGHT) - 0.5) * step
    x, y = under_waves(*np.meshgrid(x, y), depth, column.sun_direction)
    cell = sea.tile / len(pattern)
    fine = pattern[np.round(y / cell).astype(int) % 256, np.round(x / cell).astype(int) % 256]
    return fine.reshape(HEIGHT, 4, WIDTH, 4).mean(axis=(1, 3))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("floor", [4.0, 9.0])
def test_caustics_follow_depth_and_time(empty_blender, tmp_path, floor):
    scene, plan = empty_blender, _plan(floor)
    camera = _camera(scene)
    for frame, seen in zip(
        (24, 48), _renders(scene, camera, plan, (24, 48), tmp_path / "a.exr"), strict=True
    ):
        wanted = _expected(plan, frame / scene.render.fps)
        seen, wanted = seen[..., 1] / seen[..., 1].mean(), wanted / wanted.mean()
        same = np.corrcoef(seen.ravel(), wanted.ravel())[0, 1]
        rmse = np.sqrt(((seen - wanted) ** 2).mean())
        shown = f"{floor:g} m, frame {frame}: {same:.4f}, {rmse:.3f}, CV {wanted.std():.3f}"
        print(f"\n{shown}, {seen.std():.3f}")  # noqa: T201
        assert same > 0.95
        assert rmse < 0.35 * wanted.std()
    assert "UW Caustics" not in bpy.data.images


def test_calm_waves_are_the_flat_surface(empty_blender, tmp_path):
    plan = _plan(4.0, wind_speed=0.0)
    camera = _camera(empty_blender)
    (seen,) = _renders(empty_blender, camera, plan, (1,), tmp_path / "a.exr", 16)
    flat = dataclasses.replace(
        plan,
        column=dataclasses.replace(plan.column, surface="flat"),
        settings=dataclasses.replace(plan.settings, surface="flat"),
    )
    (wanted,) = _renders(empty_blender, camera, flat, (1,), tmp_path / "b.exr", 16)
    assert seen == pytest.approx(wanted, rel=1e-3)
