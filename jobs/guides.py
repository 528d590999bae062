"""The guides of a picture's denoiser, made of those of its passes: for all its bands the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers, read_layers
from ..scene.engines.denoising_guides import ALBEDO, NORMAL
from . import band_passes
from .manifest import Manifest, View
from .tasks import Rendered


@dataclass(frozen=True, eq=False)
class Guides:
    """Albedo and normal of what a picture shows, shape (h, w, 3) each."""

    albedo: NDArray[np.float64]
    normal: NDArray[np.float64]


def read_guides(manifest: Manifest, view: View, rendered: Sequence[Rendered]) -> Guides | None:
    """Return the guides of a view; None unless each of its passes has its own."""
    found = []
    for item in rendered:
        path = band_passes.layers_path(item.file.path)
        key = manifest.key(view, item.task.number)
        if band_passes.look_at(path, key, manifest.output.size)[0] is not band_passes.State.DONE:
            return None
        layers = read_layers(path)
        if ALBEDO not in layers or NORMAL not in layers:
            return None
        found.append((layers, item.file.bands, manifest.passes[item.task.number].samples))
    return mean_guides(found, manifest.weights(view))


def mean_guides(
    found: Sequence[tuple[FrameLayers, tuple[int, ...], int]], weights: NDArray[np.float64]
) -> Guides:
    """Return the guides of a picture, of layers, bands and samples of every pass.

    An albedo counts by the size of the ``weights``, shape (3, n), of its bands in the picture.
    """
    height, width = found[0][0][NORMAL].shape[:2]
    albedo, normal = np.zeros((height, width, weights.shape[1])), np.zeros((height, width, 3))
    counts = np.zeros(weights.shape[1])
    for layers, bands, samples in found:
        albedo[..., list(bands)] += samples * layers[ALBEDO]
        counts[list(bands)] += samples
        normal += samples * layers[NORMAL]
    size = np.abs(weights)
    fractions = size / np.maximum(size.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    total = sum(samples for _, _, samples in found)
    return Guides(albedo / counts @ fractions.T, normal / total)
