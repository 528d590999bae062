"""The shadow of a slab in the froxel volume, against the integral along every ray."""

from __future__ import annotations

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_background
from underwater_spectral.scene.water import frame_water
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import in_water_cosine, sun_travel_direction
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.closed_form import solve_closed_form
from underwater_spectral.validation.closed_form.light_field import light_field_of
from underwater_spectral.validation.sun_beam import closed_beam

SLAB_HEIGHT = -2.0
LOW, HIGH = np.array([-1.5, 1.0]), np.array([1.5, 12.0])
STEPS = 800
# Froxels keep 6 bits of red and green and 5 of blue, and the software rasteriser cuts the rest in
# each step: with 256 of them 4 to 6 % are lost, with 32 long ones 2 to 4 % are too much.
NEAR = 0.05


def _column(c: float) -> WaterColumn:
    a, b = c * np.array([0.6, 0.4, 0.3]), c * np.array([0.4, 0.6, 0.7])
    return WaterColumn(
        Bands.uniform(3), a, b, np.ones(3), float(in_water_cosine(30.0)),
        sun_travel_direction(30.0, 160.0), np.zeros(3), np.inf, np.zeros(3), "none", 1.34,
    )  # fmt: skip


def _meets_slab(points: np.ndarray, direction: np.ndarray, margin: float = 0.0) -> np.ndarray:
    """Whether a ray from each point along a direction meets the slab."""
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (SLAB_HEIGHT - points[..., 2]) / direction[..., 2]
        there = points + distance[..., None] * direction
        inside = np.all((there > [*(LOW - margin), -9]) & (there < [*(HIGH + margin), 9]), axis=-1)
    return inside & (distance > 0)


def _add_slab(scene: bpy.types.Scene) -> None:
    mesh = bpy.data.meshes.new("Slab")
    corners = [(LOW[0], LOW[1]), (HIGH[0], LOW[1]), (HIGH[0], HIGH[1]), (LOW[0], HIGH[1])]
    mesh.from_pydata([(x, y, SLAB_HEIGHT) for x, y in corners], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("Slab", mesh))


def _black_world(*_: object) -> bpy.types.World:
    world = bpy.data.worlds.new("Black")
    world.probe_resolution = "128"
    world.node_tree.nodes.clear()
    return world


@pytest.mark.slow
@pytest.mark.parametrize("c", [0.15, pytest.param(0.6, marks=pytest.mark.slow)])
def test_shadow_of_a_slab(tmp_path, c, empty_blender, monkeypatch):
    # Nothing but the volume shines.
    monkeypatch.setattr(realtime_background, "build_world", _black_world)
    column = _column(c)
    phase = parse_phase("hg:0.8").for_bands(column.scattering)
    view = probe.View(5.0, turn=90.0, angle=70.0, square=None, size=(64, 34))
    water = frame_water.realtime_water(column, phase, view.depth, np.eye(3), shafts=True)
    seen = []
    for _ in range(2):
        seen.append(probe.render(water, view, tmp_path / "a.exr", samples=4))
        _add_slab(empty_blender)

    optics = solve_closed_form(
        light_field_of(column, phase), phase, view.depth, column.sun_direction
    )
    beam, rays = closed_beam(optics), view.rays()
    w = tuple(rays[..., i, None] for i in range(3))
    end = water.shafts.end
    lit, open_water = np.zeros((2, *rays.shape[:2], 3))
    camera = np.array([0.0, 0.0, -view.depth])
    for s in (np.arange(STEPS) + 0.5) * end / STEPS:
        y = view.depth - w[2] * s
        light = beam.single_scattering_at(y, w, np.full_like(w[2], s)) * (y > 0) * end / STEPS
        shadowed = _meets_slab(camera + s * rays, -np.asarray(column.sun_direction))
        open_water += light
        lit += light * ~shadowed[..., None]
    # Rays that meet the slab or leave the water are another matter.
    free = ~_meets_slab(np.broadcast_to(camera, rays.shape), rays, margin=0.3)
    free &= view.depth - rays[..., 2] * end > 0
    kept, wanted = (seen[1] / seen[0])[free], (lit / open_water)[free]
    assert (wanted.min(axis=1) < 0.8).sum() > 100
    assert np.abs(kept - wanted).mean() <= 0.03
    level = (seen[0] / open_water)[free]
    assert level.mean() == pytest.approx(1.0, abs=NEAR)
