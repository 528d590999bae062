"""The render region of Blender: which pixels of a picture are rendered, and what the rest is."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.readers.picture_size import rendered_size
from ..scene.temporary import held
from ..uw_spectral.errors import InputError

_SIDES = ("border_min_x", "border_min_y", "border_max_x", "border_max_y")
_INSIDE = 1e-3  # of a pixel: Blender cuts off a fraction, by which Cycles moves the picture


@dataclass(frozen=True)
class Region:
    """Pixels of a picture, from its upper left corner; ``right`` and ``bottom`` lie beyond."""

    left: int
    top: int
    right: int
    bottom: int

    def cut(self, image: NDArray[Any]) -> NDArray[Any]:
        """Return the part of an image, shape (h, w, ...), that is in the region."""
        return image[self.top : self.bottom, self.left : self.right]

    def placed(self, part: NDArray[Any], size: tuple[int, int]) -> NDArray[Any]:
        """Return an image of width and height in pixels that has a part here, else 0."""
        image = np.zeros((size[1], size[0], *part.shape[2:]), dtype=part.dtype)
        self.cut(image)[:] = part
        return image


def region_of(scene: bpy.types.Scene) -> Region | None:
    """Return the region that a scene asks for, with Blender's own rounding; None for all.

    Raises InputError if there is no pixel in it.
    """
    render = scene.render
    if not render.use_border:
        return None
    width, height = rendered_size(
        render.resolution_x, render.resolution_y, render.resolution_percentage
    )
    sides = np.array([getattr(render, name) for name in _SIDES], np.float32)
    pixels = sides * np.array([width, height, width, height], np.float32)
    left, low, right, high = (int(x) for x in pixels)
    if left >= right or low >= high:
        raise InputError(
            "the render region is empty: draw another (View, View Regions, Render Region), or "
            "switch off Render Region in Output, Format"
        )
    return Region(left, height - high, right, height - low)


def wanted_settings(
    scene: bpy.types.Scene, region: Region | None, size: tuple[int, int]
) -> list[tuple[Any, str, Any]]:
    """Owner, name and value of the settings that render a region of a picture of some size."""
    render, (width, height) = scene.render, size
    wanted: list[tuple[Any, str, Any]] = [
        (render, "use_border", region is not None),
        # Passes have the size of the picture; it is cropped as it is developed.
        (render, "use_crop_to_border", False),
    ]
    if region is not None:
        sides = (
            (region.left + _INSIDE) / width,
            (height - region.bottom + _INSIDE) / height,
            (region.right + _INSIDE) / width,
            (height - region.top + _INSIDE) / height,
        )
        wanted += [(render, name, min(side, 1.0)) for name, side in zip(_SIDES, sides, strict=True)]
    return wanted


@contextlib.contextmanager
def rendered_region(
    scene: bpy.types.Scene, resolution: tuple[int, int, int], region: Region | None
) -> Iterator[None]:
    """Give a scene a resolution (width, height, percentage) and a region while the block runs."""
    names = ("resolution_x", "resolution_y", "resolution_percentage")
    wanted = [(scene.render, *row) for row in zip(names, resolution, strict=True)]
    with held([*wanted, *wanted_settings(scene, region, rendered_size(*resolution))]):
        yield
