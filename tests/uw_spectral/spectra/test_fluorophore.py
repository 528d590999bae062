"""Fluorophores and barrier filters: what goes in and out, and what is refused."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.barrier_filter import transmittance
from underwater_spectral.uw_spectral.spectra.fluorophore import (
    list_fluorophores,
    parse_fluorophore,
)

WIDE = Bands.uniform(500, 300.0, 1000.0)


@pytest.mark.parametrize("name", list_fluorophores())
def test_photons_out_are_the_yield_times_photons_in(name):
    dye = parse_fluorophore(name)
    E = np.random.default_rng(1).uniform(0.5, 1.5, len(WIDE))
    absorbed = dye.excitation.at(WIDE.centres) * E
    photons = (absorbed * WIDE.centres * WIDE.widths).sum()
    out = dye.reradiation(WIDE) @ E
    found = (out * WIDE.centres * WIDE.widths).sum()
    assert found == pytest.approx(dye.quantum_yield * photons, rel=2e-3)


def _published() -> list[dict[str, str]]:
    lines = Path(__file__).with_name("fluorophores_fpbase.csv").read_text().splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


@pytest.mark.parametrize("published", _published(), ids=lambda row: row["protein"])
def test_peaks_and_yields_are_those_of_a_database(published):
    """Publications differ by 2 nm: EosFP is excited at 504 or 506 nm."""
    dye = parse_fluorophore(published["name"])
    nm = np.arange(400.0, 700.0)
    excited = nm[np.argmax(dye.excitation.at(nm))]
    assert excited == pytest.approx(float(published["excitation_nm"]), abs=2)
    assert dye.peak == pytest.approx(float(published["emission_nm"]), abs=1)
    assert dye.quantum_yield == pytest.approx(float(published["quantum_yield"]), abs=0.005)


@pytest.mark.parametrize("count", [8, 30])
def test_few_bands_lose_no_light(count):
    """Means over bands: as many photons come out as of many bands."""
    dye, bands = parse_fluorophore("coral-red"), Bands.uniform(count, 400.0, 700.0)
    fine = Bands.uniform(300, 400.0, 700.0)
    few, many = (dye.emission_in(x) @ x.widths for x in (bands, fine))
    assert few == pytest.approx(many, rel=1e-3)
    few, many = (dye.excitation_in(x).sum() for x in (bands, fine))
    assert few == pytest.approx(many, rel=1e-3)


def _file(folder, text):
    path = folder / "dye.csv"
    path.write_text(text)
    return f"file:{path}"


def test_a_file_is_read(tmp_path):
    dye = parse_fluorophore(
        _file(
            tmp_path,
            "# quantum_yield: 0.5\nwavelength_nm,excitation,emission\n"
            "400,2,0\n450,4,0\n500,0,1\n600,0,0\n",
        )
    )
    assert dye.quantum_yield == 0.5
    assert dye.peak == 500.0
    assert dye.excitation_in(Bands.uniform(1, 440.0, 460.0))[0] == pytest.approx(17.2, rel=0.05)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("wavelength_nm,excitation,emission\n400,1,0\n500,0,1\n", "add a line '# quantum_yield"),
        ("# quantum_yield: 2\nwavelength_nm,excitation,emission\n400,1,0\n500,0,1\n", "at most 1"),
        ("# quantum_yield: .5\nwavelength_nm,excitation\n400,1\n500,0\n", "column emission"),
        ("# quantum_yield: .5\nwavelength_nm,excitation,emission\n400,0,0\n500,0,1\n", "is zero"),
    ],
)
def test_files_that_cannot_be_true(tmp_path, text, wrong):
    with pytest.raises(InputError, match=wrong):
        parse_fluorophore(_file(tmp_path, text))


def test_unknown_names_are_told_near_ones():
    with pytest.raises(InputError, match="Near names: coral-green"):
        parse_fluorophore("coral-gren")


def test_a_long_pass_filter_rises_about_its_cut_off():
    bands = Bands.uniform(3, 485.0, 515.0)  # 490, 500, 510
    narrow = Bands(bands.centres, np.full(3, 1e-3))
    assert transmittance("long-pass:500,20", narrow) == pytest.approx([0.1, 0.5, 0.9], abs=1e-3)
    assert transmittance("none", narrow).tolist() == [1.0, 1.0, 1.0]
    # A band is the mean of what is in it.
    wide = transmittance("long-pass:500,1", Bands(np.array([500.0]), np.array([40.0])))
    assert wide == pytest.approx([0.5], abs=0.01)


@pytest.mark.parametrize(
    "text", ["yellow", "long-pass", "long-pass:a,b", "long-pass:500,0", "long-pass:50,15"]
)
def test_filters_that_are_none(text):
    with pytest.raises(InputError, match="filter"):
        transmittance(text, WIDE)
