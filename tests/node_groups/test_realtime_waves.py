"""Caustics and the moving surface: EEVEE against numpy, pixel by pixel."""

from __future__ import annotations

import dataclasses
import math
import warnings

import bpy
import numpy as np
import pytest
from underwater_spectral.node_groups import realtime_waves
from underwater_spectral.scene.readers.moving_surface import ViewFromAir
from underwater_spectral.scene.terms.view_from_air import AirTerm
from underwater_spectral.scene.terms.waves import WaveTerm
from underwater_spectral.scene.water import frame_water
from underwater_spectral.scene.water.frame_water import FrameInputs
from underwater_spectral.tests.node_groups import realtime_probe as probe
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.raised_waves import Swell, surface_ahead
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    seen_from_air,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.wave_patterns import (
    Sea,
    layer_position,
    pattern_at,
    under_waves,
)
from underwater_spectral.uw_spectral.transfer.above_water import leaving_fraction
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.pixel_parts import (
    COLOURS,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from underwater_spectral.uw_spectral.transfer.radiance_field import (
    Ripples,
    surface_normal,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import TABLE_STREAMS
from underwater_spectral.uw_spectral.transfer.sunlit_water import SunlitWater
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

SEA = Sea(5.0, 40.0, seed=3, tile=4.0, resolution=64)
CRITICAL = math.degrees(math.asin(1 / 1.34))
LEVEL = ((3.0, 2.0), (3.0, 0.6))
CALM = dataclasses.replace(SEA, wind_speed=0.0)
UP = probe.View(4.0, turn=180.0, angle=110.0, square=None)
SUN_WIDTH = 0.1  # rad
EDGE = probe.View(4.0, turn=180.0 - CRITICAL, angle=12.0, square=None)
STORM = dataclasses.replace(SEA, wind_speed=25.0)
WEIGHTS = np.eye(3)
PHASE = parse_phase("hg:0.9").for_bands(np.ones(3))


def _column(zenith=30.0, kind="uniform", **changes) -> WaterColumn:
    values = {"a": 0.05 * np.array([4.0, 2.0, 1.0]), "b": np.full(3, 0.1), "sky": 0.1} | changes
    return WaterColumn(
        Bands.uniform(3), values["a"], values["b"], np.ones(3), float(in_water_cosine(zenith)),
        sun_travel_direction(zenith, 160.0), np.full(3, values["sky"]), np.inf, np.zeros(3),
        "waves", 1.34, sky=kind,
    )  # fmt: skip


def _lit(column):
    return SunlitWater(column.solved_field(PHASE, TABLE_STREAMS))


def _water(column, depth, *, sea=SEA, t=1.0, shafts=False, strength=1.0):
    now = sea.at(t, column.sun_direction, column.refractive_index)
    water = frame_water.realtime_water(column, PHASE, depth, WEIGHTS, shafts=shafts)
    contrast = strength * now.contrast(_lit(column))
    return water.with_terms(WaveTerm(now, contrast, strength)), now, contrast


def _tiled(image, x, y, tile):
    """Bilinear look-up of a periodic image whose first sample is at 0."""
    n = len(image)
    u, v = x / tile * n, y / tile * n
    j, i = np.floor(u).astype(int), np.floor(v).astype(int)
    fu, fv = (u - j)[..., None], (v - i)[..., None]
    image = image.reshape(n, n, -1)
    rows = [
        image[(i + k) % n, j % n] * (1 - fu) + image[(i + k) % n, (j + 1) % n] * fu for k in (0, 1)
    ]
    return rows[0] * (1 - fv) + rows[1] * fv


def _pattern(now, column, points, reach=np.inf):
    """Relative sunlight at points, by numpy; looked up no farther than that from the middle."""
    depth = -points[..., 2]
    x, y = under_waves(points[..., 0], points[..., 1], depth, column.sun_direction)
    x, y = (np.clip(at, -reach, reach) for at in (x, y))
    layers = _tiled(now.caustics_image(), x, y, now.layers.tile)
    first, last = now.layers.depths[[0, -1]]
    position = layer_position(depth, math.log(first), 3 / math.log(last / first))
    return pattern_at(depth, position, np.moveaxis(layers, -1, 0))


def _floor(now, contrast, column, view, reach=np.inf):
    """Picture of a level square that fills the view, by numpy."""
    rays = view.rays()
    w = tuple(rays[..., i, None] for i in range(3))
    floor = view.depth - view.square[0][2]
    P = ((view.depth - floor) / rays[..., 2])[..., None]
    points = np.array([0.0, 0.0, -view.depth]) + P * rays
    pattern = np.maximum(_pattern(now, column, points, reach), 1.0 - 1.0 / contrast.max())
    water = frame_water.realtime_water(column, PHASE, view.depth, WEIGHTS)
    water = water.with_terms(WaveTerm(now, contrast, 1.0))
    ray = along_rays(water.projected, water.field.sun, w)
    one = np.ones_like(P)
    lit = [one * c / math.pi * -column.sun_direction[2] for c in probe.COLOR]
    surface = SurfaceMaterial(COLOURS, lit, [one * c for c in probe.COLOR],
                  pattern=pattern[..., None])  # fmt: skip
    y, up = one * floor, (0.0 * one, 0.0 * one, one)
    leaving = ray.leaving(surface, y, up, P)
    return ray.surface(one * view.depth, y, w, P, SeenObject(leaving)).total


def _above(depth, height):
    square = ((-4.0, -4.0, -height), (8.0, 0.0, 0.0), (0.0, 8.0, 0.0))
    angle = 50.0 / max(height, 1.0)  # texels larger than pixels: no filter of theirs
    return probe.View(depth, turn=0.0, angle=angle, square=square)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Everything in one scene, so that EEVEE compiles the nodes once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.eevee.shadow_pool_size = "128"
    path = tmp_path_factory.mktemp("waves") / "a.exr"

    def render(view, column=None, **changes):
        water, now, contrast = _water(column or _column(), view.depth, **changes)
        return probe.render(water, view, path), now, contrast

    found = {f"floor {height:g}": render(_above(*depths)) for depths in LEVEL
             for height in depths[1:]}  # fmt: skip
    found["up"] = render(UP)
    water, now, _ = _water(_column(), UP.depth, sea=CALM)
    sun = {realtime_waves.GLITTER: 1.0, realtime_waves.GLITTER_WIDTH: SUN_WIDTH**2}
    water.numbers.single.update(sun)
    found["sun"] = probe.render(water, UP, path), now
    found["calm floor"] = render(_above(3.0, 2.0), sea=CALM)
    found["calm edge"] = render(EDGE, sea=CALM)
    horizon = _column(89.9)
    shallow = dataclasses.replace(UP, depth=0.01)
    found["storm up"] = render(shallow, horizon, sea=STORM, t=1e6)
    found["storm floor"] = render(_above(100.0, 1.0), horizon, sea=STORM, t=1e6)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("depths", LEVEL)
def test_caustics_on_a_floor(pictures, depths):
    seen, now, contrast = pictures[f"floor {depths[1]:g}"]
    wanted = _floor(now, contrast, _column(), _above(*depths))
    error = (seen - wanted) / wanted
    same = np.corrcoef(seen[..., 1].ravel(), wanted[..., 1].ravel())[0, 1]
    spread = wanted[..., 1].std() / wanted[..., 1].mean()
    rmse = np.sqrt((error**2).mean())
    print(f"\n{depths[1]} m above: correlation {same:.5f}, RMSE {rmse:.4f}, CV {spread:.3f}")  # noqa: T201
    assert same > 0.998
    assert rmse < 0.02
    assert spread > 0.1


@pytest.mark.slow
def test_places_are_looked_up_no_farther_than_that_from_the_eye(
    tmp_path, empty_blender, monkeypatch
):
    """Beside edges of objects they jump for miles, and a processor's filter takes every texel."""
    monkeypatch.setattr(realtime_waves, "_FARTHEST", 0.2)
    monkeypatch.setattr(realtime_waves, "_FARTHEST_PER_HEIGHT", 0.2)
    empty_blender.eevee.shadow_pool_size = "128"
    water, now, contrast = _water(_column(), 3.0)
    seen = probe.render(water, _above(3.0, 2.0), tmp_path / "a.exr")
    error = {}
    for reach in (0.8, np.inf):
        wanted = _floor(now, contrast, _column(), _above(3.0, 2.0), reach)
        error[reach] = np.sqrt((((seen - wanted) / wanted) ** 2).mean())
    assert error[0.8] < 0.02 < 0.05 < error[np.inf]


def test_without_wind_the_light_is_even(pictures):
    seen, now, contrast = pictures["calm floor"]
    assert np.all(now.caustics_image() == 1.0)
    wanted = _floor(now, contrast, _column(), _above(3.0, 2.0))
    assert seen == pytest.approx(wanted, rel=4e-3)


def _up(now, column, view, width2=None):
    """Picture of the surface from below, and the angle to the sun in degrees, by numpy."""
    rays = view.rays()
    reach = view.depth / np.maximum(rays[..., 2], 1e-3)
    slope = _tiled(now.slopes_image(), reach * rays[..., 0], reach * rays[..., 1], SEA.tile)
    slopes, n = (slope[..., :1], slope[..., 1:2]), column.refractive_index
    width2 = now.glitter_width(n) if width2 is None else width2
    ripples = Ripples(slopes, width2, sun=column.skylight.sun)
    sun = np.degrees(np.arccos(np.clip(rays @ -np.asarray(column.sun_direction), -1, 1)))
    return _open_water(column, view, ripples), sun


def _open_water(column, view, ripples=None, *, sky=1.0, depth=None):
    """Picture of open water under a surface, by numpy."""
    w = tuple(view.rays()[..., i, None] for i in range(3))
    water = frame_water.realtime_water(column, PHASE, view.depth, WEIGHTS)
    depth = np.full(w[0].shape, view.depth) if depth is None else depth
    above = dataclasses.replace(column.skylight, level=sky)
    ray = along_rays(water.projected, water.field.sun, w)
    surface = SurfaceAbove(above, column.refractive_index, ripples)
    return ray.open_water(depth, w, surface).total


def test_surface_from_below(pictures):
    seen, now, _ = pictures["up"]
    wanted, sun = _up(now, _column(), UP)
    # Glints are finer than a pixel, whose texture is filtered: see the next test.
    seen, wanted = seen[sun > 35.0], wanted[sun > 35.0]
    error = np.abs(seen - wanted) / wanted
    shown = [np.median(error), np.quantile(error, 0.9), seen.mean() / wanted.mean() - 1]
    print(f"\nfrom below: median, 90 %, mean: {np.round(shown, 4)}")  # noqa: T201
    assert np.median(error) < 0.01
    assert seen.mean() == pytest.approx(wanted.mean(), rel=0.03)


def test_clear_sky_from_below(tmp_path, empty_blender):
    """Each wave shows the part of the sky that it refracts into the view."""
    column = _column(60.0, "clear", sky=1.0)
    near = dataclasses.replace(UP, depth=0.3)  # where a pixel is finer than the image of slopes
    water, now, _ = _water(column, near.depth)
    seen = probe.render(water, near, tmp_path / "a.exr")
    wanted, sun = _up(now, column, near)
    even, _ = _up(now, dataclasses.replace(column, sky="uniform"), near)
    seen, wanted, even = (picture[sun > 35.0] for picture in (seen, wanted, even))
    error = np.abs(seen - wanted) / wanted
    assert np.median(error) < 5e-3
    assert seen.mean() == pytest.approx(wanted.mean(), rel=0.01)
    assert np.median(np.abs(even - wanted) / wanted) > 0.2


def test_surface_with_heights_from_below(tmp_path, empty_blender):
    """Rays end where numpy's meet the raised surface, not on the mean level."""
    sea = dataclasses.replace(SEA, raised=True, swell=Swell(0.6, 8.0, 60.0))
    column, view = _column(60.0, "clear", sky=1.0), dataclasses.replace(UP, depth=0.5, turn=150.0)
    water, now, _ = _water(column, view.depth, sea=sea)
    seen, rays, n = probe.render(water, view, tmp_path / "a.exr"), view.rays(), 1.34
    raised = now.raised
    start, w = (0.0, 0.0, -view.depth), tuple(np.moveaxis(rays, -1, 0))
    found, away = surface_ahead(start, w, raised.elevation, raised.highest, -1.0)
    sun = np.degrees(np.arccos(np.clip(rays @ -np.asarray(column.sun_direction), -1, 1)))
    judged = (found > 0) & (w[2] > 0.2) & (sun > 35.0)

    def picture(reach):
        x, y = reach * w[0], reach * w[1]
        slopes = [
            sum(
                part.at(x, y, getattr(part, f"slope_{axis}"))[0]
                for part in (raised.near, raised.far)
            )
            for axis in "xy"
        ]
        ripples = Ripples(
            tuple(slope[..., None] for slope in slopes),
            now.glitter_width(n),
            sun=column.skylight.sun,
        )
        return _open_water(column, view, ripples, depth=(reach * w[2])[..., None])[judged]

    wanted, level = picture(away), picture(view.depth / np.maximum(w[2], 1e-3))
    error = np.abs(seen[judged] - wanted) / wanted
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.9) < 0.2  # waves finer than a pixel
    assert np.median(np.abs(level - wanted) / wanted) > 0.1


@pytest.mark.slow
def test_surface_with_heights_from_above(tmp_path, empty_blender):
    """The sky that its crests mirror, and what comes through, where numpy's rays meet it."""
    sea = dataclasses.replace(SEA, raised=True, swell=Swell(0.6, 8.0, 60.0))
    column, n = _column(60.0, sky=1.0), 1.34
    view = dataclasses.replace(UP, depth=-1.0, turn=50.0, angle=25.0)
    water, now, contrast = _water(column, 0.0, sea=sea)
    above = AirTerm(ViewFromAir((0.0, 0.0, 1.0), True, (0.0, 0.9, -0.4)))
    seen_by = FrameInputs(terms=(above,))
    water = frame_water.realtime_water(column, PHASE, 0.0, WEIGHTS, inputs=seen_by)
    water = water.with_terms(WaveTerm(now, contrast, 1.0))
    water.numbers.single.update({realtime_waves.GLITTER: 0.0})
    seen, rays, raised = probe.render(water, view, tmp_path / "a.exr"), view.rays(), now.raised
    v = tuple(np.moveaxis(rays, -1, 0))
    found, away = surface_ahead((0.0, 0.0, 1.0), v, raised.elevation, raised.highest, 1.0, 0.1)
    judged = (found > 0) & (v[2] < -0.15)
    assert judged.mean() > 0.4

    def picture(reach):
        place = reach * v[0], reach * v[1]
        slopes = [
            sum(part.at(*place, part.slope_x if axis == "x" else part.slope_y)[0]
                for part in (raised.near, raised.far))
            for axis in "xy"
        ]  # fmt: skip
        R, bent, _ = seen_from_air(v, surface_normal(*slopes), n)
        bent = tuple(part[..., None] for part in bent)
        ray = along_rays(water.projected, water.field.sun, bent)
        below = ray.open_water(0.0 * bent[2], bent, SurfaceAbove(column.skylight, None)).total
        R = R[..., None]
        return (leaving_fraction(R, n) * below + R * column.skylight.level)[judged]

    wanted, level = picture(away), picture(-1.0 / np.minimum(v[2], -1e-3))
    error = np.abs(seen[judged] - wanted) / wanted
    assert np.median(error) < 0.02
    assert np.median(np.abs(level - wanted) / wanted) > 0.1


def test_image_of_the_sun(pictures):
    seen, now = pictures["sun"]
    wanted, _ = _up(now, _column(), UP, SUN_WIDTH**2)
    assert wanted.max() > 20 * np.median(wanted)
    assert seen == pytest.approx(wanted, rel=0.02)


def test_snells_window(pictures):
    column, seen = _column(), pictures["calm edge"][0]
    wanted = _open_water(column, EDGE)
    assert seen == pytest.approx(wanted, rel=0.01)
    # Outside it there is no sky.
    mirrored = _open_water(column, EDGE, sky=0.0)
    rays = EDGE.rays()
    inside = (np.abs(seen - mirrored) / mirrored).max(axis=-1) > 0.02
    angle = 2 * np.degrees(np.arccos(rays[inside][:, 2].min()))
    print(f"\nSnell's window: {angle:.2f} degrees, closed form {2 * CRITICAL:.2f}")  # noqa: T201
    assert 96.0 < angle < 97.0


@pytest.mark.parametrize("kind", ["up", "floor"])
def test_extremes_are_finite(pictures, kind):
    seen = pictures[f"storm {kind}"][0]
    assert np.isfinite(seen).all()
    assert seen.min() >= 0
    assert seen.max() < 1e3
