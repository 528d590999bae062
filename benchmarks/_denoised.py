"""Pictures of Cycles, denoised as jobs denoise them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..datasets.layer_file import FrameLayers
from ..jobs import development
from ..jobs.development import mean_guides
from ..scene.engines.band_engine import BandEngine
from ..settings.render_plan import RenderPlan
from ..uw_spectral.spectra.spectral_image import read_exr


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
        picture = Path(folder, "picture.exr")
        development.develop(
            paths, weights, engine.passes, picture, denoise=True,
            guides=mean_guides(found, weights),
        )  # fmt: skip
        return read_exr(picture)[0].astype(np.float64)
