"""Light scattered by spheres: the Lorenz-Mie series, summed as Bohren and Huffman sum it.

C. F. Bohren & D. R. Huffman, *Absorption and Scattering of Light by Small Particles* (1983),
sections 4.4 and 4.8: the logarithmic derivative downwards, the other functions upwards.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def scattered_by_sphere(
    size: float, index: float, cosines: ArrayLike
) -> tuple[float, float, float, Array]:
    """Scattering of unpolarised light by a sphere that does not absorb.

    ``size`` is circumference over the wavelength in the medium, ``index`` that of the sphere over
    the medium's. Returns efficiency (cross-section over that of the disc), asymmetry (mean cosine
    of the angle), glory (the phase function at 180°, 1/sr) and the phase function at the cosines of
    scattering angles, shape (k,), 1/sr, whose integral over the sphere is 1.

    Examples
    --------
    A sphere of 0.525 µm and the index 1.55 at 632.8 nm, as in Bohren & Huffman, appendix A.

    >>> efficiency, *_ = scattered_by_sphere(2 * np.pi * 0.525 / 0.6328, 1.55, [1.0])
    >>> round(efficiency, 4)
    3.1054
    """
    cosines = np.ascontiguousarray(np.atleast_1d(cosines), np.float64)
    a, b = _coefficients(size, index)
    n = np.arange(1.0, len(a) + 1.0)
    squares = np.abs(a) ** 2 + np.abs(b) ** 2
    efficiency = 2.0 / size**2 * float(np.sum((2 * n + 1) * squares))
    across = np.real(a[:-1] * np.conj(a[1:]) + b[:-1] * np.conj(b[1:]))
    same = np.real(a * np.conj(b))
    k, last = n[:-1], n
    forward = np.sum(k * (k + 2) / (k + 1) * across) + np.sum(
        (2 * last + 1) / (last * (last + 1)) * same
    )
    asymmetry = 4.0 / (size**2 * efficiency) * float(forward)
    signs = np.where(n % 2 == 0, 1.0, -1.0)
    back = abs(np.sum((2 * n + 1) * signs * (a - b))) ** 2 / size**2  # 4 π p Q
    per_area = _intensities(a, b, cosines) / (2.0 * math.pi * size**2)
    return efficiency, asymmetry, float(back) / (4 * math.pi * efficiency), per_area / efficiency


@numba.njit(nogil=True, error_model="numpy", cache=False)
def _coefficients(x, m):  # noqa: ANN001, ANN202
    count = int(x + 4.05 * x ** (1.0 / 3.0) + 2.0)
    start = int(max(count, abs(m * x))) + 16
    slope = np.zeros(start + 1)
    for n in range(start, 0, -1):
        slope[n - 1] = n / (m * x) - 1.0 / (slope[n] + n / (m * x))
    a, b = np.zeros(count, np.complex128), np.zeros(count, np.complex128)
    before, psi = math.cos(x), math.sin(x)
    chi_before, chi = -math.sin(x), math.cos(x)
    for n in range(1, count + 1):
        psi, before = (2.0 * n - 1.0) / x * psi - before, psi
        chi, chi_before = (2.0 * n - 1.0) / x * chi - chi_before, chi
        xi, xi_before = complex(psi, -chi), complex(before, -chi_before)
        one, other = slope[n] / m + n / x, slope[n] * m + n / x
        a[n - 1] = (one * psi - before) / (one * xi - xi_before)
        b[n - 1] = (other * psi - before) / (other * xi - xi_before)
    return a, b


@numba.njit(nogil=True, error_model="numpy", cache=False)
def _intensities(a, b, cosines):  # noqa: ANN001, ANN202
    found = np.zeros(len(cosines))
    for j in range(len(cosines)):
        mu = cosines[j]
        pi_before, pi = 0.0, 1.0
        s1, s2 = 0.0j, 0.0j
        for i in range(len(a)):
            n = i + 1
            tau = n * mu * pi - (n + 1) * pi_before
            factor = (2.0 * n + 1.0) / (n * (n + 1.0))
            s1 += factor * (a[i] * pi + b[i] * tau)
            s2 += factor * (a[i] * tau + b[i] * pi)
            pi, pi_before = ((2 * n + 1) * mu * pi - (n + 1) * pi_before) / n, pi
        found[j] = abs(s1) ** 2 + abs(s2) ** 2
    return found
