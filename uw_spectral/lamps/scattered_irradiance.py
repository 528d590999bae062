"""What patches get of a lamp's scattered light.

The radiance of :mod:`.lamp_harmonics` that comes from within :data:`.ABOUT_LAMP` of the lamp counts
as if all of it came from there: a renderer shadows it. Of the rest the harmonics of degrees 0 to 2
make the irradiance of a patch of any orientation, as its cosine has little of higher ones
(Ramamoorthi & Hanrahan, J. Opt. Soc. Am. A 18, 2448, 2001). In the frame of the radius, and of the
plane that the lamp's axis is in, there are six. Tabulated over the distance and the angle from the
axis, times r and without what absorption takes up to there.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import Axis, Lookup, Table, discrete_axis
from .angular_spread import ABOUT_LAMP
from .lamp_harmonics import Harmonics, lamp_distances, on_sphere
from .profile import LampProfile
from .scattered_source import TURNED

Array = NDArray[np.float64]

TERMS = 7
"""Of the table: from about the lamp; harmonics of degrees and orders 00, 10, 11, 20, 21 and 22."""
_HIGHEST = 2
_BLUR = 2.0
_OF_COSINE = (math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0)
_PLACES = 200
_LEAST_SINE2 = 1e-6


def arriving_axes(scale: Operand) -> tuple[Axis, ...]:
    """Return the axes of the table: its terms, and as of :func:`.lamp_distances`."""
    turned = TURNED.axis("turned")
    return discrete_axis("term", TERMS), lamp_distances(scale).axis("distance"), turned


@functools.lru_cache(maxsize=32)
def arriving_table(solved: Harmonics, profile: LampProfile) -> Table:
    """Tabulate what arrives of a lamp with a profile; of :meth:`.Harmonics.for_patches`."""
    around = solved.around(profile, TURNED.values(), _HIGHEST, _BLUR)
    about, beside = _windows(solved.degrees)
    found = np.einsum("mkl,rtmln->rtmkn", beside, around)
    terms = [
        found[:, :, m, degree] * (_OF_COSINE[degree] * _scale_of(degree, m) * (2.0 if m else 1.0))
        for degree in range(_HIGHEST + 1)
        for m in range(degree + 1)
    ]
    # 3 z² - 1 of the degree 2.
    terms[0], terms[3] = terms[0] - terms[3], 3.0 * terms[3]
    from_lamp = np.einsum("l,rtln->rtn", about, around[:, :, 0])
    values = np.stack([np.maximum(from_lamp, 0.0), *terms])
    r = solved.distances[:, None, None]
    return Table(values * r * np.exp(solved.a * r), arriving_axes(solved.scale))


def _scale_of(degree: int, m: int) -> float:
    """Return what the harmonic is over its polynomial: 1, z, x, 3 z² - 1, x z, x² - y²."""
    scales = ((0.25,), (0.75, -0.375), (5.0 / 16.0, -15.0 / 8.0, 15.0 / 32.0))
    value = scales[degree][m] / math.pi
    return math.copysign(math.sqrt(abs(value)), value)


@functools.cache
def _windows(highest: int) -> tuple[Array, Array]:
    """Integrals over directions about the lamp and elsewhere.

    Of its cosine and harmonics without azimuth, (l,), and of products of harmonics, (m, k, l).
    """
    edge = math.cos(ABOUT_LAMP)
    places, weights = np.polynomial.legendre.leggauss(_PLACES)
    ends = []
    for low, high in ((edge, 1.0), (-1.0, edge)):
        half = (high - low) / 2.0
        mu = low + half * (1.0 + places)
        ends.append((mu, 2.0 * math.pi * half * weights, on_sphere(mu, highest)))
    (mu, near, values), (_, far, others) = ends
    few = others[: _HIGHEST + 1, : _HIGHEST + 1]
    beside = np.einsum("mkp,mlp,p->mkl", few, others[: _HIGHEST + 1], far)
    return values[0] @ (near * mu), beside


def arriving_on(
    arriving: Lookup,
    wet: Operand,
    turned: Operand,
    bent: Operand,
    off_axis: Operand,
    m: Mathematics = NUMPY,
) -> tuple[Operand, Operand]:
    """Irradiance of a patch, absorption up to there apart, times the distance from the lamp.

    From about the lamp, on a patch that faces it; and from elsewhere. Of the cosines ``turned`` is
    between the lamp's axis and the radius, ``bent`` between the radius and the direction into the
    patch, ``off_axis`` between the axis and that direction.
    """
    z = bent
    x = (off_axis - turned * bent) / m.sqrt(m.maximum(1.0 - turned * turned, _LEAST_SINE2))
    polynomials = (z, x, z * z, x * z, 2.0 * x * x + z * z - 1.0)
    about, total, *terms = arriving.at(distance=wet, turned=turned)
    for term, factor in zip(terms, polynomials, strict=True):
        total = total + term * factor
    return about, m.maximum(total, 0.0)
