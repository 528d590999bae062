"""Pictures through ports against rays cast at boards."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.housing import (
    GLASSES,
    BrownConrady,
    DomePort,
    FlatPort,
    Housing,
    KannalaBrandt,
    LateralColour,
    LensCamera,
    effective_wavelength,
    field_needed,
    intrinsics_in_water,
    sample,
    seen_places,
    viewpoint,
    warped,
    warped_flow,
)
from underwater_spectral.validation import housing_cases as cases

SMALL = LensCamera(320, 180, 233.3, 233.3, 160.0, 90.0)
SHARP = LensCamera(
    320, 180, 233.3, 233.3, 158.0, 92.0, BrownConrady(-0.1, 0.02), LateralColour((2e-3,))
)
FISHEYE = LensCamera(320, 180, 180.0, 180.0, 160.0, 90.0, KannalaBrandt(0.01))
HOUSINGS = {
    "flat": Housing(SHARP, FlatPort(0.03, 0.008)),
    "tilted": Housing(
        SMALL, FlatPort.tilted(0.03, 0.008, GLASSES["acrylic"], degrees=8.0, towards=70.0)
    ),
    "dome": Housing(FISHEYE, DomePort(0.05, 0.004, pupil=(0.002, -0.003, -0.008))),
}
BLUE_TO_RED = (440.0, 540.0, 620.0)


def _view_of_boards(view):
    """Planar depth, board, and place of each pixel of a pinhole's picture."""
    rays = view.rays()
    origins = np.broadcast_to(view.position, rays.shape)
    depth, which = cases.cast(origins, rays)
    return depth, which, origins + depth[..., None] * rays


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("name", "position"), [*((name, None) for name in HOUSINGS), ("flat", (0.0, 0.0, 0.038))]
)
def test_pixels_see_what_their_rays_meet(name, position):
    """From the best viewpoint, and from the face of a port, where no water is too much."""
    housing = HOUSINGS[name]
    view = field_needed(housing, 0.4, BLUE_TO_RED, position)
    depth, which, _ = _view_of_boards(view)
    centres = housing.camera.pixel_centres()
    for nm in BLUE_TO_RED:
        seen = seen_places(housing, view, depth, nm)
        origins, w = housing.ray_in_water(centres, nm)
        distance, board = cases.cast(origins, w)
        inner = ~cases.edges(board)
        # Hidden objects are few; from the best viewpoint they lie at edges.
        assert seen.hidden.mean() < 0.01
        if position is None:
            assert not (seen.hidden & inner).any()
        # Beside them lies the pinhole's edge.
        inner &= ~seen.hidden & ~cases.edges(seen.hidden)
        # At Full HD a pixel is six times smaller.
        off = np.linalg.norm(housing.project(seen.points, nm) - centres, axis=-1)[inner]
        assert off.max() * 6 < 0.01
        np.testing.assert_allclose(seen.distances[inner], distance[inner], rtol=1e-4)
        assert (seen.sampled(which, "nearest")[inner] == board[inner]).all()
        points = origins + distance[..., None] * w
        longer = np.linalg.norm(points - view.position, axis=-1) - distance
        np.testing.assert_allclose(seen.extra[inner], longer[inner], atol=1e-4)


@pytest.mark.parametrize("name", HOUSINGS)
def test_warped_pictures_are_those_that_rays_see(name):
    housing = HOUSINGS[name]
    view = field_needed(housing, 0.4, BLUE_TO_RED)
    depth, _, points = _view_of_boards(view)
    picture = np.repeat(cases.painted(points)[..., None], 3, axis=-1)
    found = warped(picture, depth, housing, view, BLUE_TO_RED)
    for band, nm in enumerate(BLUE_TO_RED):
        origins, w = housing.ray_in_water(housing.camera.pixel_centres(), nm)
        distance, board = cases.cast(origins, w)
        expected = cases.painted(origins + distance[..., None] * w)
        # The wall is too far to show the pattern without aliasing.
        near = ~cases.edges(board) & (board > 0)
        assert near.sum() > 500
        miss = found[..., band] - expected
        shift = cases.shift(expected, miss, near)
        assert np.abs(shift).max() * 6 < 0.1
        assert np.abs(miss[near]).mean() < 0.02


@pytest.mark.parametrize("name", HOUSINGS)
def test_the_field_is_enough_and_not_more(name):
    housing = HOUSINGS[name]
    view = field_needed(housing, 0.4, BLUE_TO_RED)
    depth = np.full((view.camera.height, view.camera.width), 0.45)
    places = [seen_places(housing, view, d, nm).places for nm in BLUE_TO_RED
              for d in (depth, np.full_like(depth, np.inf))]  # fmt: skip
    low, high = np.min(places, axis=(0, 1, 2)), np.max(places, axis=(0, 1, 2))
    size = np.array([view.camera.width, view.camera.height])
    # Cubic sampling takes two pixels to each side.
    assert (low > 1.5).all() and (high < size - 1.5).all()  # noqa: PT018
    assert (low < 10).all() and (high > size - 10).all()  # noqa: PT018
    # And as fine as the picture: a pixel there is at most one here.
    step = np.linalg.norm(np.diff(places[0], axis=1), axis=-1)
    assert 1.0 - 1e-3 < step.min() < 1.05


def test_open_water_is_seen_in_the_ray_s_direction():
    housing = HOUSINGS["flat"]
    view = field_needed(housing, 0.4, 540.0)
    size = (view.camera.height, view.camera.width)
    seen = seen_places(housing, view, np.full(size, np.inf), 540.0)
    _, w = housing.ray_in_water(housing.camera.pixel_centres(), 540.0)
    np.testing.assert_allclose(view.camera.project(w), seen.places, atol=1e-9)
    assert np.isinf(seen.distances).all()
    assert np.isinf(seen.points).any(axis=-1).all()
    wall = seen_places(housing, view, np.full(size, 1e5), 540.0)
    np.testing.assert_allclose(seen.extra, wall.extra, atol=1e-6)


def test_the_pinhole_stands_behind_a_flat_port():
    """Paraxially by (n - 1) d and (n / m - 1) t: apparent depths of plane slabs."""
    narrow = LensCamera(200, 200, 4000.0, 4000.0, 100.0, 100.0)
    housing = Housing(narrow, FlatPort(0.05, 0.01))
    n, m = (float(x.refractive_index(550.0)) for x in (housing.water, housing.port.glass))
    x, y, z = viewpoint(housing)
    assert abs(x) + abs(y) < 1e-9
    assert z == pytest.approx(0.06 - n * (0.05 + 0.01 / m), rel=1e-3)


def test_intrinsics_in_water():
    """A centred dome's are those in air; a flat port's n times, and n differs with the band."""
    plain = LensCamera(320, 180, 233.3, 230.0, 158.0, 92.0)
    view, error = intrinsics_in_water(Housing(plain, DomePort(0.05, 0.004)), 550.0)
    np.testing.assert_allclose(
        [view.camera.fx, view.camera.fy, view.camera.cx, view.camera.cy],
        [233.3, 230.0, 158.0, 92.0], rtol=1e-9,
    )  # fmt: skip
    assert error < 1e-9
    narrow = LensCamera(320, 180, 6000.0, 6000.0, 160.0, 90.0)
    for nm in BLUE_TO_RED:
        housing = Housing(narrow, FlatPort(0.05, 0.008))
        view, error = intrinsics_in_water(housing, nm)
        n = float(housing.water.refractive_index(nm))
        assert view.camera.fx == pytest.approx(6000.0 * n, rel=5e-4)
        # It sees points of that distance where the camera does.
        points = np.array([[0.02, 0.01, 2.05], [-0.03, -0.01, 2.05]])
        seen = view.camera.project(points - view.position)
        np.testing.assert_allclose(seen, housing.project(points, nm), atol=0.02)
    _, wide = intrinsics_in_water(Housing(SMALL, FlatPort(0.05, 0.008)), 550.0)
    assert wide > 1.0


def test_flow_through_the_port():
    """Of a camera that goes sideways and ahead, against points projected twice."""
    housing = HOUSINGS["tilted"]
    view = field_needed(housing, 0.3, 540.0)
    depth, _, points = _view_of_boards(view)
    moved = points - (0.02, -0.01, 0.03)
    there = moved - view.position
    flow = view.camera.project(there) - view.camera.pixel_centres()
    places = seen_places(housing, view, depth, 540.0)
    found = warped_flow(places, flow, there[..., 2], housing, view, 540.0)
    centres = housing.camera.pixel_centres()
    origins, w = housing.ray_in_water(centres, 540.0)
    distance, board = cases.cast(origins, w)
    true = origins + distance[..., None] * w - (0.02, -0.01, 0.03)
    inner = ~cases.edges(board)
    miss = (found - (housing.project(true, 540.0) - centres))[inner]
    assert np.abs(miss).max() * 6 < 0.1


def test_labels_stay_labels_and_planes_stay_planes():
    labels = np.array([[1, 2], [3, 4]], dtype=np.uint16)
    at = np.array([[0.9, 0.2], [1.1, 1.9]])
    found = sample(labels, at, "nearest")
    assert found.dtype == np.uint16
    assert found.tolist() == [1, 4]
    x, y = np.meshgrid(np.arange(8) + 0.5, np.arange(6) + 0.5)
    at = np.random.default_rng(1).uniform(2.0, 4.0, (50, 2))
    for sampling in ("linear", "cubic"):
        plane = sample(3 * x - 2 * y, at, sampling)
        np.testing.assert_allclose(plane, 3 * at[:, 0] - 2 * at[:, 1], atol=1e-12)
    parabola = sample(x * x, at, "cubic")
    np.testing.assert_allclose(parabola, at[:, 0] ** 2, atol=1e-12)
    assert np.isnan(sample(labels, np.array([[np.nan, 1.0]]), "nearest")).all()


def test_a_channel_s_wavelength():
    # Two bands as strong as each other, and one of nothing.
    found = effective_wavelength([450, 550, 650], [[1.0, 0.0], [1.0, -0.1], [0.0, 3.0]])
    assert found.tolist() == [500.0, 650.0]


def test_inputs_that_do_not_fit():
    housing = HOUSINGS["flat"]
    view = field_needed(housing, 0.4, BLUE_TO_RED)
    size = (view.camera.height, view.camera.width)
    for depth in (np.ones((2, 2)), np.zeros(size)):
        with pytest.raises(InputError, match="depth"):
            seen_places(housing, view, depth, 540.0)
    with pytest.raises(InputError, match="wavelength"):
        warped(np.zeros((*size, 3)), np.ones(size), housing, view, (500.0, 600.0))
    narrow = field_needed(Housing(SMALL, FlatPort(0.3, 0.0)), 0.4, 540.0)
    with pytest.raises(InputError, match="too small"):
        seen_places(
            HOUSINGS["dome"], narrow, np.ones((narrow.camera.height, narrow.camera.width)), 540.0
        )
    with pytest.raises(InputError, match="nearest"):
        field_needed(housing, 0.0, BLUE_TO_RED)
    wide = LensCamera(320, 180, 80.0, 80.0, 160.0, 90.0, KannalaBrandt())
    with pytest.raises(InputError, match="longer focal"):
        field_needed(Housing(wide, DomePort(0.05, 0.0)), 0.4, BLUE_TO_RED)
    with pytest.raises(InputError, match="sees anything"):
        aside = LensCamera(320, 180, 233.3, 233.3, -100.0, 90.0)
        viewpoint(Housing(aside, DomePort(0.05, 0.0, half_angle=15.0)))
