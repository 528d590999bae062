"""A dry picture that gets water, against the same scene in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from underwater_spectral.benchmarks import applied_pictures
from underwater_spectral.benchmarks._places import delta_e


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::underwater_spectral.uw_spectral.errors.DataWarning")
@pytest.mark.parametrize("place", applied_pictures.PLACES[:3], ids=lambda place: place.name)
def test_a_dry_picture_gets_the_water_that_eevee_draws(place):
    place = replace(place, size=(96, 54), drawn=8)
    place.open()
    dry = applied_pictures.dry(place.plan(1).description.light.azimuth, 16)
    camera = place.open()
    found = applied_pictures.applied(place, camera, dry)
    off = delta_e(found, place.in_real_time(), 3)
    assert off.mean() < 1.5
    assert np.mean(delta_e(found, dry, 3)) > 10.0
