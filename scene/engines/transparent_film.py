"""A transparent film: what fraction of each pixel is no open water."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers, LayerImage, joined
from ...settings.descriptions import housing_of
from ...settings.scene_settings import SceneSettings
from ...uw_spectral.spectra.spectral_image import read_exr
from ..readers import moving_surface
from .band_engine import RenderPass
from .exr_output import write_float_exr
from .geometry_layers import without_water

ALPHA = "alpha"
"""Name of the layer."""
_TEXT = "fraction of the pixel that is no open water"


def why_opaque(
    camera: bpy.types.Object, settings: SceneSettings, eyes: Sequence[tuple[float, ...]] = ()
) -> str:
    """Return why pictures of a camera have no alpha, empty if they may have.

    Eyes are where it is at the frames of a job, see :func:`.cameras.eye_of`.
    """
    if housing_of(settings).is_any:
        return "the camera looks through a port"
    if moving_surface.may_be_over(camera, settings, eyes):
        return "the camera is above the water or at its surface"
    return ""


def note(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    settings: SceneSettings,
    eyes: Sequence[tuple[float, ...]] = (),
) -> str:
    """Say why the transparent film that a scene asks for is not supported; empty if it is."""
    why = why_opaque(camera, settings, eyes) if scene.render.film_transparent else ""
    return why and f"the transparent film is not supported: {why}"


def alpha_map(scene: bpy.types.Scene, beside: Path) -> NDArray[np.float32]:
    """Render what fraction of each pixel is no open water, shape (height, width).

    A file lies beside a path for the moment.
    """
    path = beside.with_name(f"{beside.stem}.alpha{beside.suffix}")
    transparent = scene.render, "film_transparent", True
    try:
        with without_water(scene, [(scene.cycles, "max_bounces", 0), transparent]):
            write_float_exr(scene, path, alpha=True)
        pixels, names = read_exr(path)
        return pixels[..., names.index("A")]
    finally:
        path.unlink(missing_ok=True)


def with_alpha(draw: RenderPass, scene: bpy.types.Scene) -> RenderPass:
    """Return what renders a pass, and alpha as a layer of it."""

    def render(indices: tuple[int, ...], path: Path) -> FrameLayers:
        found = draw(indices, path)
        layer = FrameLayers({ALPHA: LayerImage(alpha_map(scene, path)[..., None], text=_TEXT)})
        return layer if found is None else joined([found, layer])

    return render
