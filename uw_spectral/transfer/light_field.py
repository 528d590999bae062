"""Irradiance with depth: the delta-scaled two-stream light field, all bands at once.

Depth y is positive down, in m. The field of each band is three exponentials of
depth, so every consumer (path radiance, surfaces, shader nodes) evaluates it
at no cost. The coefficients are solved here, once, in double precision.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand

DEEPEST_FLOOR = 1e6
"""Depth in m from which a floor does not matter: deep water."""

_SMALLEST_SUN_COSINE = 0.01
_RESONANCE = 1e-3
# k·y_f below which the two diffuse solutions can no longer be told apart in single
# precision. The absorption it adds to water without any changes E0 by at most 2e-3.
_SMALLEST_DIFFUSE_DEPTH = 3e-2
_SMALLEST_ABSORPTION = 1e-12


@dataclass(frozen=True, eq=False)
class LightField:
    """Light field of n bands; make it with :func:`solve_light_field`.

    Every attribute is an array of shape (n,), or a socket when the same
    formulas build shader nodes; ``y_f`` and ``mu_s`` are single numbers.
    Arguments of the methods broadcast against the bands: give arrays a last
    axis of 1. ``m`` holds the elementary functions.

    Attributes
    ----------
    b, c : array
        Scattering and extinction, 1/m.
    bp, cp, gp : array
        The same, and the asymmetry, after the forward peak χ2 is taken out.
    k, ks : array
        Decay of the diffuse light and of the scaled direct sun with depth, 1/m.
    h : array
        Flux over scalar irradiance of the diffuse solutions, k/ct.
    C1, C2, A, B : array
        Coefficients of E0 and F.
    Fx : array
        Horizontal diffuse flux per ``e^{-ks y}`` and sine of the sun zenith.
    E : array
        Direct downwelling sun irradiance just below the surface.
    R, r : array
        Internal reflectance of the surface; reflectance of the floor.
    mu_s : float
        Cosine of the in-water sun zenith angle.
    y_f : float
        Depth of the floor, m.
    """

    b: Operand
    c: Operand
    bp: Operand
    cp: Operand
    gp: Operand
    k: Operand
    ks: Operand
    h: Operand
    C1: Operand
    C2: Operand
    A: Operand
    B: Operand
    Fx: Operand
    E: Operand
    R: Operand
    r: Operand
    mu_s: Operand
    y_f: Operand

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

    def Ed_gradient(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Derivative of :meth:`Ed` by depth."""
        down, up = self._diffuse(y, m)
        sun = self.ks * m.exp(-self.ks * y)
        mean = self.k * (up - down) - self.A * sun
        net = -self.k * self.h * (down + up) - self.B * sun
        return mean / 4.0 + net / 2.0 - self.E * sun

    def Eu(self, y: Operand, m: Mathematics = NUMPY) -> Operand:
        """Upwelling irradiance at depth y, of the two streams.

        With :meth:`Ed` it keeps the net flux, and may be negative where a ≫ b; for its own
        sake take :func:`.radiance_field.upwelling_irradiance`.
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
        openness: Operand = None,
    ) -> tuple[Operand, Operand, Operand]:
        """Irradiance on a patch of surface.

        Parameters
        ----------
        y : float or array
            Depth of the patch.
        sun_cosine : float or array
            Cosine between its normal and the direction towards the in-water
            sun; below zero the patch faces away.
        up : float or array
            Upward component of its normal (1 for a floor).
        m : Mathematics
            Elementary functions.
        openness : float or array, optional
            Share of the light from above, the direct sun apart, that nothing keeps
            away: of that in :func:`.light_cone`. All of it by default.

        Returns
        -------
        direct, forward, diffuse
            The direct sun, not yet shadowed by anything; the sunlight
            scattered forward; the diffuse light.
        """
        facing = m.maximum(sun_cosine, 0.0) / self.mu_s * self.E
        sharp = m.exp(-self.c / self.mu_s * y)
        forward = m.maximum(m.exp(-self.ks * y) - sharp, 0.0)
        mean, half_flux = self.E0(y, m) / 4.0, self.F(y, m) / 2.0
        diffuse = mean + up * half_flux
        if openness is not None:
            forward = forward * openness
            from_above = m.maximum(mean + half_flux, 0.0)
            diffuse = diffuse - (1.0 - openness) * (0.5 + 0.5 * up) * from_above
        return facing * sharp, facing * forward, m.maximum(diffuse, 0.0)

    def floor_radiance(self, m: Mathematics = NUMPY) -> Operand:
        """Radiance of the Lambertian floor."""
        return m.maximum(self.r / math.pi * self.Ed(self.y_f, m), 0.0)

    def _diffuse(self, y: Operand, m: Mathematics) -> tuple[Operand, Operand]:
        return self.C1 * m.exp(-self.k * y), self.C2 * m.exp(-self.k * (self.y_f - y))


def solve_light_field(
    a: ArrayLike,
    b: ArrayLike,
    chi1: ArrayLike,
    chi2: ArrayLike,
    E: ArrayLike,
    mu_s: float,
    *,
    E_sky: ArrayLike = 0.0,
    R: ArrayLike = 0.0,
    r: ArrayLike = 0.0,
    y_f: float = math.inf,
) -> LightField:
    """Solve the delta-Eddington light field between surface and floor.

    Parameters
    ----------
    a, b : array_like, shape (n,)
        Absorption and scattering, 1/m.
    chi1, chi2 : array_like, shape (n,)
        First two Legendre moments of the phase function.
    E : array_like, shape (n,)
        Direct downwelling sun irradiance just below the surface.
    mu_s : float
        Cosine of the in-water sun zenith angle. Taken as at least 0.01: a
        flatter sun exists only without refraction, and then without irradiance.
    E_sky : array_like, shape (n,)
        Diffuse irradiance that the surface transmits into the water.
    R : array_like, shape (n,)
        Internal reflectance of the surface: 0 where it is index-matched,
        :func:`.sun.diffuse_internal_reflectance` for a flat one.
    r : array_like, shape (n,)
        Reflectance of the Lambertian floor.
    y_f : float
        Depth of the floor, m; infinite for deep water (r has no effect).

    Returns
    -------
    LightField

    Raises
    ------
    InputError
        If a quantity is negative, not finite or above its bound.

    Notes
    -----
    J. H. Joseph, W. J. Wiscombe & J. A. Weinman, J. Atmos. Sci. 33, 2452 (1976),
    with f = χ2 as the forward peak.

    Examples
    --------
    >>> field = solve_light_field([0.05], [0.1], [0.8], [0.64], [1.0], 1.0)
    >>> field.Ed(5.0).round(2)
    array([0.74])
    """
    quantities = {
        "absorption": (a, math.inf),
        "scattering": (b, math.inf),
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
    a, b, E, E_sky, R, r, f, chi1 = np.broadcast_arrays(*arrays, chi2, chi1)

    mu_s = max(float(mu_s), _SMALLEST_SUN_COSINE)
    deep = y_f >= DEEPEST_FLOOR
    y_f = min(float(y_f), DEEPEST_FLOOR)

    gp = (chi1 - f) / (1 - f)
    bp = b * (1 - f)
    transport = bp * (1 - gp)
    smallest = _SMALLEST_DIFFUSE_DEPTH**2 / (3 * y_f * (1 + transport * y_f))
    a = np.maximum(a, _SMALLEST_ABSORPTION if deep else smallest)
    cp, c = a + bp, a + b
    S, ks = E / mu_s, cp / mu_s
    ct = 3 * (a + transport)
    k = np.sqrt(a * ct)
    h = k / ct

    detuning = k**2 - ks**2
    away = np.maximum(np.abs(detuning), _RESONANCE * ks**2)
    A = bp * (ct + 3 * gp * cp) * S / np.where(detuning > 0, away, -away)
    B = (a * A - bp * S) / ks
    Fx = bp * gp * S / (a + transport)

    # Surface: (1-R)E0/4 + (1+R)F/2 = E_sky.  Floor: (1-r)E0/4 - (1+r)F/2 = r E e^{-ks y_f}.
    top_along, top_against = (1 - R) / 4 + (1 + R) * h / 2, (1 - R) / 4 - (1 + R) * h / 2
    low_along, low_against = (1 - r) / 4 + (1 + r) * h / 2, (1 - r) / 4 - (1 + r) * h / 2
    sun_at_floor = np.exp(-ks * y_f)
    top = E_sky - (1 - R) * A / 4 - (1 + R) * B / 2
    low = (r * E - (1 - r) * A / 4 + (1 + r) * B / 2) * sun_at_floor
    if deep:
        C1, C2 = top / top_along, np.zeros_like(a)
    else:
        across = np.exp(-k * y_f)
        determinant = top_along * low_along - top_against * low_against * across**2
        C1 = (top * low_along - low * top_against * across) / determinant
        C2 = (low * top_along - top * low_against * across) / determinant
    return LightField(
        b=b, c=c, bp=bp, cp=cp, gp=gp, k=k, ks=ks, h=h, C1=C1, C2=C2, A=A, B=B, Fx=Fx,
        E=E, R=R, r=np.zeros_like(r) if deep else r, mu_s=mu_s, y_f=y_f,
    )  # fmt: skip
