"""From a description of text and numbers to optics, without Blender."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.imaging import (
    BandsDescription,
    CameraDescription,
    Description,
    FloorDescription,
    SunAndSky,
    SurfaceDescription,
    WaterDescription,
    optics,
    optimised_bands,
    resolve,
)
from underwater_spectral.uw_spectral.imaging.description import REFERENCE_BANDS
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.barrier_filter import transmittance
from underwater_spectral.uw_spectral.spectra.illuminant import parse_illuminant
from underwater_spectral.uw_spectral.spectra.reflectance import parse_reflectance
from underwater_spectral.uw_spectral.spectra.sensor import parse_sensor
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance
from underwater_spectral.uw_spectral.transfer import water_column
from underwater_spectral.uw_spectral.transfer.water_column import FEW_STREAMS
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.optical_properties import Water
from underwater_spectral.uw_spectral.water.phase_functions import HenyeyGreenstein


def test_text_and_the_object_it_stands_for_are_the_same():
    text = Description(
        WaterDescription("jerlov:3C", second="jerlov:I", second_fraction=0.2, phase="hg:0.8"),
        SunAndSky("clear-sky", 40.0, above_surface=True),
        SurfaceDescription("flat"),
        FloorDescription(9.0, "0.3"),
        CameraDescription("ARRI D21", "depth"),
        BandsDescription(5, 420.0, 680.0),
    )
    surfaces = replace(
        text,
        water=replace(
            text.water,
            water=Water.jerlov("3C"),
            second=Water.jerlov("I"),
            phase=HenyeyGreenstein(0.8),
        ),
        light=replace(text.light, illuminant=parse_illuminant("clear-sky", 40.0)),
        floor=replace(text.floor, reflectance=parse_reflectance("0.3")),
        camera=replace(text.camera, sensor=parse_sensor("ARRI D21")),
        bands=Bands.uniform(5, 420.0, 680.0),
    )
    one, other = resolve(text), resolve(surfaces)
    assert one.column == other.column
    assert one.phase == other.phase
    assert one.viewpoint(5.0) == other.viewpoint(5.0)
    assert one.viewpoint(5.0).white_balance == "depth"


def test_a_filter_dims_bands_and_leaves_balance_and_exposure():
    plain = Description()
    filtered = replace(plain, camera=replace(plain.camera, filter="long-pass:500,15"))
    one, other = (resolve(x).viewpoint(5.0).reduction for x in (plain, filtered))
    T = transmittance("long-pass:500,15", resolve(plain).bands)
    assert T[0] < 1e-3 < 0.9 < T[-1]
    np.testing.assert_allclose(other.weights, one.weights * T)
    np.testing.assert_allclose(other.response, one.response * T)
    assert other.stops == one.stops
    with pytest.raises(InputError, match="filter 'yellow' is not known"):
        resolve(replace(plain, camera=replace(plain.camera, filter="yellow")))


def test_light_above_the_surface_is_partly_reflected():
    below, above = (
        resolve(Description(light=SunAndSky("clear-sky", 60.0, sky_radiance=0.1, above_surface=a)))
        for a in (False, True)
    )
    through = 1 - float(fresnel_reflectance(math.cos(math.radians(60.0)), 1.34))
    np.testing.assert_allclose(above.column.sun_irradiance, through * below.column.sun_irradiance)
    np.testing.assert_array_equal(above.column.sky_radiance, below.column.sky_radiance)
    light, bands = below.illuminant, below.bands
    direct, diffuse = light.direct_in(bands), light.diffuse_in(bands)
    np.testing.assert_allclose(below.column.sky_radiance, diffuse / math.pi + 0.1 * direct)


def test_constituents_bring_their_phase_function():
    amounts = [Constituents(chlorophyll=c, minerals=0.1) for c in (0.5, 5.0)]
    fixed = [resolve(Description(WaterDescription(a))).phase for a in amounts]
    assert fixed[0].components == fixed[1].components
    spelt = resolve(Description(WaterDescription("bio:chl=0.5,minerals=0.1")))
    assert spelt.phase == amounts[0].phase(spelt.bands.centres)
    chosen = resolve(Description(WaterDescription(amounts[0], phase="hg:0.9"))).phase
    assert chosen.components == (HenyeyGreenstein(0.9),)
    mixed = WaterDescription(amounts[0], second="jerlov:II", second_fraction=0.5)
    assert len(resolve(Description(mixed)).phase.components) == 2


def test_mixed_constituents_keep_their_backscatter():
    """bb/b 0.007 of 1 mg/m³ and Petzold's 0.0183, by the scattering of each."""
    described = WaterDescription("bio:chl=1", second="jerlov:IB", second_fraction=0.5)
    ratio = resolve(Description(described)).phase.components[1].backscatter_ratio
    assert 0.007 < ratio < 0.0183
    alone = resolve(Description(replace(described, second_fraction=0.0))).phase.components[1]
    assert alone.backscatter_ratio == pytest.approx(0.007, rel=0.01)


def test_fluorescence_needs_constituents():
    with pytest.raises(InputError, match=r"chlorophyll, cdom needs .* bio: or case:.*Jerlov IB"):
        resolve(Description(WaterDescription(inelastic="all")))
    with pytest.raises(InputError, match="second water"):
        resolve(
            Description(
                WaterDescription(
                    "bio:chl=1", second="jerlov:II", inelastic="cdom", second_fraction=0
                )
            )
        )
    with pytest.raises(InputError, match="unknown inelastic process 'ramen'"):
        resolve(Description(WaterDescription(inelastic="ramen")))
    more, less = (
        resolve(
            Description(WaterDescription("bio:chl=1", absorption_factor=f, inelastic="chlorophyll"))
        )
        .emission()
        .at([0.0], math.inf)[0]
        for f in (2.0, 1.0)
    )
    red = np.argmax(less)
    # Twice as much absorbs, and takes a little of the light that reaches it.
    assert 1.9 * less[red] < more[red] < 2.0 * less[red]


def test_bands_are_chosen_once_for_any_camera(monkeypatch):
    described = Description(
        WaterDescription(scattering_factor=1.23), bands=BandsDescription(3, optimised=True)
    )
    searched = []

    @functools.lru_cache
    def search(count, reference):
        searched.append(count)
        return optimised_bands(count, reference)

    monkeypatch.setattr(optics, "_optimised_bands", search)
    found = [
        resolve(replace(described, camera=CameraDescription(sensor)))
        for sensor in ("cie1931", "ARRI D21", "Nikon D7000")
    ]
    assert len(searched) == 1
    assert found[0].bands == found[1].bands == found[2].bands
    assert len(found[0].reference[0].bands) == REFERENCE_BANDS
    fixed = BandsDescription(wavelengths=(450.0, 550.0, 620.0), optimised=True)
    kept = resolve(replace(described, bands=fixed))
    assert kept.bands.centres.tolist() == [450, 550, 620]
    assert kept.reference is not None
    assert len(searched) == 1


def test_optimised_bands_say_that_they_want_daylight():
    night = Description(light=SunAndSky(strength=0.0), bands=BandsDescription(3, optimised=True))
    with pytest.raises(InputError, match="fitted to daylight, and the sunlight is 0: take equal"):
        resolve(night)
    resolve(replace(night, bands=BandsDescription(3)))


def test_a_file_is_read_whenever_a_description_is_resolved(tmp_path):
    path = tmp_path / "water.csv"
    described = Description(WaterDescription(f"file:{path}", phase="hg:0.8"))
    found = []
    for b in (0.1, 0.1, 0.2):
        path.write_text(f"wavelength_nm,a,b\n300,0.5,{b}\n800,1.0,{b}\n")
        found.append(resolve(described))
    assert found[0].column == found[1].column  # the content counts
    assert found[1] != found[2]
    np.testing.assert_allclose(found[2].column.scattering, 0.2)


def test_one_light_field_for_all_who_ask(monkeypatch):
    solved, solve = [], water_column.solve_discrete_ordinates
    monkeypatch.setattr(
        water_column, "solve_discrete_ordinates", lambda *a, **k: solved.append(a) or solve(*a, **k)
    )
    described = Description(WaterDescription(scattering_factor=1.01234))
    for depth in (3.0, 4.0):
        found = resolve(described)
        assert found.viewpoint(depth).field is found.solved_field(FEW_STREAMS)
    assert len(solved) == 1


@pytest.mark.parametrize(
    ("name", "above"), [("clear-sky", True), ("astm-g173", True), ("d65", False)]
)
def test_light_is_taken_where_its_table_has_it(name, above):
    """Of a sun at 70° the surface reflects 13 % (Fresnel, by hand)."""
    given = parse_illuminant(name, 70.0)
    column = resolve(Description(light=SunAndSky(name, 70.0))).column
    air, water = math.radians(70.0), math.asin(math.sin(math.radians(70.0)) / 1.34)
    s = (math.sin(air - water) / math.sin(air + water)) ** 2
    p = (math.tan(air - water) / math.tan(air + water)) ** 2
    kept = 1 - (s + p) / 2 if above else 1.0
    assert kept == pytest.approx(0.866 if above else 1.0, abs=2e-3)
    np.testing.assert_allclose(
        column.sun_irradiance, kept * given.direct_in(column.bands), rtol=1e-9
    )
