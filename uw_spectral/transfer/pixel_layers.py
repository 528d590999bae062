"""The layers of a pixel: its components as image formation names them."""

from __future__ import annotations

from ..mathematics import Mathematics, Operand
from .pixel import Pixel, SurfaceLight


def pixel_layers(pixel: Pixel) -> dict[str, Operand]:
    """Return the layers of a pixel, by the names of :data:`.layers.LAYERS`.

    ``B_water`` is all backscatter of sun and sky. Light of changed wavelength belongs to where
    it was scattered last: on the thing, over it, or on the way, where it counts as scattered
    more than once.
    """
    parts = {
        "I": pixel.total,
        "J": pixel.L_end + pixel.L_carried,
        "D": pixel.direct,
        "B_single": pixel.single_scattering,
        "B_water": pixel.path,
        "F": pixel.forward_scattered,
    }
    if pixel.changed is not None:
        changed = pixel_layers(pixel.changed)
        parts |= {name: parts[name] + changed[name] for name in ("J", "D", "B_water", "F")}
    return {**parts, "B_lamps": pixel.lamps}


def illumination(
    light: SurfaceLight,
    sun_cosine: Operand,
    sunlit: Operand,
    lamps: Operand,
    m: Mathematics,
) -> Operand:
    """Irradiance on a patch with its normal.

    Parameters
    ----------
    light : SurfaceLight
        At its place; the sun on a plane across it.
    sun_cosine : float or array
        Cosine between the normal and the direction towards the sun.
    sunlit : float or array
        Share of the direct sun that things leave.
    lamps : float or array
        Irradiance of lamps.
    m : Mathematics
        Elementary functions.
    """
    facing = m.maximum(sun_cosine, 0.0)
    return facing * (light.direct * sunlit + light.forward) + light.diffuse + lamps
