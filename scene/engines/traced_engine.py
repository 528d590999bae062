"""Engines behind a port that trace the port's own rays."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.housing import Housing, RayFit, fit_rays
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ..readers import port_eye
from . import traced_port
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .port_look import PortLook, look_of
from .split_passes import draw_apart


@contextlib.contextmanager
def traced(
    engine: Engine,
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    eye: bpy.types.Object,
    opening: Opening,
) -> Iterator[BandEngine]:
    """Open an engine for an eye that hangs on a camera, and let rays begin at the port."""
    with engine.open(scene, eye, opening) as inner:

        @functools.lru_cache(maxsize=len(opening.plan.bands))
        def port(housing: Housing, nm: float) -> tuple[RayFit, NDArray[np.float64]]:
            """Rays of a band, and the fraction of its light that is let through."""
            passed = housing.transmittance(housing.camera.pixel_centres(), nm)
            return fit_rays(housing, nm), np.nan_to_num(passed)

        def frame(now: RenderPlan, depth: float, weights: Weights | None = None) -> RenderPass:
            housing = look_of(scene, camera, now, depth)
            assert housing is not None, "no keyframe takes a port away"
            draw = inner.frame(now, depth, weights)
            radius, focus = _lens(housing, camera, now)

            def one(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                rays, passed = port(housing, float(now.bands.centres[indices[0]]))
                with traced_port.rays(eye, rays, radius, focus):
                    layers = draw(indices, path)
                image, _ = read_exr(path)
                write_rgb_exr(path, image * passed[..., None].astype(np.float32))
                return layers

            def render(indices: tuple[int, ...], path: Path) -> FrameLayers | None:
                return draw_apart([(index,) for index in indices], path, one)

            return render

        yield replace(inner, frame=frame)


def _lens(housing: Housing, camera: bpy.types.Object, plan: RenderPlan) -> tuple[float, float]:
    """Radius of the lens as it counts in the water, and distance of the focus, m."""
    focus = port_eye.focus_of(camera)
    if not camera.data.dof.use_dof:
        return 0.0, focus
    try:
        look = PortLook.of(housing, plan)
    except InputError as problem:
        raise InputError(f"{problem}; or switch depth of field off") from problem
    return 0.5e-3 * look.aperture(camera, focus), focus
