"""Constituents: the published numbers, the printed forms and their errors, the refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.bio_optics import Constituents, parse_constituents
from underwater_spectral.uw_spectral.water.named import named_waters, parse_water
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)
from underwater_spectral.validation.constituent_seas import particle_scattering_Gordon1983
from underwater_spectral.validation.kd import chlorophyll_jerlov, jerlov_chlorophyll

NM = np.arange(400.0, 701.0, 25.0)


def test_published_absorption():
    """Pope & Fry 1997 at 440, 550, 676 nm; Bricaud 1998: a_phi(440) = 0.0378 C^0.627."""
    assert pure_water_absorption([440, 550]) == pytest.approx([0.00635, 0.0565])
    for C in (0.1, 1.0, 10.0):
        part = Constituents(C).absorptions([440.0])["phytoplankton"][0]
        assert part == pytest.approx(0.0378 * C**0.627, rel=2e-3)


def test_parts_add_up_and_slopes_are_those_given():
    sea = Constituents(2.0, cdom=0.2, minerals=0.5, detritus=0.1, cdom_slope=0.018)
    assert sum(sea.absorptions(NM).values()) == pytest.approx(sea.absorption(NM))
    parts = sea.absorptions([400.0, 440.0, 500.0])
    assert parts["cdom"][1] == pytest.approx(0.2)
    assert math.log(parts["cdom"][1] / parts["cdom"][2]) == pytest.approx(0.018 * 60)
    assert parts["detritus"][0] == pytest.approx(0.1)
    water = sea.water()
    assert water.a(NM) == pytest.approx(sea.absorption(NM), rel=1e-9)
    assert water.b(NM) == pytest.approx(sea.scattering(NM), rel=1e-9)
    assert np.all(water.Kd(NM) > water.a(NM))


@pytest.mark.parametrize("chlorophyll", [0.0, 0.05, 1.0, 10.0, 40.0])
def test_phase_of_fixed_parts(chlorophyll):
    """The stated distance from the exact mixture; the same backscattering."""
    sea = Constituents(chlorophyll, minerals=0.2 if chlorophyll == 1.0 else 0.0)
    exact, fixed = sea.phase(NM), sea.phase_of_fixed_parts(NM)
    assert fixed.components == Constituents(3.0).phase_of_fixed_parts(NM).components
    assert np.ptp(fixed.weights, axis=1).any()
    np.testing.assert_allclose(fixed.backscatter_ratio, exact.backscatter_ratio, rtol=2e-3)
    np.testing.assert_allclose(fixed.chi1, exact.chi1, atol=2e-3)
    s2 = np.sin(np.radians([1.0, 5.0, 20.0, 60.0, 90.0, 140.0, 180.0]) / 2)[:, None] ** 2
    ratio = fixed.per_steradian(s2) / exact.per_steradian(s2)
    assert ratio.min() > 0.87
    assert ratio.max() < 1.02


def test_pure_sea_water():
    pure = Constituents()
    assert pure.scattering(NM) == pytest.approx(molecular_scattering(NM))
    assert pure.phase(NM).backscatter_ratio == pytest.approx(0.5)
    fresh = Constituents(salinity=0).scattering(NM)
    assert fresh == pytest.approx(molecular_scattering(NM, "zhang2009_S0_T20"))


def test_phase_is_normalised_and_backscatters_as_stated():
    sea = Constituents(1.0, minerals=0.3)
    phase = sea.phase(NM)
    assert phase.normalisation() == pytest.approx(1.0, abs=1e-4)
    ratio = sea.backscattering(NM) / sea.scattering(NM)
    assert phase.backscatter_ratio == pytest.approx(ratio, rel=2e-2)
    # One particle function for all bands: right at 550 nm, near elsewhere.
    parts = sea.scatterings(NM)
    simple = sea.water().phase_model.for_bands(sea.scattering(NM), parts["water"]).backscatter_ratio
    assert simple[NM == 550.0] == pytest.approx(ratio[NM == 550.0], rel=5e-3)
    near = np.abs(NM - 550.0) <= 50.0
    assert simple[near] == pytest.approx(ratio[near], rel=0.08)
    # Not more than measured bb/b changes itself from 550 to 700 nm: b_b goes as λ^-0.94 (Snyder
    # et al. 2008, 6000 spectra), b as λ^-0.1 to λ^-1.2 (Doxaran et al. 2007).
    assert simple == pytest.approx(ratio, rel=0.18)


def test_backscatter_can_be_set():
    sea = Constituents(1.0, backscatter=0.02)
    assert sea.organic_backscatter == 0.02
    assert sea.water().particle_backscatter == pytest.approx(0.02)
    assert Constituents(1.0).organic_backscatter == pytest.approx(0.007)
    assert Constituents().water().particle_backscatter is None


@pytest.mark.parametrize(
    ("chlorophyll", "scattering", "exponent", "backscatter"),
    [
        (0.03, 0.02834, -0.9114, 0.010807),
        (0.1, 0.07130, -0.65, 0.0095),
        (1.0, 0.416, -0.15, 0.007),
        (10.0, 2.427, 0.0, 0.0045),
    ],
)
def test_case1_scattering_by_hand(chlorophyll, scattering, exponent, backscatter):
    """b_p(550) = 0.416 C^0.766 (Loisel & Morel 1998); v and bb/b of Morel & Maritorena (2001)."""
    sea = Constituents.case1(chlorophyll)
    blue, green, red = sea.scatterings([440.0, 550.0, 660.0])["phytoplankton"]
    assert green == pytest.approx(scattering, rel=1e-3)
    assert math.log(red / green) / math.log(660 / 550) == pytest.approx(exponent, abs=1e-3)
    assert math.log(blue / green) / math.log(440 / 550) == pytest.approx(exponent, abs=1e-3)
    assert sea.organic_backscatter == pytest.approx(backscatter, rel=1e-3)
    molecular = molecular_scattering([550.0])[0] / 2
    assert sea.backscattering([550.0])[0] == pytest.approx(
        molecular + backscatter * scattering, rel=1e-3
    )


def test_scattering_at_660_nm_of_clear_water():
    """Loisel & Morel's 0.347 C^0.766 at 660 nm, with the 1/λ of the clearest water."""
    found = Constituents.case1(0.02).scatterings([660.0])["phytoplankton"][0]
    assert found == pytest.approx(0.347 * 0.02**0.766, rel=2e-3)


@pytest.mark.parametrize("chlorophyll", [0.05, 0.5, 5.0])
def test_case1_absorption_adds_up(chlorophyll):
    """a_p of Bricaud (1998), 0.0520 C^0.635 at 440 nm; Morel & Gentili (2009) for the coloured."""
    parts = Constituents.case1(chlorophyll).absorptions([400.0, 440.0])
    particles = parts["phytoplankton"] + parts["detritus"]
    assert particles[1] == pytest.approx(0.05202 * chlorophyll**0.635, rel=2e-3)
    coloured = parts["cdom"] + parts["detritus"]
    assert coloured[1] == pytest.approx(0.065 * chlorophyll**0.63 * math.exp(-0.72), rel=1e-6)
    assert math.log(parts["cdom"][0] / parts["cdom"][1]) == pytest.approx(0.72)


def test_minerals_have_the_slopes_and_the_backscatter_given():
    sea = Constituents(
        minerals=2.0, mineral_slope=0.011, mineral_exponent=0.3, mineral_backscatter=0.02
    )
    nm = [443.0, 543.0, 400.0]
    a, b = sea.absorptions(nm)["minerals"], sea.scatterings(nm)["minerals"]
    assert a[0] == pytest.approx(2 * 0.031)
    assert math.log(a[0] / a[1]) == pytest.approx(1.1)
    assert b[2] == pytest.approx(2 * 1.151302)
    assert math.log(b[0] / b[1]) == pytest.approx(0.3 * math.log(543 / 443))
    assert sea.water().particle_backscatter == pytest.approx(0.02)
    for phase in (sea.phase(nm), sea.phase_of_fixed_parts(nm)):
        expected = sea.backscattering(nm) / sea.scattering(nm)
        np.testing.assert_allclose(phase.backscatter_ratio, expected, rtol=2e-2)
    assert parse_constituents(
        "minerals=2,mineral-slope=0.011,mineral-exponent=0.3,mineral-bb/b=0.02"
    ) == sea  # fmt: skip
    assert parse_constituents(sea.described()) == sea


@pytest.mark.parametrize(
    "wrong",
    [
        {"chlorophyll": -1.0},
        {"chlorophyll": 101.0},
        {"cdom": math.nan},
        {"minerals": -0.1},
        {"detritus": math.inf},
        {"salinity": 41.0},
        {"backscatter": 0.6},
        {"backscatter": math.nan},
        {"mineral_backscatter": 0.0},
        {"mineral_slope": -0.01},
        {"mineral_exponent": 5.0},
    ],
)
def test_impossible_constituents(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        Constituents(**wrong)


@pytest.mark.parametrize("nm", [299.0, 801.0, math.nan])
def test_wavelengths_outside_the_tables(nm):
    with pytest.raises(InputError):
        Constituents(1.0).absorption([nm])
    with pytest.raises(InputError):
        Constituents(1.0).water().a([nm])


def test_options():
    assert parse_constituents("chl=1, cdom=0.05,minerals=0.1") == Constituents(
        1.0, cdom=0.05, minerals=0.1
    )
    assert parse_constituents("") == Constituents()
    assert parse_constituents("case1=0.5,cdom=0.3").cdom == 0.3
    assert parse_constituents("bb/b=0.01").backscatter == 0.01
    for text, message in (
        ("chlor=1", "Near names: chl"),
        ("chl=one", "not key=number"),
        ("chl=1,chl=2", "twice"),
        ("chl=-1", "chlorophyll"),
        ("case1=-1", "chlorophyll"),
        ("cdom=nan", "cdom"),
    ):
        with pytest.raises(InputError, match=message):
            parse_constituents(text)


def test_named_waters_are_what_their_sources_say():
    seas = named_waters()
    assert set(seas) == {"atlantic", "mediterranean", "baltic", "north-sea", "cdom-coast"}
    north = seas["north-sea"].constituents.scatterings([440.0])
    assert north["phytoplankton"][0] + north["minerals"][0] == pytest.approx(1.21, rel=0.02)
    cdom = seas["cdom-coast"].constituents.absorptions([350.0])["cdom"][0]
    assert cdom == pytest.approx(3.66, rel=0.02)
    assert parse_water("case:North Sea").name == "north-sea"
    with pytest.raises(InputError, match="Near names: baltic"):
        parse_water("case:balti")


def test_chlorophyll_and_jerlov_types():
    """Morel 1988 puts I below 0.1 mg/m³, IB near 0.1, II at 0.5, III at 1.5 to 2."""
    chlorophyll = [jerlov_chlorophyll(name) for name in ("I", "IA", "IB", "II", "III")]
    assert chlorophyll == sorted(chlorophyll)
    assert chlorophyll[0] < 0.1
    assert 0.05 < chlorophyll[2] < 0.2
    assert 0.2 < chlorophyll[3] < 0.8
    assert 1.0 < chlorophyll[4] < 2.5
    for name, C in zip(("I", "IA", "IB", "II", "III"), chlorophyll, strict=True):
        assert chlorophyll_jerlov(C) == name


def _water_as_printed(constituents):
    """The water of Gutierrez et al. (2008): b_w taken for β_w(90°), and Smith & Baker's a_w.

    The printed a*(λ) of one phytoplankton species is replaced by Bricaud et al. (1998), its
    detritus scattering left out.
    """
    nm = np.arange(300.0, 800.1, 2.5)
    parts = constituents.absorptions(nm)
    parts["water"] = pure_water_absorption(nm, "smith_baker_1981")
    b = 16.06 * molecular_scattering(nm, "smith_baker_1981_sea")
    b = b + particle_scattering_Gordon1983(constituents.chlorophyll, nm)
    a = np.sum(list(parts.values()), axis=0)
    return Water(Spectrum(nm, a, "a"), Spectrum(nm, b, "b"), None, "printed", "")


def test_printed_forms_have_the_errors_they_are_kept_for():
    printed, ours = _water_as_printed(Constituents()), Constituents().water()
    assert printed.b([500])[0] / ours.b([500])[0] == pytest.approx(16.06, rel=0.2)
    assert printed.a([440])[0] / ours.a([440])[0] == pytest.approx(2.3, rel=0.1)
