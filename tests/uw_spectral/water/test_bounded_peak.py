"""Lobes with a bounded forward peak, and the light field with them and with the exact one."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.transfer.water_column import WaterColumn
from underwater_spectral.uw_spectral.water.bounded_peak import (
    LARGEST_ASYMMETRY,
    bound_forward_peak,
)
from underwater_spectral.uw_spectral.water.optical_properties import (
    JERLOV_TYPES,
    Water,
)
from underwater_spectral.uw_spectral.water.phase import BandPhase, PhaseFunction
from underwater_spectral.uw_spectral.water.phase_functions import (
    EinsteinSmoluchowski,
    FournierForand,
    draine,
    henyey_greenstein,
    parse_phase,
    seawater_mixture,
)
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering

NM = np.array([425.0, 475.0, 525.0, 575.0, 625.0, 675.0])


class _Draine(PhaseFunction):
    def __init__(self, g, alpha):
        self._shape = float(g), float(alpha)

    def per_steradian(self, s2, m=None):  # noqa: ARG002
        return draine(*self._shape, s2)


def _as_phase(fit):
    """The lobes as a phase function of its own, and the factor on scattering."""
    total = fit.fractions.sum(axis=0)
    shapes = list(itertools.product(range(2), range(len(total))))
    lobes = tuple(_Draine(fit.asymmetries[i, k], fit.alphas[i, k]) for i, k in shapes)
    weights = np.zeros((len(lobes), len(total)))
    for row, (i, k) in enumerate(shapes):
        weights[row, k] = fit.fractions[i, k] / total[k]
    return BandPhase(lobes, weights), total


def test_draine_is_molecules_and_henyey_greenstein():
    s2 = np.linspace(0.001, 1, 7)
    molecules = EinsteinSmoluchowski().per_steradian(s2)
    np.testing.assert_allclose(draine(0.0, (1 - 0.039) / 1.039, s2), molecules)
    np.testing.assert_allclose(draine(0.7, 0.0, s2), henyey_greenstein(0.7, s2))
    for shape in ((0.5, 2.0), (0.9, 1e3), (-0.3, 0.4)):
        assert _Draine(*shape).normalisation() == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("particles", ["fournier-forand:1.1,0.0183", "petzold"])
@pytest.mark.parametrize("molecules", [0.0, 0.02, 0.2, 1.0])
def test_backscatter_and_moments_are_kept(particles, molecules):
    phase = seawater_mixture([1.0], [molecules], parse_phase(particles))
    fit = bound_forward_peak(phase)
    scattered, total = _as_phase(fit)
    assert fit.asymmetries.max() <= LARGEST_ASYMMETRY
    assert scattered.backscatter_ratio * total == pytest.approx(phase.backscatter_ratio, rel=0.02)
    for order, (own, found) in enumerate(
        zip(phase.moments(5), scattered.moments(5), strict=True), start=1
    ):
        if order != 4:
            assert total * (1 - found) == pytest.approx(1 - own, rel=0.025), order
    assert fit.error < 0.16


def test_molecules_alone_are_kept_exactly():
    fit = bound_forward_peak(EinsteinSmoluchowski().for_bands(np.ones(2)))
    s2 = np.linspace(0.0, 1.0, 9)
    wanted = EinsteinSmoluchowski().per_steradian(s2)[:, None].repeat(2, 1)
    np.testing.assert_allclose(fit.per_steradian(s2), wanted, rtol=1e-9)


def test_a_peak_that_no_lobe_follows_shows_its_error():
    assert bound_forward_peak(FournierForand(1.02, 0.0002).for_bands([1.0])).error > 0.25


def _errors(name, depths, zenith):
    """Relative errors of radiance, E0, Eu and Ed that the bounded peak makes."""
    water, rng = Water.jerlov(name), np.random.default_rng(3)
    b_w = molecular_scattering(NM)
    a, b = water.a(NM), np.maximum(water.b(NM), b_w)
    phase = seawater_mixture(b, b_w)
    bounded, total = _as_phase(bound_forward_peak(phase))
    mu, turn = rng.uniform(-1, 1, 40), rng.uniform(0, 2 * math.pi, 40)
    across = np.sqrt(1 - mu**2)
    w = across * np.cos(turn), across * np.sin(turn), mu
    sun = np.asarray(sun_travel_direction(zenith, 60.0))
    found = []
    for optical in depths:
        y = min(optical / (a + b)[1], 40.0)
        fields = [
            WaterColumn(
                Bands.uniform(len(NM)), a, scattering, np.ones(len(NM)),
                float(in_water_cosine(zenith)), sun, np.full(len(NM), 0.1),
                y + 3 / (a + b)[1], np.full(len(NM), 0.3), "flat", 1.34, sky="clear",
            ).solved_field(p, 48)
            for scattering, p in ((b, phase), (b * total, bounded))
        ]  # fmt: skip
        L, E0, Eu, Ed = (
            np.divide(*reversed(both)) - 1
            for both in zip(
                *(
                    (f.radiance(np.full(40, y), w), f.scalar_irradiance(np.array([y])), f.Eu(y),
                     f.Ed(y))
                    for f in fields
                ),
                strict=True,
            )
        )  # fmt: skip
        far = -sum(s * part for s, part in zip(sun, w, strict=True)) < math.cos(math.radians(3))
        found.append((L[far].ravel(), *map(np.ravel, (E0, Eu, Ed))))
    return [np.concatenate(part) for part in zip(*found, strict=True)]


@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
@pytest.mark.parametrize(
    "waters", [("II", "3C"), pytest.param(JERLOV_TYPES, marks=pytest.mark.slow)]
)
def test_light_is_that_of_the_exact_peak(waters):
    """Wanted of a reference: means within 1 %, radiance beyond 3° from the sun within 3 %."""
    cases = [_errors(name, (0.5, 2.0), zenith) for name in waters for zenith in (20.0, 65.0)]
    L, E0, Eu, Ed = (np.concatenate(part) for part in zip(*cases, strict=True))
    assert abs(L.mean()) <= 0.003
    assert np.median(np.abs(L)) <= 0.01
    assert np.quantile(np.abs(L), 0.95) <= 0.04
    for E, bound in ((E0, 0.002), (Eu, 0.015), (Ed, 0.002)):
        assert np.abs(E).max() <= bound
