"""Laws that any light field keeps, whatever the water: what must not change, and what must, how.

Bounds are those of double precision; where a law holds in the limit only, it is said.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import strategies as st
from underwater_spectral.tests.stress.cases import few_or_many, try_cases
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.transfer import solved_field
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import Emission
from underwater_spectral.uw_spectral.transfer.water_column import DeeperWater, WaterColumn
from underwater_spectral.uw_spectral.water.phase import BandPhase
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

STREAMS = 16
WAYS = np.array([(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.8, -0.6), (0.48, 0.64, -0.6)])
DEPTHS = np.array([0.0, 0.7, 3.0, 8.0])


@dataclasses.dataclass(frozen=True)
class Case:
    """A water of three bands, lit by a sun and a sky, maybe over a floor."""

    a: tuple[float, ...]
    b: tuple[float, ...]
    g: float
    zenith: float
    sky: float
    floor: float
    reflectance: float
    surface: str

    @property
    def phase(self) -> BandPhase:
        return parse_phase(f"hg:{self.g}").for_bands(np.ones(3))

    def column(self, **changes: object) -> WaterColumn:
        cosine = math.cos(math.radians(self.zenith))
        index = 1.34 if self.surface == "flat" else 1.0
        values = {
            "bands": Bands.uniform(3),
            "absorption": np.array(self.a),
            "scattering": np.array(self.b),
            "sun_irradiance": np.array([1.0, 0.7, 0.4]),
            "sun_cosine": cosine,
            "sun_direction": np.array([math.sqrt(1.0 - cosine**2), 0.0, -cosine]),
            "sky_radiance": self.sky * np.array([0.5, 1.0, 1.5]),
            "floor_depth": self.floor,
            "floor_reflectance": np.full(3, self.reflectance),
            "surface": self.surface,
            "refractive_index": index,
        }
        return WaterColumn(**(values | changes))

    def field(self, **changes: object) -> solved_field.SolvedField:
        return self.column(**changes).solved_field(self.phase, STREAMS)


def of(field: solved_field.SolvedField, depths=DEPTHS, ways=WAYS) -> np.ndarray:
    """All that a field says at some depths and in some directions, by band."""
    inside = np.minimum(depths, field.floor_depth)
    flat = [field.Ed(inside), field.Eu(inside), field.scalar_irradiance(inside)]
    bright = [field.radiance(y, list(ways.T)) for y in inside]
    n = field.extinction.size
    return np.concatenate([np.asarray(x).reshape(-1, n) for x in (*flat, *bright)])


def _same(found: np.ndarray, wanted: np.ndarray, rounding: float = 0.0) -> None:
    np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-12 + rounding)


per_metre = st.floats(0.02, 1.5)
CASES = st.builds(
    Case,
    a=st.tuples(*[per_metre] * 3),
    b=st.tuples(*[per_metre] * 3),
    g=st.floats(0.0, 0.92),
    zenith=st.floats(0.0, 45.0),
    sky=st.floats(0.01, 0.3),
    floor=st.sampled_from([math.inf, 8.0, 12.0]),
    reflectance=st.floats(0.0, 0.9),
    surface=st.sampled_from(["none", "flat"]),
)


def _twice_the_light(case: Case) -> None:
    column = case.column()
    brighter = case.field(
        sun_irradiance=2.0 * column.sun_irradiance, sky_radiance=2.0 * column.sky_radiance
    )
    _same(of(brighter), 2.0 * of(case.field()))


def _sun_and_sky_add_up(case: Case) -> None:
    parts = case.field(sun_irradiance=np.zeros(3)), case.field(sky_radiance=np.zeros(3))
    both = of(case.field())
    _same(of(parts[0]) + of(parts[1]), both)


def _emission_adds_and_of_nothing_is_none(case: Case) -> None:
    rate, power = np.full((1, 3), 0.3), np.array([[0.05, 0.2, 0.4]])
    column = case.column()
    none = of(case.field())
    dark, one, two = (
        of(column.solved_field(case.phase, STREAMS, Emission(rate, times * power)))
        for times in (0.0, 1.0, 2.0)
    )
    _same(dark, none)
    # What is left of much light, of which two large numbers are rounded.
    _same(two - none, 2.0 * (one - none), 1e-11 * float(none.max()))


def _light_turned_about_the_vertical(case: Case, angle: float = 2.1) -> None:
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = case.field(sun_direction=turn @ case.column().sun_direction)
    _same(of(turned, ways=WAYS @ turn.T), of(case.field()))


def _light_mirrored(case: Case) -> None:
    field = case.field()
    _same(of(field, ways=WAYS * [1, -1, 1]), of(field))


def _scaled_lengths(case: Case, factor: float = 3.0) -> None:
    """All that counts is optical depth."""
    scaled = case.field(
        absorption=np.array(case.a) * factor, scattering=np.array(case.b) * factor,
        floor_depth=case.floor / factor,
    )  # fmt: skip
    _same(of(scaled, DEPTHS / factor), of(case.field()))


def _bands_in_another_order(case: Case) -> None:
    order = [2, 0, 1]
    column = case.column()
    names = (
        "absorption", "scattering", "sun_irradiance", "sky_radiance", "floor_reflectance"
    )  # fmt: skip
    other = case.field(**{name: getattr(column, name)[order] for name in names})
    _same(of(other), of(case.field())[:, order])


def _the_same_water_below(case: Case) -> None:
    below = DeeperWater(2.0, np.array(case.a), np.array(case.b), case.phase)
    _same(of(case.field(below=(below,))), of(case.field()))


def _net_flux(field: solved_field.SolvedField, depths: np.ndarray) -> np.ndarray:
    return np.asarray(field.Ed(depths)) - np.asarray(field.Eu(depths))


def _what_is_lost_is_absorbed(case: Case) -> None:
    """Gershun's law, d(Ed - Eu)/dy = -a E0, integrated by Gauss-Legendre; so deeper is darker."""
    field = case.field()
    nodes, weights = np.polynomial.legendre.leggauss(24)
    for top, bottom in ((0.0, 0.5), (0.5, 2.0), (2.0, 6.0)):
        depths = top + (nodes + 1.0) * (bottom - top) / 2.0
        E0 = np.asarray(field.scalar_irradiance(depths)).reshape(len(depths), -1)
        absorbed = np.array(case.a) * (weights @ E0) * (bottom - top) / 2.0
        flux = _net_flux(field, np.array([top, bottom])).reshape(2, -1)
        np.testing.assert_allclose(flux[0] - flux[1], absorbed, rtol=1e-5, atol=1e-9)
        assert (flux[1] < flux[0]).all()


def _more_scattering_throws_more_back(case: Case) -> None:
    field = case.field(floor_depth=math.inf)
    murkier = case.field(floor_depth=math.inf, scattering=1.1 * np.array(case.b))
    back = [np.asarray(x.Eu(np.zeros(1))) / np.asarray(x.Ed(np.zeros(1))) for x in (field, murkier)]
    assert (back[1] > back[0]).all()


def _no_scattering_leaves_the_beam(case: Case) -> None:
    column = case.column(
        scattering=np.full(3, 1e-9), sky_radiance=np.zeros(3), floor_depth=math.inf
    )
    field = column.solved_field(case.phase, STREAMS)
    left = np.exp(-np.outer(DEPTHS, case.a) / column.sun_cosine) * column.sun_irradiance
    _same(np.asarray(field.Ed(DEPTHS)).reshape(4, 3), left)


LAWS: tuple[Callable[[Case], None], ...] = (
    _twice_the_light,
    _sun_and_sky_add_up,
    _emission_adds_and_of_nothing_is_none,
    _light_turned_about_the_vertical,
    _light_mirrored,
    _scaled_lengths,
    _bands_in_another_order,
    _the_same_water_below,
    _what_is_lost_is_absorbed,
    _more_scattering_throws_more_back,
    _no_scattering_leaves_the_beam,
)


@pytest.mark.slow_but_first
@few_or_many(12, 300)
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__[1:])
def test_law(law, cases_, record_property):
    try_cases(law, cases_, record_property, case=CASES)


CASE = Case((0.05, 0.1, 0.4), (0.1, 0.2, 0.3), 0.8, 40.0, 0.1, 8.0, 0.3, "flat")


@dataclasses.dataclass(frozen=True)
class At:
    """What was asked of a field, and the answer."""

    field: solved_field.SolvedField
    value: np.ndarray
    y: np.ndarray
    w: tuple[np.ndarray, ...] = ()


PLANTED: dict[Callable[[Case], None], tuple[str, Callable[[At], object]]] = {
    _twice_the_light: ("Ed", lambda at: 1.0 + 0.1 * at.value),
    _emission_adds_and_of_nothing_is_none: ("Ed", lambda at: 1.0 + 0.1 * at.value),
    _sun_and_sky_add_up: ("Eu", lambda at: 1.0 + 0.1 * at.value),
    _light_turned_about_the_vertical: ("radiance", lambda at: 1.0 + 0.1 * at.w[0]),
    _light_mirrored: ("radiance", lambda at: 1.0 + 0.1 * at.w[1]),
    _scaled_lengths: ("scalar_irradiance", lambda at: 1.0 + 0.0125 * at.y),
    _bands_in_another_order: ("Ed", lambda _: np.array([1.0, 1.05, 1.1])),
    _the_same_water_below: ("Eu", lambda at: 1.1 if at.field.layered else 1.0),
    _what_is_lost_is_absorbed: ("Ed", lambda at: 1.0 + 0.0125 * at.y),
    _more_scattering_throws_more_back: ("Eu", lambda at: at.field.scattering.mean() ** -1.1),
    _no_scattering_leaves_the_beam: ("Ed", lambda at: 1.0 + 0.0125 * at.y),
}
"""What each law is there to see: an error of a tenth, at 8 m or full brightness, that depends on
what must not matter."""


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__[1:])
def test_law_sees_an_error_of_a_tenth(law, monkeypatch):
    law(CASE)
    name, error = PLANTED[law]
    right = getattr(solved_field.SolvedField, name)

    def wrong(field, y, w=()):
        value = np.asarray(right(field, y, w) if len(w) else right(field, y))
        y, w = np.asarray(y)[..., None], tuple(np.asarray(x)[..., None] for x in w)
        return value * error(At(field, value, y, w))

    monkeypatch.setattr(solved_field.SolvedField, name, wrong)
    with pytest.raises(AssertionError):
        law(CASE)
