"""Ports against least time, closed formulas of the literature, and published indices."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.housing import (
    GLASSES,
    DomePort,
    FlatPort,
    Glass,
    Housing,
    LensCamera,
    SeaWater,
    find_glass,
    focus_distance,
)
from underwater_spectral.validation import housing_cases as cases

PLAIN = LensCamera(1920, 1080, 1400.0, 1400.0, 960.0, 540.0)


def _polynomial_tangent(port, z, r, glass, water):
    """Tangent of the angle in air to a point z before the outer face and r from the axis.

    From (r - d q)² = (t q/√A + z q/√B)², A and B the n² + (n² - 1) q² of glass and water: the
    quartic of A. Agrawal et al. (2012) without thickness, their equation of twelfth degree with it.
    """
    polynomial = np.polynomial.Polynomial
    q = polynomial([0.0, 1.0])
    in_glass, in_water = (polynomial([n * n, 0.0, n * n - 1.0]) for n in (glass, water))
    rest = polynomial([r, -port.distance])
    if port.thickness == 0:
        equation = rest**2 * in_water - z**2 * q**2
        assert equation.degree() == 4
    else:
        t = port.thickness
        even = rest**2 * in_glass * in_water - q**2 * (t**2 * in_water + z**2 * in_glass)
        equation = even**2 - 4.0 * t**2 * z**2 * q**4 * in_glass * in_water
        assert equation.degree() == 12
    roots = equation.roots()
    real = roots.real[(np.abs(roots.imag) < 1e-6) & (roots.real > 0)]
    sides = [
        port.distance * x
        + port.thickness * x / math.sqrt(in_glass(x))
        + z * x / math.sqrt(in_water(x))
        for x in real
    ]
    return float(real[np.argmin(np.abs(np.array(sides) - r))])


def _traced_focus(port, distance, nm):
    """Distance at which rays from the sides of the pupil to an object on the axis meet."""
    step, found = 1e-5, []
    for side in (-step, step):
        moved = port
        if isinstance(port, DomePort):
            moved = dataclasses.replace(port, pupil=(side, 0.0, port.pupil[2]))
        x, _ = Housing(cases.CAMERA, moved).project([-side, 0.0, distance], nm)
        found.append(-side * cases.CAMERA.fx / (float(x) - cases.CAMERA.cx))
    return float(np.mean(found))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("name", cases.PORTS)
def test_rays_and_pixels_are_those_of_least_time(name):
    housing = Housing(cases.CAMERA, cases.PORTS[name], cases.WATER)
    for nm, distance in ((400.0, 0.5), (550.0, 2.0), (700.0, 10.0)):
        pixels, metres = cases.errors(housing, distance, nm)
        assert pixels < 1e-6
        assert metres < 1e-8


@pytest.mark.parametrize("name", cases.PORTS)
def test_every_pixel_is_where_its_ray_goes(name):
    housing = Housing(cases.CAMERA, cases.PORTS[name], cases.WATER)
    pixels = cases.CAMERA.pixel_centres()[::60, ::60]
    for nm in cases.NM:
        origins, w = housing.ray_in_water(pixels, nm)
        assert np.isfinite(w).all()
        for way in (1e-3, 0.5, 100.0):
            back = housing.project(origins + way * w, nm)
            np.testing.assert_allclose(back, pixels, atol=1e-9, rtol=0)


def _any_port(rng):
    """From a pupil that touches the port to one metres behind it, thin and thick."""
    glass = GLASSES[rng.choice(list(GLASSES))]
    if rng.random() < 0.5:
        return FlatPort.tilted(
            10 ** rng.uniform(-5, 0.5), 10 ** rng.uniform(-4, 0), glass,
            degrees=rng.uniform(0, 80), towards=rng.uniform(0, 360),
        )  # fmt: skip
    radius = 10 ** rng.uniform(-2.5, 1)
    thickness = radius * rng.uniform(0, 0.9)
    to_pupil = rng.standard_normal(3)
    to_pupil *= 0.999 * (radius - thickness) * rng.random() ** 0.3 / np.linalg.norm(to_pupil)
    return DomePort(radius, thickness, glass, tuple(to_pupil), half_angle=180.0)


def test_extreme_ports():
    rng = np.random.default_rng(0)
    for _ in range(60):
        water = SeaWater(rng.uniform(0, 40), rng.uniform(0, 30), rng.uniform(0, 11000))
        housing = Housing(PLAIN, _any_port(rng), water)
        pixels = rng.uniform(0, 1000, (100, 2))
        origins, w = housing.ray_in_water(pixels, 450.0)
        seen = np.isfinite(w).all(axis=-1)
        for way in (1e-4, 1.0, 1e5):
            back = housing.project(origins + way * w, 450.0)
            np.testing.assert_allclose(back[seen], pixels[seen], atol=1e-8, rtol=0)


def test_wavelengths_go_with_points():
    housing = Housing(PLAIN, FlatPort(0.03, 0.008))
    points = cases.seen_points(1.0)
    together = housing.project(points[:, None], np.array(cases.NM))
    for column, nm in enumerate(cases.NM):
        np.testing.assert_array_equal(together[:, column], housing.project(points, nm))


def test_the_caustic_of_a_thin_flat_port():
    """Rays envelop the curve of T. Treibitz et al., IEEE TPAMI 34, 51 (2012)."""
    distance = 0.04
    housing = Housing(PLAIN, FlatPort(distance, 0.0))
    n = float(housing.water.refractive_index(550.0))
    q, step = np.linspace(0.05, 0.7, 14), 1e-4
    lines = []
    for tangent in (q - step, q + step):
        pixels = np.stack([960 + 1400 * tangent, np.full_like(q, 540.0)], axis=-1)
        origins, w = housing.ray_in_water(pixels, 550.0)
        slope = w[:, 0] / w[:, 2]
        lines.append((origins[:, 0] - slope * origins[:, 2], slope))
    (foot, slope), (next_foot, next_slope) = lines
    z = (next_foot - foot) / (slope - next_slope)
    r = foot + slope * z
    curve = distance - distance * n * (1.0 + (1.0 - 1.0 / n**2) * q * q) ** 1.5
    np.testing.assert_allclose(z, curve, rtol=1e-5)
    np.testing.assert_allclose(r, -distance * (1.0 - 1.0 / n**2) * q**3, rtol=1e-4)


@pytest.mark.parametrize("thickness", [0.0, 0.02])
def test_flat_ports_solve_the_polynomials(thickness):
    """Of fourth and twelfth degree, A. Agrawal et al., CVPR 2012."""
    housing = Housing(PLAIN, FlatPort(0.03, thickness))
    nm = 500.0
    glass = float(housing.port.glass.refractive_index(nm))
    water = float(housing.water.refractive_index(nm))
    for z, r in ((0.3, 0.1), (2.0, 1.5), (8.0, 0.5)):
        q = _polynomial_tangent(housing.port, z, r, glass, water)
        (x, _) = housing.project([r, 0.0, 0.03 + thickness + z], nm)
        assert x == pytest.approx(960 + 1400 * q, abs=1e-4)


@pytest.mark.parametrize("name", cases.PORTS)
def test_all_rays_meet_the_axis(name):
    """Such a camera is axial (Agrawal et al. 2012; for domes M. She et al., ISPRS J. 2022)."""
    port = cases.PORTS[name]
    origins, w = Housing(PLAIN, port).ray_in_water(PLAIN.pixel_centres()[::90, ::90], 450.0)
    away = np.cross(w, port.axis)
    gap = np.abs((origins * away).sum(axis=-1)) / np.maximum(np.linalg.norm(away, axis=-1), 1e-6)
    assert gap.max() < 1e-12


def test_a_centred_dome_bends_nothing_and_one_off_centre_not_along_its_axis():
    points = cases.seen_points(1.5)
    for nm in cases.NM:
        straight = Housing(PLAIN, DomePort(0.05, 0.005)).project(points, nm)
        np.testing.assert_allclose(straight, PLAIN.project(points), atol=1e-9)
    dome = DomePort(0.05, 0.005, pupil=(0.002, 0.001, 0.006))
    along = dome.axis * np.array([[0.2], [3.0]])
    np.testing.assert_allclose(
        Housing(PLAIN, dome).project(along, 450.0), PLAIN.project(along), atol=1e-9
    )
    assert np.abs(Housing(PLAIN, dome).project(points, 450.0) - PLAIN.project(points)).max() > 10


def test_a_large_dome_close_by_is_a_flat_port():
    flat = Housing(PLAIN, FlatPort(0.03, 0.01))
    radius = 3000.0
    dome = Housing(PLAIN, DomePort(radius, 0.01, pupil=(0.0, 0.0, radius - 0.04)))
    points = cases.seen_points(2.0)
    np.testing.assert_allclose(dome.project(points, 500.0), flat.project(points, 500.0), atol=0.02)


@pytest.mark.parametrize(
    "port",
    [
        FlatPort(0.03, 0.01),
        DomePort(0.05, 0.005),
        DomePort(0.1, 0.012, GLASSES["acrylic"], (0.0, 0.0, -0.015)),
        DomePort(0.05, 0.004, pupil=(0.0, 0.0, 0.01)),
    ],
    ids=str,
)
@pytest.mark.parametrize("distance", [0.3, 2.0, 1e7])
def test_focus_lies_where_two_rays_meet(port, distance):
    """Rays from both sides of the pupil to an object on the axis meet in its image."""
    formula = float(focus_distance(Housing(PLAIN, port), distance, 500.0))
    assert _traced_focus(port, distance, 500.0) == pytest.approx(formula, rel=1e-5)
    if distance == 1e7 and isinstance(port, DomePort):
        far = float(focus_distance(Housing(PLAIN, port), math.inf, 500.0))
        assert far == pytest.approx(formula, rel=1e-5)


def test_light_that_ports_let_through():
    """Fresnel's ((n - m) / (n + m))² at both faces on the axis; less to the side."""
    housing = Housing(PLAIN, FlatPort(0.03, 0.01))
    n, m = (float(x.refractive_index(550.0)) for x in (housing.port.glass, housing.water))
    expected = (1 - ((n - 1) / (n + 1)) ** 2) * (1 - ((n - m) / (n + m)) ** 2)
    middle, side = housing.transmittance([[960.0, 540.0], [3000.0, 540.0]], 550.0)
    assert middle == pytest.approx(expected, rel=1e-9)
    assert side < 0.97 * middle
    dome = Housing(PLAIN, DomePort(0.05, 0.005, pupil=(0.0, 0.0, 0.002)))
    assert dome.transmittance([960.0, 540.0], 550.0) == pytest.approx(expected, rel=1e-9)


def test_light_through_a_decentred_dome_by_its_normals():
    port = DomePort(0.05, 0.006, pupil=(0.02, -0.01, -0.015))
    housing = Housing(PLAIN, port)
    pixel, centre = np.array([1700.0, 200.0]), -np.array(port.pupil)
    n, m = (float(x.refractive_index(450.0)) for x in (port.glass, housing.water))
    ray, (origin, w) = PLAIN.directions(pixel), housing.ray_in_water(pixel, 450.0)
    # Where the ray in air meets the inner sphere.
    way = np.roots([1.0, -2.0 * ray @ centre, centre @ centre - port.inner_radius**2]).max()
    normals = (way * ray - centre) / port.inner_radius, (origin - centre) / port.radius
    passed = 1.0
    for before, after, cosine, beyond in (
        (1.0, n, ray @ normals[0], None), (n, m, None, w @ normals[1])
    ):  # fmt: skip
        other = cosine if cosine is not None else beyond
        sine = np.sqrt(1.0 - other**2) * (before if cosine is not None else after)
        a, b = np.sqrt(1.0 - (sine / before) ** 2), np.sqrt(1.0 - (sine / after) ** 2)
        s, p = (before * a - after * b), (after * a - before * b)
        s, p = s / (before * a + after * b), p / (after * a + before * b)
        passed *= 1.0 - 0.5 * (s * s + p * p)
    assert housing.transmittance(pixel, 450.0) == pytest.approx(passed, rel=1e-9)


def test_what_no_port_shows_is_nan():
    flat = Housing(PLAIN, FlatPort.tilted(0.03, 0.01, GLASSES["BK7"], degrees=70.0))
    assert np.isnan(flat.ray_in_water([[100.0, 540.0]], 550.0)).all()
    assert np.isnan(flat.project([[0.0, 0.0, 0.005], [0.0, 0.0, -1.0]], 550.0)).all()
    for housing in (flat, Housing(PLAIN, DomePort(0.05, 0.01, pupil=(0.0, 0.01, 0.0)))):
        nowhere = [[np.nan, 0.0, 1.0], [np.inf, 0.0, 1.0], [0.0, 0.0, np.inf]]
        assert np.isnan(housing.project(nowhere, 550.0)).all()
        assert np.isnan(housing.ray_in_water([np.nan, 3.0], 550.0)).all()
    dome = Housing(PLAIN, DomePort(0.05, 0.005, half_angle=20.0))
    origins, _ = dome.ray_in_water([[960.0, 540.0], [1910.0, 540.0]], 550.0)
    assert np.isfinite(origins[0]).all()
    assert np.isnan(origins[1]).all()
    assert np.isnan(dome.project([[1.0, 0.0, 1.0], [0.0, 0.0, 0.04]], 550.0)).all()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: FlatPort(0.0, 0.01), "entrance pupil must be behind"),
        (lambda: FlatPort(0.03, -0.01), "thickness"),
        (lambda: FlatPort(0.03, 0.01, normal=(1.0, 0.0, 0.0)), "look forward"),
        (lambda: DomePort(0.05, 0.005, pupil=(0.0, 0.04, 0.03)), "not inside"),
        (lambda: DomePort(0.05, 0.06), "thickness"),
        (lambda: DomePort(0.05, 0.005, half_angle=0.0), "half angle"),
        (lambda: SeaWater(pressure=2e4), "dbar"),
        (lambda: SeaWater(temperature=50.0), "temperature"),
        (lambda: Glass("odd", ((1.0, 0.3),), ""), "index"),
        (lambda: find_glass("BK8"), "BK7"),
    ],
)
def test_housings_that_cannot_be(make, words):
    with pytest.raises(InputError, match=words):
        make()


def test_published_indices():
    # Schott's n_F, n_d, n_C of N-BK7; Malitson's table; acrylic: usual n_F, n_d, n_C of PMMA.
    lines = [486.1327, 587.5618, 656.2725]
    for name, published, within in (
        ("BK7", [1.52238, 1.51680, 1.51432], 1e-5),
        ("fused silica", [1.46313, 1.45846, 1.45637], 1e-5),
        ("acrylic", [1.4973, 1.4914, 1.4889], 1.2e-3),
    ):
        found = find_glass(name).refractive_index(lines)
        np.testing.assert_allclose(found, published, atol=within, rtol=0)


def test_what_pressure_adds_is_what_was_measured():
    """Pure water, 1.56 °C, R. M. Waxler et al., J. Res. NBS 68A, 489 (1964): absolute indices."""
    bars = np.array([507.4, 768.5, 1049.7])
    for nm, surface, deep in (
        (467.82, 1.33951, [1.34734, 1.35106, 1.35479]),
        (501.57, 1.33772, [1.34552, 1.34923, 1.35296]),
    ):
        for bar, index in zip(bars, deep, strict=True):
            water = SeaWater(0.0, 1.56, 10.0 * (bar - 1.0))
            rise = water.refractive_index(nm) - SeaWater(0.0, 1.56).refractive_index(nm)
            assert float(rise) == pytest.approx(index - surface, abs=6e-5)
