"""What a camera's meter sees: the luminances along a few of its rays."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp, surface_irradiance
from ..uw_spectral.lamps.multiple_scattering import LampWater
from ..uw_spectral.spectra.colour_rendering import luminance, metered_stops
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.surface.refraction import seen_from_air
from ..uw_spectral.transfer.above_water import leaving_fraction
from .picture import Optics, picture
from .seen_points import SeenPoints


def picture_stops(
    optics: Optics, seen: SeenPoints, lamps: Sequence[Lamp] = (), water: LampWater | None = None
) -> float:
    """Stops by which a camera that meters its picture exposes, from those of the optics on.

    Light that lamps put on objects counts; what they scatter into the water between does not.
    Without sunlight, only lamps count; where there are any, ``water`` is needed. Raises InputError
    if nothing in the picture is lit.
    """
    colours = _colours(optics, seen, lamps, water)
    return metered_stops(np.maximum(luminance(colours), 0.0), seen.pixels)


def stops_from_above(
    optics: Optics,
    directions: NDArray[np.float64],
    relative_index: NDArray[np.float64],
    seen: SeenPoints | None,
    lamps: Sequence[Lamp] = (),
    water: LampWater | None = None,
) -> float:
    """Stops of a camera over the water that meters its picture; objects in the air are left out.

    The camera is at the surface, ``directions``, shape (m, 3), are those of its rays,
    ``relative_index``, shape (m,), the water's against what is before it, 1 where the camera's
    glass is in the water; ``seen`` is what the rays that go down meet in the water, in their order.
    Lamps, water and errors are as of :func:`picture_stops`.
    """
    sky, develop = optics.view.column.skylight, optics.view.reduction.apply
    colours = develop(sky.radiance(tuple(directions.T[..., None])))
    if seen is not None:
        down = directions[:, 2] < 0.0
        v, n = tuple(directions[down].T[..., None]), relative_index[down, None]
        R, _, mirrored = seen_from_air(v, (0.0, 0.0, 1.0), n)
        below = _colours(optics, seen, lamps, water)
        colours[down] = develop(R * sky.radiance(mirrored)) + leaving_fraction(R, n) * below
    fractions = np.full(len(directions), 1.0 / len(directions))
    return metered_stops(np.maximum(luminance(colours), 0.0), fractions)


def _colours(
    optics: Optics, seen: SeenPoints, lamps: Sequence[Lamp], water: LampWater | None
) -> NDArray[np.float64]:
    """Colours of the rays in the light of sun, sky and lamps, shape (m, 3)."""
    column = optics.view.column
    colours = np.zeros((len(seen), 3))
    if np.any(column.sun_irradiance > 0) or np.any(column.sky_radiance > 0):
        colours = picture(optics, seen).without()
    if lamps and water is not None:
        colours = colours + optics.view.reduction.apply(_lit(optics, seen, lamps, water))
    return colours


def _lit(
    optics: Optics, seen: SeenPoints, lamps: Sequence[Lamp], water: LampWater
) -> NDArray[np.float64]:
    """Radiance of what lamps light, as it arrives at the camera, shape (m, n)."""
    hit = np.isfinite(seen.distance)
    P = np.where(hit, seen.distance, 0.0)[:, None]
    place = tuple((seen.origin + seen.direction * P).T[..., None])
    normal = tuple(seen.normal.T[..., None])
    bands = optics.view.column.bands
    floor = np.broadcast_to(optics.view.column.floor_reflectance, (len(seen), len(bands)))
    uplifted = seen.colour @ uplift_basis(bands).T
    reflectance = np.where(seen.on_floor[:, None], floor, uplifted)
    E = sum(
        sum(surface_irradiance(lamp, patch_past_lamp(lamp, place, normal), water)) for lamp in lamps
    )
    return hit[:, None] * reflectance / math.pi * E * np.exp(-water.c * P)
