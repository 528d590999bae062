from __future__ import annotations

import doctest
import importlib
import itertools
import math
import pkgutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import chdtrc
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    fresnel_reflectance,
)
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import (
    EinsteinSmoluchowski,
    FournierForand,
    HenyeyGreenstein,
    Isotropic,
    PetzoldAverage,
    parse_phase,
)
from underwater_spectral.validation import monte_carlo
from underwater_spectral.validation.closed_form.internal_reflectance import (
    diffuse_internal_reflectance,
)
from underwater_spectral.validation.monte_carlo import (
    Constituent,
    InelasticInteraction,
    phase_tables,
    photons,
    simulate,
    solver,
)

ROOT = Path(__file__).resolve().parents[2]
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)
PHASES = [
    Isotropic(),
    HenyeyGreenstein(0.8),
    HenyeyGreenstein(0.98),
    EinsteinSmoluchowski(),
    FournierForand(),
    PetzoldAverage(),
]


def column(a=0.1, b=0.3, wavelengths=(500.0,), **changes):
    values = {
        "sun_irradiance": 1.0,
        "sun_cosine": 0.8,
        "sun_direction": (0.6, 0.0, -0.8),
        "sky_radiance": 0.0,
        "floor_depth": math.inf,
        "floor_reflectance": 0.0,
        "surface": "none",
        "refractive_index": 1.34,
    }
    return WaterColumn(Bands.at_wavelengths(wavelengths), a, b, **(values | changes))


def run(water, phase=None, depths=(), **options):
    phase = phase or HenyeyGreenstein(0.8)
    options = {"engine": "numpy", "photons": 40_000} | options
    return simulate(water, phase.for_bands(water.scattering), depths, **options)


def chi_square_probability(found, expected):
    return chdtrc(len(found) - 1, ((found - expected) ** 2 / expected).sum())


def agree(found, wanted, sigmas=4.5):
    """Within the standard errors, which must mean something."""
    assert np.all(found.error <= 0.1 * np.abs(wanted) + 1e-12)
    np.testing.assert_array_less(np.abs(found.mean - wanted), sigmas * found.error + 1e-12)


@pytest.mark.parametrize("module", [m.name for m in pkgutil.iter_modules(monte_carlo.__path__)])
def test_examples_in_docstrings(module):
    if module == "photons_numba":
        pytest.importorskip("numba")
    found = importlib.import_module(f"{monte_carlo.__name__}.{module}")
    assert doctest.testmod(found).failed == 0


# Sampling


def sampling_probability(drawn_from, phase, drawn=100_000):
    """χ² probability of the engine's sampler against the integral of a phase function."""
    from scipy import integrate

    table = phase_tables.s2_grid([drawn_from])
    tables = SimpleNamespace(s2=table, cdf=[phase_tables.cumulative(drawn_from, table)])
    rng = np.random.Generator(np.random.Philox(7))
    s2 = photons._sample_s2(rng.random(drawn), np.zeros(drawn, dtype=int), tables)
    angles = np.concatenate([[0], np.geomspace(1e-3, 0.1, 12), np.linspace(0.2, math.pi, 25)])
    counts = np.histogram(2 * np.arcsin(np.sqrt(s2)), angles)[0]
    expected = [
        integrate.quad(
            lambda x: 4 * math.pi * phase.per_steradian(math.exp(x)) * math.exp(x),
            2 * math.log(max(math.sin(low / 2), 1e-14)),
            2 * math.log(math.sin(high / 2)),
            limit=400,
            epsabs=1e-9,
        )[0]
        for low, high in itertools.pairwise(angles)
    ]
    expected = np.array(expected) * drawn
    enough = expected > 5
    rest = np.append(counts[enough], counts[~enough].sum())
    wanted = np.append(expected[enough], expected[~enough].sum())
    rest, wanted = rest[wanted > 0], wanted[wanted > 0]
    return chi_square_probability(rest, wanted * drawn / wanted.sum())


@pytest.mark.parametrize("phase", PHASES, ids=lambda p: type(p).__name__)
def test_chi_square_of_phase_sampling(phase):
    """Angles drawn from the table against the integral of the function, by adaptive quadrature."""
    assert sampling_probability(phase, phase) > 1e-3


def test_chi_square_tells_phase_functions_apart():
    assert sampling_probability(HenyeyGreenstein(0.81), HenyeyGreenstein(0.8)) < 1e-6
    assert sampling_probability(FournierForand(1.10, 0.019), FournierForand()) < 1e-6


@pytest.mark.parametrize("phase", PHASES[1:], ids=lambda p: type(p).__name__)
def test_cone_average(phase):
    """It keeps the integral, and leaves alone what is smooth over the cone."""
    half_sine = np.linspace(0, 1, phase_tables.LOOKUP_CELLS + 1)
    values = phase_tables.cone_average(phase, math.radians(1.0))
    total = np.trapezoid(values * 8 * math.pi * half_sine, half_sine)
    assert abs(total - 1) < 1e-3
    at = half_sine[[1500, 3000, 4000]]
    np.testing.assert_allclose(values[[1500, 3000, 4000]], phase.per_steradian(at**2), rtol=5e-3)


def test_turned_directions():
    rng = np.random.Generator(np.random.Philox(3))
    before = rng.normal(size=(3, 10_000))
    before /= np.linalg.norm(before, axis=0)
    before[:, :2] = [[0.0, 0.0], [0.0, 0.0], [1.0, -1.0]]
    s2 = rng.random(10_000)
    after = np.array(photons.turned(*before, s2, 2 * math.pi * rng.random(10_000)))
    np.testing.assert_allclose(np.linalg.norm(after, axis=0), 1, rtol=1e-14)
    np.testing.assert_allclose((before * after).sum(axis=0), 1 - 2 * s2, atol=1e-12)
    half = np.random.Generator(np.random.Philox(4)).random(10_000) * 2 * math.pi
    around = np.array(photons.turned(*np.tile([[0.6], [0.0], [0.8]], 10_000), 0.5, half))
    assert np.all(np.abs(around.mean(axis=1)) < 0.04)


# Against what is known


def test_beer_lambert_is_exact():
    found = run(column(b=0.0), depths=[0.0, 2.0, 7.0], photons=1000).total
    np.testing.assert_allclose(found.Ed.mean[:, 0], np.exp(-0.1 / 0.8 * np.array([0, 2, 7])))
    np.testing.assert_allclose(found.E0.mean, found.Ed.mean / 0.8)
    assert not found.Eu.mean.any()
    assert found.Ed.error.max() < 1e-15


def chandrasekhar_H(w0, cosines):
    """H-function of isotropic scattering by iterating its integral equation."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    mu, weights = (nodes + 1) / 2, weights / 2
    H = np.ones_like(mu)
    root = math.sqrt(1 - w0)
    for _ in range(300):
        H = 1 / (root + w0 / 2 * (mu * H * weights / (mu + mu[:, None])).sum(axis=1))
    x = np.asarray(cosines)
    return 1 / (root + w0 / 2 * (mu * H * weights / (mu + x[:, None])).sum(axis=1))


@pytest.mark.slow_but_first
@pytest.mark.parametrize(("w0", "engine"), [(0.5, "numpy"), (0.9, "numpy"), (0.9, "numba")])
def test_reflection_of_isotropic_scattering(w0, engine):
    """Light that leaves a semi-infinite medium (Chandrasekhar 1950, III)."""
    if engine == "numba":
        pytest.importorskip("numba")
    cosines = np.array([0.2, 0.5, 0.9, 1.0])
    views = [(0.0, (math.sqrt(1 - mu**2), 0.0, -mu)) for mu in cosines]
    found = run(column(1 - w0, w0), Isotropic(), views=views, engine=engine).total.L
    *H, H0 = chandrasekhar_H(w0, [*cosines, 0.8])
    expected = w0 / (4 * math.pi) / (cosines + 0.8) * np.array(H) * H0
    assert found.relative_error.max() < 0.02
    agree(found, expected[:, None])


def test_chandrasekhar_H_has_its_known_mean():
    nodes, weights = np.polynomial.legendre.leggauss(32)
    mean = (chandrasekhar_H(0.9, (nodes + 1) / 2) * weights / 2).sum()
    assert mean == pytest.approx(2 / 0.9 * (1 - math.sqrt(0.1)), rel=1e-4)


@pytest.mark.parametrize(
    ("surface", "phase", "engine"),
    [
        ("none", FournierForand(), "numpy"),
        ("flat", HenyeyGreenstein(0.8), "auto"),
        pytest.param("none", HenyeyGreenstein(0.8), "numpy", marks=pytest.mark.slow),
        pytest.param("flat", FournierForand(), "numpy", marks=pytest.mark.slow),
    ],
)
def test_white_furnace(surface, phase, engine):
    """Nothing absorbs under a uniform sky: the radiance is n² everywhere."""
    water = column(
        0.0, 0.3, sun_irradiance=0.0, sky_radiance=1.0, floor_depth=3.0, floor_reflectance=1.0,
        surface=surface,
    )  # fmt: skip
    views = [(1.0, (math.sqrt(1 - z**2), 0.0, z)) for z in (-1.0, -0.4, 0.3, 0.6, 0.95)]
    options = {"views": views, "photons": 8_000, "cone": 5.0, "engine": engine}
    found = run(water, phase, [0.0, 1.5, 3.0], **options).total
    n2 = 1.34**2 if surface == "flat" else 1.0
    agree(found.L, n2)
    for quantity, wanted in (("Ed", 1), ("Eu", 1), ("E0", 4)):
        agree(getattr(found, quantity), math.pi * n2 * wanted)


@pytest.mark.parametrize("sky", ["uniform", "cardioidal"])
def test_skylight_in_the_water(sky):
    water = column(0.1, 0.0, sun_irradiance=0.0, sky_radiance=2.0, surface="flat")
    views = [(1.0, UP), (1.0, (0.8, 0.0, 0.6))]
    found = run(water, depths=[0.0], sky=sky, views=views).total
    zenith = 3 / (1 + 4 / 3) if sky == "cardioidal" else 1.0
    expected = 2 * 1.34**2 * zenith * (1 - float(fresnel_reflectance(1.0))) * math.exp(-0.1)
    np.testing.assert_allclose(found.L.mean[:, 0], [expected, 0.0], rtol=1e-9)
    if sky == "uniform":
        E_sky = 2 * math.pi * 1.34**2 * (1 - diffuse_internal_reflectance(1.34))
        np.testing.assert_allclose(found.Ed.mean, E_sky, rtol=1e-4)


def test_view_of_the_floor_and_its_mirror_image():
    """Through absorbing water: direct, and reflected totally under the surface."""
    water = column(0.1, 0.0, floor_depth=4.0, floor_reflectance=0.5, surface="flat")
    views = [(1.0, DOWN), (1.0, (0.8, 0.0, 0.6)), (1.0, DOWN, 2.0)]
    found = run(water, depths=[4.0], views=views).total
    # Light that the surface sends back to the floor counts: the floor's own irradiance.
    ways = np.exp(-0.1 * np.array([3.0, 5.0 / 0.6]))
    radiance = 0.5 / math.pi * found.Ed.mean[0, 0] * ways
    np.testing.assert_allclose(found.L.mean[:2, 0], radiance, rtol=0.02)
    assert found.L.mean[2, 0] == 0


def test_path_radiance_adds_up():
    water = column(floor_depth=6.0, floor_reflectance=0.3)
    w = (0.6, 0.0, -0.8)
    views = [(2.0, w), (2.0, w, 2.5), (4.0, w)]
    whole, path, beyond = run(water, views=views, cone=5.0).total.L.mean[:, 0]
    assert abs(path + math.exp(-0.4 * 2.5) * beyond - whole) < 0.03 * whole
    endless = run(water, views=[(2.0, w, math.inf), (2.0, w, 5.0)]).total.L.mean[:, 0]
    assert endless[0] == pytest.approx(endless[1])


@dataclass(frozen=True)
class Energy:
    """Where the power of one band went, by meters that know nothing of each other, per power in."""

    absorbed: float  # a ∫ E0 dy, of the irradiance meters
    escaped: float  # photons that left through the surface
    in_floor: float  # (1 - r) Ed of a meter there
    absorptions: float  # photons that ended by absorption in the water

    @property
    def balance(self):
        """Absorbed + escaped + absorbed by the floor - emitted; nothing is truncated."""
        return self.absorbed + self.escaped + self.in_floor - 1


def energies(phase, photons, engine="numpy", seed=0):
    """One :class:`Energy` per band: equal bands are independent runs."""
    bands, y_f, r, a = 8, 3.0, 0.2, 0.3
    nodes, weights = np.polynomial.legendre.leggauss(12)
    depths = np.append((nodes + 1) / 2 * y_f, y_f)
    water = column(a, 0.1, np.linspace(400, 700, bands), floor_depth=y_f, floor_reflectance=r,
                   surface="flat")  # fmt: skip
    found = run(water, phase, depths, photons=photons, engine=engine, seed=seed)
    emitted = found.incident / water.bands.widths
    E0, Ed = found.total.E0.mean[:-1], found.total.Ed.mean[-1]
    parts = (
        a * y_f / 2 * weights @ E0,
        found.event("left through the surface").power / water.bands.widths,
        (1 - r) * Ed,
        sum(e.power for e in found.events if e.name == "absorption by water") / water.bands.widths,
    )
    return [Energy(*(float(part[i] / emitted[i]) for part in parts)) for i in range(bands)]


def mean_and_error(values):
    return np.mean(values), np.std(values, ddof=1) / math.sqrt(len(values))


def test_energy_is_kept():
    """Absorbed, escaped and sunk into the floor, each counted for itself, are what was emitted."""
    found = energies(HenyeyGreenstein(0.8), 600_000)
    balance, error = mean_and_error([e.balance for e in found])
    assert error < 2e-3
    assert abs(balance) < 4.5 * error
    counted, error = mean_and_error([e.absorbed - e.absorptions for e in found])
    assert error < 2e-3
    assert abs(counted) < 4.5 * error
    assert 0.1 < np.mean([e.in_floor for e in found]) < 0.9


@pytest.mark.slow
def test_energy_balance_to_one_in_ten_thousand(record_property):
    pytest.importorskip("numba")
    found = [e for seed in range(4) for e in energies(FournierForand(), 10_000_000, "numba", seed)]
    balance, error = mean_and_error([e.balance for e in found])
    record_property("balance", f"{balance:+.1e} ± {error:.1e}")
    assert error < 1.5e-4
    assert abs(balance) < 1e-4 + 3 * error


def test_gershun():
    """The net flux loses what is absorbed: F(0) - F(y) = a ∫ E0 dy."""
    from scipy.integrate import cumulative_simpson

    depths = np.linspace(0, 3, 13)
    water = column(0.3, 0.3, floor_depth=3.0, floor_reflectance=0.4, surface="flat")
    light = run(water, depths=depths, photons=60_000).total
    net = (light.Ed.mean - light.Eu.mean)[:, 0]
    absorbed = 0.3 * cumulative_simpson(light.E0.mean[:, 0], x=depths, initial=0)
    np.testing.assert_allclose(net[0] - net, absorbed, atol=0.01 * net[0])
    np.testing.assert_allclose(light.Eu.mean[-1], 0.4 * light.Ed.mean[-1], rtol=0.02)


def test_every_photon_ends_once():
    """Power and number of the photons that ended; the shift takes its part of the power."""
    water = column([0.1, 0.3], 0.2, (450.0, 600.0), sky_radiance=0.1, floor_depth=5.0,
                   floor_reflectance=0.3, surface="flat")  # fmt: skip
    shift = InelasticInteraction("Raman", [0.05, 0.0], [[0.2, 0.6], [0.0, 0.0]])
    found = run(water, depths=[0.0, 5.0], photons=200_000, inelastic=[shift])
    assert abs(found.energy_balance) < 1e-4
    ended = sum(e.count.sum() for e in found.events if e.name.startswith(("absorption", "left")))
    lost = found.photons - ended
    expected = 0.2 * found.event("Raman").count.sum()
    assert abs(lost - expected) < 5 * math.sqrt(expected)
    # And by the irradiances, which do not know the tallies of the events.
    entered = found.incident / water.bands.widths
    net = found.total.Ed.mean - found.total.Eu.mean
    leaving = found.event("left through the surface").deposit / water.bands.widths
    in_floor = found.event("absorption by the floor").deposit / water.bands.widths
    np.testing.assert_allclose(net[1], in_floor, rtol=0.03)
    np.testing.assert_allclose(entered - leaving, net[0], rtol=0.01)


# Changing the wavelength


@pytest.mark.parametrize("engine", ["numpy", "numba"])
def test_emission_of_a_line(engine):
    """Isotropic emission into a band without extinction: Ed is half of what was made above."""
    if engine == "numba":
        pytest.importorskip("numba")
    water = column([0.2, 0.0], 0.0, (450.0, 600.0), floor_depth=5.0, sun_irradiance=[1.0, 0.0])
    shift = InelasticInteraction("line", [0.1, 0.0], [[0.0, 0.7], [0.0, 0.0]], absorber="water")
    depths = np.array([1.0, 3.0, 5.0])
    found = run(water, depths=depths, inelastic=[shift], engine=engine)
    made = 0.1 * 0.7 * 450 / 600 * (1 - np.exp(-0.25 * depths)) / 0.2
    agree(_column(found.parts["line"].Ed, 1), made / 2)
    agree(_column(found.parts["line"].Eu, 1)[:2], (made[-1] - made)[:2] / 2)
    np.testing.assert_array_equal(found.parts["elastic"].Ed.mean[:, 1], 0)
    np.testing.assert_allclose(found.total.Ed.mean[:, 0], np.exp(-0.25 * depths))
    # Photons are conserved: each excitation is emitted, or lost as the yield says.
    count = {event.name: event.count for event in found.events}
    ended = sum(c for name, c in count.items() if name != "line").sum()
    started = found.photons
    lost = started - ended
    assert abs(lost - 0.3 * count["line"].sum()) < 5 * math.sqrt(0.3 * count["line"].sum())
    assert count["line"][1] == 0
    fraction = count["line"][0] / (count["line"][0] + count["absorption by water"][0])
    assert abs(fraction - 0.5) < 0.02


def test_full_yield_loses_no_photon():
    water = column([0.05, 0.1, 0.2], 0.2, (450.0, 550.0, 650.0))
    raman = InelasticInteraction(
        "Raman", [0.1, 0.05, 0.0], [[0, 0.5, 0.5], [0, 0, 1.0], [0, 0, 0]], EinsteinSmoluchowski()
    )
    found = run(water, depths=[1.0], inelastic=[raman])
    ends = [e for e in found.events if "absorption" in e.name or "left" in e.name]
    assert sum(e.count.sum() for e in ends) == found.photons
    shift = found.event("Raman")
    stokes = shift.power[1] * (1 - 550 / 650)  # all of the second band goes to the third
    assert shift.deposit[1] == pytest.approx(stokes)


def test_mixture_of_two_functions_of_a_kind():
    both = BandPhase((FournierForand(1.1, 0.01), FournierForand(1.15, 0.04)), [[0.25], [0.75]])
    found = simulate(column(), both, photons=20_000, engine="numpy")
    one, two = (found.event(f"scattering by FournierForand {i}").count.sum() for i in (1, 2))
    assert abs(one / (one + two) - 0.25) < 0.02


def test_roulette_of_ten_events():
    """The paper's Table 3: four absorptions, three scatterings, three inelastic events."""
    parts = [
        Constituent("water", 0.04, 0.01, EinsteinSmoluchowski()),
        Constituent("phytoplankton", 0.08, 0.05, FournierForand()),
        Constituent("minerals", 0.03, 0.09, HenyeyGreenstein(0.9)),
        Constituent("CDOM", 0.05),
    ]
    to_red = np.array([[0.0, 0.02], [0.0, 0.0]])
    inelastic = [
        InelasticInteraction("Raman", [0.004, 0.0], [[0, 1.0], [0, 0]], EinsteinSmoluchowski(0.55)),
        InelasticInteraction(
            "chlorophyll fluorescence", [0.06, 0], to_red, absorber="phytoplankton"
        ),
        InelasticInteraction("CDOM fluorescence", [0.05, 0.0], to_red, absorber="CDOM"),
    ]
    water = column(0.2, 0.15, (450.0, 685.0))
    found = simulate(
        water, parts, [1.0], inelastic=inelastic, photons=100_000, engine="numpy", seed=4
    )
    assert len(found.events) == 10 + 2
    blue = np.array([event.count[0] for event in found.events[:10]], dtype=float)
    wanted = np.array([0.04, 0.02, 0.03, 0.0, 0.01, 0.05, 0.09, 0.004, 0.06, 0.05])
    used = wanted > 0
    assert blue[~used].sum() == 0
    expected = wanted[used] / wanted.sum() * blue.sum()
    assert chi_square_probability(blue[used], expected) > 1e-3


def _column(estimate, band):
    class Slice:
        def __init__(self, mean, error):
            self.mean, self.error = mean, error

        def __getitem__(self, item):
            return Slice(self.mean[item], self.error[item])

    return Slice(estimate.mean[:, band], estimate.error[:, band])


# Engines, seeds, batches


@pytest.mark.parametrize(
    "changes",
    [
        {"sky_radiance": 0.1, "floor_depth": 4.0, "floor_reflectance": 0.3, "surface": "flat"},
        {},
    ],
    ids=["shallow", "deep"],
)
def test_engines_agree(changes):
    pytest.importorskip("numba")
    water = column([0.1, 0.3], 0.3, (450.0, 600.0), **changes)
    shift = InelasticInteraction("Raman", [0.05, 0.0], [[0.2, 0.6], [0.0, 0.0]], Isotropic())
    views = [(1.0, DOWN), (2.0, (0.8, 0.0, 0.6)), (2.0, (0.6, 0.0, -0.8), 1.5)]
    numpy, numba = (
        run(water, FournierForand(), [0.0, 1.0, 4.0], views=views, cone=5.0, inelastic=[shift],
            engine=engine, photons=20_000, seed=11)
        for engine in ("numpy", "numba")
    )  # fmt: skip
    assert (numpy.engine, numba.engine) == ("numpy", "numba")
    for part in ("Raman", "elastic"):
        for quantity in ("Ed", "Eu", "Eod", "Eou", "E0", "L"):
            one, two = (getattr(r.parts[part], quantity) for r in (numpy, numba))
            error = np.hypot(one.error, two.error)
            assert np.all(np.abs(one.mean - two.mean) <= 5 * error + 1e-12), (part, quantity)
    for one, two in zip(numpy.events, numba.events, strict=True):
        spread = np.sqrt(one.count + two.count)
        assert np.all(np.abs(one.count - two.count) <= 5 * 2 * spread + 5)


@pytest.mark.parametrize("engine", ["numpy", "numba"])
def test_reproducible_by_seed(engine):
    if engine == "numba":
        pytest.importorskip("numba")
    options = {"depths": [0.5, 1.0], "photons": 600, "engine": engine}
    water = column(1.0, 0.5)
    first, again, other = (run(water, seed=s, **options) for s in (5, 5, 6))
    threaded = run(water, seed=5, threads=3, **options)
    np.testing.assert_array_equal(first.total.Eu.mean, again.total.Eu.mean)
    np.testing.assert_array_equal(first.total.Eu.mean, threaded.total.Eu.mean)
    assert np.all(first.total.Eu.mean != other.total.Eu.mean)


def test_standard_errors_are_those_of_repeated_runs():
    """Bands of the same water are independent runs."""
    water = column(wavelengths=np.linspace(400, 700, 60))
    found = run(water, depths=[3.0], photons=60_000).total.Ed
    stated = math.sqrt((found.error**2).mean())
    assert 0.7 < np.std(found.mean, ddof=1) / stated < 1.4


def test_engine_without_numba(monkeypatch):
    monkeypatch.setattr(solver, "numba_available", lambda: False)
    assert run(column(), photons=100, engine="auto").engine == "numpy"
    with pytest.raises(InputError, match="not installed"):
        run(column(), photons=100, engine="numba")


def test_memory_does_not_grow_with_photons(monkeypatch):
    import tracemalloc

    monkeypatch.setattr(solver, "_BATCH", 2000)
    peaks = []
    for number in (40_000, 80_000):
        tracemalloc.start()
        run(column(1.0, 0.05), photons=number)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


# Input that cannot be used


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"photons": 0}, "photons"),
        ({"photons": 1.5}, "photons"),
        ({"photons": math.nan}, "photons"),
        ({"photons": 1e14}, "1e13"),
        ({"seed": -1}, "seed"),
        ({"threads": 0}, "threads"),
        ({"engine": "cuda"}, "engine"),
        ({"sky": "blue"}, "sky"),
        ({"cone": 0.0}, "cone"),
        ({"cone": math.nan}, "cone"),
        ({"depths": [7.0]}, "depth 7 m"),
        ({"depths": [-1.0]}, "depth -1 m"),
        ({"depths": [2.0, 1.0]}, "increasing"),
        ({"depths": [math.nan]}, "finite"),
        ({"depths": [[1.0]]}, "list"),
        ({"views": [(1.0, (1.0, 0.0, 0.0))]}, "level"),
        ({"views": [(1.0, (1.0, 0.0, 1.0))]}, "unit"),
        ({"views": [(1.0, (0.0, 1.0))]}, "unit"),
        ({"views": [(9.0, UP)]}, "depth 9 m"),
        ({"views": [(1.0, UP, -1.0)]}, "positive"),
        ({"views": [(1.0, UP, 1.0, 1.0)]}, "positive"),
        ({"views": [1.0]}, "view"),
        ({"inelastic": [InelasticInteraction("x", [0.1, 0.1], np.eye(2))]}, "1 bands"),
        ({"inelastic": [InelasticInteraction("x", [0.1], [[1.0]], absorber="y")]}, "named 'y'"),
        ({"inelastic": [InelasticInteraction("x", [0.2], [[1.0]], absorber="water")]}, "more than"),
        ({"inelastic": [InelasticInteraction("water", [0.1], [[1.0]])]}, "two parts"),
    ],
)
def test_bad_options(options, message):
    with pytest.raises(InputError, match=message):
        run(column(floor_depth=6.0), **({"photons": 100} | options))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Constituent("x", -0.1), "not negative"),
        (lambda: Constituent("x", 0.1, math.nan), "finite"),
        (lambda: Constituent("x", "much"), "not numbers"),
        (lambda: InelasticInteraction("x", [0.1], [[1.1]]), "adds up to 1.1"),
        (lambda: InelasticInteraction("x", [0.1], [[-0.1]]), "not negative"),
        (lambda: InelasticInteraction("x", [0.1], [0.1]), "n × n"),
        (lambda: InelasticInteraction("x", [math.inf], [[0.1]]), "finite"),
        (lambda: simulate(column(), [Constituent("x", 0.1, 0.2)]), "adds up"),
        (lambda: simulate(column(), [Constituent("x", [0.1, 0.1], 0.3)]), "1 bands"),
        (lambda: simulate(column(), parse_phase("hg:0.8").for_bands([1.0, 1.0])), "2 bands"),
        (lambda: run(column(0.0)), "never ends"),
        (lambda: run(column(sun_irradiance=0.0)), "no light"),
        (lambda: run(column(sun_cosine=0.5)), "sun must travel"),
        (lambda: run(column(surface="flat", refractive_index=0.9)), "refractive index"),
        (lambda: run(column(), _Doubled()), "integrates to 2"),
    ],
)
def test_bad_medium(make, message):
    with pytest.raises(InputError, match=message):
        make()


class _Doubled(Isotropic):
    def per_steradian(self, s2, m=None):  # noqa: ARG002
        return 0.0 * s2 + 1 / (2 * math.pi)


# The command line


@pytest.mark.slow
def test_command_line(tmp_path):
    table, picture = tmp_path / "out.csv", tmp_path / "out.png"
    command = [sys.executable, "-m", "validation", "--water", "jerlov:II"]
    command += ["--bands", "3", "--depths", "1,5", "--photons", "2000", "--surface", "flat"]
    command += ["--engine", "numpy", "--floor-depth", "8", "--floor-reflectance", "0.2"]
    done = subprocess.run(
        [*command, "--csv", str(table), "--plot", str(picture)],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "100 %" in done.stderr
    assert "energy balance" in done.stdout
    rows = table.read_text().splitlines()
    assert rows[1].startswith("quantity,part,depth_m")
    assert sum(row.startswith("Ed,total") for row in rows) == 6
    assert picture.read_bytes().startswith(b"\x89PNG")
    refused = subprocess.run([*command, "--photons", "0"], cwd=ROOT, capture_output=True, text=True)
    assert refused.returncode == 2
    assert "photons" in refused.stderr
    assert "Traceback" not in refused.stderr


def test_command_line_inside_the_package(capsys, tmp_path):
    main = importlib.import_module(f"{monte_carlo.__name__}.command_line").main
    options = ["--photons", "100", "--bands", "2", "--engine", "numpy"]
    table = tmp_path / "out.csv"
    given = ["--water", "0.1,0.2", "--phase", "hg:0.8", "--depths", "1", "--csv", str(table)]
    assert main([*options, *given]) == 0
    written = capsys.readouterr()
    assert "Ed" in written.out
    assert "100 %" in written.err
    rows = table.read_text().splitlines()
    assert sum(row.startswith("Ed,total") for row in rows) == 2
    assert main([*options, "--water", "0.1"]) == 2


def test_command_line_with_inelastic_light(capsys, tmp_path):
    main = importlib.import_module(f"{monte_carlo.__name__}.command_line").main
    table = tmp_path / "out.csv"
    options = ["--photons", "2000", "--bands", "10", "--range", "300,800", "--engine", "numpy"]
    options += ["--depths", "2", "--csv", str(table)]
    assert main([*options, "--water", "case:baltic", "--inelastic", "all"]) == 0
    assert "inelastic Ed" in capsys.readouterr().out
    parts = {row.split(",")[1] for row in table.read_text().splitlines()[2:]}
    assert parts == {"total", "elastic", "raman light", "chlorophyll light", "cdom light"}
    narrow = [*options, "--range", "300,700"]
    assert main([*narrow, "--water", "jerlov:II", "--inelastic", "raman"]) == 0
    capsys.readouterr()
    for water, phase in (("jerlov:II", "mixture"), ("bio:chl=1", "hg:0.9")):
        given = ["--water", water, "--phase", phase, "--inelastic", "cdom"]
        assert main([*narrow, *given]) == 2
        assert "bio: or case:" in capsys.readouterr().err
