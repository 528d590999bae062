"""Path radiance of Monzón et al. 2024, as printed and corrected: baselines to compare with.

N. Monzón, D. Gutierrez, D. Akkaynak & A. Muñoz, Real-Time Underwater Spectral
Rendering, Computer Graphics Forum 43(2), e15009 (2024). Both need Kd; the closed
form of :mod:`.closed_form` does not.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.transfer.path_integral import attenuated_path
from ..uw_spectral.transfer.radiance_field import distance_in_water

TABLE2 = {
    ("3C", 3.0): 0.059, ("3C", 9.0): 0.041, ("I", 5.0): 0.117, ("IA", 9.0): 0.107,
    ("IB", 5.0): 0.107, ("II", 3.0): 0.107,
}  # fmt: skip
"""sRGB RMSE of their method against their path tracer by water and depth in m, their Table 2."""


def path_radiance_Monzon2024(
    b: ArrayLike,
    c: ArrayLike,
    Kd: ArrayLike,
    E: ArrayLike,
    r: ArrayLike,
    y_o: ArrayLike,
    w_y: ArrayLike,
    P: ArrayLike,
    y_f: float,
) -> NDArray[np.float64]:
    """Evaluate Eq. 9 as printed, errors included.

    One factor with exponent ``c - Kd w_y`` serves sunlight and floor light (the
    sign is against the paper's own y = y_o + w_y v), and the floor carries r/π.
    Written from a description of the errors of Eq. 9, not from the paper itself.
    Parameters and result as in :func:`path_radiance_Monzon2024_corrected`.
    """
    b, c, Kd, E, r, y_o, w_y, P = _prepared(b, c, Kd, E, r, y_o, w_y, P, y_f)
    sun = _term(c, Kd, -w_y, -Kd * y_o, P)
    floor = _term(c, Kd, -w_y, -Kd * (2 * y_f - y_o), P)
    return b * E / (4 * math.pi) * (sun + r / math.pi * floor)


def path_radiance_Monzon2024_corrected(
    b: ArrayLike,
    c: ArrayLike,
    Kd: ArrayLike,
    E: ArrayLike,
    r: ArrayLike,
    y_o: ArrayLike,
    w_y: ArrayLike,
    P: ArrayLike,
    y_f: float,
) -> NDArray[np.float64]:
    """Evaluate Eq. 9 with its two exponents apart and a floor of reflectance r.

    Parameters
    ----------
    b, c, Kd : array_like
        Scattering, extinction, diffuse attenuation, 1/m.
    E : array_like
        Downwelling irradiance just below the surface.
    y_o, y_f : array_like, float
        Depths of the camera and of the floor, m, finite.
    w_y : array_like
        Downward component of the view direction.
    P : array_like
        Length of the path, m; ends at the surface or the floor.
    """
    b, c, Kd, E, r, y_o, w_y, P = _prepared(b, c, Kd, E, r, y_o, w_y, P, y_f)
    sun = _term(c, Kd, w_y, -Kd * y_o, P)
    floor = _term(c, Kd, -w_y, -Kd * (2 * y_f - y_o), P)
    return b * E / (4 * math.pi) * (sun + r * floor)


def _prepared(*values: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Return all but the depth of the floor as arrays, the path within the water."""
    *others, y_o, w_y, P, y_f = (np.asarray(value, dtype=np.float64) for value in values)
    return *others, y_o, w_y, np.minimum(P, distance_in_water(y_o, w_y, y_f))


def _term(
    c: NDArray[np.float64],
    Kd: NDArray[np.float64],
    slope: NDArray[np.float64],
    near: NDArray[np.float64],
    P: NDArray[np.float64],
) -> NDArray[np.float64]:
    qP = (c + Kd * slope) * P
    return attenuated_path(near, near - qP, qP, P)
