"""How far one sees, and how far the light reaches down."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..spectra.sensor import standard_observer
from ..transfer.water_column import WaterColumn
from ..water.named import parse_uniform_water
from ..water.optical_properties import JERLOV_SOURCES
from ..water.phase import BandPhase
from .viewpoint import Viewpoint

LIMINAL_CONTRAST = 0.02
"""Smallest contrast that counts as visible."""
_GREEN = 550.0  # nm
_DEEPEST = 1e6  # m from which on light is said never to end
_SECANTS, _CLOSE = 12, 1e-3
_SHORT = 1e-3  # optical length over which a slope is taken


def sighting_range(
    c: ArrayLike, background: ArrayLike, contrast: float = LIMINAL_CONTRAST
) -> float:
    """Distance, m, at which a black target fades into the water, looking level.

    The difference between the radiance of a target and of the water behind it decays as e^{-c r} in
    every band. Weighted with the background as the eye sees it, a black target keeps the contrast
    Σ w e^{-c r} / Σ w; r is where that falls to ``contrast``. For one c it is -ln(contrast)/c,
    3.91/c at 2 %.

    ``background`` is the radiance times the luminous efficiency, per band; where no weighted band
    attenuates, the range is infinite.

    S. Q. Duntley, J. Opt. Soc. Am. 53, 214 (1963); J. R. V. Zaneveld &
    W. S. Pegau, Opt. Express 11, 2997 (2003), who find 4.8/c for divers' eyes.

    Raises
    ------
    InputError
        If no weight is positive, or the contrast is out of its domain.
    """
    if not 0 < contrast < 1:
        raise InputError(f"visible contrast must lie between 0 and 1, got {contrast:g}")
    weights = np.maximum(np.asarray(background, dtype=np.float64), 0.0)
    attenuation = np.asarray(c, dtype=np.float64)
    total = weights.sum()
    if not (np.isfinite(total) and total > 0):
        raise InputError("visibility: there is no light to see by; move the camera up")
    attenuation, weights = attenuation[weights > 0], weights[weights > 0] / total
    if not attenuation.min() > 0:
        return math.inf
    # The logarithm of the contrast is convex and falls, so Newton's steps from 0 never overshoot.
    distance, excess = 0.0, -math.log(contrast)
    while excess > 1e-9:
        transmittance = weights * np.exp(-attenuation * distance)
        excess = math.log(transmittance.sum() / contrast)
        distance += excess * transmittance.sum() / (transmittance @ attenuation)
    return float(distance)


def visibility_by_source(water_type: str) -> dict[str, float]:
    """Sighting range in m at 550 nm, of a Jerlov type by each publication that has it.

    Examples
    --------
    >>> {name: round(metres, 1) for name, metres in visibility_by_source("II").items()}
    {'solonenko2015': 9.3, 'williamson2022': 15.7}
    """
    found = {}
    for source in JERLOV_SOURCES:
        try:
            c = parse_uniform_water(f"jerlov:{water_type}", source).c([_GREEN])
        except InputError:
            continue  # too few measurements of that type
        found[source] = sighting_range(c, [1.0])
    return found


def horizontal_visibility(view: Viewpoint, contrast: float = LIMINAL_CONTRAST) -> float:
    """Sighting range in m of a black target before the open water, for the eye.

    :func:`sighting_range` with the CIE 1931 luminous efficiency.

    Raises
    ------
    InputError
        If no light is left at that depth.
    """
    weights = standard_observer().response_in(view.column.bands)[1] * view.background
    return sighting_range(view.attenuation, weights, contrast)


def concentration_for(
    wanted: float, visibility_at: Callable[[float], float], most: float = 1e3
) -> float:
    """Concentration at which one sees as far as is wanted, in m; 0 if pure water is not as clear.

    What takes contrast away grows almost in proportion with what is in the water, so that a few
    secants of the inverse range are enough.

    Raises
    ------
    InputError
        If the range is not positive.
    """
    if not wanted > 0:
        raise InputError(f"visibility: {wanted:g} m; give a distance above 0")
    low, clearest = 0.0, 1.0 / visibility_at(0.0)
    if clearest >= 1.0 / wanted:
        return 0.0
    high, murk = 1.0, 1.0 / visibility_at(1.0)
    for _ in range(_SECANTS):
        found = low + (1.0 / wanted - clearest) * (high - low) / (murk - clearest)
        found = min(max(found, 0.0), most)
        if found == high:
            break
        low, clearest, high, murk = high, murk, found, 1.0 / visibility_at(found)
        if abs(murk * wanted - 1.0) < _CLOSE or murk == clearest:
            break
    return high


def euphotic_depth(column: WaterColumn, phase: BandPhase, fraction: float = 0.01) -> float:
    """Depth, m, at which a fraction of the light is left; infinite if water takes none away.

    The light is PAR, the photons of Ed from 400 to 700 nm, against PAR just below the surface; at
    1 % this is the euphotic depth. It belongs to the water: a floor is taken away.

    J. T. O. Kirk, Light and Photosynthesis in Aquatic Ecosystems, 3rd ed. (2011), ch. 6.

    Raises
    ------
    InputError
        If the fraction is out of its domain, or no band carries light.
    """
    if not 0 < fraction < 1:
        raise InputError(f"fraction of light must lie between 0 and 1, got {fraction:g}")
    centres = column.bands.centres
    photons = centres * column.bands.widths * ((centres >= 400) & (centres <= 700))
    deep = dataclasses.replace(column, floor_depth=math.inf)

    def light(y: ArrayLike) -> NDArray[np.float64]:
        return deep.Ed(y, phase) @ photons

    wanted = fraction * float(light(0.0))
    if not wanted > 0:
        raise InputError("depth of light: no light between 400 and 700 nm enters the water")
    # Nested grids, each 8 times finer; the last cell is then almost exponential.
    low, high = 0.0, 1.0
    while float(light(high)) > wanted:
        low, high = high, 2.0 * high
        if high > _DEEPEST:
            return math.inf
    for _ in range(3):
        depths = np.linspace(low, high, 9)
        below = int(np.argmax(light(depths) <= wanted))
        low, high = depths[below - 1], depths[below]
    ends = np.log(light([low, high]))
    return float(low + (high - low) * (ends[0] - math.log(wanted)) / (ends[0] - ends[1]))


def transmitted_light(view: Viewpoint) -> NDArray[np.float64]:
    """Fraction of each band's Ed just below the surface that is left at depth, shape (n,).

    A band without light has 0 left.
    """
    surface = view.column.Ed(0.0, view.phase)
    return np.divide(view.light, surface, out=np.zeros_like(surface), where=surface > 0)


def diffuse_attenuation(view: Viewpoint) -> NDArray[np.float64]:
    """Diffuse attenuation Kd = -d ln Ed/dy at the camera's depth in 1/m, shape (n,).

    Of the project's own light field, so every water has it; near a bright
    floor it may be negative. A band without light has NaN.
    """
    # The solved light has no slope in closed form: a short way, where it is exponential.
    step = _SHORT / max(float(np.max(view.attenuation)), _SHORT)
    low = min(view.depth, view.layer.bottom - step)
    ends = view.column.Ed([low, low + step], view.phase)
    ratio = np.divide(*ends, out=np.full_like(ends[0], np.nan), where=ends[1] > 0)
    return np.log(ratio) / step
