"""Radiance of the water between the camera and what it sees: the closed form.

Directions are in Blender's axes (x, y horizontal, z up); depth is positive
down. Arguments broadcast against the bands: give arrays a last axis of 1. The
formulas are plain arithmetic over an injected :class:`.Mathematics`, so they
also build shader nodes.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..surface.refraction import fresnel_reflectance
from ..water.phase import BandPhase
from .aureole import Aureole, solve_aureole
from .light_field import LightField

FARTHEST = 1e7
"""Distance in m that stands for infinity along a level ray."""

_NEAR_ZERO = 0.25  # below it phi comes from its series
_STEP = math.exp(-_NEAR_ZERO)
_LOWEST_SUN = 0.1  # share of the sun's normal irradiance that a flat surface lets in, at 80°
_LEVEL = -0.01  # vertical component of a mirrored ray that would go up
# Directions of the upwelling light; more of them change it by less than 0.5 %.
_ELEVATIONS, _AZIMUTHS = 6, 8


def phi(x: Operand, m: Mathematics = NUMPY) -> Operand:
    """Return ``(1 - e^{-x})/x`` for x ≥ 0, stable in single precision.

    The series serves up to 0.25 and the exact difference beyond; the two are
    added, not chosen: each is constant where the other is valid.

    Examples
    --------
    >>> phi(np.array([0.0, 1.0])).round(6)
    array([1.      , 0.632121])
    """
    small, large = m.minimum(x, _NEAR_ZERO), m.maximum(x, _NEAR_ZERO)
    series = 1.0 / 5040.0
    for term in (720.0, 120.0, 24.0, 6.0, 2.0, 1.0):
        series = 1.0 / term - small * series
    return (_NEAR_ZERO * series + (_STEP - m.exp(-large))) / large


def attenuated_path(
    near: Operand,
    far: Operand,
    qP: Operand,
    P: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Return ``e^near G(q, P)``, the integral of ``e^{near - q v}`` over the path.

    Parameters
    ----------
    near, far : float or array
        Exponents at the camera and at the end of the path, far = near - q P.
    qP : float or array
        q P; q may have either sign.
    P : float or array
        Length of the path, m.
    m : Mathematics
        Elementary functions.

    Notes
    -----
    The larger exponent is taken out, so that nothing overflows for q < 0.
    """
    return P * m.exp(m.maximum(near, far)) * phi(m.absolute(qP), m)


def distance_in_water(
    y_o: Operand,
    w_y: Operand,
    y_f: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Distance from depth y_o along w to the surface or the floor, at most :data:`FARTHEST`."""
    # Each bound holds for one sign of w_y; at the other, and at zero, FARTHEST lifts it.
    to_surface = y_o / m.maximum(-w_y, 1e-7) + FARTHEST * m.clamp(1.0 + 1e7 * w_y, 0.0, 1.0)
    to_floor = m.maximum(y_f - y_o, 0.0) / m.maximum(w_y, 1e-7) + FARTHEST * m.clamp(
        1.0 - 1e7 * w_y, 0.0, 1.0
    )
    return m.minimum(m.minimum(to_surface, to_floor), FARTHEST)


def pixel_radiance(
    field: LightField,
    path: Operand,
    P: Operand,
    L_object: Operand,
    L_background: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance of a pixel: water, object, and the background scattered around it.

    Parameters
    ----------
    field : LightField
        The water.
    path : array
        :meth:`PathRadiance.path` up to the object.
    P : array
        Distance of the object, m.
    L_object : array
        Its radiance.
    L_background : array
        Radiance of the undisturbed water or floor beyond P. Light that is
        scattered forward between it and the camera blurs over the object.
    m : Mathematics
        Elementary functions.
    """
    return path + m.exp(-field.c * P) * L_object + veil(field, P, m) * L_background


def veil(field: LightField, P: Operand, m: Mathematics = NUMPY) -> Operand:
    """Share of the background that reaches the camera scattered forward, over distance P."""
    return m.maximum(m.exp(-field.cp * P) - m.exp(-field.c * P), 0.0)


def upwelling_irradiance(
    background: Callable[..., NDArray[np.float64]],
    y: ArrayLike,
) -> NDArray[np.float64]:
    """Upwelling irradiance: the radiance that comes from below, integrated.

    The two streams' own Eu holds over a bright floor. Where little light comes
    back it is off by tens of percent, and negative where absorption outweighs
    scattering; this one is as good as the radiance, and never negative.

    Parameters
    ----------
    background : callable
        Radiance at depth y along w: :meth:`PathRadiance.background`, or that of
        :class:`.InelasticLight`.
    y : float or array
        Depth, m; an array has a last axis of 1 for the bands.

    Returns
    -------
    array, shape (..., n)
        Gauss-Legendre over the cosine, evenly in azimuth.

    Examples
    --------
    >>> upwelling_irradiance(lambda y, w: np.array([1.0]) + 0.0 * w[2], 1.0).round(6)
    array([3.141593])
    """
    nodes, weights = np.polynomial.legendre.leggauss(_ELEVATIONS)
    azimuth = (np.arange(_AZIMUTHS) + 0.5) * (2.0 * math.pi / _AZIMUTHS)
    down, around = (x.ravel() for x in np.meshgrid((nodes + 1.0) / 2.0, azimuth, indexing="ij"))
    across = np.sqrt(1.0 - down**2)
    places = (slice(None), *[None] * max(np.ndim(y), 1))
    w = (across * np.cos(around), across * np.sin(around), -down)
    L = background(y, tuple(component[places] for component in w))
    return np.tensordot(np.repeat(weights, _AZIMUTHS) * down * math.pi / _AZIMUTHS, L, axes=1)


def surface_normal(
    slope_x: Operand,
    slope_y: Operand,
    m: Mathematics = NUMPY,
) -> tuple[Operand, Operand, Operand]:
    """Unit normal, upwards, of a surface with these slopes."""
    z = 1.0 / m.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return -slope_x * z, -slope_y * z, z


def _dot(one: Sequence[Operand], other: Sequence[Operand]) -> Operand:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


@dataclass(frozen=True, eq=False)
class PathRadiance:
    """The closed form for a camera in water; make it with :func:`solve_path_radiance`.

    Attributes
    ----------
    field : LightField
        Light field of the n bands.
    phase : BandPhase
        Phase function of the n bands.
    aureole : Aureole
        Spread of the sun at the depth of the camera.
    sun : sequence of 3
        Unit direction the sunlight travels to in the water.
    """

    field: LightField
    phase: BandPhase
    aureole: Aureole
    sun: Sequence[Operand]

    def astype(self, dtype: DTypeLike) -> PathRadiance:
        """Return the coefficients in another floating-point precision."""
        cast = np.dtype(dtype).type
        return dataclasses.replace(
            self,
            field=self.field.astype(dtype),
            phase=dataclasses.replace(self.phase, weights=cast(self.phase.weights)),
            aureole=self.aureole.astype(dtype),
            sun=cast(self.sun),
        )

    def path(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance of the water between depth y_o and distance P.

        Parameters
        ----------
        y_o : float or array
            Depth of the camera, m.
        w : three floats or arrays
            Components of the unit view direction, away from the camera, z up.
        P : float or array
            Length of the path, m; ends at the surface or the floor.
        m : Mathematics
            Elementary functions.

        Returns
        -------
        array, shape (..., n)
            In units of E per steradian, never negative.
        """
        f = self.field
        w_y = -w[2]
        P = m.minimum(P, distance_in_water(y_o, w_y, f.y_f, m))
        y_e = m.clamp(y_o + w_y * P, 0.0, f.y_f)
        cpP = f.cp * P
        sun, down, up = self._source(w, m)
        return m.maximum(
            sun * attenuated_path(
                -f.ks * y_o, -f.ks * y_e - cpP, (f.cp + f.ks * w_y) * P, P, m
            )
            + down * attenuated_path(
                -f.k * y_o, -f.k * y_e - cpP, (f.cp + f.k * w_y) * P, P, m
            )
            + up * attenuated_path(
                -f.k * (f.y_f - y_o), -f.k * (f.y_f - y_e) - cpP, (f.cp - f.k * w_y) * P, P, m
            ),
            0.0,
        )  # fmt: skip

    def background(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        L_surface: Operand = 0.0,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance L(∞) of the undisturbed water with its floor or surface behind.

        Parameters
        ----------
        y_o : float or array
            Depth it is seen from, m.
        w : three floats or arrays
            View direction, as in :meth:`path`.
        L_surface : float or array
            Radiance that comes down from the surface against w.
        m : Mathematics
            Elementary functions.
        """
        f = self.field
        w_y = -w[2]
        P = distance_in_water(y_o, w_y, f.y_f, m)
        looks_up = m.less(w_y, 0.0)
        end = m.select(looks_up, L_surface, f.floor_radiance(m))
        return self.path(y_o, w, P, m) + m.exp(-f.cp * P) * end

    def under_surface(
        self,
        w: Sequence[Operand],
        L_sky: Operand,
        relative_index: float,
        m: Mathematics = NUMPY,
        slopes: tuple[Operand, Operand] | None = None,
    ) -> Operand:
        """Radiance just below the surface, looking up along w.

        The sky inside Snell's window and the mirrored water outside it.

        Parameters
        ----------
        w : three floats or arrays
            View direction, as in :meth:`path`; z > 0.
        L_sky : float or array
            Radiance of the sky, in air, where the refracted ray meets it.
        relative_index : float
            Index of the water against air, n; the radiance gains a factor n².
        m : Mathematics
            Elementary functions.
        slopes : two floats or arrays, optional
            Slopes of the surface along x and y where w meets it; flat without.
        """
        n2 = relative_index * relative_index
        if slopes is None:
            cosine = m.maximum(w[2], 0.0)
            reflected = (w[0], w[1], -cosine)
        else:
            normal = surface_normal(*slopes, m)
            cosine = m.maximum(_dot(w, normal), 0.0)
            x, y, z = (a - 2.0 * cosine * b for a, b in zip(w, normal, strict=True))
            # A steep wave mirrors what lies level; a second reflection is left out.
            reflected = (x, y, m.minimum(z, _LEVEL))
        reflectance = fresnel_reflectance(cosine, 1.0 / relative_index, m)
        mirrored = self.background(0.0 * w[2], reflected, m=m)
        return (1.0 - reflectance) * n2 * L_sky + reflectance * mirrored

    def sun_glitter(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        relative_index: Operand,
        width2: Operand,
        slopes: tuple[Operand, Operand],
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance of the sun's image just below the waves, looking up along w.

        The solid angle over which the sun appears is a Gaussian one, so that no
        pixel misses it. Seen through water that keeps ``e^{-cp P}`` of it, it
        comes out attenuated by ``e^{-c P}``: forward scattering takes it away.

        Parameters
        ----------
        y_o : float or array
            Depth of the camera, m.
        w : three floats or arrays
            View direction, as in :meth:`path`; z > 0.
        relative_index : float
            Index of the water against air.
        width2 : float
            Mean squared angle, in air, of the sun's disc and of the waves that the
            slopes leave out; positive.
        slopes : two floats or arrays
            Slopes of the surface along x and y where w meets it.
        m : Mathematics
            Elementary functions.
        """
        f, n, n2 = self.field, relative_index, relative_index * relative_index
        normal = surface_normal(*slopes, m)
        inside = m.maximum(_dot(w, normal), 0.0)
        outside = m.sqrt(m.maximum(1.0 - n2 * (1.0 - inside * inside), 0.0))
        air = [n * a + (outside - n * inside) * b for a, b in zip(w, normal, strict=True)]
        sx, sy = n * self.sun[0], n * self.sun[1]
        high = m.sqrt(m.maximum(1.0 - sx * sx - sy * sy, 1e-6))
        x, y, z = air[0] + sx, air[1] + sy, air[2] - high
        image = m.exp(-m.minimum((x * x + y * y + z * z) / width2, 80.0)) / (math.pi * width2)
        through = 1.0 - fresnel_reflectance(inside, 1.0 / n, m)
        # A sun at the horizon lights tilted waves out of all proportion to E: held.
        entered = m.maximum(high * (1.0 - fresnel_reflectance(high, n, m)), _LOWEST_SUN)
        P = m.minimum(y_o / m.maximum(w[2], 1e-4), FARTHEST)
        return image * through * n2 / entered * f.E * m.exp((f.cp - f.c) * P)

    def single_scattering(
        self,
        y_o: Operand,
        w: Sequence[Operand],
        P: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Radiance of sunlight scattered once, unshadowed.

        Subtract it from :meth:`path` where shafts of light are drawn apart.
        """
        f = self.field
        w_y = -w[2]
        P = m.minimum(P, distance_in_water(y_o, w_y, f.y_f, m))
        y_e = m.clamp(y_o + w_y * P, 0.0, f.y_f)
        cs = f.c / f.mu_s
        return self._sun_source(w, m) * attenuated_path(
            -cs * y_o, -cs * y_e - f.c * P, (f.c + cs * w_y) * P, P, m
        )  # fmt: skip

    def single_scattering_at(
        self,
        y: Operand,
        w: Sequence[Operand],
        v: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Integrand of :meth:`single_scattering` at depth y and distance v, per metre."""
        f = self.field
        return self._sun_source(w, m) * m.exp(-f.c * (y / f.mu_s + v))

    def _sun_source(self, w: Sequence[Operand], m: Mathematics) -> Operand:
        """Sunlight scattered once towards the camera, per metre, before any attenuation."""
        f = self.field
        return f.b * self.phase.per_steradian(self._s2(w, m), m) * f.E / f.mu_s

    def _s2(self, w: Sequence[Operand], m: Mathematics) -> Operand:
        """Squared sine of half the angle by which sunlight turns to reach the camera."""
        x, y, z = (w[i] + self.sun[i] for i in range(3))
        return m.clamp((x * x + y * y + z * z) / 4.0, 1e-14, 1.0)

    def _source(self, w: Sequence[Operand], m: Mathematics) -> tuple[Operand, Operand, Operand]:
        """Strength m1, m2, m3 of the three exponentials of depth along w."""
        f = self.field
        w_y = -w[2]
        s2 = self._s2(w, m)
        cosine = 1.0 - 2.0 * s2
        spread = self.aureole.spread(self.phase.per_steradian(s2, m), s2, m)
        diffuse = f.bp / (4.0 * math.pi)
        tilt = 3.0 * f.gp * w_y
        sideways = 3.0 * f.gp * f.Fx * (cosine + w_y * f.mu_s)
        return (
            f.b * spread * f.E / f.mu_s + diffuse * (f.A - tilt * f.B + sideways),
            diffuse * f.C1 * (1.0 - tilt * f.h),
            diffuse * f.C2 * (1.0 + tilt * f.h),
        )


def solve_path_radiance(
    field: LightField, phase: BandPhase, y_o: float, sun: ArrayLike
) -> PathRadiance:
    """Prepare the closed form for a camera.

    Parameters
    ----------
    field : LightField
        Of the water.
    phase : BandPhase
        Its phase function, the one the field was solved with.
    y_o : float
        Depth of the camera, m: it sets how far the sun is spread.
    sun : array_like, shape (3,)
        Unit direction that sunlight travels to in the water, z up.

    Returns
    -------
    PathRadiance

    Raises
    ------
    InputError
        If the camera is not between surface and floor.

    Examples
    --------
    >>> from ..water.phase import parse_phase
    >>> from .light_field import solve_light_field
    >>> phase = parse_phase("hg:0.8").for_bands([0.1])
    >>> field = solve_light_field([0.05], [0.1], phase.chi1, phase.chi2, [1.0], 1.0, r=0.2, y_f=9)
    >>> water = solve_path_radiance(field, phase, 5.0, (0, 0, -1))
    >>> water.path(5.0, (1.0, 0.0, 0.0), 2.0).round(4)
    array([0.0036])
    """
    if not 0 <= y_o <= field.y_f:
        raise InputError(
            f"the camera is at depth {y_o:g} m, but the water reaches from 0 to {field.y_f:g} m; "
            "move the camera or the floor"
        )
    direction: NDArray[np.float64] = np.asarray(sun, dtype=np.float64)
    return PathRadiance(field, phase, solve_aureole(field.b, phase, y_o, field.mu_s), direction)
