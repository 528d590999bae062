"""Pictures of Cycles, denoised as jobs denoise them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers
from ..jobs import development
from ..scene.engines.band_engine import BandEngine
from ..settings.render_plan import RenderPlan


def denoised(
    engine: BandEngine, plan: RenderPlan, depth: float, weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Render the passes of an engine that has guides, and develop them, shape (h, w, 3)."""
    render = engine.frame(plan, depth)
    paths: list[Path] = []
    found: list[tuple[FrameLayers, tuple[int, ...], int]] = []
    with tempfile.TemporaryDirectory() as folder:
        for number, bands in enumerate(engine.passes):
            paths.append(Path(folder, f"{number}.exr"))
            layers = render(bands, paths[-1])
            assert layers is not None
            found.append((layers, bands, 1))
        guides = development.mean_guides(found, weights)
        picture = development.develop(paths, weights, engine.passes, denoise=True, guides=guides)
        return picture.astype(np.float64)
