"""The water seen from above, and objects in the air over it.

A camera in air that looks down sees the sky mirrored by the surface, and through it the light
that comes up: the radiance just below it along the refracted ray, of which the surface lets
1 - R pass and which loses the factor n² that it has in the water.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.refraction import fresnel_reflectance, seen_from_air
from .radiance_field import Ripples, upwelling_irradiance
from .solved_field import SolvedField
from .water_column import WaterColumn

_STEEPEST, _FLATTEST = 0.3, 0.02  # cosines of facets to the level, and of views to the surface
_LOWEST_VIEW = 0.25  # downward component of a view for which the sun is turned
_MOST_TURN = 3.0  # factor on the sun's cosine, close to where an object turns away from it


def leaving_fraction(reflectance: Operand, relative_index: Operand) -> Operand:
    """Fraction (1 - R)/n² of the radiance below the surface that is left above it."""
    return (1.0 - reflectance) / (relative_index * relative_index)


@dataclass(frozen=True, eq=False)
class LightInAir:
    """Sun and sky above the water."""

    sun: Operand  #: Irradiance on a plane across the sunlight, (n,).
    sky: Operand  #: Irradiance of the sky on a level plane, (n,).
    mirrored: Operand  #: Fraction of the sky's irradiance that the water sends back up.
    level: Operand = 0.0  #: Of the sky's radiance, see :class:`.Sky`, (n,).
    #: Fraction of the sun's irradiance that the water sends on, as a mirror does.
    sun_mirrored: Operand = 0.0
    #: Irradiance, on a level plane that looks down, of the light that comes out of the water, (n,).
    leaving: Operand = 0.0

    def reflected(
        self,
        sun_response: Operand,
        albedo: Operand,
        turned: Operand,
        up: Operand,
        facing: Operand = 0.0,
    ) -> Operand:
        """Radiance that a patch reflects.

        What comes from the water has no shadows; the sky mirrored in it, and the light out of it,
        count as even over its half of the view. ``sun_response`` is its radiance per normal
        irradiance of a sun in another direction, shadows included.
        """
        above, below = 0.5 + 0.5 * up, 0.5 - 0.5 * up
        diffuse = (above + below * self.mirrored) * self.sky + below * self.leaving
        diffuse = diffuse + facing * self.sun_mirrored * self.sun
        return sun_response * turned * self.sun + albedo / math.pi * diffuse


def facing_mirrored(
    normal: Sequence[Operand], sun: Sequence[Operand], m: Mathematics = NUMPY
) -> Operand:
    """Cosine of a patch to the sun that a level surface mirrors; ``sun`` travels so in air."""
    return m.maximum(normal[2] * sun[2] - normal[0] * sun[0] - normal[1] * sun[1], 0.0)


def leaving_irradiance(field: SolvedField, relative_index: float) -> NDArray[np.float64]:
    """Irradiance, on a level plane above, of the light that comes out through a level surface."""

    def leaving(y: Operand, v: Sequence[Operand]) -> Operand:
        R, w, _ = seen_from_air(v, (0.0, 0.0, 1.0), relative_index)
        along = [np.ravel(component) for component in w]  # the field has an axis of bands itself
        return leaving_fraction(R, relative_index) * field.radiance(y, along)

    return upwelling_irradiance(leaving, 0.0)


def light_in_air(column: WaterColumn, field: SolvedField | None = None) -> LightInAir:
    """Return the light above the water of a column.

    ``field`` is the light in it, if what comes up from there is wanted.
    """
    sky, surface, high = column.skylight, column.mean_surface, -float(column.skylight.sun[2])
    lets_in, mirrored, leaving = 1.0, 0.0, np.zeros_like(column.sun_irradiance)
    if field is not None:
        leaving = leaving_irradiance(field, surface.refractive_index if surface else 1.0)
    if surface is not None:
        lets_in = 1.0 - float(surface.reflectance(high))
        mirrored = 1.0 - sky.transmittance(surface)
    sun: NDArray[np.float64] = column.sun_irradiance / (lets_in * max(high, 1e-3))
    sky_irradiance = math.pi * column.sky_radiance
    # A sky of several spectra has no one level.
    level = sky.level if column.sky_picture is None else column.sky_radiance
    return LightInAir(sun, sky_irradiance, mirrored, level, 1.0 - lets_in, leaving)


def turned_sun(cosine: Operand, other: Operand, m: Mathematics = NUMPY) -> Operand:
    """Factor on the light of a sun whose cosine on a patch is ``other`` but should be ``cosine``.

    Examples
    --------
    >>> float(turned_sun(0.8, 0.5))
    1.6
    """
    return m.minimum(m.maximum(cosine, 0.0) / m.maximum(other, 1e-3), _MOST_TURN)


def glitter_from_above(
    sun_irradiance: Operand,
    view: Sequence[Operand],
    ripples: Ripples,
    relative_index: Operand,
    sun_disc2: float,
    m: Mathematics = NUMPY,
) -> Operand:
    """Radiance of the sun's image on the waves, seen from the air.

    Facets whose slopes mirror the sun into the eye, by their fraction of the surface that is seen:
    the finer waves' slopes are Gaussian about those of the surface there.

    ``sun_irradiance`` is across the sunlight, in air; ``view`` is a unit vector away from the
    camera, z < 0; ``ripples`` has the direction of sunlight in air; ``sun_disc2`` is the mean
    squared angle of the sun's disc, rad².

    C. Cox & W. Munk, J. Opt. Soc. Am. 44, 838 (1954): R E p / (4 cos θ cos⁴ β).
    """
    sun, n = ripples.sun, relative_index
    assert sun is not None, "the sun in air is known"
    # A mirrored ray turns by twice the angle of a facet.
    width2 = (ripples.glitter_width - sun_disc2) / ((n - 1.0) * (n - 1.0)) + sun_disc2 / 4.0
    x, y, z = (-a - b for a, b in zip(view, sun, strict=True))
    length = m.sqrt(m.maximum(x * x + y * y + z * z, 1e-9))
    x, y, up = x / length, y / length, m.maximum(z / length, _STEEPEST)
    away_x, away_y = -x / up - ripples.slopes[0], -y / up - ripples.slopes[1]
    off = (away_x * away_x + away_y * away_y) / width2
    fraction = m.exp(-m.minimum(off, 80.0)) / (math.pi * width2)
    reflectance = fresnel_reflectance(m.maximum(-dot((x, y, up), view), 0.0), n, m)
    # What is seen of the surface there, over its area on the level.
    seen = view[0] * ripples.slopes[0] + view[1] * ripples.slopes[1] - view[2]
    shown = 4.0 * m.maximum(seen, _FLATTEST) * up * up * up * up
    return m.less(0.0, ripples.glitter) * reflectance * fraction * sun_irradiance / shown


def flattened_sun(
    sun: Sequence[float], towards: Sequence[float], relative_index: float
) -> NDArray[np.float64]:
    """Direction of the sun for objects that are drawn where they seem to lie from the air.

    Shadows of objects that seem to lie k times as deep fall right if the sun comes down k times as
    far. That is exact on the camera's axis, where k is taken.

    ``sun`` is the unit direction of the light in the water, ``towards`` that to where the camera
    looks.
    """
    down = float(np.clip(-towards[2], _LOWEST_VIEW, 1.0))
    inside = math.sqrt(1.0 - (1.0 - down * down) / relative_index**2)
    flattened = np.array([sun[0], sun[1], sun[2] * down / (relative_index * inside)])
    return flattened / np.linalg.norm(flattened)
