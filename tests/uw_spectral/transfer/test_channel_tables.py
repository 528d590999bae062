"""Light projected into channels, against sums over the bands of its tables."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from underwater_spectral.settings import render_plan
from underwater_spectral.settings.scene_settings import DEFAULT_BANDS, SceneSettings
from underwater_spectral.uw_spectral.mathematics import NUMPY
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.reflectance import uplift_basis
from underwater_spectral.uw_spectral.transfer.band_spectra import OcclusionSpectra
from underwater_spectral.uw_spectral.transfer.channel_pixel import along_rays
from underwater_spectral.uw_spectral.transfer.channel_tables import ON_PATH, RATES
from underwater_spectral.uw_spectral.transfer.channels import channels_of, channels_of_bands
from underwater_spectral.uw_spectral.transfer.pixel_parts import (
    COLOURS,
    Around,
    OcclusionFactor,
    OcclusionOnPath,
    SeenObject,
    SurfaceAbove,
    SurfaceMaterial,
)
from underwater_spectral.uw_spectral.transfer.projection import project
from underwater_spectral.uw_spectral.transfer.radiance_field import distance_in_water
from underwater_spectral.uw_spectral.transfer.radiance_table import OCCLUSION_STREAMS, tabulate
from underwater_spectral.uw_spectral.transfer.sun_beam import half_angle2
from underwater_spectral.validation.solved_ray import (
    PathOcclusion,
    SolvedWater,
)
from underwater_spectral.validation.sun_beam import sun_beam
from underwater_spectral.validation.tabulated_water import aureole_at, tabulated_water

pytestmark = pytest.mark.filterwarnings(
    "ignore::underwater_spectral.uw_spectral.errors.DataWarning"
)
PIXELS = 10_000
FLOOR = 12.0
FROM_SUN = math.cos(math.radians(15.0))


@dataclasses.dataclass(frozen=True, eq=False)
class LayeredBeam:
    """The direct sun in layered water along one path, by its mean extinctions.

    ``near`` and ``far`` are sunlight scattered once from the path's beginning, and from its end,
    to the boundary ahead, the peak counted as unscattered.
    """

    c: object
    cp: object
    E: object
    mu_s: float
    y_f: float
    sun: object
    near: object = 0.0
    far: object = 0.0

    def boundary(self, y, w, m=NUMPY):
        return distance_in_water(y, -w[2], self.y_f, m)

    def single_scattering(self, y_o, w, P, m=NUMPY, *, without_peak=False):
        del y_o, w, without_peak
        return self.near - m.exp(-self.cp * P) * self.far


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """A water, its projection, and pixels of coloured objects in it."""

    plan: render_plan.RenderPlan
    projected: object
    exact: np.ndarray
    found: np.ndarray
    open_exact: np.ndarray
    open_found: np.ndarray

    @property
    def errors(self):
        """Relative errors of objects and of open water."""
        return self.found / self.exact - 1, self.open_found / self.open_exact - 1


def _case(water: str, zenith: float, channels: str, *, spoilt: dict | None = None) -> Case:
    chosen = SceneSettings(
        water=water, bands=30, surface="flat", sky="clear", sun_zenith=zenith,
        floor_depth=FLOOR, floor_reflectance="0.3",
    )  # fmt: skip
    plan = render_plan.make_plan(chosen)
    column, field = plan.column, plan.solved_field(24)
    projecting = {
        "sensor": lambda: channels_of(plan.bands, plan.response(5.0)),
        "bands": lambda: channels_of_bands(plan.bands, (3, 12, 24)),
    }[channels]()
    projected = project(field, projecting, 5.0, column.skylight.level)
    if spoilt:
        changed = {name: getattr(projected, name) * factor for name, factor in spoilt.items()}
        projected = dataclasses.replace(projected, **changed)
    rng = np.random.default_rng(5)
    v = rng.normal(size=(3 * PIXELS, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    y_o = rng.uniform(0.2, FLOOR - 0.2, len(v))
    P = np.exp(rng.uniform(math.log(0.2), math.log(20.0), len(v)))
    y_e = y_o - v[:, 2] * P
    # Close to the sun the light scattered forward takes the aureole of another depth.
    kept = (y_e > 0) & (y_e < FLOOR) & (v @ -np.asarray(field.sun) < FROM_SUN)
    v, y_o, y_e, P = (x[kept][:PIXELS] for x in (v, y_o, y_e, P))
    assert len(v) > PIXELS / 3
    w = [x[:, None] for x in v.T]
    y_o, y_e, P = y_o[:, None], y_e[:, None], P[:, None]
    n = rng.normal(size=(3, len(v), 1))
    n = list(n / np.linalg.norm(n, axis=0))
    colour = rng.uniform(0.0, 1.0, (len(v), 3))
    facing = np.maximum(-sum(a * b for a, b in zip(n, field.sun, strict=True)), 0.0)

    by_band = tabulated_water(
        field, sun_beam(column, plan.phase), column.skylight, column.refractive_index
    )
    direct, forward, rest = by_band.patch_light(y_e, n).surface_irradiance(y_e, 1.0, n[2])
    base = colour @ uplift_basis(plan.bands).T / math.pi
    L = base * (facing * (direct + forward) + rest)
    exact = projecting.project(by_band.surface(y_o, y_e, w, P, L).total)
    ahead = by_band.open_water(y_o, w)

    ray = along_rays(projected, field.sun, w)
    rgb = [colour[:, k : k + 1] for k in range(3)]
    surface = SurfaceMaterial(COLOURS, [c * facing / math.pi for c in rgb], rgb)
    leaving = ray.leaving(surface, y_e, n, P)
    found = ray.surface(y_o, y_e, w, P, SeenObject(leaving)).total
    sky = dataclasses.replace(column.skylight, level=1.0)
    open_found = ray.open_water(y_o, w, SurfaceAbove(sky, column.refractive_index)).total
    return Case(plan, projected, exact, found, projecting.project(ahead.total), open_found)


def _assert_close(case: Case, most: float) -> None:
    for errors in case.errors:
        assert np.median(np.abs(errors)) <= 0.2 * most
        assert np.quantile(np.abs(errors), 0.95) <= most


WATERS = ("jerlov:I", "jerlov:IB", "jerlov:II", "jerlov:III", "jerlov:1C", "jerlov:5C", "jerlov:9C")


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("water", "zenith", "channels"),
    [
        ("jerlov:IB", 30.0, "sensor"),
        ("jerlov:5C", 30.0, "sensor"),
        ("jerlov:II", 70.0, "bands"),
        *(
            pytest.param(water, zenith, channels, marks=pytest.mark.slow)
            for water in WATERS
            for zenith in (30.0, 70.0)
            for channels in ("sensor", "bands")
        ),
    ],
)
def test_pixels_are_those_of_the_bands(water, zenith, channels):
    # In the most turbid water a channel falls off unlike any one exponential between slices.
    turbid = channels == "sensor" and water in ("jerlov:5C", "jerlov:9C")
    _assert_close(_case(water, zenith, channels), 0.02 if turbid else 0.006)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    "table", ["scattered", "irradiance", "dimmed", "matte", "sunlit", "single"]
)
def test_an_error_of_a_tenth_is_seen(table):
    with pytest.raises(AssertionError):
        _assert_close(_case("jerlov:IB", 30.0, "sensor", spoilt={table: 1.1}), 0.006)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", ["jerlov:IB", "jerlov:I", "jerlov:9C"])
@pytest.mark.parametrize("sensor", ["cie1931", "Nikon D7000"])
def test_more_bands_than_usual_change_nothing(water, sensor):
    """Objects of all colours in 3 to 9 m, by what an eye tells apart."""
    many = _picture(water, sensor, 80)
    typical, few = (
        delta_e_CIE2000_images(_picture(water, sensor, bands), many).mean()
        for bands in (DEFAULT_BANDS["realtime"], 8)
    )
    assert typical <= 0.1
    assert few > 0.5


LAYERS = """depth_m,wavelength_nm,a,b
0,400,0.06,0.25
0,700,0.62,0.20
5,400,0.20,0.60
5,700,0.75,0.50
"""
SPECTRA = np.cos(np.multiply.outer((1.0, 2.0, 1.0), np.linspace(0.0, math.pi, 30)))
# What is left of light at the object and on its way, mean and fractions of these; of sunlight
# scattered once; of what shines past the object.
OCCLUSION = (0.5, -0.225), (0.6, 0.3), 0.7, 0.5


@pytest.mark.slow_but_first
@pytest.mark.parametrize("water", ["layers", "jerlov:IB"])
@pytest.mark.parametrize("channels", ["sensor", "bands"])
@pytest.mark.parametrize("occluded", [False, True])
def test_pixels_in_layers_and_under_occlusion(water, channels, occluded, tmp_path):
    found, exact = _dim_pixels(water, channels, tmp_path, occluded=occluded)
    errors = np.abs(found / exact - 1.0)
    assert np.median(errors) <= 0.001
    assert np.quantile(errors, 0.95) <= 0.005


@pytest.mark.slow_but_first
@pytest.mark.parametrize("table", ["occlusion_matrices", "matte", "peak", "single"])
def test_an_error_of_a_tenth_is_seen_in_layers(table, tmp_path):
    found, exact = _dim_pixels("layers", "bands", tmp_path, occluded=True, spoilt=table)
    assert np.quantile(np.abs(found / exact - 1.0), 0.95) > 0.005


def test_what_a_path_gathers_falls_off_as_the_layers_do(tmp_path):
    """By it the occlusion on the way is weighed."""
    (tmp_path / "layers.csv").write_text(LAYERS)
    chosen = SceneSettings(water=f"file:{tmp_path / 'layers.csv'}", bands=3)
    plan = render_plan.make_plan(chosen)
    field, projecting = plan.solved_field(24), channels_of_bands(plan.bands, (0, 1, 2))
    projected = project(field, projecting, 4.0, plan.column.skylight.level)
    y, w = np.array([[3.0], [4.5], [9.0]]), [np.full((3, 1), part) for part in (0.6, 0.0, 0.8)]
    often, single = along_rays(projected, field.sun, w).falling_off(y, w)
    rate = field.extinction_between(4.0, y[:, 0], scaled=True)
    np.testing.assert_allclose(single, rate * (1.0 - 0.8 / field.light.mu_s), rtol=0.01)
    np.testing.assert_allclose(often, rate - 0.8 * projected.numbers.decay, rtol=0.01)


def test_pixels_in_a_shade_of_two_spectra(tmp_path):
    found, exact = _dim_pixels("jerlov:IB", "sensor", tmp_path, occluded=True, second=0.08)
    assert np.quantile(np.abs(found / exact - 1.0), 0.95) <= 0.01


def _dim_pixels(water, channels, tmp_path, *, occluded, spoilt="", second=0.0):
    """Channels of objects in the shade, projected and as sums over bands; cameras in 4 m."""
    if water == "layers":
        (tmp_path / "layers.csv").write_text(LAYERS)
        water = f"file:{tmp_path / 'layers.csv'}"
    chosen = SceneSettings(
        water=water, bands=30, surface="flat", floor_depth=FLOOR, floor_reflectance="0.3"
    )
    plan = render_plan.make_plan(chosen)
    field, sky = plan.solved_field(24), plan.column.skylight.level
    projecting = {
        "sensor": lambda: channels_of(plan.bands, plan.response(4.0)),
        "bands": lambda: channels_of_bands(plan.bands, (3, 12, 24)),
    }[channels]()
    on, transmittance, sunlit, beyond = (
        OCCLUSION if occluded else ((1.0, 0.0), (1.0, 0.0), 1.0, 1.0)
    )
    on = *on, second
    on_object = on[0] + np.array(on[1:]) @ SPECTRA[:ON_PATH]
    typical = np.array([on_object, np.ones(30)])
    projected = project(
        field, projecting, 4.0, sky, occlusion=OcclusionSpectra(SPECTRA, typical, field)
    )
    if spoilt in RATES:
        rates = projected.rates.copy()
        rates[RATES.index(spoilt)] *= 1.1
        projected = dataclasses.replace(projected, rates=rates)
    elif spoilt:
        projected = dataclasses.replace(projected, **{spoilt: 1.1 * getattr(projected, spoilt)})

    rng = np.random.default_rng(7)
    v = rng.normal(size=(PIXELS, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    P = np.exp(rng.uniform(math.log(0.5), math.log(8.0), len(v)))
    y_e = 4.0 - v[:, 2] * P
    kept = (y_e > 0) & (y_e < FLOOR) & (v @ -np.asarray(field.sun) < FROM_SUN)
    v, y_e, P = v[kept], y_e[kept], P[kept]
    y_o, w = np.full(len(v), 4.0), [x[:, None] for x in v.T]
    normal = rng.normal(size=(3, len(v)))
    normal /= np.linalg.norm(normal, axis=0)
    colour = rng.uniform(0.0, 1.0, (len(v), 3))
    facing = np.maximum(-(normal.T @ np.asarray(field.sun)), 0.0)[:, None]

    table = tabulate(field)
    parts = [part.per_steradian(half_angle2(w, field.sun)) for part in field.components]

    def beam(near, far, first, last=0.0):
        c, cp = (field.extinction_between(near, far, scaled=scaled) for scaled in (False, True))
        light = field.light
        return LayeredBeam(c, cp, light.E, light.mu_s, FLOOR, field.sun, first, last)

    single = [
        sum(
            p * part
            for p, part in zip(parts, field.single_scattering_on_rays(y, v[:, 2]), strict=True)
        )
        for y in (y_o, y_e)
    ]
    end = np.where(v[:, 2] > 0, 0.0, FLOOR)
    seen = SolvedWater(
        beam(y_o, y_e, *single),
        table.scattered(y_o, v.T, field.sun),
        table.scattered(y_e, v.T, field.sun),
        table.boundary_image(v.T, field.sun),
        beam(y_e, end, single[1]),
        aureole=aureole_at(table, y_o, v.T, field.sun),
        occlusion=PathOcclusion(
            transmittance[0] + transmittance[1] * SPECTRA[ON_PATH], sunlit, beyond
        ),
    )
    peaked = field.light.E / field.light.mu_s * field.beam(y_e).T
    around = table.patch_irradiance(y_e, normal, field.sun) * on_object
    base = colour @ uplift_basis(plan.bands).T / math.pi
    L = base * (facing * peaked + around)
    y_o, y_e, P, normal = y_o[:, None], y_e[:, None], P[:, None], list(normal[..., None])
    exact = projecting.project(seen.surface(y_o, y_e, w, P, L).total)

    ray, rgb = along_rays(projected, field.sun, w), [colour[:, k : k + 1] for k in range(3)]
    surface = SurfaceMaterial(
        COLOURS, [c * facing / math.pi for c in rgb], rgb, occlusion=OcclusionFactor(on[0], on[1:])
    )
    occlusion = OcclusionOnPath(OcclusionFactor(transmittance[0], transmittance[1:]), sunlit)
    leaving = ray.leaving(surface, y_e, normal, P)
    # What an object must block for that share to be left of what shines past it.
    direct, peaked = ray.transmittance(y_e, P), ray.transmittance_with_peak(y_e, P)
    kept = peaked - (peaked - direct) * beyond
    scattering = projected.numbers.scattering
    if projected.layered:
        scattering = ray.tables.at("rates", rate=RATES.index("scattering"), depth=y_e)
    blocked = np.log(kept / direct) / (scattering * P)
    item, around = SeenObject(leaving), Around(blocked)
    found = ray.surface(y_o, y_e, w, P, item, occlusion=occlusion, around=around)
    return found.total, exact


def _picture(water: str, sensor: str, bands: int) -> np.ndarray:
    """Linear Rec.709 of objects of many colours, seen from 3 m."""
    chosen = SceneSettings(
        water=water, sensor=sensor, bands=bands, surface="flat", floor_depth=FLOOR
    )
    plan = render_plan.make_plan(chosen)
    field, response = plan.solved_field(24), plan.response(5.0)
    projected = project(field, channels_of(plan.bands, response), 5.0, plan.column.skylight.level)
    rng = np.random.default_rng(3)
    colour, y_e = rng.uniform(0.02, 0.9, (400, 3)), rng.uniform(3.5, 7.0, (400, 1))
    rising = (5.0 - y_e) / 3.0
    w = [np.sqrt(1.0 - rising**2), 0.0 * rising, rising]
    ray = along_rays(projected, field.sun, w)
    rgb, normal = [colour[:, k : k + 1] for k in range(3)], [-part for part in w]
    facing = np.maximum(-sum(a * b for a, b in zip(normal, field.sun, strict=True)), 0.0)
    surface, P = SurfaceMaterial(COLOURS, [c * facing / math.pi for c in rgb], rgb), 0.0 * y_e + 3.0
    item = SeenObject(ray.leaving(surface, y_e, normal, P))
    seen = ray.surface(0.0 * y_e + 5.0, y_e, w, P, item).total
    developed = plan.reduction(5.0).weights @ np.linalg.pinv(response)
    return np.clip(seen @ developed.T, 0.0, 1.0)


def test_nothing_is_scattered_on_no_way():
    case = _case("jerlov:IB", 30.0, "sensor")
    w = [np.array([[0.6]]), np.array([[0.0]]), np.array([[0.8]])]
    y = np.array([[5.0]])
    ray = along_rays(case.projected, case.plan.solved_field(24).sun, w)
    pixel = ray.surface(y, y - 0.8e-6, w, np.array([[1e-6]]), SeenObject(np.ones((1, 3))))
    assert np.abs(pixel.water).max() < 1e-5 * case.open_exact.mean()
    assert pixel.direct == pytest.approx(np.ones((1, 3)), rel=1e-5)


def test_a_measured_reflectance_is_a_column():
    """One that is that of green is seen as green is."""
    plan = render_plan.make_plan(SceneSettings(water="jerlov:II", bands=12))
    channels = channels_of(plan.bands, plan.response(5.0))
    green = uplift_basis(plan.bands)[:, 1]
    projected = project(plan.solved_field(24), channels, 5.0, plan.column.skylight.level, [green])
    np.testing.assert_allclose(projected.sunlit[3], projected.sunlit[1], rtol=1e-9)
    np.testing.assert_allclose(projected.matte[3], projected.matte[1], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("planted", [1.0, 1.1])
def test_what_counts_as_unscattered_changes_no_light_of_open_water(planted):
    """Light that fewer streams let go straight on is missing from M; a tenth of M is seen."""
    chosen = SceneSettings(water="jerlov:IB", bands=3, surface="flat", sky="clear", floor_depth=9.0)
    plan = render_plan.make_plan(chosen)
    field, low_stream_field = plan.solved_field(24), plan.solved_field(OCCLUSION_STREAMS)
    projecting, sky = channels_of_bands(plan.bands, (0, 1, 2)), plan.column.skylight
    occlusion = OcclusionSpectra(np.zeros((3, 3)), np.ones((2, 3)), low_stream_field)
    both = [project(field, projecting, 5.0, sky.level, occlusion=x) for x in (None, occlusion)]
    both[1] = dataclasses.replace(both[1], scattered=planted * both[1].scattered)
    v = np.random.default_rng(5).normal(size=(400, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    v = v[v @ -np.asarray(field.sun) < FROM_SUN]
    w, P = [x[:, None] for x in v.T], np.full((len(v), 1), 2.0)
    y, far, level = 0.0 * P + 5.0, 5.0 - 2.0 * w[2], dataclasses.replace(sky, level=1.0)
    rays = [along_rays(light, field.sun, w) for light in both]
    dark, surface = 0.0 * P * np.ones(3), SurfaceAbove(level, plan.column.refractive_index)
    M, less = (ray.scattered(y, w) for ray in rays)
    assert np.median(less / M) < 0.9, "less counts as scattered"
    for of_all, of_few in (
        [ray.open_water(y, w, surface).total for ray in rays],
        [ray.surface(y, far, w, P, SeenObject(dark)).total for ray in rays],
    ):
        off = np.quantile(np.abs(of_few / of_all - 1.0), 0.95)
        assert (off < 0.01) == (planted == 1.0), off


CLEAR_BELOW = """depth_m,wavelength_nm,a,b
1,400,0.03,0.14
1,700,0.33,0.08
3,400,0.02,0.04
3,700,0.23,0.02
"""


@pytest.mark.parametrize(("surface", "floor"), [("none", 5000.0), ("flat", 14.0)])
def test_open_water_below_a_turbid_layer_is_that_of_the_solution(surface, floor, tmp_path):
    """However far, and with the floor that the surface mirrors, seen through the layer twice."""
    (tmp_path / "water.csv").write_text(CLEAR_BELOW)
    chosen = SceneSettings(
        water=f"file:{tmp_path / 'water.csv'}", bands=3, surface=surface, floor_depth=floor,
        floor_reflectance="0.3", sun_zenith=40.0,
    )  # fmt: skip
    plan = render_plan.make_plan(chosen)
    field, sky = plan.solved_field(24), plan.column.skylight
    projected = project(field, channels_of_bands(plan.bands, (0, 1, 2)), 5.0, sky.level)
    v = np.random.default_rng(5).normal(size=(600, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    window = 1.0 / plan.column.refractive_index
    v = v[(v @ -np.asarray(field.sun) < FROM_SUN) & (np.abs(np.hypot(*v.T[:2]) - window) > 0.02)]
    v = v[np.abs(v[:, 2]) > 0.1]
    w, y = [x[:, None] for x in v.T], np.full((len(v), 1), 5.0)
    index = plan.column.refractive_index if plan.column.reflects else None
    ray = along_rays(projected, field.sun, w)
    above = SurfaceAbove(dataclasses.replace(sky, level=1.0), index)
    found = ray.open_water(y, w, above).total
    errors = np.abs(found / field.radiance(y[:, 0], v.T) - 1.0)
    assert np.median(errors) <= 0.005
    assert np.quantile(errors, 0.99) <= 0.03
