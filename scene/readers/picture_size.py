"""The size of a picture, and whether Blender and the memory of this machine can render it."""

from __future__ import annotations

import math
import os

import bpy

from ...uw_spectral.errors import InputError

# Blender's picture has four float32 channels; bands are read from the passes, then stacked.
_PICTURE_BYTES, _BAND_BYTES = 16, 8
_GB = 1e9


def rendered_size(width: int, height: int, percentage: int) -> tuple[int, int]:
    """Size in pixels that Blender renders, which counts in whole numbers.

    Examples
    --------
    >>> rendered_size(1280, 720, 35)
    (448, 252)
    """
    return width * percentage // 100, height * percentage // 100


def least_memory(size: tuple[int, int], bands: int) -> int:
    """Return the memory in bytes that a frame takes at least.

    Examples
    --------
    >>> least_memory((1920, 1080), 8) / 1e9
    0.165888
    """
    return size[0] * size[1] * (_PICTURE_BYTES + _BAND_BYTES * bands)


def check_resolution(size: tuple[int, int]) -> None:
    """Refuse sizes in pixels outside Blender's limits, which would cut them silently."""
    limits = bpy.types.RenderSettings.bl_rna.properties["resolution_x"]
    if not all(limits.hard_min <= side <= limits.hard_max for side in size):
        raise InputError(
            f"--resolution: {size[0]} × {size[1]} pixels; Blender renders {limits.hard_min} to "
            f"{limits.hard_max} a side, and every band of a picture of this size would take "
            f"{size[0] * size[1] * _BAND_BYTES / _GB:.2g} GB of memory"
        )


def check_memory(size: tuple[int, int], bands: int) -> None:
    """Refuse a frame that takes more than all the memory there is, where the system tells."""
    needed, present = least_memory(size, bands), physical_memory()
    if needed > present:
        raise InputError(
            f"a frame of {size[0]} × {size[1]} pixels in {bands} bands takes at least "
            f"{needed / _GB:.0f} GB of memory, and this machine has {present / _GB:.0f} GB; "
            "lower --resolution or --bands"
        )


def physical_memory() -> float:
    """Return this machine's memory in bytes; infinity where the system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):  # such as on Windows
        return math.inf
