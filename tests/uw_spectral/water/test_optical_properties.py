"""Waters: the published values, the repairs, the refusals."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import DataWarning, InputError
from underwater_spectral.uw_spectral.water.named import list_waters, parse_water
from underwater_spectral.uw_spectral.water.optical_properties import (
    JERLOV_TYPES,
    Water,
)
from underwater_spectral.uw_spectral.water.pure_water import (
    molecular_scattering,
    pure_water_absorption,
)

# Solonenko & Mobley 2015, Table 7: (type, nm) → a, b.
PUBLISHED = {("I", 450): 0.018, ("IB", 550): 0.0623, ("II", 400): 0.0355, ("9C", 700): 0.651}


@pytest.mark.parametrize(("key", "a"), PUBLISHED.items())
def test_published_absorption(key, a):
    assert Water.jerlov(key[0]).a([key[1]])[0] == pytest.approx(a)


def test_all_types_are_whole_and_ordered():
    grid = np.arange(300.0, 701.0, 25.0)
    blue = []
    for name in JERLOV_TYPES:
        water = Water.jerlov(name)
        assert np.all(water.a(grid) > 0)
        assert np.all(water.b(grid) > 0)
        assert np.all(water.Kd(grid) > 0)
        blue.append(water.a([450])[0])
    assert blue == sorted(blue)


@pytest.mark.parametrize(("name", "nm", "a"), [("3C", 675, 0.477), ("5C", 600, 0.259)])
def test_misprinted_rows_are_repaired_and_said_so(name, nm, a):
    water = Water.jerlov(name)
    assert water.a([nm])[0] == pytest.approx(a)
    with pytest.warns(DataWarning, match="misprinted"):
        water.warn_doubts([nm])
    assert any("misprinted" in text for text in water.caveats_at([nm]))
    assert not any("misprinted there" in text for text in water.caveats_at([450]))


def test_sources_differ():
    ours, theirs = (
        Water.jerlov("III", source).b([510])[0] for source in ("solonenko2015", "williamson2022")
    )
    assert max(ours / theirs, theirs / ours) > 3


@pytest.mark.parametrize("name", ["I", "IA", "7C", "9C"])
def test_williamson_refuses_what_was_not_measured(name):
    with pytest.raises(InputError, match=f"williamson2022 has no Jerlov {name}.*solonenko2015"):
        Water.jerlov(name, "williamson2022")


def test_names_and_schemes():
    assert parse_water("jerlov:ib").name == parse_water("jerlov:IB").name
    assert set(list_waters()) == {"solonenko2015", "williamson2022", "constituents"}
    assert list_waters()["solonenko2015"] == tuple(f"jerlov:{n}" for n in JERLOV_TYPES)
    for text, message in (
        ("jerlov:1B", "Near names"),
        ("IB", "write jerlov:IB"),
        ("sea:IB", "write jerlov:IB"),
    ):
        with pytest.raises(InputError, match=message):
            parse_water(text)
    with pytest.raises(InputError, match="unknown source"):
        Water.jerlov("I", "jerlov1976")


def _file(tmp_path, text):
    path = tmp_path / "water.csv"
    path.write_text(text)
    return path


def test_own_water(tmp_path):
    path = _file(tmp_path, "# mine\nwavelength_nm,a,b,Kd\n400,0.1,0.2,0.15\n700,0.7,0.2,0.8\n")
    water = parse_water(f"file:{path}")
    assert water.c([550])[0] == pytest.approx(0.6)
    assert water.Kd([400])[0] == pytest.approx(0.15)
    assert water.source == "mine"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wavelength_nm,a,b\n400,0.1,0.2\n700,-0.7,0.2\n", "-0.7"),
        ("wavelength_nm,a\n400,0.1\n", "column b is missing"),
        ("wavelength_nm,a,b\n0.4,0.1,0.2\n0.7,0.7,0.2\n", "look like micrometres"),
    ],
)
def test_bad_water_files(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        Water.from_csv(_file(tmp_path, text))


def test_units_that_cannot_be_are_doubted(tmp_path):
    path = _file(tmp_path, "wavelength_nm,a,b\n400,0.0001,0.2\n700,0.006,0.2\n")
    with pytest.warns(DataWarning, match="multiply by 100 if the table is in 1/cm"):
        Water.from_csv(path)


def test_kd_below_a_is_doubted(tmp_path):
    path = _file(tmp_path, "wavelength_nm,a,b,Kd\n400,0.1,0.2,0.05\n500,0.1,0.2,0.2\n")
    with pytest.warns(DataWarning, match="Kd is below a at 400 nm"):
        Water.from_csv(path)


def test_uniform_water_and_missing_kd():
    water = Water.uniform(0.05, 0.1)
    assert water.c([300, 900]) == pytest.approx(0.15)
    with pytest.raises(InputError, match="has no Kd"):
        water.Kd([500])
    with pytest.raises(InputError, match="negative"):
        Water.uniform(-0.1, 0.1)


def test_molecular_scattering_of_seawater():
    """Morel 1974 is 10 % and more above Zhang 2009; both fall as λ^-4.3."""
    zhang, morel = (
        molecular_scattering([400, 600], m) for m in ("zhang2009_S35_T22", "morel1974_sea")
    )
    assert np.all(morel / zhang > 1.0)
    assert np.all(morel / zhang < 1.2)
    assert zhang[0] / zhang[1] == pytest.approx((400 / 600) ** -4.3, rel=0.03)
    with pytest.raises(InputError, match="unknown molecular scattering"):
        molecular_scattering([500], "rayleigh")
    with pytest.raises(InputError, match="300 to 800"):
        molecular_scattering([900])


def test_between_rows_absorption_has_the_steps_of_water():
    """Linear over 25 nm, a at 585 nm would be a fifth too large."""
    water, table = Water.jerlov("IB"), np.array([575.0, 600.0])
    rest = water.a(table) - pure_water_absorption(table)
    wanted = pure_water_absorption([585.0]) + 0.6 * rest[0] + 0.4 * rest[1]
    assert water.a([585.0]) == pytest.approx(wanted)
    assert np.interp(585.0, table, water.a(table)) > 1.2 * water.a([585.0])[0]


def test_absorption_below_that_of_water_is_said():
    texts = [text for text in Water.jerlov("I").caveats if "below that of pure water" in text]
    assert texts == [
        "absorption of Jerlov I at 650 to 700 nm lies up to 7 % below that of pure water "
        "(Pope & Fry 1997); kept as published"
    ]
    assert not any("below that" in text for text in Water.jerlov("9C").caveats)


def test_a_table_may_state_the_backscatter_of_its_particles(tmp_path):
    path = tmp_path / "water.csv"
    table = "wavelength_nm,a,b\n450,0.05,0.1\n550,0.07,0.1\n"
    path.write_text(table)
    assert Water.from_csv(path).particle_backscatter is None
    path.write_text(f"# station 4\n# bb/b: 0.01\n{table}")
    assert Water.from_csv(path).particle_backscatter == 0.01
    path.write_text(f"# bb/b: 1\n{table}")
    with pytest.raises(InputError, match=r"water.csv: bb/b of the particles must be 0.0001 to 0.2"):
        Water.from_csv(path)
