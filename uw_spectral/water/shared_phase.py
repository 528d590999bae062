"""Neighbouring bands that can share a phase function.

A renderer that carries three bands in one pass scatters them with one phase function. Where
molecules hardly count, or count alone, neighbouring bands have nearly the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from .phase import BandPhase

LARGEST_SPREAD = 0.08
"""Of bb/b and of 1 - g among bands that share a phase function, relative to their mean.

By the solver it moves the mean radiance of a band by 0.5 % at most, and Eu by 1 %.
"""


def alike(
    phases: Sequence[BandPhase], most: int = 3, spread: float = LARGEST_SPREAD
) -> list[tuple[int, ...]]:
    """Group neighbouring bands, by their indices, whose phase functions are nearly the same.

    Bands must be alike in every layer, of which each has one of ``phases``; a group has so many
    bands at most. ``spread`` is the range of bb/b, and of 1 - g, over their mean that is allowed; 0
    asks for equal ones.
    """
    kept = [np.stack([p.backscatter_ratio, 1.0 - p.chi1]) for p in phases]

    def are_alike(group: tuple[int, ...]) -> bool:
        of_group = list(group)
        return all(
            _equal(phase.weights[:, of_group])
            or bool(np.all(np.ptp(x[:, of_group], axis=1) < spread * x[:, of_group].mean(axis=1)))
            for phase, x in zip(phases, kept, strict=True)
        )

    groups: list[tuple[int, ...]] = []
    for band in range(len(phases[0])):
        if groups and len(groups[-1]) < most and are_alike((*groups[-1], band)):
            groups[-1] = (*groups[-1], band)
        else:
            groups.append((band,))
    return groups


def _equal(weights: NDArray[np.float64]) -> bool:
    return bool(np.all(weights == weights[:, :1]))


def with_mean_of(phase: BandPhase, groups: Sequence[tuple[int, ...]]) -> BandPhase:
    """Give every band of a group the mean phase function of the group."""
    weights = phase.weights.copy()
    for group in map(list, groups):
        if not _equal(weights[:, group]):
            weights[:, group] = weights[:, group].mean(axis=1, keepdims=True)
    return replace(phase, weights=weights)
