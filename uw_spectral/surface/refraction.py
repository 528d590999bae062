"""Light through the water surface: Snell's law and Fresnel reflectance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand, dot

REFRACTIVE_INDEX = 1.34
"""Of seawater against air in the visible."""

_LEVEL = 0.01  # vertical component of a ray that is mirrored down from above
_NEWTON = 6  # steps: within 0.01° for 99.9 % of places
_NEAR, _MATCHED = 1e-5, 1e-6


# X. Quan & E. S. Fry, Appl. Opt. 34, 3477 (1995): what they fit lies within these, but for the
# wavelengths, which P. D. T. Huibers, Appl. Opt. 36, 3785 (1997) found to hold from 200 to 1100 nm.
_FITTED = {"wavelength": (200.0, 1100.0), "salinity": (0.0, 40.0), "temperature": (0.0, 30.0)}


def refractive_index_QuanFry1995(
    wavelength: ArrayLike, salinity: ArrayLike = 35.0, temperature: ArrayLike = 20.0
) -> NDArray[np.float64]:
    """Refractive index of seawater against air, at atmospheric pressure.

    Pictures are made with one index, :data:`REFRACTIVE_INDEX`, for all wavelengths:
    docs/measured/refractive_index.md measures what that leaves out.

    Wavelengths from 200 to 1100 nm, measured from 400 to 700; salinity 0 to 40 g/kg, temperature 0
    to 30 °C.

    X. Quan & E. S. Fry, Appl. Opt. 34, 3477 (1995): within 1.5e-5 of Austin & Halikas (1976).

    Raises
    ------
    InputError
        If one is out of its range.
    """
    given = {"wavelength": wavelength, "salinity": salinity, "temperature": temperature}
    values = {name: np.asarray(value, dtype=np.float64) for name, value in given.items()}
    for name, (low, high) in _FITTED.items():
        if not np.all((values[name] >= low) & (values[name] <= high)):
            raise InputError(
                f"refractive index of seawater: the {name} must be {low:g} to {high:g}, got "
                f"{np.ravel(values[name]).tolist()}"
            )
    nm, S, T = values.values()
    n = 1.31405 + (1.779e-4 - 1.05e-6 * T + 1.6e-8 * T**2) * S - 2.02e-6 * T**2
    n = n + (15.868 + 0.01155 * S - 0.00423 * T) / nm
    return n - 4382 / nm**2 + 1.1455e6 / nm**3


def in_water_cosine(zenith: ArrayLike, refractive_index: float = REFRACTIVE_INDEX) -> NDArray:
    """Cosine of the in-water sun zenith angle, μs, by that in air in degrees, 0 to 90.

    Raises
    ------
    InputError
        If the sun is below the horizon or the index below 1.
    """
    zenith = np.asarray(zenith, dtype=np.float64)
    if not (np.all(zenith >= 0) and np.all(zenith <= 90)):
        raise InputError(f"sun zenith must be 0 to 90 degrees, got {np.ravel(zenith).tolist()}")
    if not (np.isfinite(refractive_index) and refractive_index >= 1):
        raise InputError(f"refractive index must be at least 1, got {refractive_index:g}")
    cosine = np.cos(np.radians(zenith))
    # n² - sin² as a sum of positive terms: exact at grazing incidence and for n = 1.
    return np.sqrt(cosine**2 + (refractive_index**2 - 1)) / refractive_index


def sun_travel_direction(
    zenith: float, azimuth: float, refractive_index: float = REFRACTIVE_INDEX
) -> NDArray[np.float64]:
    """Unit direction that sunlight travels to in the water, z up, shape (3,).

    The zenith angle is that in air; the azimuth that of the light's way, from +x towards +y, both
    in degrees. An index of 1 gives the direction in air.
    """
    cosine = float(in_water_cosine(zenith, refractive_index))
    sine = np.sin(np.radians(zenith)) / refractive_index
    turn = np.radians(azimuth)
    return np.array([sine * np.cos(turn), sine * np.sin(turn), -cosine])


def direction_in_air(
    w: Sequence[Operand],
    normal: Sequence[Operand],
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> tuple[Operand, Operand, Operand]:
    """Direction in air of light that travels along w in the water, out of it or into it.

    The normal is on the side that w points to. Where the reflection is total the direction is
    finite, but without meaning.
    """
    n = relative_index
    inside = m.maximum(dot(w, normal), 0.0)
    outside = m.sqrt(m.maximum(1.0 - n * n * (1.0 - inside * inside), 0.0))
    x, y, z = (n * a + (outside - n * inside) * b for a, b in zip(w, normal, strict=True))
    return x, y, z


def fresnel_reflectance(
    cosine: Operand,
    relative_index: Operand = REFRACTIVE_INDEX,
    m: Mathematics = NUMPY,
) -> Operand:
    """Fresnel reflectance of unpolarised light at a flat interface.

    ``cosine`` is that of the angle of incidence, 0 to 1; ``relative_index`` the index beyond the
    interface over that before it: n from air into water, 1/n from water into air (1 where the
    reflection is total).
    """
    n2 = relative_index * relative_index
    incident = m.clamp(cosine, 1e-7, 1.0)  # not 0, which is 0/0 between equal indices
    # n cos(refracted) = sqrt(n² - sin²); below zero the reflection is total.
    refracted = m.sqrt(m.maximum(incident * incident + (n2 - 1.0), 0.0))
    perpendicular = (incident - refracted) / (incident + refracted)
    parallel = (n2 * incident - refracted) / (n2 * incident + refracted)
    return 0.5 * (perpendicular * perpendicular + parallel * parallel)


def is_in_window(
    cosine: Operand, relative_index: Operand = REFRACTIVE_INDEX, m: Mathematics = NUMPY
) -> Operand:
    """1 for rays up that leave the water through a flat surface, 0 for those wholly mirrored.

    ``cosine`` is the upward component of the unit direction.
    """
    n = relative_index
    return m.less(m.sqrt(m.maximum(1.0 - 1.0 / (n * n), 0.0)), cosine)


def mirrored_direction(v: Sequence[Operand], normal: Sequence[Operand]) -> list[Operand]:
    """Direction in which a ray along v goes on from a mirror with a unit normal.

    Examples
    --------
    >>> mirrored_direction((0.0, 1.0, 0.0), (0.0, -1.0, 0.0))
    [0.0, -1.0, 0.0]
    """
    twice = 2.0 * dot(v, normal)
    return [a - twice * b for a, b in zip(v, normal, strict=True)]


def seen_from_air(
    v: Sequence[Operand],
    normal: Sequence[Operand],
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> tuple[Operand, tuple[Operand, ...], tuple[Operand, ...]]:
    """What a view ray v, z < 0, becomes that meets the water from above: three values.

    Fresnel reflectance; unit directions of the ray in the water, and of the one that is mirrored
    up.
    """
    n = relative_index
    cosine = m.maximum(-dot(v, normal), 0.0)
    inside = m.sqrt(1.0 - (1.0 - cosine * cosine) / (n * n))
    refracted = [a / n + (cosine / n - inside) * b for a, b in zip(v, normal, strict=True)]
    x, y, z = (a + 2.0 * cosine * b for a, b in zip(v, normal, strict=True))
    # A steep wave mirrors what lies level; a second reflection is left out.
    mirrored = x, y, m.maximum(z, _LEVEL)
    return fresnel_reflectance(cosine, n, m), tuple(refracted), mirrored


def apparent_depth(
    distance: Operand,
    depth: Operand,
    height: Operand,
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Depth at which an object under a flat surface seems to lie, seen from the air.

    It is that of the point straight above the object, or below it, on the ray that arrives, drawn
    on without refraction.

    Distances in m: horizontal from the camera; the object's depth and the camera's height,
    positive.
    """
    fraction = fraction_in_air(distance, depth, height, relative_index, m)
    return height * (1.0 - fraction) / fraction


def apparent_height(
    distance: Operand,
    height: Operand,
    depth: Operand,
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Height at which an object over a flat surface seems to be, seen from the water.

    As :func:`apparent_depth`, the other way: it lies on the straight line on which the refracted
    ray reaches the eye. What is just above the surface seems to stand on the rim of Snell's window
    where it is farther away than the window reaches on the surface.
    """
    fraction = fraction_in_air(distance, depth, height, relative_index, m)
    return lifted_height(depth, fraction, m)


def lifted_height(depth: Operand, fraction: Operand, m: Mathematics = NUMPY) -> Operand:
    """Height of :func:`apparent_height` for an eye at a depth, by what :func:`fraction_in_air` is.

    Examples
    --------
    >>> float(lifted_height(2.0, 0.5))
    2.0
    """
    return depth * fraction / m.maximum(1.0 - fraction, _MATCHED)


def fraction_in_air(
    distance: Operand,
    depth: Operand,
    height: Operand,
    relative_index: Operand,
    m: Mathematics = NUMPY,
) -> Operand:
    """Fraction of the horizontal distance between two points that light goes in the air.

    The place of refraction is found by Newton's method, from the nearer of two bounds: a point
    high above, and the critical angle.

    ``depth`` and ``height`` are those of the point in the water and of the one in the air, m,
    positive.
    """
    n = relative_index
    farthest = depth / m.sqrt(n * n - 1.0 + _MATCHED)  # that a ray turns to the side in the water
    least = m.maximum(1.0 - farthest / m.maximum(distance, _NEAR), _NEAR)
    fraction = m.maximum(n * height / (n * height + depth), least)  # of the distance, in air
    d2, h2, y2 = distance * distance, height * height, depth * depth
    for _ in range(_NEWTON):
        rest = 1.0 - fraction
        air, water = fraction * fraction * d2 + h2, rest * rest * d2 + y2
        root_air, root_water = m.sqrt(air), m.sqrt(water)
        error = fraction / root_air - n * rest / root_water
        slope = h2 / (air * root_air) + n * y2 / (water * root_water)
        fraction = m.clamp(fraction - error / slope, least, 1.0)
    return fraction


def index_in_water(n: Operand, water: Operand, z: Operand, m: Mathematics = NUMPY) -> Operand:
    """Refractive index of a material against what is around it.

    Against water it mirrors less, and bends light less, than against air: glass of 1.5 mirrors
    .4 % at normal incidence instead of 4 %. An index below 1 has been given against a denser
    medium already, and stays.

    ``n`` and ``water`` are against air, ``z`` is the height above the water surface, m.
    """
    against_air = m.less(n, 1.0)
    return n / m.select(m.less(z, 0.0) * (1.0 - against_air), water, 1.0)


def opaque_index_in_water(
    n: Operand, water: Operand, z: Operand, m: Mathematics = NUMPY
) -> Operand:
    """Refractive index of an opaque material against what is around it.

    As :func:`index_in_water`, but water makes it no thinner than itself: an index of 1, which
    many files give to what has no gloss, would mirror all that comes in at a flat angle.
    """
    return m.maximum(index_in_water(n, water, z, m), m.minimum(n, 1.0))


def length_in_water(d: Operand, water: Operand, z: Operand, m: Mathematics = NUMPY) -> Operand:
    """Thickness that counts as many wavelengths in air as the given one does where it lies.

    Parameters as of :func:`index_in_water`; ``d`` in any unit of length.

    Examples
    --------
    >>> length_in_water(500.0, 1.34, -3.0).item()
    670.0
    """
    return d * m.select(m.less(z, 0.0), water, 1.0)
