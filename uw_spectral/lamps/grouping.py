"""Lamps in a few groups, for renderers that can tell only so many shadows apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

_ALIKE = 1e-3
"""Distances that differ by less are the same, so that a rig that moves keeps its groups."""


def grouped(positions: ArrayLike, groups: int) -> list[int]:
    """Number of the group, of at most so many, of each lamp at positions (n, 3).

    Those that are near each other share one.
    """
    places = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    clusters = [[index] for index in range(len(places))]
    while len(clusters) > groups:
        centres = np.array([places[cluster].mean(axis=0) for cluster in clusters])
        distance = np.linalg.norm(centres[:, None] - centres, axis=-1)
        pairs = np.triu_indices(len(clusters), 1)
        apart = distance[pairs]
        # The first of those that are as near as the nearest.
        place = int(np.argmax(apart <= apart.min() * (1.0 + _ALIKE)))
        one, other = pairs[0][place], pairs[1][place]
        clusters[one] = sorted([*clusters[one], *clusters.pop(other)])
    found = [0] * len(places)
    for number, cluster in enumerate(sorted(clusters)):
        for index in cluster:
            found[index] = number
    return found
