"""Engines behind a port that trace the port's own rays: a camera in Open Shading Language."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import bpy
import numpy as np
from numpy.typing import NDArray

from ...datasets.layer_file import FrameLayers
from ...settings.render_plan import RenderPlan
from ...uw_spectral.errors import InputError
from ...uw_spectral.housing import Housing, RayFit, fit_rays
from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ..readers import port_eye
from .band_engine import BandEngine, Engine, Opening, RenderPass, Weights
from .port_look import PortLook, look_of
from .split_passes import draw_apart

# Coefficients of each coordinate by rows of y, then x; the picture's first row is y = -1.
_SHADER = """
shader uw_port(
    float radius = 0.0,
    float focus = 1.0,
    output point position = 0.0,
    output vector direction = 0.0,
    output color throughput = 1.0)
{{
  float c[{count}] = {{ {numbers} }};
  vector place = camera_shader_raster_position();
  float x = 2.0 * place[0] - 1.0, y = 1.0 - 2.0 * place[1];
  float across[{n}], down[{n}], found[6];
  across[0] = 1.0; across[1] = x; down[0] = 1.0; down[1] = y;
  for (int k = 2; k < {n}; k++) {{
    across[k] = 2.0 * x * across[k - 1] - across[k - 2];
    down[k] = 2.0 * y * down[k - 1] - down[k - 2];
  }}
  for (int part = 0; part < 6; part++) {{
    float total = 0.0;
    for (int row = 0; row < {n}; row++) {{
      float along = 0.0;
      for (int k = 0; k < {n}; k++) along += c[(part * {n} + row) * {n} + k] * across[k];
      total += along * down[row];
    }}
    found[part] = total;
  }}
  position = point(found[0], -found[1], found[2]);
  direction = normalize(vector(found[3], -found[4], found[5]));
  if (radius > 0.0) {{
    vector drawn = camera_shader_random_sample();
    float r = radius * sqrt(drawn[0]), turn = 2.0 * M_PI * drawn[1];
    vector aside = vector(r * cos(turn), r * sin(turn), 0.0);
    point there = position + direction * ((focus - position[2]) / max(direction[2], 0.01));
    position += aside;
    direction = normalize(there - position);
  }}
}}
"""
_SINGLE = 9  # digits that hold a number of single precision


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
                with _rays(eye, rays, radius, focus):
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


def may_trace(camera: bpy.types.Object) -> bool:
    """Whether this Blender traces cameras of one's own."""
    kinds = camera.data.bl_rna.properties["type"].enum_items
    return "CUSTOM" in kinds and bool(getattr(_cycles(), "with_osl", False))


@contextlib.contextmanager
def _rays(eye: bpy.types.Object, fit: RayFit, radius: float, focus: float) -> Iterator[None]:
    """Let a camera at the entrance pupil have the rays of a fit while the block runs.

    ``radius`` is the lens's as it counts in the water, m; with 0 everything is in focus. Objects
    are in focus at the planar distance ``focus``, m. InputError if Cycles cannot compile the rays.
    """
    data, before = eye.data, eye.data.type
    compiled = _compiled(_source(fit))
    data.type, data.custom_mode = "CUSTOM", "INTERNAL"
    data.custom_bytecode = compiled
    data.custom_bytecode_hash = hashlib.sha256(compiled.encode()).hexdigest()
    data.cycles_custom["radius"], data.cycles_custom["focus"] = radius, focus
    data.update_tag()
    try:
        yield
    finally:
        data.type = before


def _source(fit: RayFit) -> str:
    coefficients = fit.coefficients
    numbers = ", ".join(f"{value:.{_SINGLE}g}" for value in coefficients.ravel())
    # Whole numbers would make another kind of list.
    numbers = ", ".join(x if {".", "e"} & set(x) else f"{x}.0" for x in numbers.split(", "))
    return _SHADER.format(count=coefficients.size, n=coefficients.shape[1], numbers=numbers)


def _compiled(source: str) -> str:
    with tempfile.TemporaryDirectory() as folder:
        written, made = Path(folder, "uw_port.osl"), Path(folder, "uw_port.oso")
        written.write_text(source, encoding="utf-8")
        done = _cycles().osl_compile(str(written), str(made))
        if not done or not made.exists():
            raise InputError(
                "--housing: Cycles cannot compile the rays of the port here; use --engine eevee"
            )
        return made.read_text(encoding="utf-8")


def _cycles() -> ModuleType:
    return importlib.import_module("_cycles")
