"""Waters of which only Kd is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.diffuse_attenuation import (
    Kd490_Morel2007,
    Kd_Lee2005,
    chlorophyll_Morel2007,
)
from underwater_spectral.uw_spectral.water.kd_inversion import invert_Kd, water_from_Kd_csv
from underwater_spectral.uw_spectral.water.measured import read_water
from underwater_spectral.uw_spectral.water.optical_properties import (
    JERLOV_TYPES,
    Water,
)
from underwater_spectral.uw_spectral.water.phase import FournierForand
from underwater_spectral.uw_spectral.water.pure_water import molecular_scattering

NM = np.arange(400.0, 701.0, 25.0)


def test_lee_2005_by_hand():
    a, bb = 0.1, 0.01
    by_hand = (1 + 0.005 * 40) * a + 4.18 * (1 - 0.52 * math.exp(-1.08)) * bb
    assert Kd_Lee2005(a, bb, 40.0) == pytest.approx(by_hand, rel=1e-12)
    for wrong in ((-0.1, 0.0, 30.0), (0.1, math.nan, 30.0), (0.1, 0.0, 91.0)):
        with pytest.raises(InputError):
            Kd_Lee2005(*wrong)


def test_morel_2007_and_back():
    C = np.array([0.03, 1.0, 30.0])
    assert chlorophyll_Morel2007(Kd490_Morel2007(C)) == pytest.approx(C)
    assert chlorophyll_Morel2007(0.01) == 0
    for function in (Kd490_Morel2007, chlorophyll_Morel2007):
        with pytest.raises(InputError):
            function(-1.0)


@pytest.mark.parametrize("name", JERLOV_TYPES)
def test_the_inversion_gives_back_its_kd(name):
    Kd = Water.jerlov(name).Kd(NM)
    found = invert_Kd(Spectrum(NM, Kd, name))
    a, b = found.water.a(NM), found.water.b(NM)
    molecular = molecular_scattering(NM)
    bb = molecular / 2 + FournierForand().backscatter * (b - molecular)
    assert Kd_Lee2005(a, bb) == pytest.approx(Kd, rel=1e-9)
    assert np.all((found.a_range[0] <= a) & (a <= found.a_range[1]))
    assert np.all((found.b_range[0] <= b) & (b <= found.b_range[1]))
    assert found.water.Kd(NM) == pytest.approx(Kd)


def test_impossible_kd():
    with pytest.raises(InputError, match="must be positive, at 450 nm"):
        invert_Kd(Spectrum([450, 500], [0.0, 0.1], "mine"))
    with pytest.raises(InputError, match="needs it at 490 nm"):
        invert_Kd(Spectrum([500, 600], [0.1, 0.1], "mine"))
    with pytest.warns(DataWarning, match="backscattering alone"):
        found = invert_Kd(Spectrum([400, 500], [1e-5, 0.1], "mine"))
    assert found.water.a([400])[0] == 0


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
