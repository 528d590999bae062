"""Passes whose bands have to be rendered one after another."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...datasets.layer_file import FrameLayers, side_by_side
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from . import denoising_guides
from .band_engine import RenderPass


def shared_parts(
    bands: tuple[int, ...], passes: Sequence[tuple[int, ...]]
) -> list[tuple[int, ...]]:
    """Split the bands of a pass of the first frame into those that still share one."""
    parts = (tuple(band for band in bands if band in shared) for shared in passes)
    return [part for part in parts if part]


def draw_apart(
    parts: Sequence[tuple[int, ...]], path: Path, draw: RenderPass
) -> FrameLayers | None:
    """Render parts of a pass, the bands of each, by themselves and put them into one file."""
    channels, layers = [], []
    for part in parts:
        found = draw(part, path)
        layers.append(denoising_guides.without_normal(found) if found and layers else found)
        channels.append(read_exr(path)[0][..., : len(part)])
    missing = 3 - sum(map(len, parts))
    image = np.concatenate(channels, axis=-1)
    write_rgb_exr(path, np.pad(image, ((0, 0), (0, 0), (0, missing)), mode="edge"))
    there = [found for found in layers if found is not None]
    return side_by_side(there) if there else None
