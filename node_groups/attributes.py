"""Names of the view-layer properties through which a render pass gets its values.

Every value is a vector: one number for each of the (up to) three bands that the pass carries. Nodes
read them with ``Attribute`` nodes of type ``VIEW_LAYER``, so a pass changes no node and no link.
"""

from __future__ import annotations

PREFIX = "uw_"

SUN_IRRADIANCE = "uw_sun_irradiance"
SUN_IN_AIR = "uw_sun_in_air"
SKY_RADIANCE = "uw_sky_radiance"
SKY_BASIS = ("uw_sky_red", "uw_sky_green", "uw_sky_blue")
"""Of the red, green and blue of a sky that is a picture."""
FLOOR_REFLECTANCE = "uw_floor_reflectance"
FOAM_REFLECTANCE, FOAM_BELOW = "uw_foam_reflectance", "uw_foam_below"
REFLECTANCE_BASIS = ("uw_reflectance_red", "uw_reflectance_green", "uw_reflectance_blue")
EXCITED_TILE = "uw_excited_tile"
EXCITED_CHANNELS = ("uw_excited_first", "uw_excited_second", "uw_excited_third")
"""Tile of a band in the images of what lamps excite, and whether it is a channel of its texels."""
EMISSION_BASIS = ("uw_emission_red", "uw_emission_green", "uw_emission_blue")

_INELASTIC, _LAMP = "uw_inelastic_", "uw_lamp_"
_LIGHT = {SUN_IRRADIANCE, SUN_IN_AIR, SKY_RADIANCE, *SKY_BASIS, *EMISSION_BASIS}


def inelastic(layer: int) -> str:
    """Name of the radiance per metre that a layer of the water emits."""
    return f"{_INELASTIC}{layer}"


def is_light(name: str) -> bool:
    """Whether a value is that of a source of light, without which it is dark."""
    return name in _LIGHT or name.startswith((_INELASTIC, _LAMP))


def cloud(index: int) -> str:
    """Name of a cloud where a layer of the water has its number."""
    return f"cloud_{index}"


def absorption(layer: int | str) -> str:
    """Name of the absorption coefficient of one layer of the water, or of a cloud."""
    return f"uw_absorption_{layer}"


def scattering(layer: int | str, component: int) -> str:
    """Name of a layer's scattering coefficient, of one component of its phase function."""
    return f"uw_scattering_{layer}_{component}"


def asymmetry(layer: int | str, component: int) -> str:
    """Name of the asymmetry of one component of a layer's phase function."""
    return f"uw_asymmetry_{layer}_{component}"


def alpha(layer: int | str, component: int) -> str:
    """Name of the weight of cos² of one component of a layer's phase function."""
    return f"uw_alpha_{layer}_{component}"


def lamp(index: int) -> str:
    """Name of the radiant intensity of one lamp."""
    return f"{_LAMP}{index}"


def measured(index: int) -> str:
    """Name of the reflectance of one material with a measured spectrum."""
    return f"uw_measured_{index}"
