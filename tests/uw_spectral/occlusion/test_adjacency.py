"""Light that objects beside an object send, in the place of what they block."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import SceneSettings
from underwater_spectral.uw_spectral.occlusion.adjacency import adjacency
from underwater_spectral.uw_spectral.occlusion.occlusion_table import without_occlusion
from underwater_spectral.uw_spectral.occlusion.point_spread import spread
from underwater_spectral.uw_spectral.occlusion.view_map import SIZE, view_map
from underwater_spectral.uw_spectral.occlusion.visibility_buffer import Surface, visibility_buffer
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.transfer.band_spectra import OcclusionSpectra
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.transfer.pixel_parts import (
    COLOURS,
    Around,
    SeenObject,
    SurfaceMaterial,
)
from underwater_spectral.uw_spectral.transfer.projection import project
from underwater_spectral.uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, tabulate

DEPTH, AWAY = 5.0, 4.0
TOWARDS = np.array([0.0, -1.0, 0.0])


@pytest.fixture(scope="module")
def water():
    chosen = SceneSettings(
        water="jerlov:IB", bands=8, surface="flat", sky="clear", sun_zenith=50.0, sun_azimuth=0.0
    )
    plan = render_plan.make_plan(chosen)
    field, occlusion = plan.solved_field(24), without_occlusion(8)
    low_stream_field = plan.column.solved_field(plan.phase, OCCLUSION_STREAMS)
    projected = project(
        field, channels_of_bands(plan.bands, (1, 3, 5)), DEPTH, plan.column.skylight.level,
        (), OcclusionSpectra(occlusion.spectra, occlusion.typical, low_stream_field),
    )  # fmt: skip
    return plan, field, projected, occlusion


def _axes() -> np.ndarray:
    back = TOWARDS
    right, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return np.stack([right, up, back], axis=1)


def _reflected(water, colour: float, depth: float, normal: np.ndarray) -> np.ndarray:
    """What a grey patch sends to all sides, by the bands themselves."""
    plan, field, _, _ = water
    at, facing = np.array([depth]), max(-float(normal @ np.asarray(field.sun)), 0.0)
    E = np.ravel(tabulate(field).patch_irradiance(at, normal[:, None], field.sun))
    E += facing * np.ravel(field.light.E / field.light.mu_s * field.beam(at).T)
    return (colour * uplift_basis(plan.bands).sum(axis=1) * E / math.pi)[[1, 3, 5]]


def _wall(left: float, right: float, colour: float) -> Surface:
    """Part of a wall across the view."""
    y, low, high = AWAY, -DEPTH - 30.0, -DEPTH + 30.0
    a, b = np.array([left, y, low]), np.array([right, y, low])
    c, d = np.array([right, y, high]), np.array([left, y, high])
    return Surface(np.array([[a, b, c], [a, c, d]]), np.full((2, 3), colour))


def _buffer(*walls: Surface):
    view = view_map((0.0, 0.0, -DEPTH), _axes(), math.radians(60.0))
    return visibility_buffer(view, walls)


def test_a_wall_of_one_colour_brings_what_it_is_itself(water):
    _, field, projected, occlusion = water
    found = adjacency(_buffer(_wall(-50.0, 50.0, 0.5)), projected, field.sun, occlusion)
    middle = slice(SIZE // 2 - 8, SIZE // 2 + 8)
    dark = adjacency(
        _buffer(_wall(-50.0, 0.0, 0.0), _wall(0.0, 50.0, 0.5)), projected, field.sun, occlusion
    )
    contrast = np.abs(dark.beside).max()
    assert np.abs(found.beside[:, middle, middle]).max() < 0.1 * contrast
    assert found.blocked[:, middle, middle].min() > 0.8


def test_at_an_edge_both_sides_bring_what_the_other_sends(water):
    _, field, projected, occlusion = water
    buffer = _buffer(_wall(-50.0, 0.0, 0.0), _wall(0.0, 50.0, 0.5))
    found = adjacency(buffer, projected, field.sun, occlusion)
    row, edge = SIZE // 2, SIZE // 2
    L = _reflected(water, 0.5, DEPTH, TOWARDS)
    on_dark = found.beside[:, row, edge - 1]
    on_bright = found.beside[:, row, edge] + (found.own[:, row, edge] - 1.0) * L
    halves = np.zeros((2, SIZE, SIZE))
    halves[0, :, edge:], halves[1] = 1.0, 1.0
    fraction, all_of_it = np.sum(
        [
            part * spread(halves, phase, float(buffer.view.per_unit))[:, row, edge - 1, None]
            for part, phase in zip(projected.parts, projected.components, strict=True)
        ],
        axis=0,
    )
    assert (fraction > 0.2 * all_of_it).all()
    np.testing.assert_allclose(on_dark, L * fraction / all_of_it, rtol=0.03)
    np.testing.assert_allclose(on_dark, -on_bright, rtol=0.03)
    # At the edge only what is scattered within a texel has the pixel's light.
    assert found.own[:, row, edge].max() < 0.5
    assert found.own[:, row, edge + 5].min() > 0.99


def _box(low: tuple[float, ...], high: tuple[float, ...], colour: float) -> Surface:
    """A box, counter-clockwise from outside."""
    corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [corners[list(x)] for a, b, c, d in sides for x in ((a, b, c), (a, c, d))]
    return Surface(np.array(triangles), np.full((12, 3), colour))


def _turned(yaw: float, pitch: float) -> np.ndarray:
    """Axes of a view to the +y side, down by 26°, and turned a little."""
    down = math.radians(26.0) + pitch
    back = np.array([0.0, -math.cos(down), math.sin(down)])
    right = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    back = np.array([[right[0], -right[1], 0.0], [right[1], right[0], 0.0], [0.0, 0.0, 1.0]]) @ back
    return np.stack([right, np.cross(back, right), back], axis=1)


def _floor_pixels(water, adjacent, view, ways: np.ndarray, depth: float, colour: float):
    """Pixels of a grey floor along unit vectors (m, 3), in channels."""
    _, field, projected, _ = water
    w = list(ways.T[..., None])
    P = (depth + view.centre[2]) / -w[2]
    place = view.place(tuple((np.asarray(view.centre) + ways * P).T))
    images = adjacent.blocked, adjacent.own, adjacent.beside
    around = Around(
        *(np.stack([map_coordinates(x, place[::-1], order=1) for x in im], axis=1) for im in images)
    )
    ray = along_rays(projected, field.sun, w)
    y, up = np.full(P.shape, depth), [np.full(P.shape, x) for x in (0.0, 0.0, 1.0)]
    lit = [np.full(P.shape, -colour * field.sun[2] / math.pi)] * 3
    leaving = ray.leaving(SurfaceMaterial(COLOURS, lit, [np.full(P.shape, colour)] * 3), y, up, P)
    return ray.surface(-view.centre[2], y, w, P, SeenObject(leaving), around=around).total


@pytest.mark.slow_but_first
@pytest.mark.parametrize("size", [2.0, 1.0, 0.4])
@pytest.mark.parametrize("above", [0.0, 2.0])
def test_before_a_floor_it_does_not_matter_where_texels_lie(water, size, above):
    """Beside the upper corners and edge of a box, as seen by a camera that turns a little."""
    _, field, projected, occlusion = water
    depth, eye = 9.0, (0.0, -6.0, -3.0)
    low = -size / 2, 0.0, above - depth
    box = _box(low, (size / 2, size, low[2] + size), 0.8)
    corner = np.array([size / 2, size, low[2] + size]) - eye
    off = [(a, b) for a in (0.004, 0.008, 0.015) for b in (-1.0, -0.4, 0.3, 1.0)]
    ways = np.array(
        [corner * [b, 1.0, 1.0] / np.linalg.norm(corner) + [a * b, 0, a] for a, b in off]
    )
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    found = []
    for step in range(9):
        view = view_map(eye, _turned(0.004 * step, 0.0021 * step), math.radians(48.0))
        buffer = visibility_buffer(view, [box], depth)
        adjacent = adjacency(buffer, projected, field.sun, occlusion, (0.3, 0.3, 0.3))
        found.append(_floor_pixels(water, adjacent, view, ways, depth, 0.3))
    change = np.ptp(found, axis=0) / np.mean(found, axis=0)
    # Where a texel's surface stood for all pixels in it, it was .21 to .56: spots at the corners.
    assert change.max() < 0.16
    assert change.mean() < 0.05


@pytest.mark.parametrize("has_mesh", [True, False])
def test_where_the_floor_is_seen_it_counts_as_an_object(water, has_mesh):
    """It brings its own light far from objects, and theirs beside them; it blocks none of that."""
    _, field, projected, occlusion = water
    view = view_map((0.0, 0.0, -DEPTH), _axes(), math.radians(60.0))
    x, y = [-90.0, 90.0, 90.0, -90.0], [-5.0, -5.0, 90.0, 90.0]
    flat = np.column_stack([x, y, np.full(4, -8.0)])[[[0, 1, 2], [0, 2, 3]]]
    surfaces = [_wall(-1.0, 1.0, 0.0)]
    if has_mesh:
        surfaces.append(Surface(flat, np.full((2, 3), 0.5)))
    buffer = visibility_buffer(view, surfaces, floor_depth=8.0)
    found = adjacency(buffer, projected, field.sun, occlusion, (0.5, 0.5, 0.5))
    row = SIZE // 2 - 28  # 20° down
    assert buffer.floor[row, 4]
    assert found.blocked[:, row, SIZE // 4].min() > 0.75
    edge = int(np.flatnonzero(~buffer.floor[row])[0])
    L = _reflected(water, 0.5, 8.0, np.array([0.0, 0.0, 1.0]))
    off = found.beside[:, row] + (found.own[:, row] - 1.0) * L[:, None]
    assert (off[:, edge - 1] < -0.1 * L).all()
    assert (np.abs(off[:, SIZE // 8]) < 0.1 * np.abs(off[:, edge - 1])).all()
    alone = adjacency(visibility_buffer(view, surfaces[:1]), projected, field.sun, occlusion)
    middle = SIZE // 2, SIZE // 2
    np.testing.assert_allclose(found.blocked[:, *middle], alone.blocked[:, *middle], rtol=0.01)
