"""Optimised bands in a plan: placed for the water, developed with fitted weights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.jobs import command_line
from underwater_spectral.settings.render_plan import make_plan
from underwater_spectral.settings.scene_settings import OPTIMISED, SceneSettings
from underwater_spectral.uw_spectral.spectra.bands import Bands
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from underwater_spectral.uw_spectral.spectra.reflectance import colorchecker_reflectance

SIX = SceneSettings(
    water="jerlov:II", bands=6, band_placement=OPTIMISED, surface="flat", floor_depth=15.0
)
DEPTH = 8.0
PATCHES = ("blue sky", "orange", "bluish green", "neutral 5 (.70 D)")


def picture(plan):
    """Colours of patches and open water that the plan's reduction gives, in numpy alone."""
    field, centres = plan.solved_field(), plan.bands.centres
    w, distance = (0.6, 0.8, 0.0), 2.5
    patches = np.stack([colorchecker_reflectance(patch).at(centres) for patch in PATCHES])
    background = field.radiance(DEPTH, w)
    light = field.Ed(DEPTH) / math.pi
    transmittance = np.exp(-plan.column.attenuation * distance)
    seen = transmittance * patches * light + (1.0 - transmittance) * background
    return plan.reduction(DEPTH).apply(np.vstack([background, seen]))


@pytest.mark.parametrize("white_balance", ["daylight", "depth", "none"])
def test_optimised_plan_develops_as_many_bands_do(white_balance):
    chosen = replace(SIX, white_balance=white_balance)
    truth = picture(make_plan(replace(chosen, bands=120, band_placement="equal")))
    errors = {
        placement: delta_e_CIE2000_images(
            picture(make_plan(replace(chosen, band_placement=placement))), truth
        ).mean()
        for placement in (OPTIMISED, "equal")
    }
    assert errors[OPTIMISED] < 0.5 < errors["equal"]


def test_bands_outlive_the_choice_of_a_camera():
    """Bands that are rendered can be developed through any camera, at any exposure."""
    plan = make_plan(SIX)
    for change in ({"sensor": "Nikon D7000"}, {"white_balance": "depth"}, {"exposure": "1"}):
        other = make_plan(replace(SIX, **change))
        np.testing.assert_array_equal(other.bands.centres, plan.bands.centres)
        assert not np.allclose(other.reduction(DEPTH).weights, plan.reduction(DEPTH).weights)
    nikon = replace(SIX, sensor="Nikon D7000")
    truth = picture(make_plan(replace(nikon, bands=120, band_placement="equal")))
    assert delta_e_CIE2000_images(picture(make_plan(nikon)), truth).mean() < 0.5


def test_frames_keep_the_bands_of_the_first():
    first = make_plan(SIX)
    later = first.fixed_bands(replace(SIX, scattering_factor=4.0))
    np.testing.assert_array_equal(make_plan(later).bands.centres, first.bands.centres)
    np.testing.assert_array_equal(make_plan(later).bands.widths, first.bands.widths)
    truth = picture(
        make_plan(replace(SIX, scattering_factor=4.0, bands=120, band_placement="equal"))
    )
    assert delta_e_CIE2000_images(picture(make_plan(later)), truth).mean() < 0.5
    equal = replace(SIX, band_placement="equal")
    assert make_plan(equal).fixed_bands(equal) is equal


def test_exposure_is_that_of_the_settings():
    """A white diffuser at the camera has luminance 0.9, or what the stops say."""
    for exposure in ("auto", "-2"):
        few, many = (make_plan(replace(SIX, exposure=exposure, bands=n)) for n in (6, 60))
        white = [p.reduction(DEPTH).apply(p.column.Ed(DEPTH, p.phase)) for p in (few, many)]
        np.testing.assert_allclose(white[0], white[1], rtol=1e-9)


def test_options():
    options = command_line.parse(["--band-placement", "optimised", "--bands", "5"])
    chosen = command_line.merge(SceneSettings(), options)
    assert (chosen.band_placement, chosen.bands) == (OPTIMISED, 5)
    plan = make_plan(chosen)
    assert len(plan.bands) == 5
    assert not np.allclose(plan.bands.centres, Bands.uniform(5).centres)
    inelastic = make_plan(replace(chosen, inelastic="raman"))
    assert any("inelastic" in note for note in inelastic.notes)
