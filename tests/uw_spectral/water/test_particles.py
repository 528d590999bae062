"""Particles by number, size and speed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.errors import InputError
from underwater_spectral.uw_spectral.water import parse_water, particles
from underwater_spectral.uw_spectral.water.particles import KINDS, SLOPES


@pytest.mark.parametrize("slope", [3.0, 3.6, 4.0, 4.7])
def test_number_and_scattering_are_those_of_the_power_law(slope):
    D = np.geomspace(1e-6, 1e-2, 400_001)
    law = D**-slope
    large = D >= particles.COUNTED_FROM
    area = 2.0 * math.pi / 4.0 * law * D**2
    fraction = np.trapezoid(area[large], D[large]) / np.trapezoid(area, D)
    assert particles.scattering_fraction(slope) == pytest.approx(fraction, rel=1e-3)
    per_litre = 1e-3 * 0.3 * np.trapezoid(law[large], D[large]) / np.trapezoid(area, D)
    assert particles.number_of_scattering(0.3, slope) == pytest.approx(per_litre, rel=1e-3)


def test_ordinary_sea_water_has_as_many_flocs_as_divers_count():
    """Flocs above 0.5 mm: 1 to 10 a litre are usual at the surface (Alldredge & Silver 1988)."""
    wavelengths = [500.0, 550.0, 600.0]
    found = {}
    for name in ("jerlov:IB", "jerlov:3C"):
        b = parse_water(name).b(wavelengths)
        found[name] = [
            particles.number_of_scattering(particles.particle_scattering(wavelengths, b), slope)
            * (0.5 / 0.1) ** (1.0 - slope)
            for slope in (4.0, 3.0)
        ]
    assert found["jerlov:IB"][0] < 1.0 < found["jerlov:3C"][0] < 10.0
    assert found["jerlov:IB"][1] > 1.0


def test_pure_water_has_none():
    b = particles.molecular_scattering([500.0, 600.0])
    assert particles.particle_scattering([500.0, 600.0], b) == 0.0


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_classes_hold_the_density_that_was_asked_for(kind):
    cloud = particles.particle_cloud(kind, 30.0, angle=1e-3, most=10**7)
    slope = kind.slope or particles.TYPICAL_SLOPE
    assert cloud.classes[0].smallest == kind.smallest
    assert cloud.classes[-1].largest == kind.largest
    for one, other in itertools.pairwise(cloud.classes):
        assert one.largest == other.smallest
    for part in cloud.classes:
        # K D^(1-s) / (s-1) of a law of 30 per litre from 0.1 mm to 1 cm
        fraction = (part.smallest ** (1 - slope) - part.largest ** (1 - slope)) / (
            1e-4 ** (1 - slope) - 1e-2 ** (1 - slope)
        )
        assert part.count == pytest.approx(30e3 * fraction * part.side**3, abs=1.0)
        # At the middle of a face the smallest is just as small as may be drawn.
        assert part.smallest / (part.side / 2.0) == pytest.approx(1e-3)


def test_too_many_are_drawn_down_to_a_larger_angle():
    free = particles.particle_cloud(KINDS["silt"], 1e3, most=10**9)
    cloud = particles.particle_cloud(KINDS["silt"], 1e3, most=20_000)
    assert free.count > 20_000 >= cloud.count > 10_000
    assert cloud.angle > free.angle == 3e-4


def test_sizes_drawn_follow_the_law():
    fractions = (np.arange(100_000) + 0.5) / 100_000
    sizes = particles.diameter(fractions, 1e-4, 1e-2, 4.0)
    for size in (1.5e-4, 3e-4, 1e-3):
        expected = (size**-3 - 1e-2**-3) / (1e-4**-3 - 1e-2**-3)
        assert np.mean(sizes > size) == pytest.approx(expected, rel=0.02, abs=1e-5)


def test_speeds_of_bubbles_and_sand():
    """Stokes where it holds; a bubble of 1 mm in sea water rises 0.1 to 0.15 m/s."""
    tiny = 1e-5
    stokes = 1.58 * 9.81 * tiny**2 / (18.0 * 1.05e-6)
    assert -KINDS["silt"].rise(tiny) == pytest.approx(stokes, rel=0.05)
    assert 0.1 < KINDS["bubbles"].rise(1e-3) < 0.15
    assert KINDS["plankton"].rise(1e-3) == 0.0


def test_a_particle_drifts_and_comes_back():
    start = (np.array([0.1]), np.array([0.2]), np.array([0.3]))
    nowhere = (0.0, 0.0, 0.0)
    still = particles.drifted(start, 5.0, 0.0, nowhere, 0.0, 1.0, nowhere)
    assert still == start
    moved = particles.drifted(start, 5.0, -0.01, (0.2, 0.0, 0.0), 0.0, 1.0, nowhere)
    assert [float(x[0]) for x in moved] == pytest.approx([1.1, 0.2, 0.25])
    place = particles.wrapped(np.array([1.1]), 0.0, 1.0)
    assert place[0] == pytest.approx(0.1)


@pytest.mark.parametrize("slope", [SLOPES[0] - 0.1, SLOPES[1] + 0.1])
def test_impossible_input_is_refused(slope):
    with pytest.raises(InputError, match="slope of the particles"):
        particles.particle_cloud(KINDS["snow"], 1.0, slope=slope)
    with pytest.raises(InputError, match="cannot be drawn"):
        particles.particle_cloud(KINDS["snow"], 1.0, angle=0.0)
