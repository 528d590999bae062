"""A camera's detector as a device: vignetting, colour filters, noise, counts, and their files."""

from .dng import write_dng
from .linear_detector import Detector, dark_counts, expected_counts, raw_counts
from .raw_capture import (
    PATTERNS,
    RawSettings,
    Vignetting,
    capture,
    filter_of_pixels,
    mosaic,
)

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
