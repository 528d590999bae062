"""The optics over their whole parameter space: finite, in bounds, monotone, or one clear error."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import strategies as st
from underwater_spectral.tests.stress.cases import few_or_many, try_cases
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging.band_selection import fitted_reduction, optimised_bands
from underwater_spectral.uw_spectral.imaging.summary import colour_error
from underwater_spectral.uw_spectral.imaging.visibility import (
    diffuse_attenuation,
    euphotic_depth,
    horizontal_visibility,
    transmitted_light,
)
from underwater_spectral.uw_spectral.imaging.water_colour import dominant_colour, water_swatch
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import WHITE_BALANCES, reduction
from underwater_spectral.uw_spectral.spectra.illuminant import ILLUMINANTS, parse_illuminant
from underwater_spectral.uw_spectral.spectra.sensor import list_sensors, parse_sensor
from underwater_spectral.uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from underwater_spectral.uw_spectral.surface.wave_patterns import Sea
from underwater_spectral.uw_spectral.transfer.discrete_ordinates import (
    OpticalLayer,
    solve_discrete_ordinates,
)
from underwater_spectral.uw_spectral.transfer.radiance_field import (
    Ripples,
    sun_image,
    upwelling_irradiance,
)
from underwater_spectral.uw_spectral.transfer.radiance_table import tabulate
from underwater_spectral.uw_spectral.transfer.rough_surface import WaterSurface
from underwater_spectral.uw_spectral.transfer.sky import SKIES, Sky
from underwater_spectral.uw_spectral.transfer.sunlit_water import SunlitWater
from underwater_spectral.uw_spectral.transfer.water_column import SURFACES, WaterColumn
from underwater_spectral.uw_spectral.water.bio_optics import Constituents, parse_constituents
from underwater_spectral.uw_spectral.water.inelastic_processes import (
    EXCITATION,
    inelastic_processes,
)
from underwater_spectral.uw_spectral.water.named import list_waters, parse_water
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase
from underwater_spectral.validation.closed_form.closed_form import ClosedForm, solve_closed_form
from underwater_spectral.validation.closed_form.light_field import LightField, light_field_of
from underwater_spectral.validation.closed_form.paths import under_surface
from underwater_spectral.validation.closed_form.pixel import Pixel, forward_scattered_fraction
from underwater_spectral.validation.inelastic_light import (
    excitation_fields,
    solve_inelastic,
)
from underwater_spectral.validation.sun_beam import closed_beam
from underwater_spectral.validation.viewpoints import make_viewpoint

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)

COUNTS = st.sampled_from([1, 2, 3, 4, 6, 16, 31, 64])
COEFFICIENTS = st.sampled_from([0.0, 1e-300, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 1e3, 1e6]) | st.floats(
    0.0, 100.0
)
ZENITHS = st.sampled_from([0.0, 89.9]) | st.floats(0.0, 89.9)
DEPTHS = st.sampled_from([0.0, 1e-6, 1e-3, 1.0, 1000.0]) | st.floats(0.0, 1000.0)
BELOW = st.sampled_from([1e-6, 1e-3, 1.0, 1e4, math.inf]) | st.floats(1e-3, 1000.0)
FRACTIONS = st.sampled_from([0.0, 0.2, 1.0]) | st.floats(0.0, 1.0)
# Sea particles, molecules, and what lies between: all that scatter no more backwards than forwards.
FORWARD = (
    "hg:0", "hg:0.5", "hg:0.8", "hg:0.95", "hg:0.99", "petzold", "rayleigh", "isotropic",
    "einstein-smoluchowski", "tthg:0.95,-0.3,0.97", "fournier-forand:1.1,0.0183",
    "fournier-forand:1.02,0.01", "fournier-forand:1.15,0.039", "mixture", "mixture:0.002",
    "mixture:0.1",
)  # fmt: skip
LIMITS = (
    "hg:0.999", "hg:-0.999", "tthg:0.999,-0.999,0.5", "tthg:-0.99,0.99,0",
    "fournier-forand:1.0001,1e-6", "fournier-forand:1.0001,0.4999", "fournier-forand:1.5,1e-6",
    "fournier-forand:1.5,0.4999", "mixture:1e-4", "mixture:0.2",
)  # fmt: skip
DISTANCES = (1e-3, 1.0, 30.0, 1e4)
UP_DOWN_LEVEL = ((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Case:
    """A camera in a column of water, and how much light enters it."""

    column: WaterColumn
    water: ClosedForm
    depth: float

    @property
    def field(self) -> LightField:
        return self.water.field

    @property
    def entering(self) -> np.ndarray:
        """Irradiance that enters, shape (n,)."""
        column, surface = self.column, self.column.mean_surface
        fraction = 1.0 if surface is None else column.skylight.transmittance(surface)
        return column.sun_irradiance + math.pi * fraction * column.sky_radiance

    def depths(self) -> np.ndarray:
        return np.linspace(0.0, min(self.column.floor_depth, 1000.0), 9)[:, None]

    def views(self, seed: int, *, at_sun: bool = True) -> tuple[np.ndarray, ...]:
        """Up, down, level, towards and away from the sun, and some others."""
        some = np.random.default_rng(seed).normal(size=(6, 3))
        along = [-np.asarray(self.water.sun), np.asarray(self.water.sun)] if at_sun else []
        w = np.concatenate([UP_DOWN_LEVEL, *([along] if at_sun else []), some])
        w /= np.linalg.norm(w, axis=1)[:, None]
        return tuple(w[:, axis, None] for axis in range(3))


@st.composite
def cases(draw, phases=FORWARD + LIMITS, indices=(1.0, 1.1, 1.34, 2.0), zeniths=ZENITHS, **fixed):
    """Draw a case; ``fixed`` holds strategies for a, b, sun, sky, below, reflectance, surface."""
    bands = Bands.uniform(draw(COUNTS))
    few = st.lists(fixed.get("coefficients", COEFFICIENTS), min_size=1, max_size=4)
    a, b = (np.resize(draw(few), len(bands)) for _ in range(2))
    index, zenith = draw(st.sampled_from(indices)), draw(zeniths)
    depth = draw(fixed.get("depths", DEPTHS))
    floor = depth + draw(fixed.get("below", BELOW))
    sun, sky = draw(fixed.get("light", st.sampled_from([(1, 0), (1e3, 1), (0, 1), (1, 0.1)])))
    phase = parse_phase(draw(st.sampled_from(phases))).for_bands(b, np.minimum(b, 0.005))
    direction = sun_travel_direction(zenith, draw(st.sampled_from([0.0, 77.0, -360.0])), index)
    column = WaterColumn(
        bands, a, b, float(sun), float(in_water_cosine(zenith, index)), direction, float(sky),
        floor, draw(FRACTIONS), draw(st.sampled_from(SURFACES)), index,
        sky=draw(fixed.get("kinds", st.sampled_from(SKIES))),
    )  # fmt: skip
    water = solve_closed_form(light_field_of(column, phase), phase, depth, direction)
    return Case(column, water, depth)


def _sound(values, what, least=0.0) -> None:
    values = np.asarray(values)
    assert np.isfinite(values).all(), what
    assert (values >= least).all(), f"{what}: {values.min():g}"


@few_or_many(80, 3_000)
def test_radiance_is_finite_and_not_negative(cases_, record_property):
    """Every water, sun, floor, surface, phase function and view, their limits first."""

    def check(case, seed):
        y, water, column = case.depth, case.water, case.column
        w = case.views(seed)
        sky = column.skylight.radiance(w)
        _sound(sky, "sky")
        for P in (0.0, *DISTANCES, math.inf):
            _sound(water.path(y, w, P), "path")
            _sound(closed_beam(water).single_scattering(y, w, P), "single scattering")
            _sound(forward_scattered_fraction(water, min(P, 1e7)), "forward-scattered")
        if column.reflects:
            up = (w[0], w[1], np.abs(w[2]))
            index = column.refractive_index
            sky = under_surface(water, w, column.skylight.seen_through(w, index), index)
            _sound(sky, "surface")
            for slopes in ((0.0, 0.0), (0.1, -0.3), (-30.0, 4.0)):
                over_waves = column.skylight.seen_through(up, index, slopes=slopes)
                _sound(under_surface(water, up, over_waves, index, slopes=slopes), "waves")
                _sound(sun_image(water.sun, up, index, Ripples(slopes, 1e-5)), "glitter")
        background = water.radiance(y, w, sky)
        _sound(background, "background")
        _sound(Pixel(water, y, w, 1.0, 1.0, background).total, "pixel")
        _sound(upwelling_irradiance(water.radiance, y), "upwelling")
        for part in (-1.0, 0.0, 1.0):
            for light in case.field.surface_irradiance(case.depths(), 0.5 * part, part):
                _sound(light, "surface irradiance")
        for name in ("E0", "F", "Ed", "Eu", "scalar_irradiance"):
            _sound(getattr(case.field, name)(case.depths()), name, -math.inf)
        _sound(case.field.floor_radiance(), "floor")

    try_cases(check, cases_, record_property, case=cases(), seed=st.integers(0, 9))


@few_or_many(60, 5_000)
def test_no_energy_is_gained(cases_, record_property):
    """What enters bounds what is there, for phase functions that scatter forwards.

    Of the exact net flux nothing can be gained. 5/4 of the downwelling flux is what two streams
    give deep in white water under a sun in the zenith (exact: 1.26); the surface sends it back
    1/(1 - R) times. The two streams' own Eu is negative by up to (1/√3 - 1/2)/(1 + 2/√3) of the
    light that enters where water only absorbs; :func:`upwelling_irradiance` is never.
    """
    low_sun = st.floats(0.0, 84.0)  # below, an index of 1 meets the bound on the sun's cosine

    def check(case):
        field, entering = case.field, case.entering
        most = 1.25 * (1 + 1e-9) * entering / (1 - field.R)
        y = case.depths()
        Ed, Eu, E0 = field.Ed(y), field.Eu(y), field.scalar_irradiance(y)
        _sound(Ed, "Ed", -1e-9 * entering.max())
        _sound(E0, "E0", -1e-9 * entering.max())
        assert (Ed <= most).all()
        assert (Eu >= -0.072 * entering).all()
        net = Ed - Eu
        assert (np.diff(net, axis=0) <= 1e-9 * most).all()
        assert (net <= entering * 1.08).all()
        assert (upwelling_irradiance(case.water.radiance, case.depth) <= 1.001 * most).all()
        for part in field.surface_irradiance(y, field.mu_s, 1.0):
            assert (part <= most).all()

    drawn = cases(FORWARD, zeniths=low_sun)
    try_cases(check, cases_, record_property, case=drawn)


@few_or_many(40, 3_000)
def test_white_water_is_no_brighter_than_its_sky(cases_, record_property):
    """Lit by a uniform sky alone, nothing in the water outshines it: the furnace as a bound."""

    def check(case, seed):
        column, w = case.column, case.views(seed)
        source = column.sky_radiance * (column.refractive_index**2 if column.reflects else 1.0)
        for P in DISTANCES:
            assert (case.water.path(case.depth, w, P) <= source * (1 + 1e-6)).all()
        sky = column.sky_radiance
        if column.reflects:
            sky = under_surface(case.water, w, sky, column.refractive_index)
        assert (case.water.radiance(case.depth, w, sky) <= source * (1 + 1e-6)).all()

    drawn = cases(FORWARD, light=st.just((0, 1)), kinds=st.just("uniform"))
    try_cases(check, cases_, record_property, case=drawn, seed=st.integers(0, 9))


@few_or_many(40, 3_000)
def test_what_must_be_monotone(cases_, record_property):
    """What is scattered forward comes of the beam; more absorption leaves less light and sight."""

    def check(case, more):
        field = case.field
        P = np.geomspace(1e-3, 1e4, 30)[:, None]
        direct, together = (
            np.exp(-field.c * P),
            np.exp(-field.c * P) + forward_scattered_fraction(case.water, P),
        )
        for fraction in (direct, together):
            assert (fraction <= 1.0).all()
            assert (np.diff(fraction, axis=0) <= 1e-15).all()
        darker = dataclasses.replace(
            case.column, absorption=case.column.absorption * more + 1e-4, floor_reflectance=0.0
        )
        dark = dataclasses.replace(case.column, floor_reflectance=0.0)
        y, phase = case.depths(), case.water.phase
        less, light = (light_field_of(column, phase) for column in (darker, dark))
        assert (
            less.scalar_irradiance(y)
            <= light.scalar_irradiance(y) * (1 + 1e-6) + 1e-6 * case.entering
        ).all()

    drawn = cases(FORWARD, zeniths=st.floats(0.0, 80.0), coefficients=st.floats(0.0, 10.0))
    try_cases(check, cases_, record_property, case=drawn, more=st.floats(1.0, 10.0))


# --- The solved field and its tables -------------------------------------------------------------

CLEAR_TO_MURKY = st.sampled_from([0.0, 1e-12, 1e-4, 1e-3, 0.02, 0.1, 1.0, 10.0, 50.0])
FLOORS = st.sampled_from([0.05, 0.5, 3.0, 20.0, 200.0, 1000.0, math.inf])
# hg:0.99 and narrower: 32 streams leave ripples around their peak.
WIDER = tuple(name for name in FORWARD if name != "hg:0.99")
LEVEL_SUN = math.cos(math.radians(85.0))
MOST_TABLE = 0.25
"""Relative error of what is looked up, at worst; nine cases in ten are below half of that."""
SKIES_AND_SUNS = st.sampled_from([(1, 0), (1, 0.1), (0, 1)])


@st.composite
def solved(draw, phases=FORWARD + LIMITS, layers=(1, 1, 2, 3)):
    """Draw the layers of a column, solved, the scattering and absorption of each, and its floor."""
    n, count, floor = 3, draw(st.sampled_from(layers)), draw(FLOORS)
    bottoms = [*(min(floor, 30.0) * np.arange(1, count) / count), floor]
    phase, index = parse_phase(draw(st.sampled_from(phases))), draw(st.sampled_from([None, 1.34]))
    water = []
    for bottom in bottoms:
        a, b = (np.array([draw(CLEAR_TO_MURKY) for _ in range(n)]) for _ in range(2))
        water.append(OpticalLayer(bottom, a, b, phase.for_bands(b, np.minimum(b, 0.005))))
    zenith, azimuth = draw(ZENITHS), draw(st.sampled_from([0.0, 77.0]))
    sun, sky = draw(SKIES_AND_SUNS)
    toward = sun_travel_direction(zenith, azimuth, 1.0)
    field = solve_discrete_ordinates(
        water, np.full(n, float(sun)), sun_travel_direction(zenith, azimuth, index or 1.0),
        sky=Sky.standard(draw(st.sampled_from(SKIES)), np.full(n, float(sky)), toward),
        surface=index and WaterSurface(index), floor_reflectance=draw(FRACTIONS),
    )  # fmt: skip
    return field, water


def _directions(field, seed):
    """Up, down, level, towards and away from the sun, and some others, shape (3, q)."""
    sun, some = np.asarray(field.sun), np.random.default_rng(seed).normal(size=(24, 3))
    w = np.concatenate([UP_DOWN_LEVEL, [-sun, sun], some])
    return (w / np.linalg.norm(w, axis=1)[:, None]).T


def _water_depths(field):
    return min(field.floor_depth, 1000.0) * np.array([0.0, 1e-3, 0.03, 0.2, 0.6, 1.0])


@few_or_many(40, 400)
def test_solved_field_is_finite(cases_, record_property):
    """Also of phase functions that no streams resolve; what is looked up is not negative."""

    def check(column, seed):
        field, _ = column
        y = _water_depths(field)
        for name in ("Ed", "Eu", "scalar_irradiance"):
            _sound(getattr(field, name)(y), name, -math.inf)
        w = _directions(field, seed)
        for name in ("radiance", "scattered", "single_scattering"):
            _sound(getattr(field, name)(y[:, None], w), name, -math.inf)
        _sound(field.single_scattering(y[:, None], w), "single scattering")
        table = tabulate(field)
        for name in ("radiance", "irradiance", "image", "scale", "decay"):
            _sound(np.float32(getattr(table, name)), name)
        _sound(np.float32(table.aureole), "aureole", -math.inf)
        depths = table.depth_scale.depths()
        for scaled in (False, True):
            each = field.extinction_between(depths, depths, scaled=scaled)
            mean = field.extinction_between(0.0, depths, scaled=scaled)
            # A mean lies between those of the depths that it is taken over.
            assert (mean <= each.max(axis=0) * (1 + 1e-6)).all()
            assert (mean >= each.min(axis=0) * (1 - 1e-6)).all()
        y = y[:, None] + 0.0 * w[0]
        _sound(table.scattered(y, w, field.sun), "scattered")
        _sound(table.patch_irradiance(y, w, field.sun), "irradiance on patches")
        _sound(table.boundary_image(w, field.sun), "image")

    try_cases(check, cases_, record_property, column=solved(), seed=st.integers(0, 9))


@few_or_many(40, 400)
def test_solved_light_is_not_negative(cases_, record_property):
    """Of phase functions that sea water has, in one water and in layers."""

    def check(column, seed):
        field, _ = column
        L = field.radiance(_water_depths(field)[:, None], _directions(field, seed))
        for name in ("Ed", "Eu", "scalar_irradiance"):
            _sound(getattr(field, name)(_water_depths(field)), name, -1e-9)
        least = -1e-5 * np.maximum(L.max(axis=1, keepdims=True), 1e-3)
        _sound(L - least, "radiance")
        _sound(field.aureole(_water_depths(field), [1e-6, 1e-4, 1e-3, 1e-2]), "aureole", -0.05)

    drawn = solved(phases=WIDER)
    try_cases(check, cases_, record_property, column=drawn, seed=st.integers(0, 9))


@few_or_many(30, 400)
def test_solved_field_keeps_the_energy(cases_, record_property):
    """Net flux at the top is what is absorbed and what the floor keeps (Gershun), to 1e-3."""

    def check(column):
        field, water = column
        bottom = min(field.floor_depth, 1000.0)
        nodes, weights = np.polynomial.legendre.leggauss(12)
        top, absorbed = 0.0, 0.0
        for layer in water:
            thickness = min(layer.bottom, bottom) - top
            near = np.geomspace(min(1e-4, 0.1 * thickness), thickness / 2, 40)
            ends = np.unique(np.concatenate([[0.0], near, thickness - near, [thickness]]))
            middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
            y = (middle[:, None] + half[:, None] * nodes).ravel()
            E0 = field.scalar_irradiance(top + y)
            absorbed = absorbed + layer.absorption * ((half[:, None] * weights).ravel() @ E0)
            top = layer.bottom
        above, below = (field.Ed(y) - field.Eu(y) for y in (0.0, bottom))
        most = np.maximum(field.Ed(0.0), 1e-3)
        assert (np.abs(above - below - absorbed) <= 1e-3 * most).all()
        assert (below >= -1e-9 * most).all()
        if math.isfinite(field.floor_depth):
            kept = (1 - field.light.floor_reflectance) * field.Ed(bottom)
            assert (np.abs(below - kept) <= 1e-9 * most).all()

    try_cases(check, cases_, record_property, column=solved(phases=FORWARD))


@few_or_many(30, 400)
def test_tables_are_close_to_the_solved_field(cases_, record_property):
    """Not near the sun and the horizon, against the mean radiance there of the brightest band.

    Nor under a level sun that nothing refracts: see docs/measured/stress.md.
    """
    errors = []

    def check(column, seed):
        field, _ = column
        if -field.sun[2] < LEVEL_SUN:
            return
        table, w = tabulate(field), _directions(field, seed)
        away = -np.asarray(field.sun) @ w < math.cos(math.radians(20.0))
        w = w[:, away & (np.abs(w[2]) > 0.1)]
        mu, turns = w[2], np.arctan2(-w[1], -w[0]) - math.atan2(field.sun[1], field.sun[0])
        y = table.depth_scale.deepest * np.array([0.0, 0.002, 0.03, 0.21, 0.6, 0.97, 1.0])
        grids = [
            field.scattered_on_grid(y, [m], [t])[:, :, 0, 0] for m, t in zip(mu, turns, strict=True)
        ]
        exact, found = np.moveaxis(grids, 0, 2), table.scattered(y[:, None], w, field.sun)
        mean = field.scalar_irradiance(y).max(axis=1)[:, None] / (4 * math.pi)
        error = np.abs(np.moveaxis(found, 2, 0) - exact) / np.maximum(np.maximum(exact, mean), 1e-7)
        errors.append(error.max())
        assert error.max() < MOST_TABLE

    drawn = solved(phases=WIDER, layers=(1,))
    try_cases(check, cases_, record_property, column=drawn, seed=st.integers(0, 9))
    assert np.quantile(errors, 0.9) < MOST_TABLE / 2


# --- Single precision -------------------------------------------------------------------------

# Radiance of 1 % of a white surface in the light there: errors below 1e-3 of it are a thirtieth
# of the darkest step of an 8-bit picture (3e-4) that is exposed for it.
VISIBLE = 0.01
MOST_TRANSPORT = 250.0
"""Optical depth b(1 - χ1) y_f of the column up to which 1e-3 holds: see docs/measured/stress.md."""


def _single(values):
    return np.asarray(values, dtype=np.float32)


def _agrees(single, exact, floor, what) -> None:
    assert np.asarray(single).dtype == np.float32, what
    error = np.abs(single - np.asarray(exact)) / np.maximum(np.maximum(exact, floor), 1e-30)
    assert np.isfinite(single).all(), what
    assert error.max() <= 1e-3, f"{what}: {error.max():.2g}"


@few_or_many(40, 2_500)
def test_single_precision_follows_double(cases_, record_property):
    """The formulas of the nodes in float32 against float64, 1e-3 of the visible.

    Not within 1e-5 (in cos²) of the edge of Snell's window, which is infinitely steep there.
    """

    def check(case, seed):
        field, water, column = case.field, case.water, case.column
        transport = field.bp * (1 - field.gp) * field.y_f
        if math.isfinite(column.floor_depth) and transport.max() > MOST_TRANSPORT:
            return
        w = tuple(np.float64(_single(axis)) for axis in case.views(seed))
        y = float(np.float32(case.depth))
        if y > field.y_f:
            return
        near, few, few_w = np.float32(y), water.astype(np.float32), tuple(map(_single, w))
        white = np.maximum(field.Ed(y), 0.0) / math.pi
        floor = VISIBLE * white + 1e-12
        behind, few_behind = water.radiance(y, w, 0.1), few.radiance(near, few_w, _single(0.1))
        _agrees(few_behind, behind, floor, "background")
        for P in map(float, _single(DISTANCES)):
            far = np.float32(P)
            path, few_path = water.path(y, w, P), few.path(near, few_w, far)
            _agrees(few_path, path, floor, "path")
            single = closed_beam(water).single_scattering(y, w, P)
            few_single = closed_beam(few).single_scattering(near, few_w, far)
            _agrees(few_single, single, floor, "single scattering")
            _agrees(few_path - few_single, path - single, np.maximum(floor, path), "many times")
            seen = Pixel(water, y, w, P, white, behind).total
            few_seen = Pixel(few, near, few_w, far, _single(white), few_behind).total
            # Forward-scattered light is a difference: exact to 6e-8 of what lies behind.
            _agrees(few_seen, seen, np.maximum(floor, 2e-4 * behind), "pixel")
        if column.reflects:
            index = float(np.float32(column.refractive_index))
            steep = np.abs(w[2])[np.abs(w[2] ** 2 - (1 - index**-2))[:, 0] > 1e-5]
            up = (np.sqrt(1 - steep**2), 0.0 * steep, steep)
            up = tuple(np.float64(_single(axis)) for axis in up)
            top = VISIBLE * np.maximum(field.Ed(0.0), 0.0) / math.pi + 1e-12
            few_up = tuple(map(_single, up))
            exact = under_surface(water, up, 0.1, index)
            _agrees(under_surface(few, few_up, _single(0.1), _single(index)), exact, top, "surface")
        depths = np.float64(_single(case.depths()))
        light = np.maximum(field.Ed(depths), 0.0) + 1e-12
        for up in (-1.0, 0.0, 1.0):
            whole = sum(field.surface_irradiance(depths, up, up))
            few_whole = sum(few.field.surface_irradiance(*map(_single, (depths, up, up))))
            _agrees(few_whole, whole, light, "surface irradiance")
        floors = field.floor_radiance()
        _agrees(few.field.floor_radiance(), floors, VISIBLE * light[-1], "floor")

    drawn = cases(
        FORWARD,
        zeniths=st.floats(0.0, 85.0),
        coefficients=st.sampled_from([0.0, 1e-6, 1e-3, 0.1, 10.0]) | st.floats(1e-4, 100.0),
        depths=st.sampled_from([0.0, 1e-3, 1.0, 5.0]) | st.floats(0.0, 200.0),
        below=st.sampled_from([1e-2, 1.0, 10.0, math.inf]) | st.floats(0.01, 100.0),
        light=st.sampled_from([(1, 0), (1, 0.1), (0, 1)]),
    )
    try_cases(check, cases_, record_property, case=drawn, seed=st.integers(0, 9))


# --- Waters, cameras, read-outs ---------------------------------------------------------------

NAMED = tuple(
    (name, "solonenko2015" if source == "constituents" else source)
    for source, names in list_waters().items()
    for name in names
)
AMOUNTS = {"chl": 100.0, "cdom": 20.0, "minerals": 1000.0, "detritus": 20.0}
MADE = (
    "bio:",
    *(f"bio:{key}={amount:g}" for key, most in AMOUNTS.items() for amount in (1e-9, most)),
    "bio:" + ",".join(f"{key}={most:g}" for key, most in AMOUNTS.items()),
    "bio:chl=1,cdom=1,detritus=1,cdom-slope=0.1,detritus-slope=0.1,salinity=40,bb/b=0.2",
    "bio:chl=1,cdom=1,detritus=1,cdom-slope=0,detritus-slope=0,salinity=0,bb/b=1e-4",
)
WATERS = tuple(parse_water(*name) for name in NAMED) + tuple(parse_water(name) for name in MADE)
D65 = parse_illuminant("d65")
BANDS = {count: Bands.uniform(count) for count in (1, 2, 3, 8, 31, 60, 64)}


def _or_input_error(make):
    """Return the value, or None where the input is refused."""
    try:
        return make()
    except InputError:
        return None


@few_or_many(30, 500)
def test_readouts_of_every_water(cases_, record_property):
    """Jerlov types, named seas and constituents at their limits, scaled by 0 to 1000."""
    cameras = [parse_sensor(name) for name in ("cie1931", "Nikon D7000", "Fuji Velvia 50")]

    def check(water, factors, camera, depth, below, count, how):
        water = water.scaled(*factors)
        views = [
            make_viewpoint(water, D65, camera, depth, BANDS[n], floor_depth=depth + below, **how)
            for n in (count, 60)
        ]
        view = views[0]
        _sound(transmitted_light(view), "light left")
        weights = _or_input_error(lambda: view.reduction.weights)
        if weights is not None:
            assert np.isfinite(weights).all()
        fitted = _or_input_error(lambda: fitted_reduction(*views))
        if fitted is not None:
            assert np.isfinite(fitted.weights).all()
        swatch = _or_input_error(lambda: water_swatch(view))
        if swatch is not None:
            assert ((swatch >= 0) & (swatch <= 1)).all()
        Kd = diffuse_attenuation(view)
        assert np.isfinite(Kd[view.light > 0]).all()
        for readout in (
            lambda: horizontal_visibility(view),
            lambda: euphotic_depth(view.column, view.phase),
            lambda: dominant_colour(view).purity,
            lambda: colour_error(*views).maximum,
        ):
            value = _or_input_error(readout)
            assert value is None or value >= 0

    factors = st.sampled_from([0.0, 1e-6, 1.0, 1000.0])
    how = st.fixed_dictionaries(
        {
            "sun_zenith": ZENITHS,
            "floor_reflectance": st.sampled_from(["0", "1"]),
            "surface": st.sampled_from(SURFACES),
            "sky_radiance": st.sampled_from([0.0, 0.1, 1e6]),
            "above_surface": st.booleans(),
            "white_balance": st.sampled_from(WHITE_BALANCES),
            "exposure_stops": st.sampled_from([None, -20.0, 0.0, 20.0]),
            "phase": st.sampled_from(["mixture", "hg:0.924", "isotropic"]),
        }
    )
    try_cases(
        check, cases_, record_property,
        water=st.sampled_from(WATERS), factors=st.tuples(factors, factors),
        camera=st.sampled_from(cameras), depth=DEPTHS, below=BELOW,
        count=st.sampled_from(sorted(BANDS)), how=how,
    )  # fmt: skip


@pytest.mark.parametrize("water", ["jerlov:I", "jerlov:9C", MADE[-3]])
def test_sight_and_light_shrink_with_what_is_in_the_water(water):
    camera, clear = parse_sensor("cie1931"), parse_water(water)
    views = [
        make_viewpoint(clear.scaled(f, f), D65, camera, 0.5, BANDS[60]) for f in (0.5, 1.0, 2.0)
    ]
    for series in (
        [horizontal_visibility(view) for view in views],
        [euphotic_depth(view.column, view.phase) for view in views],
    ):
        assert series == sorted(series, reverse=True)


def _reductions(sensors, record_property):
    """Each sensor with few, many and narrow bands, in each light and white balance."""
    tried, refused = 0, 0
    ranges = [(1, 400, 700), (3, 400, 700), (64, 400, 700), (3, 500, 501), (2, 300, 780)]
    for name in sensors:
        sensor = parse_sensor(name)
        for light in ILLUMINANTS:
            illuminant = parse_illuminant(light, 75.0)
            for count, low, high in ranges:
                bands = Bands.uniform(count, low, high)
                fading = np.exp(-np.linspace(0.0, 40.0, count))
                for balance in WHITE_BALANCES:
                    tried += 1
                    found = _or_input_error(
                        lambda s=sensor, b=bands, i=illuminant, f=fading, w=balance: reduction(
                            s, b, i, f, w
                        )
                    )
                    if found is None:
                        refused += 1
                    else:
                        assert np.isfinite(found.weights).all(), (name, light, count, balance)
                        assert math.isfinite(found.delta_e)
    record_property("cases", tried)
    record_property("refused", refused)


def test_some_sensors_with_every_light(record_property):
    _reductions(["cie1931", "cie2015-10", "Nikon D7000", "Fuji Velvia 50"], record_property)


@pytest.mark.slow
def test_every_sensor_with_every_light(record_property):
    _reductions(list_sensors(), record_property)


def test_one_band_develops_unless_daylight_is_balanced():
    """Bradford's cones turn negative for it; the two other balances do not need them."""
    sensor, one = parse_sensor("cie1931"), BANDS[1]
    with pytest.raises(InputError, match="take more bands, or white balance none or depth"):
        reduction(sensor, one, D65)
    for balance in ("none", "depth"):
        assert np.isfinite(reduction(sensor, one, D65, [0.1], balance).weights).all()


@pytest.mark.parametrize("count", [1, 12, pytest.param(13, marks=pytest.mark.slow), 60, 64])
@pytest.mark.parametrize("water", ["jerlov:9C", MADE[-3]])
def test_optimised_bands_of_any_number(count, water):
    eye = make_viewpoint(parse_water(water), D65, parse_sensor("cie1931"), 0.0, BANDS[60])
    found = optimised_bands(count, eye, (2.0, 1000.0))
    assert len(found.bands) == count
    assert 0 <= found.delta_e < 200


# --- Inelastic light, waves -------------------------------------------------------------------


@few_or_many(8, 200)
def test_inelastic_light(cases_, record_property):
    def check(amounts, count, floor, surface, zenith, sky, factor, efficiency):
        sea = Constituents(*amounts, chlorophyll_yield=efficiency)
        emission = Bands.uniform(count)
        parts = []
        for bands in (EXCITATION, emission):
            nm = bands.centres
            column = WaterColumn(
                bands, factor * sea.absorption(nm), factor * sea.scattering(nm), 1.0,
                float(in_water_cosine(zenith)), sun_travel_direction(zenith, 0.0), sky, floor, 1.0,
                surface, 1.34,
            )  # fmt: skip
            parts.append((column, sea.phase(nm)))
        field = light_field_of(parts[1][0], parts[1][1])
        processes = inelastic_processes(sea, EXCITATION, emission)
        exciting = excitation_fields(*parts[0])
        light = solve_inelastic(processes, exciting, EXCITATION, field, emission)
        y = np.linspace(0.0, min(floor, 1000.0), 5)[:, None]
        w = tuple(np.array(axis)[:, None] for axis in np.transpose(UP_DOWN_LEVEL))
        for name in ("E0", "F", "Ed", "Eu", "source"):
            assert np.isfinite(getattr(light, name)(y)).all(), name
        for P in DISTANCES:
            _sound(light.path(y[2], w, P), "inelastic path")
        _sound(light.radiance(y[2], w, under_surface(light, w, 0.0, 1.34)), "inelastic background")
        _sound(light.surface_irradiance(y, -1.0), "inelastic irradiance")
        # What is emitted has been taken from the light: at most the yield of one, and Raman.
        _sound(light.source(y), "source", -1e-9 * max(light.source(y).max(), 0.0))

    amounts = [
        st.sampled_from(values) for values in ([0, 1e-6, 1, 100], [0, 20], [0, 1e3], [0, 20])
    ]
    try_cases(
        check, cases_, record_property,
        amounts=st.tuples(*amounts), count=COUNTS,
        floor=st.sampled_from([1e-3, 1.0, 100.0, math.inf]),
        surface=st.sampled_from(["none", "flat"]), zenith=st.sampled_from([0.0, 89.9]),
        sky=st.sampled_from([0.0, 0.1]), factor=st.sampled_from([0.0, 1.0, 1000.0]),
        efficiency=st.sampled_from([0.0, 0.02, 1.0]),
    )  # fmt: skip


@few_or_many(25, 1_000)
def test_waves_and_caustics(cases_, record_property):
    phase = parse_phase("mixture").for_bands([0.0, 1e-3, 1.0, 100.0], [0.0, 1e-3, 3e-3, 3e-3])

    def check(wind, fetch, tile, resolution, zenith, index, floor, time, loop):
        sun = sun_travel_direction(zenith, 20.0, index)
        sea = Sea(wind, 30.0, fetch, floor, 1, tile, resolution, loop)
        now = sea.at(time, sun, index, floor)
        _sound(now.caustics_image(), "caustics")
        assert now.layers.images.mean(axis=(1, 2)) == pytest.approx(1.0, abs=1e-3)
        assert np.isfinite(now.slopes_image()).all()
        column = WaterColumn(
            Bands.uniform(4), [0, 0.05, 1.0, 100.0], [0, 1e-3, 1.0, 100.0], [1.0, 0, 1.0, 1.0],
            -float(sun[2]), sun, 0.1, floor, 0.2, "waves", index,
        )  # fmt: skip
        contrast = now.contrast(SunlitWater(column.solved_field(phase, 16)))
        _sound(contrast, "contrast")
        assert (contrast <= 1.5).all()  # its own bound
        assert now.glitter_width(index) > 0

    try_cases(
        check, cases_, record_property,
        wind=st.sampled_from([0.0, 1e-3, 5.0, 40.0]), fetch=st.sampled_from([10.0, 5e5, 1e7]),
        tile=st.sampled_from([0.1, 1.0, 10.0, 1000.0]), resolution=st.sampled_from([16, 17, 64]),
        zenith=st.sampled_from([0.0, 45.0, 89.9]), index=st.sampled_from([1.0, 1.34, 2.0]),
        floor=st.sampled_from([1e-3, 1.0, 100.0, math.inf]),
        time=st.sampled_from([0.0, -1e5, 1e7]), loop=st.sampled_from([None, 1e-3, 1e4]),
    )  # fmt: skip


# --- What a user writes -----------------------------------------------------------------------


@few_or_many(150, 5_000)
def test_texts_are_read_or_refused(cases_, record_property):
    """Names and numbers of all kinds end in a value or one InputError."""

    def check(kind, text):
        parse = {
            "phase": parse_phase,
            "water": parse_water,
            "constituents": parse_constituents,
            "illuminant": parse_illuminant,
        }[kind]
        _or_input_error(lambda: parse(text))

    words = ["hg", "tthg", "mixture", "petzold", "jerlov", "bio", "case", "file", "IB", "baltic",
             "chl", "cdom", "bb/b", "salinity", "d65", "clear-sky", ":", ",", "=", "-", " ", "é",
             "nan", "inf", "1e999", "-1", "0", "0.5", "1e-320", "//", "\x00"]  # fmt: skip
    text = st.lists(st.sampled_from(words), max_size=7).map("".join) | st.text(max_size=12)
    kinds = st.sampled_from(["phase", "water", "constituents", "illuminant"])
    try_cases(check, cases_, record_property, kind=kinds, text=text)
