"""Values are equal, and keys alike, if what they hold is."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from underwater_spectral.uw_spectral.content import constant
from underwater_spectral.uw_spectral.imaging import Description, WaterDescription, resolve
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.spectra.spectrum import Spectrum
from underwater_spectral.uw_spectral.water.optical_properties import Water


def _spectrum(last=3.0, name="ramp"):
    return Spectrum(np.array([400.0, 500.0]), np.array([1.0, last]), name)


def _optics(water="jerlov:IB", **changes):
    return resolve(Description(WaterDescription(water, **changes)))


# What makes a value, and another that differs in one number or word.
PAIRS = {
    "spectrum": (_spectrum, functools.partial(_spectrum, 3.0 + 1e-15)),
    "name": (_spectrum, functools.partial(_spectrum, name="slope")),
    "bands": (lambda: Bands.uniform(8), lambda: Bands.uniform(8, end=700.5)),
    "illuminant": (
        lambda: parse_illuminant("clear-sky", 30.0),
        lambda: parse_illuminant("clear-sky", 31.0),
    ),
    "sensor": (lambda: parse_sensor("ARRI D21"), lambda: parse_sensor("Nikon D7000")),
    "water": (lambda: Water.jerlov("IB"), lambda: Water.jerlov("IB").scaled(1.0, 1.001)),
    "phase": (lambda: _optics().phase, lambda: _optics(phase="mixture:0.02").phase),
    "column": (lambda: _optics().column, lambda: _optics(scattering_factor=1.1).column),
    "optics": (_optics, lambda: _optics("jerlov:II")),
    "viewpoint": (lambda: _optics().viewpoint(5.0), lambda: _optics().viewpoint(5.1)),
    "description": (
        lambda: Description(WaterDescription(Water.jerlov("IB"))),
        lambda: Description(WaterDescription(Water.jerlov("II"))),
    ),
}


@pytest.mark.parametrize("what", PAIRS)
def test_equal_content_is_one_key(what):
    make, make_other = PAIRS[what]
    one, again, other = make(), make(), make_other()
    assert one is not again or what == "sensor"
    assert one == again
    assert hash(one) == hash(again)
    assert one != other
    assert {one: "found"}.get(again) == "found"
    assert other not in {one}


def test_a_copy_with_other_values_is_another_value():
    spectrum = _spectrum()
    assert hash(spectrum) == hash(_spectrum())  # what it holds is known from here on
    assert dataclasses.replace(spectrum, values=2 * spectrum.values) != spectrum
    assert dataclasses.replace(spectrum) == spectrum


def test_values_of_different_kinds_are_never_equal():
    bands = Bands.uniform(2)
    assert bands != "bands"
    assert bands != Spectrum(bands.centres, bands.widths, "")


def test_what_a_value_holds_cannot_be_changed():
    values = np.ones(2)
    spectrum = Spectrum(np.array([400.0, 500.0]), values, "flat")
    with pytest.raises(ValueError, match="read-only"):
        spectrum.values[0] = 2.0
    values[0] = 1.0  # the caller's own array stays the caller's
    optics = _optics()
    for array in (optics.bands.centres, optics.phase.weights, optics.column.sun_direction):
        assert not array.flags.writeable
    assert constant([1, 2]).dtype == np.float64
