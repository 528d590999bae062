"""The grey scene: a sphere over a grey floor, by Cycles and by the closed form.

    python3 dev.py run -m benchmarks grey_scene [--samples N]

writes docs/grey_scene.md and docs/grey_scene.png. The geometry is intersected
analytically here, so nothing but the optics can differ between the two images.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import band_passes, engines, render_plan, settings, water_body
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode, srgb_rmse
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.transfer.closed_form import solve_closed_form
from ..uw_spectral.transfer.pixel import UndisturbedWater, surface_light
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase

ABOVE_FLOOR = 3.0
FLOOR_REFLECTANCE = 0.3
SPHERE_REFLECTANCE = 0.5
SPHERE_RADIUS = 0.8
SPHERE_AHEAD = 4.0
SPHERE_DROP = 1.2
PITCH = math.radians(75.0)
FIELD_OF_VIEW = math.radians(70.0)


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

    Parameters
    ----------
    sun : array, shape (3,)
        Direction the sunlight travels to.
    width, height : int
        Pixels.
    oversampling : int
        Rays per pixel and axis.
    """
    columns, rows = width * oversampling, height * oversampling
    scale = 2.0 * math.tan(FIELD_OF_VIEW / 2) / columns
    x = (np.arange(columns) + 0.5 - columns / 2) * scale
    y = (rows / 2 - np.arange(rows) - 0.5) * scale
    right, up = np.meshgrid(x, y)
    forward, lift = (
        np.array([0.0, math.sin(PITCH), -math.cos(PITCH)]),
        np.array([0.0, math.cos(PITCH), math.sin(PITCH)]),
    )
    direction = right[..., None] * np.array([1.0, 0.0, 0.0]) + up[..., None] * lift + forward
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    centre = np.array([0.0, SPHERE_AHEAD, -SPHERE_DROP])
    to_sphere = _sphere_distance(np.zeros(3), direction, centre)
    with np.errstate(divide="ignore"):
        to_floor = np.where(direction[..., 2] < 0, -ABOVE_FLOOR / direction[..., 2], np.inf)
    distance = np.minimum(to_sphere, to_floor)
    on_sphere = to_sphere < to_floor
    point = direction * np.where(np.isfinite(distance), distance, 0.0)[..., None]
    normal = np.where(
        on_sphere[..., None], (point - centre) / SPHERE_RADIUS, np.array([0.0, 0.0, 1.0])
    )
    blocked = np.isfinite(_sphere_distance(point, -sun * np.ones_like(direction), centre))
    return Hits(
        distance,
        direction,
        normal,
        np.where(on_sphere, SPHERE_REFLECTANCE, FLOOR_REFLECTANCE),
        np.where(blocked & ~on_sphere, 0.0, 1.0),
    )


def closed_form_image(
    column: WaterColumn,
    phase: BandPhase,
    depth: float,
    width: int,
    height: int,
    oversampling: int = 3,
) -> NDArray[np.float64]:
    """Return the band radiances of the closed form, shape (h, w, n)."""
    hits = trace(column.sun_direction, width, height, oversampling)
    field = column.light_field(phase)
    water = solve_closed_form(field, phase, depth, column.sun_direction)
    w = tuple(hits.direction[..., i, None] for i in range(3))
    seen = np.isfinite(hits.distance)[..., None]
    P = np.where(seen, hits.distance[..., None], 0.0)
    y = np.minimum(depth - w[2] * P, column.floor_depth)
    cosine = -(hits.normal @ column.sun_direction)[..., None]
    albedo = hits.reflectance[..., None]
    response = albedo / math.pi * np.maximum(cosine, 0.0) * hits.sunlit[..., None]
    light = surface_light(field, y, hits.normal[..., 2, None])
    surface = light.reflected(response, albedo, cosine)
    undisturbed = UndisturbedWater(water)
    on_surface = undisturbed.surface(depth, y, w, P, surface)
    image = np.where(seen, on_surface.total, undisturbed.open_water(depth, w).total)
    shape = (height, oversampling, width, oversampling, len(column.bands))
    return image.reshape(shape).mean(axis=(1, 3))


def _sphere_distance(
    origin: NDArray[np.float64], direction: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    offset = origin - centre
    along = np.sum(offset * direction, axis=-1)
    inside = along**2 - np.sum(offset * offset, axis=-1) + SPHERE_RADIUS**2
    distance = -along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside > 0) & (distance > 1e-6), distance, np.inf)


def build_scene(depth: float, width: int, height: int) -> bpy.types.Object:
    """Fill the open, empty file with the sphere and return the camera."""
    import bmesh  # exists once bpy is loaded

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    mesh = bpy.data.meshes.new("sphere")
    shape = bmesh.new()
    bmesh.ops.create_icosphere(shape, subdivisions=6, radius=SPHERE_RADIUS)
    shape.to_mesh(mesh)
    shape.free()
    mesh.shade_smooth()
    material = bpy.data.materials.new("grey")
    tree = material.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*[SPHERE_REFLECTANCE] * 3, 1.0)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    sphere = bpy.data.objects.new("sphere", mesh)
    sphere.location = (0.0, SPHERE_AHEAD, -depth - SPHERE_DROP)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -depth)
    camera.rotation_euler = (PITCH, 0.0, 0.0)
    camera.data.sensor_fit = "HORIZONTAL"
    camera.data.angle = FIELD_OF_VIEW
    for item in (sphere, camera):
        scene.collection.objects.link(item)
    scene.camera = camera
    return camera


def cycles_image(
    plan: render_plan.RenderPlan, camera: bpy.types.Object, samples: int, seed: int
) -> NDArray[np.float64]:
    """Render the scene's bands in Cycles, shape (h, w, n)."""
    scene = bpy.context.scene
    plan = replace(plan, settings=replace(plan.settings, samples=samples))
    extent = water_body.water_extent(scene, plan.column, -camera.location.z)
    with engines.cycles_bands(scene, camera, plan, extent, seed=seed, denoise=False) as engine:
        return band_image(engine, plan, -camera.location.z)


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


def plan_for(water: str, depth: float, bands: int) -> render_plan.RenderPlan:
    """Return the plan of one combination: HG 0.8, D65, sun at 30°, CIE 1931."""
    return render_plan.make_plan(
        settings.SceneSettings(
            water=f"jerlov:{water}",
            phase="hg:0.8",
            bands=bands,
            floor_depth=depth + ABOVE_FLOOR,
            floor_reflectance=str(FLOOR_REFLECTANCE),
        )
    )


@dataclass(frozen=True, eq=False)
class Comparison:
    """A closed-form image against two independent Cycles images.

    The variance of the reference, from its two halves, is taken off the
    squared error, so noise does not count as error.
    """

    water: str
    depth: float
    reference: NDArray[np.float64]
    closed_form: NDArray[np.float64]
    srgb_rmse: float
    srgb_noise: float
    delta_e: float
    delta_e_noise: float
    radiance_error: NDArray[np.float64]


def compare(
    water: str, depth: float, width: int, height: int, samples: int, bands: int = 8
) -> Comparison:
    """Render and evaluate one combination; images come back as scene-linear RGB."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = build_scene(depth, width, height)
    plan = plan_for(water, depth, bands)
    halves = [cycles_image(plan, camera, samples, seed) for seed in (1, 2)]
    closed = closed_form_image(plan.column, plan.phase, depth, width, height)
    develop = plan.reduction(depth).apply
    first, second, closed_rgb = (develop(image) for image in (*halves, closed))
    reference = (first + second) / 2
    mean = (halves[0] + halves[1]) / 2
    noise = srgb_rmse(first, second) / 2
    # Blocks beat the noise down before a relative error is taken.
    averaged = [blocks(image, 9) for image in (closed, mean)]
    return Comparison(
        water,
        depth,
        reference,
        closed_rgb,
        math.sqrt(max(srgb_rmse(closed_rgb, reference) ** 2 - noise**2, 0.0)),
        noise,
        float(delta_e_CIE2000_images(blocks(closed_rgb, 9), blocks(reference, 9)).mean()),
        float(delta_e_CIE2000_images(blocks(first, 9), blocks(second, 9)).mean() / 2),
        np.median(np.abs(averaged[0] / averaged[1] - 1), axis=(0, 1)),
    )


def blocks(image: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """Average over squares of pixels; the size must divide the image."""
    height, width, bands = image.shape
    shape = (height // size, size, width // size, size, bands)
    return image.reshape(shape).mean(axis=(1, 3))


def picture(comparisons: Sequence[Comparison], path: Path) -> None:
    """Draw reference, closed form and their difference (± 10 %) side by side."""
    import matplotlib as mpl

    mpl.use("agg")
    import matplotlib.pyplot as plt

    rows = len(comparisons)
    figure, axes = plt.subplots(rows, 3, figsize=(9, 1.75 * rows), squeeze=False)
    for row, item in zip(axes, comparisons, strict=True):
        row[0].imshow(srgb_encode(item.reference))
        row[1].imshow(srgb_encode(item.closed_form))
        difference = (srgb_encode(item.closed_form) - srgb_encode(item.reference)).mean(axis=-1)
        shown = row[2].imshow(difference, cmap="RdBu_r", vmin=-0.1, vmax=0.1)
        row[0].set_ylabel(f"{item.water}, {item.depth:g} m")
        figure.colorbar(shown, ax=row[2], shrink=0.8)
    titles = ("Cycles", "closed form", "difference, sRGB")
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title)
    for axis in axes.flat:
        axis.set(xticks=[], yticks=[])
    figure.tight_layout()
    figure.savefig(path, dpi=80)


COMBINATIONS = (("3C", 3.0), ("3C", 9.0), ("I", 5.0), ("IA", 9.0), ("IB", 5.0), ("II", 3.0))


def report(comparisons: Sequence[Comparison], samples: int) -> str:
    """Return the table as Markdown."""
    lines = [
        "# The closed form against Cycles: a grey sphere over a grey floor",
        "",
        "HG 0.8, sun at 30°, no surface, floor 3 m below the camera, 8 bands, CIE 1931. The",
        f"reference is two Cycles images of {samples} samples; its noise is taken off the RMSE.",
        "ΔE2000 is over blocks of 9 × 9 pixels, its noise stated. Radiance: median relative error",
        "of the blocks, range over the bands.",
        "",
        "| water | depth | sRGB RMSE | its noise | ΔE2000 mean | its noise | radiance |",
        "|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {c.water} | {c.depth:g} m | {c.srgb_rmse:.4f} | {c.srgb_noise:.4f} | {c.delta_e:.2f} | "
        f"{c.delta_e_noise:.2f} | {100 * c.radiance_error.min():.1f} to "
        f"{100 * c.radiance_error.max():.1f} % |"
        for c in comparisons
    ]
    mean = np.mean([(c.srgb_rmse, c.delta_e) for c in comparisons], axis=0)
    lines += [f"| **mean** | | **{mean[0]:.4f}** | | **{mean[1]:.2f}** | | |", ""]
    lines += ["![Cycles, closed form, difference](grey_scene.png)", ""]
    lines += ["Repeat: `python3 dev.py run -m benchmarks grey_scene`", ""]
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> None:
    """Compare every combination and write table and picture to docs/."""
    parser = argparse.ArgumentParser(prog="grey_scene")
    parser.add_argument("--samples", type=int, default=160)
    options = parser.parse_args(arguments)
    docs = Path(__file__).resolve().parent.parent / "docs"
    comparisons = []
    for water, depth in COMBINATIONS:
        comparisons.append(compare(water, depth, 90, 54, options.samples))
        last = comparisons[-1]
        print(f"{water} {depth:g} m: RMSE {last.srgb_rmse:.4f}, ΔE {last.delta_e:.2f}", flush=True)
    picture(comparisons, docs / "grey_scene.png")
    (docs / "grey_scene.md").write_text(report(comparisons, options.samples), encoding="utf-8")
