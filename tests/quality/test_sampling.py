"""Noise of a picture, and how samples are allotted for it."""

from __future__ import annotations

import numpy as np
import pytest
from underwater_spectral.quality import sampling
from underwater_spectral.uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images

SIZE = (80, 120, 3)
PASSES = np.array([[0.02, 0.0, 0.05], [0.1, 0.3, 0.05], [0.2, 0.1, 0.0]])


def _halves(samples, seed=1, deviations=(0.2, 0.5, 0.8)):
    """Two halves of each pass: noise of one value that falls as the root of the samples."""
    random = np.random.default_rng(seed)
    found = []
    for row, count, deviation in zip(PASSES, samples, deviations, strict=True):
        noise = random.normal(size=(2, *SIZE[:2], 1)) * deviation / np.sqrt(count / 2)
        found.append(row * (1.0 + noise))
    return found


@pytest.mark.parametrize("samples", [(64, 64, 64), (16, 256, 40), (2000, 2000, 2000)])
def test_noise_is_the_error_of_the_mean(samples):
    halves = _halves(samples)
    picture = np.sum([half.mean(axis=0) for half in halves], axis=0)
    error = delta_e_CIE2000_images(picture, np.broadcast_to(PASSES.sum(axis=0), SIZE)).mean()
    assert sampling.picture_noise(halves).delta_e == pytest.approx(error, rel=0.05)


def test_allotment_gets_to_the_target_with_fewer_samples_than_equal_ones():
    samples, target = (8, 8, 8), 2.0
    for seed in range(20):
        noise = sampling.picture_noise(_halves(samples, seed))
        if noise.delta_e <= target:
            break
        wanted = sampling.allot(noise, samples, target)
        assert all(w <= 2 * n for w, n in zip(wanted, samples, strict=True))
        samples = tuple(max(round(w), n) for w, n in zip(wanted, samples, strict=True))
    assert noise.delta_e == pytest.approx(target, rel=0.1)
    assert samples[0] < samples[1]
    assert samples[0] < samples[2]
    equal = sampling.picture_noise(_halves((sum(samples) // 3,) * 3, seed=99))
    assert equal.delta_e > 1.1 * target


def test_large_pictures_are_thinned(monkeypatch):
    halves = _halves((64, 64, 64))
    whole = sampling.picture_noise(halves).delta_e
    monkeypatch.setattr(sampling, "_MOST_PIXELS", 2000)
    assert sampling.picture_noise(halves).delta_e == pytest.approx(whole, rel=0.1)
