"""Rays that waves let out into the air, looked for in a picture of objects in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.refraction import apparent_height, direction_in_air
from underwater_spectral.uw_spectral.surface.surface_views import ReflectedView, RefractedView

N, SIZE, WIDE = 1.34, 400.0, 1.3  # pixels; half the picture's width at distance 1, straight up
SCALE, LEVEL = SIZE / 2 / WIDE, (0.0, 0.0, 1.0)


def _view(depth):
    right, up = (SCALE, 0.0, SIZE / 2), (0.0, SCALE, SIZE / 2)
    return RefractedView(ReflectedView((0.0, 0.0, -depth), right, up, LEVEL, SIZE, SIZE), N)


def _in_air(w, normal=LEVEL):
    return np.stack(direction_in_air(tuple(w.T), tuple(np.atleast_2d(normal).T), N), 1)


def _flat(depth, h, v):
    """Where the ray of a pixel leaves a flat surface, and its direction from there; nan outside."""
    w = np.stack([(h + 0.5 - SIZE / 2) / SCALE, (v + 0.5 - SIZE / 2) / SCALE, np.ones_like(h)], 1)
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    w[w[:, 2] < np.sqrt(1 - 1 / N**2)] = np.nan
    return w * (depth / w[:, 2:]) - [0.0, 0.0, depth], _in_air(w)


def _rays(depth, slope=0.12, count=6000):
    random = np.random.default_rng(3)
    place = np.append(random.uniform(-depth, depth, (count, 2)), np.zeros((count, 1)), 1)
    w = place + np.array([0.0, 0.0, depth])
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    normal = np.append(random.normal(0.0, slope, (count, 2)), np.ones((count, 1)), axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = (w * normal).sum(axis=1) > np.sqrt(1 - 1 / N**2) + 1e-3
    up = _in_air(w, normal)
    use = inside & (up[:, 2] > 0.15)
    return place[use], up[use]


def _seen(depth, point):
    """Columns and rows at which a flat surface shows points in the air."""
    x, y, z = point.T
    rise = apparent_height(np.hypot(x, y), z, depth, N)
    return np.stack(_view(depth).picture.place((x, y, depth + rise))[:2], 1)


@pytest.mark.parametrize("depth", [1.5, 5.0])
@pytest.mark.parametrize("height", [1.5, 8.0])
def test_rays_to_a_level_ceiling_end_where_they_meet_it(depth, height):
    def nearness(h, v):
        return np.nan_to_num(_flat(depth, h, v)[1][:, 2] / height)

    place, up = _rays(depth)
    h, v, inside = _view(depth).found(tuple(place.T), tuple(up.T), nearness)
    wanted = _seen(depth, place + up * (height / up[:, 2:]))
    whole = (np.asarray(inside) > 0) & (np.abs(wanted - SIZE / 2) < SIZE / 2 - 1).all(axis=1)
    assert whole.mean() > 0.9
    # In fractions of the distance that a wave moves what is seen: without its turn, 1.
    level = np.stack(_view(depth).picture.place(tuple((place + np.array([0, 0, depth])).T))[:2], 1)
    moved = np.linalg.norm(wanted - level, axis=1)[whole]
    off = np.linalg.norm(np.stack([h, v], 1) - wanted, axis=1)[whole]
    assert np.median(off / moved) < 0.02
    assert np.quantile(off / moved, 0.9) < 0.1


def test_rays_find_a_ball_in_the_air():
    depth, centre, radius = 2.0, np.array([0.9, 0.6, 1.4]), 0.5

    def to_ball(place, d):
        off = centre - place
        along = (off * d).sum(axis=-1)
        gap = radius**2 - ((off * off).sum(axis=-1) - along**2)
        return np.where(gap > 0, along - np.sqrt(np.maximum(gap, 0.0)), np.inf)

    def nearness(h, v):
        return np.nan_to_num(1.0 / to_ball(*_flat(depth, h, v)))

    place, up = _rays(depth, count=40000)
    h, v, inside = _view(depth).found(tuple(place.T), tuple(up.T), nearness)
    meets, shows = np.isfinite(to_ball(place, up)), (nearness(h, v) > 0) & (inside > 0)
    straight = place + np.array([0.0, 0.0, depth])
    level = _in_air(straight / np.linalg.norm(straight, axis=1, keepdims=True))
    new = meets & ~np.isfinite(to_ball(place, level))
    assert new.sum() > 20
    assert shows[new].mean() > 0.7
    assert (shows == meets).mean() > 0.98
