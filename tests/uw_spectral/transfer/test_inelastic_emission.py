"""Light that is emitted in the water, in the solved field; and what excites it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.description import (
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
)
from underwater_spectral.uw_spectral.imaging.excitation import Excitation
from underwater_spectral.uw_spectral.imaging.optics import resolve
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    Emission,
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.inelastic_emission import inelastic_emission
from underwater_spectral.uw_spectral.transfer.rough_surface import WaterSurface
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.inelastic_processes import (
    EXCITATION,
    InelasticProcess,
    energy_matrix,
)
from underwater_spectral.uw_spectral.water.phase_functions import Isotropic, parse_phase
from underwater_spectral.validation.closed_form.light_field import light_field_of
from underwater_spectral.validation.inelastic_light import excitation_fields, solve_inelastic
from underwater_spectral.validation.monte_carlo import (
    InelasticInteraction,
    numba_available,
    simulate,
)

DOWN = (0.0, 0.0, -1.0)


def _layer(a, b, bottom, rate=None, power=None, phase="hg:0.8"):
    a, b = np.atleast_1d(np.asarray(a, float)), np.atleast_1d(np.asarray(b, float))
    emission = None if rate is None else Emission(rate, power)
    return OpticalLayer(bottom, a, b, parse_phase(phase).for_bands(b), emission)


def test_emission_in_water_that_only_absorbs():
    """Also where the rate of the source is that of a ray, and one that grows with depth."""
    a, floor = 0.5, 6.0
    layer = _layer(a, 0.0, floor, [[0.4], [-0.3], [0.0]], [[2.0], [3.0], [1.0]])
    field = solve_discrete_ordinates([layer], [0.0], DOWN, streams=8)
    mu, y = np.array([-1.0, -0.4, 0.1, 0.5 / 0.4, 0.9]), np.array([0.0, 0.7, 5.9])
    mu[3] = field.mu[1]
    found = field.scattered_on_grid(y, mu, [0.0])[0, ..., 0]
    nodes, weights = np.polynomial.legendre.leggauss(200)
    for i, j in np.ndindex(found.shape):
        end = 0.0 if mu[j] > 0 else floor
        z = y[i] + (end - y[i]) * (nodes + 1) / 2
        source = (2 * np.exp(-0.4 * z) + 3 * np.exp(0.3 * (z - floor)) + 1) / (4 * math.pi)
        length = np.abs(z - y[i]) / abs(mu[j])
        step = abs(end - y[i]) / abs(mu[j]) / 2
        wanted = step * (weights * source * np.exp(-a * length)).sum()
        assert found[i, j] == pytest.approx(wanted, rel=1e-8)
    np.testing.assert_allclose(layer.emission.at([0.0], floor), 3 + 3 * math.exp(-0.3 * floor))


@pytest.mark.parametrize("index", [None, 1.34])
def test_net_flux_grows_by_what_is_emitted(index):
    """Gershun's law with sources, through layers, over a floor; and sunlight adds to it."""
    upper = [0.4, 3.0], [[1.0, 0.5], [0.3, 2.0]]
    a = np.array([[0.1, 0.4], [0.3, 0.2]])
    layers = [
        _layer(a[0], [0.6, 0.2], 2.0, np.c_[upper[0], upper[0]], upper[1], "petzold"),
        _layer(a[1], [0.3, 0.9], 5.0, [[-0.5, -0.1]], [[1.0, 2.0]], "petzold"),
    ]
    how = {"surface": index and WaterSurface(index), "floor_reflectance": 0.4}
    field = solve_discrete_ordinates(layers, [0.0, 0.0], DOWN, **how)
    for place, (top, bottom) in enumerate(((0.0, 2.0), (2.0, 5.0))):
        y = np.linspace(top, bottom, 4001)
        y[0] += 1e-12
        net, E0 = field.Ed(y) - field.Eu(y), field.scalar_irradiance(y)
        emitted = layers[place].emission.at(y - top, bottom - top)
        gained = np.trapezoid(emitted - a[place] * E0, y, axis=0)
        scale = np.trapezoid(emitted, y, axis=0)
        np.testing.assert_allclose((net[-1] - net[0]) / scale, gained / scale, atol=1e-5)
    np.testing.assert_allclose(field.Eu(5.0), 0.4 * field.Ed(5.0), rtol=1e-9)
    plain = [OpticalLayer(x.bottom, x.absorption, x.scattering, x.phase) for x in layers]
    sunlit, both = (solve_discrete_ordinates(x, [1.0, 2.0], DOWN, **how) for x in (plain, layers))
    w = ([0.6, 0.0], [0.0, 0.8], [0.8, -0.6])
    np.testing.assert_allclose(
        both.radiance(3.0, w), sunlit.radiance(3.0, w) + field.radiance(3.0, w), rtol=1e-10
    )


@pytest.mark.skipif(not numba_available(), reason="without numba it takes minutes")
def test_changed_light_against_monte_carlo():
    n, floor, depths = 1.34, 5.0, [0.0, 1.0, 4.0]
    bands = Bands([450.0, 600.0], [20.0, 20.0])
    a, b = np.array([0.15, 0.3]), np.array([0.4, 0.6])
    column = WaterColumn(bands, a, b, [1.0, 0.0], 0.8, (0.6, 0.0, -0.8), [0.1, 0.0], floor, 0.3,
                         "flat", n)  # fmt: skip
    phase = parse_phase("hg:0.8").for_bands(b)
    photons = np.array([[0.0, 0.7], [0.0, 0.0]])
    line = InelasticInteraction("line", [0.1, 0.0], photons, Isotropic(), absorber="water")
    views = [(1.0, (0.6, 0.0, -0.8)), (1.0, (0.0, 0.6, 0.8)), (1.0, (0.96, 0.0, 0.28))]
    truth = simulate(column, phase, depths, views=views, inelastic=[line], photons=1_000_000,
                     threads=2).parts["line"]  # fmt: skip
    process = InelasticProcess("line", np.array([0.1, 0.0]), photons, Isotropic())
    emission = inelastic_emission([process], column.solved_field(phase, modes=1), bands, bands)
    field = column.solved_field(phase, emission=emission)
    for name in ("Ed", "Eu"):
        found, wanted = getattr(field, name)(depths)[:, 1], getattr(truth, name)
        error = 4 * wanted.error[:, 1] + 0.004 * wanted.mean[:, 1]
        assert np.all(np.abs(found - wanted.mean[:, 1]) < error), name
    found = field.radiance(1.0, np.transpose([w for _, w in views]))[:, 1]
    error = 4 * truth.L.error[:, 1] + 0.01 * truth.L.mean[:, 1]
    assert np.all(np.abs(found - truth.L.mean[:, 1]) < error)
    assert column.solved_field(phase, emission=emission) is field


@pytest.mark.skipif(not numba_available(), reason="without numba it takes minutes")
def test_light_that_changes_its_wavelength_twice_against_monte_carlo():
    """From blue to green to red; red light starts nowhere else."""
    bands, to_next = Bands([450.0, 525.0, 600.0], [20.0] * 3), 0.7 * np.eye(3, k=1)
    a, b, rate = np.array([0.15, 0.2, 0.3]), np.array([0.4, 0.5, 0.6]), np.array([0.1, 0.12, 0.0])
    column = WaterColumn(bands, a, b, [1.0, 0.0, 0.0], 0.8, (0.6, 0.0, -0.8), [0.1, 0.0, 0.0], 5.0,
                         0.3, "flat", 1.34)  # fmt: skip
    phase, depths = parse_phase("hg:0.8").for_bands(b), [0.0, 1.0, 4.0]
    line = InelasticInteraction("line", rate, to_next, Isotropic(), absorber="water")
    truth = simulate(column, phase, depths, inelastic=[line], photons=1_000_000,
                     threads=2).parts["line"]  # fmt: skip
    process = (InelasticProcess("line", rate, to_next, Isotropic()),)
    field = column.solved_field(
        phase, emission=Excitation(process, column, phase, process).emission(bands)
    )
    alone = Excitation(process, column, phase).emission(bands)
    assert column.solved_field(phase, emission=alone).Ed(1.0)[2] == pytest.approx(0.0, abs=1e-12)
    for name in ("Ed", "Eu"):
        found, wanted = getattr(field, name)(depths)[:, 1:], getattr(truth, name)
        error = 4 * wanted.error[:, 1:] + 0.006 * wanted.mean[:, 1:]
        assert np.all(np.abs(found - wanted.mean[:, 1:]) < error), name
        assert np.all(4 * wanted.error[:, 1:] < 0.08 * wanted.mean[:, 1:])


def _described(water, floor, zenith, surface="flat"):
    return resolve(
        Description(
            WaterDescription(water, inelastic="all"), SunAndSky("d65", zenith, 0.0, 0.1),
            SurfaceDescription(surface), FloorDescription(floor, "0.4"), bands=Bands.uniform(8),
        )
    )  # fmt: skip


@pytest.mark.parametrize("water", ["bio:case1=0.05", "bio:case1=5", "case:baltic"])
@pytest.mark.parametrize("floor", [math.inf, 2.0, 40.0])
def test_few_exponentials_stand_for_the_source(water, floor):
    for zenith in (10.0, 85.0):
        optics = _described(water, floor, zenith, "none")
        column, phase = optics.excitation.column, optics.excitation.phase
        exciting = column.solved_field(phase, 24, modes=1)
        processes, bands = optics.excitation.processes, optics.bands
        emission = inelastic_emission(processes, exciting, EXCITATION, bands)
        y = min(floor, 400.0) * np.linspace(0, 1, 800) ** 3
        exact = exciting.scalar_irradiance(y) @ energy_matrix(processes, EXCITATION, bands)
        shown = exact > 1e-3 * exact.max(axis=0)
        assert shown[1:].any(axis=0)[1:].all()
        error = emission.at(y, floor) / np.maximum(exact, 1e-300) - 1
        assert np.abs(error[shown]).max() < 5e-3


def test_described_water_glows():
    """The part of the field that has changed its wavelength, as the closed form has it."""
    optics = _described("bio:case1=1", 20.0, 30.0)
    field, elastic = optics.solved_field(24), optics.column.solved_field(optics.phase, 24)
    y = np.array([0.5, 5.0, 15.0])
    changed = field.scalar_irradiance(y) - elastic.scalar_irradiance(y)
    excitation = optics.excitation
    closed = solve_inelastic(
        excitation.processes, excitation_fields(excitation.column, excitation.phase), EXCITATION,
        light_field_of(optics.column, optics.phase), optics.bands,
    )  # fmt: skip
    np.testing.assert_allclose(changed, [closed.E0(x) for x in y], rtol=0.5)
    np.testing.assert_allclose(changed[1], closed.E0(5.0), rtol=0.2)
    assert np.all(changed[:, 1:] > 0)
    plain = resolve(Description())
    assert plain.solved_field(8).Ed(1.0).shape == (len(plain.bands),)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Emission([0.1], [[math.nan]]), "finite"),
        (lambda: Emission([[0.1, 0.2]], [[1.0]]), "one shape"),
        (lambda: _solve(_layer(0.1, 0.1, 5.0, [[0.1, 0.1]], [[1.0, 1.0]])), "1 bands"),
        (lambda: _solve(_layer(0.1, 0.1, math.inf, [[-0.1]], [[1.0]])), "infinite depth"),
    ],
)
def test_emission_that_cannot_be_used(make, words):
    with pytest.raises(InputError, match=words):
        make()


def _solve(layer):
    return solve_discrete_ordinates([layer], [1.0], DOWN, streams=8)
