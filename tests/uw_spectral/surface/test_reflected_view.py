"""Rays that waves mirror, looked for in a picture whose objects are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.surface.surface_views import ReflectedView

DEPTH, SIZE, WIDE = 1.5, 400.0, 1.6  # of the eye; pixels; half the picture's width at distance 1
_COS = _SIN = np.sqrt(0.5)
X, Y, AHEAD = np.eye(3)[0], np.array([0.0, _SIN, _COS]), np.array([0.0, _COS, -_SIN])
SCALE = SIZE / 2 / WIDE
VIEW = ReflectedView(
    (0.0, 0.0, DEPTH),
    tuple(SCALE * X + SIZE / 2 * AHEAD),
    tuple(SCALE * Y + SIZE / 2 * AHEAD),
    tuple(AHEAD),
    SIZE,
    SIZE,
)


def _direction(h, v):
    right, up = (h + 0.5 - SIZE / 2) / SCALE, (v + 0.5 - SIZE / 2) / SCALE
    d = right[..., None] * X + up[..., None] * Y + AHEAD
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def _from_surface(h, v):
    """Where the ray of a pixel enters the water, and its direction."""
    d = _direction(h, v)
    return np.array([0.0, 0.0, DEPTH]) + d * (DEPTH / -d[..., 2:]), d


def _to_plane(place, d, depth):
    return (depth + place[..., 2]) / -d[..., 2]


def _to_ball(place, d, centre, radius):
    off = centre - place
    along = (off * d).sum(axis=-1)
    gap = radius**2 - ((off * off).sum(axis=-1) - along**2)
    return np.where(gap > 0, along - np.sqrt(np.maximum(gap, 0.0)), np.inf)


def _rays(seed=3, count=6000, slope=0.12):
    """Rays from the camera that meet the surface ahead, and what waves make of them."""
    random = np.random.default_rng(seed)
    place = np.stack(
        [random.uniform(-1.5, 1.5, count), random.uniform(1.0, 4.0, count), np.zeros(count)], 1
    )
    w = place + np.array([0.0, 0.0, DEPTH])
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    normal = np.append(random.normal(0.0, slope, (count, 2)), np.ones((count, 1)), axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    down = w - 2.0 * (w * normal).sum(axis=1, keepdims=True) * normal
    use = down[:, 2] < -0.15
    return place[use], down[use]


def _found(nearness):
    place, down = _rays()
    h, v, inside = VIEW.found(tuple(place.T), tuple(down.T), nearness)
    return place, down, np.stack([h, v], 1), np.asarray(inside) > 0


@pytest.mark.parametrize("depth", [0.5, 2.0])
def test_rays_to_a_level_ground_end_where_they_meet_it(depth):
    def nearness(h, v):
        return 1.0 / _to_plane(*_from_surface(h, v), depth)

    place, down, at, inside = _found(nearness)
    met = place + down * _to_plane(place, down, depth)[:, None]
    wanted = np.stack(VIEW.place(tuple((met - [0.0, 0.0, DEPTH]).T))[:2], 1)
    assert inside.mean() > 0.8
    # In fractions of the distance that a wave moves what is seen: without waves' turn, 1.
    level = np.stack(VIEW.place(tuple((place - [0.0, 0.0, DEPTH]).T))[:2], 1)
    moved = np.linalg.norm(wanted - level, axis=1)[inside]
    off = np.linalg.norm(at - wanted, axis=1)[inside]
    assert np.median(off / moved) < 0.02
    assert np.quantile(off / moved, 0.9) < 0.1


def test_rays_find_a_ball_that_the_flat_surface_would_not_show_there():
    centre, radius = np.array([0.2, 2.6, -0.9]), 0.45

    def nearness(h, v):
        return 1.0 / _to_ball(*_from_surface(h, v), centre, radius)

    place, down, at, inside = _found(nearness)
    level = _direction(*VIEW.place(tuple((place - [0.0, 0.0, DEPTH]).T))[:2])
    meets = np.isfinite(_to_ball(place, down, centre, radius)) & inside
    shows = (nearness(*at.T) > 0) & inside
    new = meets & ~np.isfinite(_to_ball(place, level, centre, radius))
    assert new.sum() > 20
    assert shows[new].mean() > 0.7
    assert (shows == meets)[inside].mean() > 0.98
