"""The surface of the water: refraction, waves, and the caustics under them."""

from .caustics import caustic_pattern
from .refraction import fresnel_reflectance, in_water_cosine, sun_travel_direction
from .wave_patterns import Sea, WavePatterns
from .waves import WaveSpectrum

__all__ = [
    "Sea",
    "WavePatterns",
    "WaveSpectrum",
    "caustic_pattern",
    "fresnel_reflectance",
    "in_water_cosine",
    "sun_travel_direction",
]
