"""What every model of the light in unoccluded water answers, and what follows from it alone.

Directions are in Blender's axes (x, y horizontal, z up); depth is positive down.
Arguments broadcast against the bands: give arrays a last axis of 1. The formulas are
plain arithmetic over an injected :class:`.Mathematics`, so they also build shader nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.refraction import direction_in_air, fresnel_reflectance

FARTHEST = 1e7
"""Distance in m that stands for infinity along a level ray."""

_LOWEST_SUN = 0.1  # fraction of the sun's normal irradiance that a flat surface lets in, at 80°
_LEVEL = -0.01  # vertical component of a mirrored ray that would go up
# Directions of the upwelling light; more of them change it by less than 0.5 %.
_ELEVATIONS, _AZIMUTHS = 6, 8


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


def upwelling_irradiance(
    radiance: Callable[..., NDArray[np.float64]],
    y: ArrayLike,
) -> NDArray[np.float64]:
    """Upwelling irradiance: the radiance that comes from below, integrated.

    By Gauss-Legendre over the cosine, evenly in azimuth, so never negative, as the two streams' own
    Eu is where absorption outweighs scattering. ``radiance`` is at depth y, m, along w; an array of
    depths has a last axis of 1 for the bands. Shape (..., n).
    """
    nodes, weights = np.polynomial.legendre.leggauss(_ELEVATIONS)
    azimuth = (np.arange(_AZIMUTHS) + 0.5) * (2.0 * math.pi / _AZIMUTHS)
    down, around = (x.ravel() for x in np.meshgrid((nodes + 1.0) / 2.0, azimuth, indexing="ij"))
    across = np.sqrt(1.0 - down**2)
    places = (slice(None), *[None] * max(np.ndim(y), 1))
    w = (across * np.cos(around), across * np.sin(around), -down)
    L = radiance(y, tuple(component[places] for component in w))
    return np.tensordot(np.repeat(weights, _AZIMUTHS) * down * math.pi / _AZIMUTHS, L, axes=1)


@dataclass(frozen=True, eq=False)
class Ripples:
    """The moving surface where a view ray meets it."""

    slopes: tuple[Operand, Operand]  #: Along x and y.
    #: Mean squared angle, in air, of the sun's disc and of the waves that the slopes leave out;
    #: positive, rad².
    glitter_width: Operand
    glitter: Operand = 1.0  #: Factor on the sun's image; 1 is physical.
    #: Direction that sunlight travels to in air; that of the water's beam below a level surface
    #: without.
    sun: Sequence[Operand] | None = None


def surface_normal(
    slope_x: Operand,
    slope_y: Operand,
    m: Mathematics = NUMPY,
) -> tuple[Operand, Operand, Operand]:
    """Unit normal, upwards, of a surface with these slopes."""
    z = 1.0 / m.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return -slope_x * z, -slope_y * z, z


def mirrored_ray(
    w: Sequence[Operand],
    m: Mathematics = NUMPY,
    slopes: tuple[Operand, Operand] | None = None,
) -> tuple[Operand, tuple[Operand, Operand, Operand]]:
    """Cosine at which a ray meets the surface from below, and its direction from there on.

    ``w`` is a unit vector away from the camera, ``slopes`` are along x and y; flat without.
    """
    if slopes is None:
        cosine = m.maximum(w[2], 0.0)
        return cosine, (w[0], w[1], -cosine)
    cosine, (x, y, z) = tilted_mirror(w, surface_normal(*slopes, m), m)
    # A steep wave mirrors what lies level; a second reflection is left out.
    return cosine, (x, y, m.minimum(z, _LEVEL))


def tilted_mirror(
    w: Sequence[Operand], normal: Sequence[Operand], m: Mathematics = NUMPY
) -> tuple[Operand, tuple[Operand, Operand, Operand]]:
    """Cosine at which a ray meets a facet, and its direction after it is mirrored."""
    cosine = m.maximum(dot(w, normal), 0.0)
    x, y, z = (a - 2.0 * cosine * b for a, b in zip(w, normal, strict=True))
    return cosine, (x, y, z)


def sky_and_mirrored(
    cosine: Operand,
    L_sky: Operand,
    L_mirrored: Operand,
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance just below the surface of a ray that meets it from below at a cosine."""
    reflectance = fresnel_reflectance(cosine, 1.0 / relative_index, m)
    n2 = relative_index * relative_index
    return (1.0 - reflectance) * n2 * L_sky + reflectance * L_mirrored


def sun_image(
    sun: Sequence[Operand],
    w: Sequence[Operand],
    relative_index: Operand,
    ripples: Ripples,
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance of the sun's image just below the waves, per its irradiance there, looking up.

    The solid angle over which the sun appears is a Gaussian one, so that no pixel misses it.

    ``w`` is a unit vector away from the camera, z > 0; ``sun`` the direction of sunlight in the
    water.
    """
    n, n2 = relative_index, relative_index * relative_index
    normal = surface_normal(*ripples.slopes, m)
    inside = m.maximum(dot(w, normal), 0.0)
    air = direction_in_air(w, normal, n, m)
    sx, sy = (n * sun[0], n * sun[1]) if ripples.sun is None else ripples.sun[:2]
    high = m.sqrt(m.maximum(1.0 - sx * sx - sy * sy, 1e-6))
    x, y, z = air[0] + sx, air[1] + sy, air[2] - high
    width2 = ripples.glitter_width
    image = m.exp(-m.minimum((x * x + y * y + z * z) / width2, 80.0)) / (math.pi * width2)
    through = 1.0 - fresnel_reflectance(inside, 1.0 / n, m)
    # A sun at the horizon lights tilted waves out of all proportion to E: held.
    entered = m.maximum(high * (1.0 - fresnel_reflectance(high, n, m)), _LOWEST_SUN)
    return image * through * n2 / entered * ripples.glitter
