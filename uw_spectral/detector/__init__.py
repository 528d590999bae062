"""A camera's detector as a device: vignetting, colour filters, noise, counts, and their files."""

from .bayer import PATTERNS, filter_of_pixels, mosaic
from .dng import write_dng
from .linear_detector import Detector, dark_counts, expected_counts, raw_counts
from .raw_capture import RawSettings, capture
from .vignetting import Vignetting

__all__ = [
    "PATTERNS",
    "Detector",
    "RawSettings",
    "Vignetting",
    "capture",
    "dark_counts",
    "expected_counts",
    "filter_of_pixels",
    "mosaic",
    "raw_counts",
    "write_dng",
]
