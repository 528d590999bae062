"""What clouds are made of."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.uw_spectral.clouds.matter import MOST_AIR, blunt_phase, suspended_matter
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.water.bio_optics import Constituents
from underwater_spectral.uw_spectral.water.bubbles import BubblePhase
from underwater_spectral.uw_spectral.water.phase import quadrature
from underwater_spectral.uw_spectral.water.phase_functions import FournierForand, HenyeyGreenstein

NM = np.array([420.0, 550.0, 680.0])


def test_a_constituent_adds_what_it_adds_to_waters():
    pure, muddy = Constituents(), Constituents(minerals=7.0)
    found = suspended_matter("minerals", 7.0, NM)
    assert found.absorption == pytest.approx(muddy.absorption(NM) - pure.absorption(NM))
    assert found.scattering == pytest.approx(muddy.scattering(NM) - pure.scattering(NM))


def test_bubbles_scatter_all_colours_alike_and_absorb_nothing():
    found = suspended_matter("bubbles", 2.0, NM)
    assert np.all(found.absorption == 0.0)
    # Areas and volumes of spheres: what is not diffracted is the discs' area, once.
    radii = np.linspace(20e-6, 1e-3, 40001)
    numbers = radii**-1.5
    discs = np.sum(numbers * np.pi * radii**2)
    air = np.sum(numbers * 4.0 / 3.0 * np.pi * radii**3)
    assert found.scattering == pytest.approx(np.full(3, 2e-3 * discs / air), rel=1e-3)


@pytest.mark.parametrize(
    "phase", [HenyeyGreenstein(0.9), FournierForand(1.15, 0.039), BubblePhase()]
)
def test_a_blunt_phase_function_integrates_to_one(phase):
    blunt = blunt_phase(phase)
    angles, solid_angles = quadrature(phase.kinks)
    p = np.minimum(phase.per_steradian(np.sin(angles / 2) ** 2) / (1 - blunt.peak), blunt.ceiling)
    assert float(np.sum(p * solid_angles)) == pytest.approx(1.0, abs=1e-4)
    g = float(np.sum(p * np.cos(angles) * solid_angles))
    assert blunt.asymmetry == pytest.approx(g, abs=1e-4)
    assert blunt.peak == pytest.approx(float(phase.moments(2)[1]))


def test_what_it_is_not_made_of_is_refused():
    with pytest.raises(InputError, match="constituent of a cloud"):
        suspended_matter("milk", 1.0, NM)
    with pytest.raises(InputError, match="minerals"):
        suspended_matter("minerals", -1.0, NM)
    with pytest.raises(InputError, match="is foam"):
        suspended_matter("bubbles", MOST_AIR + 1.0, NM)
