"""What guides a denoiser: albedo and normal of what a pass of Cycles sees, through its water."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers, LayerImage, bands_name
from .exr_output import Passes

SWITCHES = ("cycles.denoising_store_passes",)
ALBEDO = bands_name("guide_albedo")
NORMAL = "guide_normal"
_TEXT = "of what is seen first, as Cycles gives it to a denoiser"


def guides_of(passes: Passes, channels: Sequence[str]) -> FrameLayers:
    """Return the guides of a pass whose bands are called ``channels``."""
    albedo = passes["Denoising Albedo"][..., : len(channels)]
    normal = passes["Denoising Normal"][..., :3]
    return FrameLayers(
        {
            ALBEDO: LayerImage(albedo, tuple(channels), "", f"albedo {_TEXT}"),
            NORMAL: LayerImage(normal, ("X", "Y", "Z"), "", f"normal {_TEXT}"),
        }
    )


def without_normal(found: FrameLayers) -> FrameLayers:
    """Return layers without the normal, which is the same for all bands of a pass."""
    return replace(found, layers={n: image for n, image in found.layers.items() if n != NORMAL})


def bent(
    found: FrameLayers, bend: Callable[[NDArray[np.float32]], NDArray[np.float32]]
) -> FrameLayers:
    """Return guides as a picture is bent."""
    layers = {n: replace(image, values=bend(image.values)) for n, image in found.layers.items()}
    return replace(found, layers=layers)
