"""Spectra and those who see them: bands, light above the water, sensors, colour, images."""

from .bands import Bands
from .colour_rendering import SensorReduction, delta_e_CIE2000_images, reduction
from .illuminant import Illuminant, parse_illuminant
from .reflectance import parse_reflectance, uplift
from .sensor import Sensor, list_sensors, parse_sensor
from .spectral_image import read_exr, read_spectral_exr, write_spectral_exr
from .spectrum import Spectrum

__all__ = [
    "Bands",
    "Illuminant",
    "Sensor",
    "SensorReduction",
    "Spectrum",
    "delta_e_CIE2000_images",
    "list_sensors",
    "parse_illuminant",
    "parse_reflectance",
    "parse_sensor",
    "read_exr",
    "read_spectral_exr",
    "reduction",
    "uplift",
    "write_spectral_exr",
]
