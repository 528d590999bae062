"""The grey scene: a sphere over a grey floor, by Cycles, by EEVEE and by the formulas in numpy.

For numpy the geometry is intersected analytically here, so nothing but the optics can differ from
Cycles. What draws it draws other scenes as well.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..jobs import band_passes
from ..scene.engines import engines
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..settings.water_settings import DEFAULT_PHASE
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.transfer.radiance_table import TABLE_STREAMS
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase
from ..validation.closed_form.closed_form import solve_closed_form
from ..validation.closed_form.light_field import light_field_of
from ..validation.closed_form.pixel import surface_light
from ..validation.closed_form.unoccluded_water import UnoccludedWater
from ..validation.monzon import TABLE2
from ..validation.sun_beam import sun_beam
from ..validation.tabulated_water import TabulatedWater, tabulated_water
from ._rays import sphere_distance, view_rays
from ._scenery import camera_at, depth_of, matt, sized

ABOVE_FLOOR = 3.0
FLOOR_REFLECTANCE = 0.3
SPHERE_REFLECTANCE = 0.5
SPHERE_RADIUS = 0.8
SPHERE_AHEAD = 4.0
SPHERE_DROP = 1.2
PITCH = math.radians(75.0)
FIELD_OF_VIEW = math.radians(70.0)


@dataclass(frozen=True)
class Light:
    """Phase function of the water, and the light above it; what ships by default."""

    phase: str = DEFAULT_PHASE
    illuminant: str = "clear-sky"
    sky: str = "clear"

    @property
    def title(self) -> str:
        """In words."""
        phase = "default mixture" if self.phase == DEFAULT_PHASE else self.phase
        return f"{phase}, {'clear sky' if self.sky == 'clear' else 'black sky'}"


CLEAR = Light()
PAPERS = Light("hg:0.8", "d65", "uniform")
"""That of Monzon et al. (2024): HG 0.8, all light from the sun."""


@dataclass(frozen=True, eq=False)
class Hits:
    """What the camera's rays meet, each of shape (h, w).

    ``distance`` in m (infinite for open water), ``normal`` and ``direction``
    with z up and shape (h, w, 3), ``reflectance``, grey or linear RGB of shape
    (h, w, 3), and ``sunlit``, 1 where nothing casts a shadow.
    """

    distance: NDArray[np.float64]
    direction: NDArray[np.float64]
    normal: NDArray[np.float64]
    reflectance: NDArray[np.float64]
    sunlit: NDArray[np.float64]

    def in_bands(self, bands: Bands) -> NDArray[np.float64]:
        """Reflectance in each band, shape (h, w, n), or (h, w, 1) where grey."""
        if self.reflectance.ndim == self.distance.ndim:
            return self.reflectance[..., None]
        return self.reflectance @ uplift_basis(bands).T


def trace(sun: NDArray[np.float64], width: int, height: int, oversampling: int) -> Hits:
    """Intersect the camera's rays with sphere and floor.

    ``sun`` is the direction the sunlight travels to; ``oversampling`` rays per pixel and axis.
    """
    rays = width * oversampling, height * oversampling
    direction = view_rays(*rays, FIELD_OF_VIEW, PITCH - math.pi / 2)
    centre = np.array([0.0, SPHERE_AHEAD, -SPHERE_DROP])
    to_sphere = sphere_distance(np.zeros(3), direction, centre, SPHERE_RADIUS)
    with np.errstate(divide="ignore"):
        to_floor = np.where(direction[..., 2] < 0, -ABOVE_FLOOR / direction[..., 2], np.inf)
    distance = np.minimum(to_sphere, to_floor)
    on_sphere = to_sphere < to_floor
    point = direction * np.where(np.isfinite(distance), distance, 0.0)[..., None]
    normal = np.where(
        on_sphere[..., None], (point - centre) / SPHERE_RADIUS, np.array([0.0, 0.0, 1.0])
    )
    blocked = np.isfinite(sphere_distance(point, -sun, centre, SPHERE_RADIUS))
    return Hits(
        distance,
        direction,
        normal,
        np.where(on_sphere, SPHERE_REFLECTANCE, FLOOR_REFLECTANCE),
        np.where(blocked & ~on_sphere, 0.0, 1.0),
    )


def closed_form_image(
    column: WaterColumn, phase: BandPhase, depth: float, size: Sequence[int], oversampling: int = 3
) -> NDArray[np.float64]:
    """Return the band radiances of the closed form, shape (h, w, n); ``size`` is w, h."""
    field = light_field_of(column, phase)
    water = solve_closed_form(field, phase, depth, column.sun_direction)
    unoccluded = UnoccludedWater(water, column.skylight)
    return _image(unoccluded, column, depth, size, oversampling)


def solved_image(
    column: WaterColumn, phase: BandPhase, depth: float, size: Sequence[int], oversampling: int = 3
) -> NDArray[np.float64]:
    """Return the band radiances of the tables that EEVEE looks up, shape (h, w, n)."""
    field = column.solved_field(phase, TABLE_STREAMS)
    water = tabulated_water(field, sun_beam(column, phase), column.skylight, None)
    return _image(water, column, depth, size, oversampling)


def _image(
    water: UnoccludedWater | TabulatedWater, column: WaterColumn, depth: float,
    size: Sequence[int], oversampling: int,
) -> NDArray[np.float64]:  # fmt: skip
    hits = trace(column.sun_direction, *size, oversampling)
    w = tuple(hits.direction[..., i, None] for i in range(3))
    normal = tuple(hits.normal[..., i, None] for i in range(3))
    seen = np.isfinite(hits.distance)[..., None]
    P = np.where(seen, hits.distance[..., None], 0.0)
    y = np.minimum(depth - w[2] * P, column.floor_depth)
    cosine = -(hits.normal @ column.sun_direction)[..., None]
    albedo = hits.reflectance[..., None]
    response = albedo / math.pi * np.maximum(cosine, 0.0) * hits.sunlit[..., None]
    light = surface_light(water.patch_light(y, normal), y, normal[2])
    surface = light.reflected(response, albedo, cosine)
    on_surface = water.surface(np.full_like(y, depth), y, w, P, surface)
    ahead = water.open_water(np.full_like(y, depth), w)
    return blocks(np.where(seen, on_surface.total, ahead.total), oversampling)


def build_scene(depth: float, width: int, height: int) -> bpy.types.Object:
    """Fill the open, empty file with the sphere and return the camera."""
    import bmesh  # exists once bpy is loaded

    scene = sized((width, height))
    mesh = bpy.data.meshes.new("sphere")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=6, radius=SPHERE_RADIUS)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    mesh.materials.append(matt([SPHERE_REFLECTANCE] * 3))
    sphere = bpy.data.objects.new("sphere", mesh)
    sphere.location = (0.0, SPHERE_AHEAD, -depth - SPHERE_DROP)
    scene.collection.objects.link(sphere)
    camera = camera_at((0.0, 0.0, -depth), (PITCH, 0.0, 0.0), FIELD_OF_VIEW)
    camera.data.sensor_fit = "HORIZONTAL"
    return camera


def cycles_image(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, samples: int, seed: int
) -> NDArray[np.float64]:
    """Render the scene's bands in Cycles, shape (h, w, n)."""
    scene, depth = bpy.context.scene, depth_of(camera)
    plan = replace(plan, settings=replace(plan.settings, samples=samples))
    extent = water_body.water_extent(scene, plan.column, depth)
    with engines.cycles_bands(scene, camera, plan, extent, seed=seed) as engine:
        return band_image(engine, plan, depth)


def cycles_images(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, samples: int,
    seeds: Sequence[int] = (1, 2),
) -> NDArray[np.float64]:  # fmt: skip
    """Render them with independent noise, shape (seeds, h, w, n)."""
    return np.stack([cycles_image(plan, camera, samples, seed) for seed in seeds])


def band_image(
    engine: engines.BandEngine, plan: render_plan.RenderPlan, depth: float
) -> NDArray[np.float64]:
    """Render the passes of an engine and stack them, shape (h, w, n)."""
    render = engine.frame(plan, depth)
    rendered = []
    with tempfile.TemporaryDirectory() as folder:
        for number, bands in enumerate(engine.passes):
            path = Path(folder, f"pass_{number:02d}.exr")
            seconds = band_passes.render_pass(render, bands, path)
            rendered.append(band_passes.RenderedPass(path, bands, seconds))
        return band_passes.gather(rendered).astype(np.float64)


def plan_for(
    water: str, depth: float, bands: int, light: Light = CLEAR, *, share_passes: bool = True
) -> render_plan.RenderPlan:
    """Return the plan of one combination: sun at 30°, CIE 1931."""
    return render_plan.make_plan(
        SceneSettings(
            water=f"jerlov:{water}", phase=light.phase, illuminant=light.illuminant, sky=light.sky,
            bands=bands, floor_depth=depth + ABOVE_FLOOR, floor_reflectance=str(FLOOR_REFLECTANCE),
            share_passes=share_passes,
        )
    )  # fmt: skip


def eevee_image(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, samples: int = 16
) -> NDArray[np.float64]:
    """Draw the bands by EEVEE, shape (h, w, n)."""
    scene, depth = bpy.context.scene, depth_of(camera)
    plan = replace(plan, settings=replace(plan.settings, samples=samples))
    extent = water_body.water_extent(scene, plan.column, depth)
    with engines.eevee_bands(scene, camera, plan, extent, depth) as engine:
        return band_image(engine, plan, depth)


def blocks(image: NDArray[np.float64], size: int | Sequence[int]) -> NDArray[np.float64]:
    """Average over squares of pixels, or so many down and across; that must divide the image."""
    height, width, bands = image.shape
    down, across = np.broadcast_to(size, 2)
    return image.reshape(height // down, down, width // across, across, bands).mean(axis=(1, 3))


COMBINATIONS = tuple(TABLE2)
"""Water and depth."""
