"""Waters of which only Kd is known."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.imaging import Description, WaterDescription, resolve
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.diffuse_attenuation import (
    Kd490_Morel2007,
    Kd_Lee2013,
    Kd_Morel2001,
    chlorophyll_Morel2007,
)
from underwater_spectral.uw_spectral.water.kd_inversion import invert_Kd, water_from_Kd_csv
from underwater_spectral.uw_spectral.water.measured import read_water
from underwater_spectral.uw_spectral.water.named import parse_water
from underwater_spectral.uw_spectral.water.optical_properties import (
    JERLOV_TYPES,
    Water,
)
from underwater_spectral.uw_spectral.water.phase_functions import SeawaterMixture
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)
from underwater_spectral.validation.kd import Kd_Lee2005

NM = np.arange(400.0, 701.0, 25.0)


def test_lee_2005_by_hand():
    a, bb = 0.1, 0.01
    by_hand = (1 + 0.005 * 40) * a + 4.18 * (1 - 0.52 * math.exp(-1.08)) * bb
    assert Kd_Lee2005(a, bb, 40.0) == pytest.approx(by_hand, rel=1e-12)
    for wrong in ((-0.1, 0.0, 30.0), (0.1, math.nan, 30.0), (0.1, 0.0, 91.0)):
        with pytest.raises(InputError):
            Kd_Lee2005(*wrong)


def test_lee_2013_by_hand():
    """Their coefficients: 0.005, 0.265, 4.259, 0.52, 10.8."""
    a, bb, molecular = 0.1, 0.01, 0.004
    strength = (1 - 0.265 * 0.4) * 4.259 * (1 - 0.52 * math.exp(-1.08))
    by_hand = (1 + 0.005 * 40) * a + strength * bb
    assert Kd_Lee2013(a, bb, molecular, 40.0) == pytest.approx(by_hand, rel=1e-12)
    assert Kd_Lee2013(0.1, 0.0, 0.0) == pytest.approx(0.115)
    with pytest.raises(InputError, match="molecular"):
        Kd_Lee2013(0.1, 0.01, -0.1)


def test_morel_2007_and_back():
    C = np.array([0.03, 1.0, 30.0])
    assert chlorophyll_Morel2007(Kd490_Morel2007(C)) == pytest.approx(C)
    assert chlorophyll_Morel2007(0.01) == 0
    for function in (Kd490_Morel2007, chlorophyll_Morel2007):
        with pytest.raises(InputError):
            function(-1.0)


@pytest.mark.parametrize(("sun_zenith", "backscatter"), [(None, None), (60.0, None), (0.0, 0.02)])
@pytest.mark.parametrize("name", JERLOV_TYPES)
def test_the_inversion_gives_back_its_kd(name, sun_zenith, backscatter):
    Kd = Water.jerlov(name).Kd(NM)
    found = invert_Kd(Spectrum(NM, Kd, name), sun_zenith, backscatter)
    a, b = found.water.a(NM), found.water.b(NM)
    molecular = molecular_scattering(NM)
    assert backscatter is None or found.backscatter == backscatter
    assert found.water.particle_backscatter == found.backscatter
    bb = molecular / 2 + found.backscatter * (b - molecular)
    zenith = 30.0 if sun_zenith is None else sun_zenith
    assert Kd_Lee2013(a, bb, molecular / 2, zenith) == pytest.approx(Kd, rel=1e-9)
    assert np.all((found.a_range[0] <= a) & (a <= found.a_range[1]))
    assert np.all((found.b_range[0] <= b) & (b <= found.b_range[1]))
    assert found.water.Kd(NM) == pytest.approx(Kd)


def test_impossible_kd():
    with pytest.raises(InputError, match="must be positive, at 450 nm"):
        invert_Kd(Spectrum([450, 500], [0.0, 0.1], "mine"))
    with pytest.raises(InputError, match="needs it at 490 nm"):
        invert_Kd(Spectrum([500, 600], [0.1, 0.1], "mine"))
    Kd = Spectrum([450, 500], [0.1, 0.1], "mine")
    for zenith in (-1.0, 90.0, math.nan):
        with pytest.raises(
            InputError, match="mine: the sun zenith of the measurement must be 0 to"
        ):
            invert_Kd(Kd, zenith)
    with pytest.raises(InputError, match="mine: bb/b of the particles must be 0.0001 to 0.2, got"):
        invert_Kd(Kd, backscatter=0.5)
    with pytest.warns(DataWarning, match="backscattering alone"):
        found = invert_Kd(Spectrum([400, 500], [1e-5, 0.1], "mine"))
    assert found.water.a([400])[0] == 0


def test_closure_and_picture_have_one_backscatter():
    """bb/b of the case 1 water of 0.12 mg/m³ (Morel & Maritorena 2001), to solve and to draw."""
    found = invert_Kd(Spectrum(NM, Water.jerlov("IB").Kd(NM), "IB"))
    water = found.water
    # b of the same water, 0.416 C^0.766 at 550 nm (Loisel & Morel 1998), and the molecules'.
    assert found.chlorophyll == pytest.approx(0.1222, rel=1e-3)
    assert water.b([550.0])[0] == pytest.approx(0.08314 + 0.00167, rel=5e-3)
    assert water.particle_backscatter == pytest.approx(0.0093, rel=0.01)
    assert water.phase_model.particles.backscatter_ratio == pytest.approx(0.0093, rel=0.01)
    drawn = resolve(Description(WaterDescription(water))).phase
    assert drawn.components[1].backscatter_ratio == pytest.approx(0.0093, rel=0.01)
    assert water.scaled(2.0, 2.0).particle_backscatter == water.particle_backscatter
    assert Water.jerlov("IB").phase_model == SeawaterMixture()


def test_water_by_its_chlorophyll():
    # Kw(443) + 0.1070 · 3^0.6729 by hand from the rows of 425 and 450 nm.
    assert Kd_Morel2001(3.0).at([443])[0] == pytest.approx(0.00706 + 0.0027 + 0.2242, rel=0.01)
    np.testing.assert_allclose(
        [Kd_Morel2001(C).at([490])[0] for C in (0.1, 1.0, 10.0)],
        Kd490_Morel2007([0.1, 1.0, 10.0]), rtol=0.01,
    )  # fmt: skip
    water = parse_water("chl:3")
    assert water.name == "case 1 water, chlorophyll 3 mg/m³"
    assert np.all(water.a(NM) >= pure_water_absorption(NM))
    for wrong, match in (
        ("chl:", "mg/m³, as chl:3"),
        ("chl:nan", "0.01 to 30"),
        ("chl:31", "0.01"),
    ):
        with pytest.raises(InputError, match=match):
            parse_water(wrong)


def test_backscatter_of_mixed_water_is_weighted_by_scattering():
    one = dataclasses.replace(Water.uniform(0.1, 0.1), particle_backscatter=0.005)
    other = dataclasses.replace(Water.uniform(0.1, 0.4), particle_backscatter=0.02)
    assert one.mixed(other, 0.5).particle_backscatter == pytest.approx(0.017)
    typical = Water.uniform(0.1, 0.1)
    assert one.mixed(typical, 0.5).particle_backscatter == pytest.approx((0.005 + 0.0183) / 2)
    assert typical.mixed(typical, 0.5).particle_backscatter is None
    with pytest.raises(InputError, match="bb/b of the particles must be"):
        dataclasses.replace(typical, particle_backscatter=0.0)


def test_the_comment_gives_sun_and_backscatter(tmp_path):
    path = tmp_path / "kd.csv"
    table = "wavelength_nm,Kd\n450,0.05\n500,0.06\n600,0.3\n"
    path.write_text(table)
    unknown = read_water(path)
    assert any("sun of the Kd measurement is not known" in text for text in unknown.caveats)
    path.write_text(f"# station 5\n# sun_zenith: 60\n# bb/b = 0.012\n{table}")
    known = read_water(path)
    assert known.particle_backscatter == 0.012
    assert not any("is not known" in text for text in known.caveats)
    assert "sun at 60°" in known.caveats[0]
    # Water absorbs far more than it scatters back there: Kd is 1 + 0.005 θ times a, nearly.
    ratio = known.a([600])[0] / unknown.a([600])[0]
    assert ratio == pytest.approx(1.15 / 1.30, rel=0.02)
    for comment, message in (
        ("# sun_zenith: high", "sun_zenith as 'high'; write '# sun_zenith: ' and a number"),
        ("# sun_zenith: 95", "Kd of kd.csv: the sun zenith of the measurement must be 0 to 90"),
        ("# bb/b: 1\n", "Kd of kd.csv: bb/b of the particles must be"),
        ("# bb/b: 0.01\n# bb/b: 0.02", "gives bb/b twice"),
    ):
        path.write_text(f"{comment}\n{table}")
        with pytest.raises(InputError, match=message):
            read_water(path)


def test_csv_files(tmp_path):
    path = tmp_path / "kd.csv"
    path.write_text("wavelength_nm,Kd\n450,0.05\n500,0.06\n600,0.3\n")
    water = read_water(path)
    assert water.Kd([500])[0] == pytest.approx(0.06)
    assert 0.03 < water.a([500])[0] < 0.06
    assert any("inverted from Kd" in text for text in water.caveats)
    assert water_from_Kd_csv(path).a([500]) == pytest.approx(water.a([500]))
    path.write_text("wavelength_nm,a,b,Kd\n450,0.05,0.1,0.06\n500,0.05,0.1,0.06\n")
    assert read_water(path).b([450])[0] == pytest.approx(0.1)
    path.write_text("wavelength_nm,Kd\n450,0.05\n500,nan\n")
    with pytest.raises(InputError, match="line 3, column Kd"):
        read_water(path)
