"""Closures of facets in the light of lamps: what they throw back in all, and how bright it is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.lamps.lamp import Lamp
from underwater_spectral.uw_spectral.lamps.lamp_projection import project_lamps
from underwater_spectral.uw_spectral.lamps.multiple_scattering import lamp_water
from underwater_spectral.uw_spectral.mathematics import dot
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.surface.refraction import fresnel_reflectance
from underwater_spectral.uw_spectral.transfer.channels import channels_of_bands
from underwater_spectral.uw_spectral.transfer.facets import Facets, specular_index
from underwater_spectral.uw_spectral.transfer.highlights import (
    halfway,
    round_highlight,
    stretched_highlight,
)
from underwater_spectral.uw_spectral.water.phase_functions import parse_phase

_UP = (0.0, 0.0, 1.0)
_WHITE = (1.0, 1.0, 1.0)


def _hemisphere(count=800):
    """Return directions, and solid angles times cosines over pi."""
    z, angle = np.meshgrid((np.arange(count) + 0.5) / count, np.arange(count) * 2 * np.pi / count)
    side = np.sqrt(1.0 - z * z)
    return (side * np.cos(angle), side * np.sin(angle), z), 2.0 * z / count**2


@pytest.mark.parametrize("roughness", [0.3, 0.6, 0.8, 1.0])
@pytest.mark.parametrize("cosine", [1.0, 0.7, 0.4])
def test_a_white_one_loses_no_light(roughness, cosine):
    """A white furnace, in which GGX without what goes between facets is .96 to .32."""
    w, weight = _hemisphere()
    eye = (math.sqrt(1.0 - cosine * cosine), 0.0, cosine)
    facets = Facets(_UP, roughness, _WHITE).with_all_light(eye)
    half = halfway(eye, w)
    thrown = facets.highlight(eye, half, w, 0.0) * facets.colour(dot(half, w))[0]
    assert (thrown * weight).sum() == pytest.approx(1.0, abs=0.05)


def test_round_ones_are_stretched_ones_without_anisotropy():
    eye, light = (0.6, 0.0, 0.8), (-0.3, 0.4, math.sqrt(0.75))
    wanted = stretched_highlight(_UP, (1.0, 0.0, 0.0), eye, light, 0.4, 0.0)
    found = round_highlight(_UP, eye, halfway(eye, light), light, 0.4**4)
    assert found == pytest.approx(float(wanted), rel=1e-9)


def test_a_mirror_shows_a_lamp_as_bright_as_it_is():
    """A disc of radiance L and half-angle ρ, irradiance π L ρ²: the mirror's middle has L."""
    rho = 0.05
    found = Facets(_UP, 0.0, _WHITE).highlight(_UP, _UP, _UP, 0.5 * rho * rho)
    assert found * rho * rho == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize(("index", "level"), [(1.5, 0.8), (1.119, 0.5), (0.8, 0.2)])
def test_the_level_scales_what_is_reflected(index, level):
    found = fresnel_reflectance(1.0, specular_index(index, level))
    assert found == pytest.approx(2.0 * level * fresnel_reflectance(1.0, index), rel=1e-6)


@pytest.mark.parametrize("angle", [0.0, 60.0, 120.0])
@pytest.mark.parametrize(("roughness", "b"), [(0.2, 0.0), (0.2, 0.3)])
def test_a_mirroring_ball_sends_light_evenly_to_all_sides(angle, roughness, b):
    """E R²/4 of the irradiance E (geometrical optics), whatever the angle to the lamp.

    Light that is scattered forward makes wider highlights, of all of its light.
    """
    radius, P, r = 0.05, 4.0, 3.0
    turn = math.radians(angle)
    towards = (math.sin(turn), 0.0, math.cos(turn))
    scattering = np.full(3, b)
    phase = parse_phase("hg:0.997").for_bands(np.ones(3))
    water = lamp_water([0.05, 0.1, 0.2], scattering, phase)
    place, axis = [r * x for x in towards], [-x for x in towards]
    lamp = Lamp(place, axis, np.array([1.0, 2.0, 3.0]), radius=0.02)
    projected = project_lamps([lamp], water, channels_of_bands(Bands.uniform(3), [0, 1, 2]))
    # The half of the ball that the camera sees, and its shares as seen.
    theta, phi = np.meshgrid((np.arange(300) + 0.5) * np.pi / 600, np.arange(200) * np.pi / 100)
    n = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    n, fraction = [part.reshape(-1, 1) for part in n], np.sin(2.0 * theta) * np.pi / 600 / 200
    mirrors = {"facets": [Facets(n, roughness, _WHITE)], "to_eye": _UP}
    point = [radius * part for part in n]
    seen = sum(projected.reflected(point, n, _WHITE, P, **mirrors))
    intensity = (seen * fraction.reshape(-1, 1)).sum(axis=0) * math.pi * radius**2
    E = math.pi * sum(projected.reflected((0.0, 0.0, 0.0), towards, _WHITE, P))
    assert intensity == pytest.approx(E * radius**2 / 4.0, rel=0.04)
