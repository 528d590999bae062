"""Power and spectrum of a lamp to radiant intensity in bands."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.lamps import emission
from underwater_spectral.uw_spectral.lamps.profile import SpotProfile
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum

FLAT = Spectrum([400, 700], [1.0, 1.0], "flat")
BANDS = Bands.uniform(6)


def test_the_bands_of_an_isotropic_lamp_add_up_to_its_power():
    intensity = emission.radiant_intensity(FLAT, 25.0, BANDS)
    assert 4 * math.pi * (intensity * BANDS.widths).sum() == pytest.approx(25.0, rel=1e-12)
    # Within its table, the same for a lamp that is not flat.
    led = emission.parse_emission("led")
    wide = Bands.uniform(40, 380, 780)
    intensity = emission.radiant_intensity(led, 25.0, wide)
    assert 4 * math.pi * (intensity * wide.widths).sum() == pytest.approx(25.0, rel=1e-9)


def test_lumens_of_a_line_and_of_a_white_source():
    line = Spectrum([554.5, 555.0, 555.5], [0.0, 2.0, 0.0], "line")
    assert emission.flux(line, "lm") == pytest.approx(683.0 * emission.flux(line), rel=1e-3)
    # V(510 nm) = 0.503, CIE 1924.
    green = Spectrum([509.5, 510.0, 510.5], [0.0, 2.0, 0.0], "line")
    assert emission.flux(green, "lm") == pytest.approx(0.503 * 683.0, rel=2e-3)
    # The integral of V(λ) is 106.857 nm: a flat spectrum of 1 W/nm.
    wide = Spectrum([360, 830], [1.0, 1.0], "flat")
    assert emission.flux(wide, "lm") == pytest.approx(683.0 * 106.857, rel=1e-4)
    # A watt of light of CIE illuminant A between 380 and 780 nm gives 150 to 160 lm.
    a = emission.parse_emission("halogen")
    visible = Spectrum(np.arange(380.0, 781.0), a.at(np.arange(380.0, 781.0)), "A")
    assert 140 < emission.flux(visible, "lm") / emission.flux(visible) < 170


def test_a_thousand_lumens_are_a_thousand_lumens_whatever_the_spectrum():
    fine = Bands.uniform(80, 380, 780)
    for name in ("led", "led-warm", "hid", "blackbody:5600", "LED-B3"):
        intensity = emission.radiant_intensity(emission.parse_emission(name), 1000.0, fine, "lm")
        V = emission.luminous_efficiency().at_or_zero(fine.centres)
        lumens = 4 * math.pi * 683.0 * (intensity * V * fine.widths).sum()
        assert lumens == pytest.approx(1000.0, rel=5e-3), name


def test_the_power_of_a_narrow_lamp_is_concentrated_and_that_of_blender_is_not():
    spot = SpotProfile(math.radians(40), 0.2)
    own = emission.radiant_intensity(FLAT, 10.0, BANDS, solid_angle=spot.solid_angle)
    blender = emission.radiant_intensity(FLAT, 10.0, BANDS)
    assert own / blender == pytest.approx(4 * math.pi / spot.solid_angle, rel=1e-12)
    assert (own * BANDS.widths).sum() * spot.solid_angle == pytest.approx(10.0)


def test_a_blackbody_follows_wien_and_planck():
    for kelvin in (4000.0, 5600.0, 6500.0):
        spectrum = emission.blackbody(kelvin)
        peak = spectrum.wavelengths[np.argmax(spectrum.values)]
        assert peak == pytest.approx(2.897772e6 / kelvin, abs=5.1)
    # CIE illuminant A is a blackbody of 2856 K, in its own, older constant.
    at = np.arange(400.0, 701.0, 50)
    a = emission.parse_emission("A")
    assert emission.blackbody(2856).at(at) == pytest.approx(a.at(at) / a.at([560]), rel=2e-3)


def test_a_white_blender_light_is_as_bright_as_a_diffuser_in_d65():
    bands = Bands.uniform(40, 380, 780)
    white = emission.intensity_of_colour((1, 1, 1), 4 * math.pi, bands)
    d65 = parse_illuminant("d65").direct.at(bands.centres)
    assert white == pytest.approx(d65 / math.pi, rel=0.02)
    parts = [emission.intensity_of_colour(rgb, 4 * math.pi, bands) for rgb in np.eye(3)]
    assert sum(parts) == pytest.approx(white)


def test_no_power_is_no_light():
    assert not emission.radiant_intensity(FLAT, 0.0, BANDS).any()
    assert not emission.intensity_of_colour((1, 0, 0), 0.0, BANDS).any()


def test_a_table_of_the_users(tmp_path):
    path = tmp_path / "torch.csv"
    path.write_text("wavelength_nm,power\n400,1\n700,3\n")
    assert emission.parse_emission(f"file:{path}").at([550]) == pytest.approx([2.0])
    path.write_text("wavelength_nm,power\n400,0\n700,0\n")
    with pytest.raises(InputError, match="zero at every wavelength"):
        emission.parse_emission(f"file:{path}")
    path.write_text("wavelength_nm,power\n400,1\n")
    with pytest.raises(InputError, match="one row"):
        emission.parse_emission(f"file:{path}")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: emission.parse_emission("LED-B33"), "unknown emission.*LED-B3"),
        (lambda: emission.parse_emission("blackbody:hot"), "write blackbody:5600"),
        (lambda: emission.parse_emission("blackbody:5"), "500 to 50000 K"),
        (lambda: emission.parse_emission("blackbody:nan"), "500 to 50000 K"),
        (lambda: emission.radiant_intensity(FLAT, -1.0, BANDS), "not negative, got -1 W"),
        (lambda: emission.radiant_intensity(FLAT, math.nan, BANDS), "finite"),
        (lambda: emission.radiant_intensity(FLAT, 1.0, BANDS, "mol"), "unit of a lamp's power"),
        (lambda: emission.radiant_intensity(FLAT, 1.0, BANDS, solid_angle=0.0), "solid angle"),
        (lambda: emission.radiant_intensity(FLAT, 1.0, Bands.uniform(3, 380, 900)), "wider table"),
        (lambda: emission.intensity_of_colour((1, -1, 0), 1.0, BANDS), "three numbers from 0"),
        (
            lambda: emission.radiant_intensity(
                Spectrum([850, 900], [1, 1], "infrared"), 1.0, BANDS, "lm"
            ),
            "infrared has no flux in lm",
        ),
    ],
)
def test_what_cannot_be_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()
