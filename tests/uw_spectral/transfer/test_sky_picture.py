"""Skies from pictures: what they hold is what the water gets."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from uw_spectral.errors import InputError
from uw_spectral.imaging.description import (
    BandsDescription,
    Description,
    SunAndSky,
    SurfaceDescription,
)
from uw_spectral.imaging.optics import resolve
from uw_spectral.imaging.resolved_optics import ResolvedOptics
from uw_spectral.spectra.bands import Bands
from uw_spectral.spectra.colour_rendering import rec709_to_XYZ
from uw_spectral.spectra.illuminant import parse_illuminant
from uw_spectral.spectra.sensor import standard_observer
from uw_spectral.spectra.sky_colours import least_saturation, sky_basis
from uw_spectral.spectra.spectral_image import write_rgb_exr
from uw_spectral.surface.refraction import fresnel_reflectance
from uw_spectral.transfer.rough_surface import WaterSurface
from uw_spectral.transfer.sky import OVERCAST
from uw_spectral.transfer.sky_picture import SkyPicture

from .sky_pictures import CLOUDY, COLOURED, KNOWN_SKIES, NOON, KnownSky

FLAT = Description(surface=SurfaceDescription("flat"), bands=BandsDescription(6))


def lit_by(known: KnownSky, gain: float = 1.0, strength: float = 1.0) -> ResolvedOptics:
    """Return water that a sky lights."""
    picture = SkyPicture.checked(gain * known.picture(), "sky")
    return resolve(replace(FLAT, light=SunAndSky(sky_picture=picture, strength=strength)))


@pytest.mark.parametrize("name", KNOWN_SKIES)
def test_direct_and_diffuse_light_of_a_picture_are_those_that_it_was_made_of(name: str) -> None:
    known = KNOWN_SKIES[name]
    picture = SkyPicture.checked(known.picture(), name)
    sun, sky = picture.sun_irradiance, picture.without_sun.irradiance
    assert sun == pytest.approx(known.sun_irradiance, rel=0.02)
    assert sky == pytest.approx(known.diffuse_irradiance, rel=0.02)
    assert sun + sky == pytest.approx(picture.irradiance, rel=1e-9)
    if known.sun_irradiance.any():
        apart = math.degrees(math.acos(min(float(np.dot(picture.sun, known.sun)), 1.0)))
        assert apart < 0.3


@pytest.mark.parametrize("name", KNOWN_SKIES)
def test_each_channel_of_a_picture_reaches_the_water_as_an_integral_has_it(name: str) -> None:
    known = KNOWN_SKIES[name]
    column = lit_by(known).column
    mu = np.polynomial.legendre.leggauss(400)[0] / 2.0 + 0.5
    weights = np.polynomial.legendre.leggauss(400)[1] / 2.0
    turn = (np.arange(360) + 0.5) * (math.pi / 180.0)
    across = np.sqrt(1.0 - mu**2)[:, None]
    L = known.radiance(across * np.cos(turn), across * np.sin(turn), mu[:, None] + 0.0 * turn)
    passes = 1.0 - fresnel_reflectance(mu, column.refractive_index)
    E = 2.0 * math.pi * np.einsum("q,qk->k", weights * mu * passes, L.mean(axis=1))
    assert column.sky_basis is not None
    # By the streams of the field, which see only some of the picture's rows.
    field = column.solved_field(lit_by(known).phase)
    modes = column.skylight.modes(field.mu, 1, column.refractive_index)[0]
    entering = 2.0 * math.pi * modes @ (field.weights * field.mu)
    assert entering == pytest.approx(column.sky_basis @ E, rel=0.02)
    flat = WaterSurface(1.34)
    assert column.skylight.transmittance(flat) == pytest.approx(
        float(E.sum() / known.diffuse_irradiance.sum()), rel=0.02
    )
    sun = column.sky_basis @ known.sun_irradiance
    reflected = fresnel_reflectance(math.cos(math.radians(known.zenith)), 1.34)
    assert column.sun_irradiance == pytest.approx(sun * (1.0 - reflected), rel=0.02)


def test_a_uniform_picture_is_the_uniform_sky() -> None:
    white = SkyPicture.checked(np.ones((32, 64, 3)), "sky")
    uniform = SunAndSky(sky_radiance=1.0 / math.pi, zenith=0.0)
    for surface in (SurfaceDescription("flat"), SurfaceDescription("waves", slope_variance=0.03)):
        described = replace(FLAT, surface=surface)
        found = resolve(replace(described, light=SunAndSky(sky_picture=white)))
        wanted = resolve(replace(described, light=uniform))
        column = replace(wanted.column, sun_irradiance=0.0 * wanted.column.sun_irradiance)
        one, other = (x.solved_field(found.phase) for x in (found.column, column))
        w = 0.3, 0.2, math.sqrt(0.87)
        assert one.Ed([0.0, 5.0]) == pytest.approx(other.Ed([0.0, 5.0]), rel=1e-3)
        assert one.radiance(3.0, w) == pytest.approx(other.radiance(3.0, w), rel=1e-3)


def test_an_overcast_picture_is_the_overcast_sky() -> None:
    found = lit_by(replace(CLOUDY, colour=(1.0, 1.0, 1.0)))
    overcast = SunAndSky(
        sky=OVERCAST, sky_radiance=float(found.column.sky_radiance[3] / _d65(found.bands)[3])
    )
    wanted = resolve(replace(FLAT, light=overcast))
    column = replace(wanted.column, sun_irradiance=0.0 * wanted.column.sun_irradiance)
    one, other = (x.solved_field(found.phase) for x in (found.column, column))
    assert one.Ed([0.0, 5.0]) == pytest.approx(other.Ed([0.0, 5.0]), rel=5e-3)
    assert one.Eu([5.0]) == pytest.approx(other.Eu([5.0]), rel=5e-3)


def _d65(bands: Bands) -> np.ndarray:
    return parse_illuminant("d65").direct_in(bands)


@pytest.mark.parametrize("turned", [90, 225])
def test_a_picture_that_is_turned_turns_the_sun_and_all_light(turned: int) -> None:
    picture = SkyPicture.checked(COLOURED.picture(), "sky")
    steps = round(turned / 360 * picture.radiance.shape[1])
    other = SkyPicture.checked(np.roll(picture.radiance, -steps, axis=1), "sky")
    one, two = (resolve(replace(FLAT, light=SunAndSky(sky_picture=x))) for x in (picture, other))
    azimuths = [math.atan2(*reversed(x.column.sun_direction[:2].tolist())) for x in (one, two)]
    apart = math.degrees(azimuths[1] - azimuths[0]) % 360
    assert apart == pytest.approx(turned, abs=0.01)
    x, y, z = 0.4, -0.3, math.sqrt(0.75)
    c, s = math.cos(math.radians(turned)), math.sin(math.radians(turned))
    seen = [
        field.solved_field().radiance(2.0, w)
        for field, w in ((one, (x, y, z)), (two, (c * x - s * y, s * x + c * y, z)))
    ]
    assert seen[1] == pytest.approx(seen[0], rel=1e-6)


def test_twice_the_strength_is_twice_the_light() -> None:
    one, two = lit_by(NOON), lit_by(NOON, gain=2.0)
    half = lit_by(NOON, gain=2.0, strength=0.5)
    for depth in (0.0, 6.0):
        Ed = [x.column.Ed(depth, x.phase) for x in (one, two, half)]
        assert Ed[1] == pytest.approx(2.0 * Ed[0], rel=1e-9)
        assert Ed[2] == pytest.approx(Ed[0], rel=1e-9)


def test_colours_are_kept_and_daylight_has_its_own_spectrum() -> None:
    bands = Bands.uniform(80, 380.0, 780.0)
    eye = standard_observer().sensitivity.at(bands.centres)
    for saturation in (0.0, 0.6):
        # Of a picture's white: 1 at 560 nm over π.
        XYZ = eye.T @ sky_basis(bands, saturation) * math.pi / (eye[:, 1] @ _d65(bands))
        assert np.linalg.solve(rec709_to_XYZ(), XYZ) == pytest.approx(np.eye(3), abs=0.01)
    white = sky_basis(bands).sum(axis=1) * math.pi
    assert white[4:-8] == pytest.approx(_d65(bands)[4:-8], rel=0.01)
    green = np.array([[0.3, 1.0, 0.3]])
    least = least_saturation(green)
    assert (green @ sky_basis(bands, least).T).min() >= -1e-3
    assert (green @ sky_basis(bands, 0.8 * least).T).min() < -1e-3


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (math.nan, "1 pixels are not finite, the first in row 3, column 5 (green: nan); mend"),
        (-0.5, "1 pixels are negative, the first in row 3, column 5 (green: -0.5); mend"),
        (None, "black above the horizon"),
    ],
)
def test_pictures_that_cannot_be_used_are_refused(spoil: float | None, said: str) -> None:
    pixels = np.ones((16, 32, 3))
    if spoil is None:
        pixels[:8] = 0.0
    else:
        pixels[3, 5, 1] = spoil
    with pytest.raises(InputError) as error:
        SkyPicture.checked(pixels, "sky.exr")
    assert "sky.exr" in str(error.value)
    assert said in str(error.value)


def test_pictures_are_read_of_files(tmp_path) -> None:
    pixels = NOON.picture(32).astype(np.float32)
    write_rgb_exr(tmp_path / "sky.exr", pixels)
    given = f"file:{tmp_path / 'sky.exr'}"
    found = resolve(replace(FLAT, light=SunAndSky(sky_picture=given))).column
    held = SkyPicture.checked(pixels, "sky")
    wanted = resolve(replace(FLAT, light=SunAndSky(sky_picture=held))).column
    assert found == wanted
    with pytest.raises(InputError, match=r"missing.exr: there is no such file"):
        resolve(replace(FLAT, light=SunAndSky(sky_picture=f"file:{tmp_path / 'missing.exr'}")))
