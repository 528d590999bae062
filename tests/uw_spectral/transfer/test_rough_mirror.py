"""Rays that a rough mirror throws on by chance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from underwater_spectral.uw_spectral.transfer.highlights import halfway, round_highlight
from underwater_spectral.uw_spectral.transfer.rough_mirror import mirrored_by_chance

_UP = (0.0, 0.0, 1.0)


def _chances(count):
    """Even pairs from 0 to 1."""
    x, y = np.meshgrid(*2 * [(np.arange(count) + 0.5) / count])
    return x.ravel(), y.ravel()


@pytest.mark.parametrize("roughness", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("sine", [0.0, 0.5])
def test_light_comes_from_where_the_closure_of_facets_takes_it(roughness, sine):
    """How much there is, and the means and widths of its directions."""
    eye = (sine, 0.0, math.sqrt(1.0 - sine * sine))
    r, weight = mirrored_by_chance([-x for x in eye], _UP, roughness, _chances(400))
    moments = [1.0, *(x * x for x in r), r[0]]
    found = [np.mean(weight * x) for x in moments]
    z, angle = np.meshgrid(np.sqrt((np.arange(1500) + 0.5) / 1500), np.arange(720) * math.pi / 360)
    side = np.sqrt(1.0 - z * z)
    w = (side * np.cos(angle), side * np.sin(angle), z)
    closure = round_highlight(_UP, eye, halfway(eye, w), w, roughness**4)
    wanted = [np.mean(closure * x) for x in (1.0, *(x * x for x in w), w[0])]
    assert found == pytest.approx(wanted, rel=0.01, abs=0.001)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("normal", [(0.0, 0.0, -1.0), (0.6, 0.0, -0.8), (0.0, -1.0, 0.0)])
def test_whatever_way_it_faces(normal):
    """Turned, the same facets throw on the same share within 15° of the mirrored ray."""
    eye = np.add(normal, (0.3, 0.2, 0.1))
    eye = eye / np.linalg.norm(eye)
    c = float(eye @ normal)
    assert _near(eye, np.array(normal)) == pytest.approx(
        _near(np.array((math.sqrt(1.0 - c * c), 0.0, c)), np.array(_UP)), abs=0.01
    )
    assert 0.2 < _near(eye, np.array(normal)) < 0.8


def _near(eye, normal):
    """Fraction of rays within 15° of the mirrored one."""
    r = np.array(mirrored_by_chance(-eye, normal, 0.4, _chances(300))[0])
    assert np.linalg.norm(r, axis=0) == pytest.approx(1.0)
    straight = 2.0 * (eye @ normal) * normal - eye
    return np.mean(straight @ r > math.cos(math.radians(15.0)))
