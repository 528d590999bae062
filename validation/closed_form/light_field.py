"""Irradiance with depth: the delta-scaled two-stream light field, all bands at once.

Depth y is positive down, in m. The field of each band is three exponentials of
depth, so every consumer (path radiance, surfaces, shader nodes) evaluates it
at no cost. The coefficients are solved here, once, in double precision.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ...uw_spectral.errors import InputError
from ...uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from .internal_reflectance import internal_reflectance

DEEPEST_FLOOR = 1e6
"""Depth in m from which a floor does not matter: deep water."""

_SMALLEST_SUN_COSINE = 0.01
_RESONANCE = 1e-3
# k·y_f below which the two diffuse solutions can no longer be told apart in single
# precision. The absorption it adds to water without any changes E0 by at most 2e-3.
_SMALLEST_DIFFUSE_DEPTH = 3e-2


@dataclass(frozen=True, eq=False)
class LightField:
    """Light field of n bands; make it with :func:`solve_light_field`.

    Every attribute is an array of shape (n,), or a socket when the same
    formulas build shader nodes; ``y_f`` and ``mu_s`` are single numbers.
    Arguments of the methods broadcast against the bands: give arrays a last
    axis of 1. ``m`` holds the elementary functions.
    """

    #: Scattering and extinction, 1/m.
    b: Operand
    c: Operand
    #: The same, and the asymmetry, after the forward peak χ2 is taken out.
    bp: Operand
    cp: Operand
    gp: Operand
    #: Decay of the diffuse light and of the scaled direct sun with depth, 1/m.
    k: Operand
    ks: Operand
    h: Operand  #: Flux over scalar irradiance of the diffuse solutions, k/ct.
    #: Coefficients of E0 and F.
    C1: Operand
    C2: Operand
    A: Operand
    B: Operand
    Fx: Operand  #: Horizontal diffuse flux per ``e^{-ks y}`` and sine of the sun zenith.
    E: Operand  #: Direct downwelling sun irradiance just below the surface.
    #: Internal reflectance of the surface; reflectance of the floor.
    R: Operand
    r: Operand
    mu_s: Operand  #: Cosine of the in-water sun zenith angle.
    y_f: Operand  #: Depth of the floor, m.

    def astype(self, dtype: DTypeLike) -> LightField:
        """Return the field in another floating-point precision."""
        fields = dataclasses.fields(self)
        cast = np.dtype(dtype).type
        return LightField(**{f.name: cast(getattr(self, f.name)) for f in fields})

    def E0(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Diffuse scalar irradiance at depth y."""
        down, up = self._diffuse(y, m)
        return down + up + self.A * m.exp(-self.ks * y)

    def F(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Diffuse net downward flux at depth y."""
        down, up = self._diffuse(y, m)
        return self.h * (down - up) + self.B * m.exp(-self.ks * y)

    def Ed(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Downwelling irradiance at depth y, direct sun included."""
        return self.E0(y, m) / 4.0 + self.F(y, m) / 2.0 + self.E * m.exp(-self.ks * y)

    def Eu(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Upwelling irradiance at depth y, of the two streams.

        With :meth:`Ed` it keeps the net flux, and may be negative where a ≫ b; for its own
        sake take :func:`.upwelling_irradiance`.
        """
        return self.E0(y, m) / 4.0 - self.F(y, m) / 2.0

    def scalar_irradiance(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Scalar irradiance at depth y, direct sun included."""
        return self.E0(y, m) + self.E / self.mu_s * m.exp(-self.ks * y)

    def surface_irradiance(
        self,
        y: Operand,
        sun_cosine: Operand,
        up: Operand,
        m: Mathematics = NUMPY,
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance on a patch: the direct sun unshadowed, its light scattered forward, the rest.

        ``sun_cosine`` is between its normal and the direction towards the in-water sun; below zero
        the patch faces away. ``up`` is the upward component of its normal (1 for a floor).
        """
        facing = m.maximum(sun_cosine, 0.0) / self.mu_s * self.E
        sharp = m.exp(-self.c / self.mu_s * y)
        forward = m.maximum(m.exp(-self.ks * y) - sharp, 0.0)
        diffuse = self.E0(y, m) / 4.0 + up * (self.F(y, m) / 2.0)
        return facing * sharp, facing * forward, m.maximum(diffuse, 0.0)

    def floor_radiance(self, m: Mathematics = NUMPY) -> Operand:
        """Radiance of the Lambertian floor."""
        return m.maximum(self.r / math.pi * self.Ed(self.y_f, m), 0.0)

    def _diffuse(self, y: Operand, m: Mathematics) -> tuple[Operand, Operand]:
        return self.C1 * m.exp(-self.k * y), self.C2 * m.exp(-self.k * (self.y_f - y))


@dataclass(frozen=True, eq=False)
class TwoStreamWater:
    """What two streams know of a water, per band."""

    #: Absorption and scattering, 1/m.
    a: Operand
    b: Operand
    #: First two Legendre moments of the phase function; χ2 = g² of Henyey-Greenstein's own.
    chi1: Operand
    chi2: Operand


def solve_light_field(
    water: TwoStreamWater,
    E: ArrayLike,
    mu_s: float,
    *,
    E_sky: ArrayLike = 0.0,
    R: ArrayLike = 0.0,
    r: ArrayLike = 0.0,
    y_f: float = math.inf,
) -> LightField:
    """Solve the delta-Eddington light field between surface and floor.

    E is that of the sun just below the surface, E_sky of what the surface lets in, r of the
    Lambertian floor. Arrays have shape (n,).

    J. H. Joseph, W. J. Wiscombe & J. A. Weinman, J. Atmos. Sci. 33, 2452 (1976),
    with f = χ2 as the forward peak.

    Parameters
    ----------
    mu_s : float
        Cosine of the in-water sun zenith angle. Taken as at least 0.01: a
        flatter sun exists only without refraction, and then without irradiance.
    R : array_like, shape (n,)
        Internal reflectance of the surface: 0 where it is index-matched,
        :func:`.diffuse_internal_reflectance` for a flat one.
    y_f : float
        Depth of the floor, m; infinite for deep water (r has no effect).

    Raises
    ------
    InputError
        If a quantity is negative, not finite or above its bound.
    """
    quantities = {
        "absorption": (water.a, math.inf),
        "scattering": (water.b, math.inf),
        "sun irradiance": (E, math.inf),
        "sky irradiance": (E_sky, math.inf),
        "surface reflectance": (R, 1.0),
        "floor reflectance": (r, 1.0),
    }
    arrays = [
        np.atleast_1d(np.asarray(value, dtype=np.float64)) for value, _ in quantities.values()
    ]
    for (name, (_, bound)), values in zip(quantities.items(), arrays, strict=True):
        if not np.all(np.isfinite(values) & (values >= 0) & (values <= bound)):
            limit = "not negative" if bound == math.inf else f"0 to {bound:g}"
            raise InputError(f"light field: {name} must be finite and {limit}")
    if not y_f > 0:
        raise InputError(f"light field: the floor must lie below the surface, got y_f = {y_f:g} m")
    if not 0 <= mu_s <= 1:
        raise InputError(f"light field: the sun cosine must be 0 to 1, got {mu_s:g}")
    a, b, E, E_sky, R, r, f, chi1 = np.broadcast_arrays(*arrays, water.chi2, water.chi1)
    if y_f >= DEEPEST_FLOOR:
        y_f, r = DEEPEST_FLOOR, np.zeros_like(r)
    checked = TwoStreamWater(a, b, chi1, f)
    return two_stream_field(checked, E, float(mu_s), E_sky=E_sky, R=R, r=r, y_f=float(y_f))


@functools.lru_cache(maxsize=64)
def light_field_of(column: WaterColumn, phase: BandPhase) -> LightField:
    """Return the light field of a column for a phase function, solved once for both.

    Raises
    ------
    InputError
        If the column has layers.
    """
    column.require_one_layer("the closed form knows")
    mean = column.mean_surface
    return solve_light_field(
        TwoStreamWater(column.absorption, column.scattering, phase.chi1, phase.chi2),
        column.sun_irradiance,
        column.sun_cosine,
        E_sky=column.sky_irradiance,
        R=0.0 if mean is None else internal_reflectance(mean),
        r=column.floor_reflectance,
        y_f=column.floor_depth,
    )


def two_stream_field(
    water: TwoStreamWater,
    E: Operand,
    mu_s: Operand,
    *,
    E_sky: Operand,
    R: Operand,
    r: Operand,
    y_f: Operand,
    m: Mathematics = NUMPY,
) -> LightField:
    """Coefficients of the light field, as a formula that shader nodes can hold.

    Arguments are those of :func:`solve_light_field`, finite and within their bounds, with
    ``y_f`` at most :data:`DEEPEST_FLOOR`.
    """
    a, b, f = water.a, water.b, water.chi2
    mu_s = m.maximum(mu_s, _SMALLEST_SUN_COSINE)
    gp = (water.chi1 - f) / (1.0 - f)
    bp = b * (1.0 - f)
    transport = bp * (1.0 - gp)
    a = m.maximum(a, _SMALLEST_DIFFUSE_DEPTH**2 / (3.0 * y_f * (1.0 + transport * y_f)))
    cp, c = a + bp, a + b
    S, ks = E / mu_s, cp / mu_s
    ct = 3.0 * (a + transport)
    k = m.sqrt(a * ct)
    h = k / ct

    detuning = k * k - ks * ks
    away = m.maximum(m.absolute(detuning), _RESONANCE * (ks * ks))
    A = bp * (ct + 3.0 * gp * cp) * S / (away * (1.0 - 2.0 * m.less(detuning, 0.0)))
    B = (a * A - bp * S) / ks
    Fx = bp * gp * S / (a + transport)

    # Surface: (1-R)E0/4 + (1+R)F/2 = E_sky.  Floor: (1-r)E0/4 - (1+r)F/2 = r E e^{-ks y_f}.
    top_mean, top_flux = (1.0 - R) / 4.0, (1.0 + R) / 2.0
    low_mean, low_flux = (1.0 - r) / 4.0, (1.0 + r) / 2.0
    top_along, top_against = top_mean + top_flux * h, top_mean - top_flux * h
    low_along, low_against = low_mean + low_flux * h, low_mean - low_flux * h
    top = E_sky - top_mean * A - top_flux * B
    low = (r * E - low_mean * A + low_flux * B) * m.exp(-ks * y_f)
    across = m.exp(-k * y_f)
    determinant = top_along * low_along - top_against * low_against * (across * across)
    return LightField(
        b=b, c=c, bp=bp, cp=cp, gp=gp, k=k, ks=ks, h=h,
        C1=(top * low_along - low * top_against * across) / determinant,
        C2=(low * top_along - top * low_against * across) / determinant,
        A=A, B=B, Fx=Fx, E=E, R=R, r=r, mu_s=mu_s, y_f=y_f,
    )  # fmt: skip
