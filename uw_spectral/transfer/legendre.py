"""Associated Legendre functions, for the expansion of radiance in azimuth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def legendre_modes(degree: int, modes: int, mu: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalised associated Legendre functions, sqrt((l-m)!/(l+m)!) P_l^m; 0 where l < m.

    Shape (modes, degree + 1, q) for l to ``degree``, so many m, and mu (q,).
    """
    out = np.zeros((modes, degree + 1, len(mu)))
    out[0, 0] = 1.0
    sine = np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    for l in range(1, degree + 1):  # noqa: E741 - the degree
        m = np.arange(min(l, modes))[:, None]
        before = np.sqrt((l - 1) ** 2 - m * m) * out[: len(m), l - 2] if l > 1 else 0.0
        along = (2 * l - 1) * mu * out[: len(m), l - 1]
        out[: len(m), l] = (along - before) / np.sqrt(l * l - m * m)
        if l < modes:
            out[l, l] = out[l - 1, l - 1] * sine * np.sqrt((2 * l - 1) / (2 * l))
    return out
