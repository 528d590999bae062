"""Water from plain numbers alone: no tables, no fits, nothing that cannot be a shader node.

The phase function is Henyey-Greenstein's, and the aureole of the sun its own series: light
scattered n times at small angles has the function of asymmetry gⁿ (Goudsmit & Saunderson,
Phys. Rev. 57, 24 (1940)), so that with x = b y/μs scatterings on the way, f = χ2 of which the
scaled beam keeps,

    p* = e^{-fx} Σ_{n≥1} x^{n-1}/n! HG(gⁿ) - (e0 + 3 e1 cos)/4π,

where el is what the series has too much of the moments l = 0 and 1, which the diffuse light
knows (`uw_spectral.transfer.aureole`). The first orders are summed one by one; those beyond share
the mean of their asymmetries.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.path_integral import phi
from ...uw_spectral.transfer.sky import Sky
from ...uw_spectral.water.phase_functions import henyey_greenstein
from .closed_form import ClosedForm
from .internal_reflectance import diffuse_internal_reflectance
from .light_field import TwoStreamWater, two_stream_field
from .unoccluded_water import UnoccludedWater

_ORDERS = 5
_LEAST = 1e-6
_MOST = 80.0  # scatterings; of more, e^x has no single precision, and no sunlight is left
_INDICES = (1.0, 1.005, 1.02, 1.05, 1.1, 1.16, 1.22, 1.28, 1.34, 1.4, 1.5, 1.65, 1.8, 2.0)


@dataclass(frozen=True, eq=False)
class OneLobe:
    """Henyey-Greenstein's phase function of asymmetry g, per band."""

    g: Operand

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Value at s2 = sin²(angle / 2), 1/sr."""
        return henyey_greenstein(self.g, s2, m)


@dataclass(frozen=True, eq=False)
class LobeSeries:
    """Spread of the sun at a camera, by orders of scattering."""

    #: Asymmetry, and fraction of the scattering that the scaled beam keeps.
    g: Operand
    f: Operand
    x: Operand  #: Scatterings on the slant path from the surface.

    def spread(self, p: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return p*, given the phase function p at s2 = sin²(angle / 2)."""
        fraction, g, total, summed, summed_g = 1.0, self.g, 0.0, 0.0, 0.0
        for order in range(1, _ORDERS + 1):
            total = total + fraction * henyey_greenstein(g, s2, m)
            summed, summed_g = summed + fraction, summed_g + fraction * g
            fraction, g = fraction * self.x / (order + 1.0), g * self.g
        del p
        beam = m.exp(-self.f * self.x)
        # Of all orders together: (e^x - 1)/x = e^x phi(x), and with gⁿ: g e^{gx} phi(gx).
        every = m.exp((1.0 - self.f) * self.x) * phi(self.x, m)
        turned = self.g * m.exp((self.g - self.f) * self.x) * phi(self.g * self.x, m)
        rest = m.maximum(every - beam * summed, 0.0)
        mean = (turned - beam * summed_g) / m.maximum(rest, _LEAST)
        wide = m.clamp(mean, 0.0, g)
        total = beam * total + rest * henyey_greenstein(wide, s2, m)
        excess0, excess1 = (
            u * (m.exp(u * self.x) * phi(u * self.x, m) - 1.0)
            for u in (1.0 - self.f, m.maximum(self.g - self.f, 0.0))
        )
        return total - (excess0 + 3.0 * excess1 * (1.0 - 2.0 * s2)) / (4.0 * math.pi)


def surface_fractions(index: Operand, m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
    """Fraction of uniform skylight that a flat surface lets in, and of upward light it sends back.

    By reciprocity the first is n² (1 - the second). Interpolated to 0.3 %; an index of 1 is no
    surface.
    """
    known = [x * x * (1.0 - diffuse_internal_reflectance(x)) for x in _INDICES]
    let_in = m.interpolate(index, np.array(_INDICES), np.array(known))
    return let_in, 1.0 - let_in / (index * index)


@dataclass(frozen=True, eq=False)
class PlainLight:
    """Sun and sky as numbers."""

    E: Operand  #: Direct downwelling sun irradiance just below the surface, per band.
    L_sky: Operand  #: Radiance of a uniform sky, in air, per band.
    sun: Sequence[Operand]  #: Unit direction that sunlight travels to in the water, z up.


def plain_water(
    water: TwoStreamWater,
    light: PlainLight,
    *,
    y_o: Operand,
    y_f: Operand,
    r: Operand,
    index: Operand,
    m: Mathematics = NUMPY,
) -> UnoccludedWater:
    """Return unoccluded water as a camera sees it, from numbers.

    ``y_o`` and ``y_f`` are the depths of the camera and of the floor of reflectance ``r``, m; deep
    water has a floor far down. An index of 1 is no surface.
    """
    let_in, sent_back = surface_fractions(index, m)
    E_sky = np.pi * light.L_sky * let_in
    field = two_stream_field(
        water, light.E, -light.sun[2], E_sky=E_sky, R=sent_back, r=r, y_f=y_f, m=m
    )
    g, x = water.chi1, m.minimum(water.b * y_o / field.mu_s, _MOST)
    elastic = ClosedForm(field, OneLobe(g), LobeSeries(g, water.chi2, x), light.sun)
    return UnoccludedWater(elastic, Sky(light.L_sky), index)
