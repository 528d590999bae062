"""Shadows of the light from above, rendered, against the share of its cone that is open."""

from __future__ import annotations

import math

import bpy
import numpy as np
import pytest
from underwater_spectral.scene import realtime, scene_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.tests.scene.columns import grey_column
from underwater_spectral.uw_spectral.water.phase import parse_phase

BELOW_CAMERA, ABOVE_CAMERA = 2.0, 1.0
SQUARE = ((-8.0, -4.0, -BELOW_CAMERA), (16.0, 0.0, 0.0), (0.0, 8.0, 0.0))
VIEW = probe.View(5.0, turn=0.0, angle=120.0, square=SQUARE)


def _water(*, shadows: bool = True) -> realtime.RealtimeWater:
    """Water of diffuse light only, so clear that nothing but it is seen."""
    column = grey_column(
        1e-6, 1e-5, sun_irradiance=0.0, sky_radiance=1.0 / math.pi,
        sun_direction=np.array([0.0, 0.0, -1.0]), sun_cosine=1.0,
    )  # fmt: skip
    phase = parse_phase("hg:0.8").for_bands(column.bands.centres)
    return realtime.realtime_water(
        column, phase, VIEW.depth, np.ones((3, len(column.bands))), diffuse_shadows=shadows
    )


def _roof() -> bpy.types.Object:
    """A wide plane above the camera, over x < 0 only."""
    mesh = bpy.data.meshes.new("roof")
    z = ABOVE_CAMERA - VIEW.depth
    mesh.from_pydata([(-60, -60, z), (0, -60, z), (0, 60, z), (-60, 60, z)], [], [(0, 1, 2, 3)])
    roof = bpy.data.objects.new("roof", mesh)
    bpy.context.scene.collection.objects.link(roof)
    return roof


def _open_share(x: np.ndarray, half_angle: float) -> np.ndarray:
    """Share of the irradiance of a vertical cone that passes the roof's edge."""
    radius = np.sqrt((np.arange(400) + 0.5) / 400) * math.sin(half_angle)
    around = (np.arange(360) + 0.5) * (2.0 * math.pi / 360)
    sine, angle = np.meshgrid(radius, around)  # even over the projected solid angle
    tangent = sine * np.cos(angle) / np.sqrt(1.0 - sine**2)
    return (tangent[..., None] > -x / (ABOVE_CAMERA + BELOW_CAMERA)).mean(axis=(0, 1))


@pytest.mark.slow
def test_a_roof_keeps_the_light_of_the_cone_away(tmp_path):
    water = _water()
    open_water = probe.render(water, VIEW, tmp_path / "open.exr", samples=8)
    plain = _water(shadows=False)
    scene_water.remove(bpy.context.scene)
    roof = _roof()
    unshadowed = probe.render(plain, VIEW, tmp_path / "plain.exr", samples=8)
    scene_water.remove(bpy.context.scene)
    shadowed = probe.render(water, VIEW, tmp_path / "shadowed.exr", samples=32)
    bpy.data.objects.remove(roof)
    # In the open, and without shadows, nothing is kept away.
    assert open_water == pytest.approx(unshadowed, rel=1e-3)
    x = BELOW_CAMERA * VIEW.rays()[0, :, 0] / -VIEW.rays()[0, :, 2]
    inside = np.abs(x) < 6.0
    kept = (shadowed / unshadowed).mean(axis=(0, 2))[inside]
    wanted = _open_share(x[inside], water.cone.half_angle)
    assert kept == pytest.approx(wanted, abs=0.04)
    # The faint lamps' own colours are not seen.
    assert shadowed[:, inside].std(axis=-1).max() < 1e-3 * shadowed.max()


@pytest.mark.slow
def test_without_shadows_no_lamp_is_added(tmp_path):
    probe.render(_water(shadows=False), VIEW, tmp_path / "x.exr")
    assert len(bpy.data.lights) == 1
    scene_water.remove(bpy.context.scene)
    probe.render(_water(), VIEW, tmp_path / "y.exr")
    assert len(bpy.data.lights) == 3
    scene_water.remove(bpy.context.scene)
    assert not bpy.data.lights
