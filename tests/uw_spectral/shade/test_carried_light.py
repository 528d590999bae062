"""Light that things beside a thing send, in the place of what they block."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.shade.carried_light import carried_light
from underwater_spectral.uw_spectral.shade.forward_share import spread
from underwater_spectral.uw_spectral.shade.shade_table import without_shade
from underwater_spectral.uw_spectral.shade.view_cover import Surface, view_cover
from underwater_spectral.uw_spectral.shade.view_map import SIZE, view_map
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.transfer.folded_light import Shades, fold
from underwater_spectral.uw_spectral.transfer.radiance_table import SHADED_STREAMS, tabulate

DEPTH, AWAY = 5.0, 4.0
TOWARDS = np.array([0.0, -1.0, 0.0])


@pytest.fixture(scope="module")
def water():
    chosen = SceneSettings(
        water="jerlov:IB", bands=8, surface="flat", sky="clear", sun_zenith=50.0, sun_azimuth=0.0
    )
    plan = render_plan.make_plan(chosen)
    field, shade = plan.solved_field(24), without_shade(8)
    straight = plan.column.solved_field(plan.phase, SHADED_STREAMS)
    folded = fold(
        field, channels_of_bands(plan.bands, (1, 3, 5)), DEPTH, plan.column.skylight.level,
        (), Shades(shade.spectrum, shade.usual, straight),
    )  # fmt: skip
    return plan, field, folded, shade


def _axes() -> np.ndarray:
    back = TOWARDS
    right, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return np.stack([right, up, back], axis=1)


def _wall(left: float, right: float, colour: float) -> Surface:
    """Part of a wall across the view."""
    y, low, high = AWAY, -DEPTH - 30.0, -DEPTH + 30.0
    a, b = np.array([left, y, low]), np.array([right, y, low])
    c, d = np.array([right, y, high]), np.array([left, y, high])
    return Surface(np.array([[a, b, c], [a, c, d]]), np.full((2, 3), colour))


def _cover(*walls: Surface):
    view = view_map((0.0, 0.0, -DEPTH), _axes(), math.radians(60.0))
    return view_cover(view, walls)


def test_a_wall_of_one_colour_brings_what_it_is_itself(water):
    _, field, folded, shade = water
    found = carried_light(_cover(_wall(-50.0, 50.0, 0.5)), folded, field.sun, shade)
    middle = slice(SIZE // 2 - 8, SIZE // 2 + 8)
    dark = carried_light(
        _cover(_wall(-50.0, 0.0, 0.0), _wall(0.0, 50.0, 0.5)), folded, field.sun, shade
    )
    contrast = np.abs(dark.beside).max()
    assert np.abs(found.beside[:, middle, middle]).max() < 0.1 * contrast
    assert found.blocked[:, middle, middle].min() > 0.8


def test_at_an_edge_both_sides_bring_what_the_other_sends(water):
    plan, field, folded, shade = water
    cover = _cover(_wall(-50.0, 0.0, 0.0), _wall(0.0, 50.0, 0.5))
    beside = carried_light(cover, folded, field.sun, shade).beside
    row, edge = SIZE // 2, SIZE // 2
    on_dark, on_bright = beside[:, row, edge - 1], beside[:, row, edge]
    # By the bands themselves: what the grey sends that faces the camera.
    depth, facing = np.array([DEPTH]), max(-float(TOWARDS @ np.asarray(field.sun)), 0.0)
    E = np.ravel(tabulate(field).patch_irradiance(depth, TOWARDS[:, None], field.sun))
    E += facing * np.ravel(field.light.E / field.light.mu_s * field.beam(depth).T)
    L = (0.5 * uplift_basis(plan.bands).sum(axis=1) * E / math.pi)[[1, 3, 5]]
    halves = np.zeros((2, SIZE, SIZE))
    halves[0, :, edge:], halves[1] = 1.0, 1.0
    share, all_of_it = np.sum(
        [
            part * spread(halves, phase, cover.view)[:, row, edge - 1, None]
            for part, phase in zip(folded.parts, folded.components, strict=True)
        ],
        axis=0,
    )
    assert (share > 0.2 * all_of_it).all()
    np.testing.assert_allclose(on_dark, L * share / all_of_it, rtol=0.03)
    np.testing.assert_allclose(on_dark, -on_bright, rtol=0.03)


@pytest.mark.parametrize("has_mesh", [True, False])
def test_where_the_floor_is_seen_it_counts_as_a_thing(water, has_mesh):
    """It brings its own light far from things, and theirs beside them; it blocks none of theirs."""
    _, field, folded, shade = water
    view = view_map((0.0, 0.0, -DEPTH), _axes(), math.radians(60.0))
    x, y = [-90.0, 90.0, 90.0, -90.0], [-5.0, -5.0, 90.0, 90.0]
    flat = np.column_stack([x, y, np.full(4, -8.0)])[[[0, 1, 2], [0, 2, 3]]]
    things = [_wall(-1.0, 1.0, 0.0)]
    if has_mesh:
        things.append(Surface(flat, np.full((2, 3), 0.5)))
    cover = view_cover(view, things, floor_depth=8.0)
    found = carried_light(cover, folded, field.sun, shade, (0.5, 0.5, 0.5))
    row = SIZE // 2 - 28  # 20° down
    assert cover.floor[row, 4]
    assert found.blocked[:, row, SIZE // 4].min() > 0.75
    edge = int(np.flatnonzero(~cover.floor[row])[0])
    contrast = np.abs(found.beside[:, row, edge - 1])
    assert (found.beside[:, row, edge - 1] < 0.0).all()
    assert (np.abs(found.beside[:, row, SIZE // 8]) < 0.1 * contrast).all()
    alone = carried_light(view_cover(view, things[:1]), folded, field.sun, shade)
    middle = SIZE // 2, SIZE // 2
    np.testing.assert_allclose(found.blocked[:, *middle], alone.blocked[:, *middle], rtol=0.01)
