"""Things in the air seen through the water surface from below: EEVEE against Cycles.

    python3 dev.py run -m benchmarks window_things [--samples N] [--case K]

writes docs/measured/window_things.md and docs/measured/window_things.jpg.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import engines
from ..scene.engines.band_engine import BandEngine
from ..scene.seen.ray_casting import Meshes
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images
from ..uw_spectral.spectra.reflectance import emission_basis
from ..uw_spectral.surface.refraction import (
    direction_in_air,
    fresnel_reflectance,
    is_in_window,
)
from . import grey_scene
from ._against_cycles import Pair, run, write_sheet
from ._shade_scenes import matt

TARGET, EDGE_TARGET = 2.0, 0.3
_WIDTH, _HEIGHT, _BLOCK = 96, 54, 6
_FIELD = math.radians(75.0)
_BANDS, _FLOOR, _EEVEE_SAMPLES = 3, 8.0, 8
_FINE, _RAYS, _GLOW = 2, 6, 30.0  # of the edges: pixels, and rays per pixel, along a side
_UP = (0.0, 0.0, 1.0)

Place = tuple[float, float, float]


def _coat(colour: Place, *, smooth: bool = False) -> None:
    item = bpy.context.object
    if smooth:
        for face in item.data.polygons:
            face.use_smooth = len(face.vertices) == 4
    item.data.materials.append(matt(colour))


def _post(place: Place, radius: float, length: float, tilt: float, colour: Place) -> None:
    bpy.ops.mesh.primitive_cylinder_add(
        radius=radius, depth=length, location=place, vertices=48, rotation=(0.0, tilt, 0.0)
    )
    _coat(colour, smooth=True)


def _posts(depth: float) -> None:
    ahead = 0.7 * (depth - 1.5)
    _post((0.4, 1.0 + ahead, 0.5), 0.08, 4.0, 0.0, (0.6, 0.5, 0.3))
    _post((-0.9, 1.4 + ahead, 0.5), 0.12, 5.0, 0.15, (0.7, 0.2, 0.1))


def _pier(depth: float) -> None:
    ahead = 0.4 * depth
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.6, 1.6 + ahead, 1.6))
    bpy.context.object.scale = (1.6, 2.4, 0.2)
    _coat((0.5, 0.35, 0.2))
    for x in (0.0, 1.2):
        for y in (0.6 + ahead, 2.6 + ahead):
            _post((x, y, -1.0), 0.1, 5.0, 0.0, (0.4, 0.3, 0.2))


def _hull(depth: float) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(
        radius=1.0, location=(0.3, 1.6 + 0.4 * depth, 0.15), segments=64, ring_count=32
    )
    bpy.context.object.scale, bpy.context.object.rotation_euler.z = (1.5, 0.5, 0.5), 0.6
    _coat((0.6, 0.15, 0.1))
    bpy.context.object.data.shade_smooth()


@dataclass(frozen=True)
class Case:
    """A scene under a surface: what is there, how deep the camera is, and the wind."""

    name: str
    things: Callable[[float], None]
    depth: float
    wind: float | None = None

    @property
    def title(self) -> str:
        """In words."""
        sea = "flat" if self.wind is None else f"wind {self.wind:g} m/s"
        return f"{self.name}, {self.depth:g} m, {sea}"

    def plan(self, samples: int = _EEVEE_SAMPLES) -> render_plan.RenderPlan:
        """Return what is rendered."""
        return render_plan.make_plan(
            SceneSettings(
                water="jerlov:IB",
                phase="hg:0.9",
                illuminant="clear-sky",
                sky="clear",
                bands=_BANDS,
                surface="flat" if self.wind is None else "waves",
                wind_speed=self.wind or 0.0,
                sun_zenith=35.0,
                sun_azimuth=60.0,
                floor_depth=_FLOOR,
                floor_reflectance="0.3",
                samples=samples,
            )
        )


CASES = tuple(
    Case(name, things, depth, wind)
    for wind in (None, 5.0)
    for depth in (1.5, 5.0)
    for name, things in (("posts", _posts), ("pier", _pier), ("hull", _hull))
)


def build(case: Case, finer: int = 1) -> bpy.types.Object:
    """Fill an empty file with the things of a case; return the camera."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = finer * _WIDTH, finer * _HEIGHT
    scene.render.resolution_percentage = 100
    scene.cycles.pixel_filter_type = "BOX"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = (0.0, 0.0, -case.depth)
    camera.rotation_euler = (math.radians(140.0), 0.0, 0.0)
    camera.data.angle = _FIELD
    scene.collection.objects.link(camera)
    scene.camera = camera
    case.things(case.depth)
    bpy.context.view_layer.update()
    return camera


def _directions(camera: bpy.types.Object, finer: int = 1) -> NDArray[np.float64]:
    """Unit directions over the picture, shape (h, w, 3)."""
    width, height = finer * _WIDTH, finer * _HEIGHT
    step = 2.0 * math.tan(_FIELD / 2) / width
    x = (np.arange(width) + 0.5 - width / 2) * step
    y = (height / 2 - np.arange(height) - 0.5) * step
    right, up = np.meshgrid(x, y)
    turn = np.array(camera.matrix_world.to_3x3())
    v = np.stack([right, up, -np.ones_like(up)], axis=-1) @ turn.T
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Found:
    """Pictures of a case, what they differ by in the window, and CPU seconds of a picture."""

    cycles: NDArray[np.float64]
    eevee: NDArray[np.float64]
    mean: float
    worst: float
    noise: float
    seconds: float
    edges: tuple[float, float] | None


def measure(case: Case, samples: int) -> Found:
    """Render a case."""
    camera, plan = build(case), case.plan()
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, case.depth)
    develop = plan.reduction(case.depth).apply
    index = plan.column.refractive_index

    def drawn(engine: BandEngine, now: render_plan.RenderPlan) -> NDArray[np.float64]:
        return develop(grey_scene.band_image(engine, now, case.depth))

    with engines.eevee_bands(scene, camera, plan, extent, case.depth) as engine:
        eevee = drawn(engine, plan)
        start = time.process_time()
        drawn(engine, plan)  # the shaders are compiled, the light is solved
        seconds = time.process_time() - start
    halves = []
    slow = replace(plan, settings=replace(plan.settings, samples=samples))
    for seed in (1, 2):
        with engines.cycles_bands(scene, camera, slow, extent, seed=seed) as engine:
            halves.append(drawn(engine, slow))
    cycles = (halves[0] + halves[1]) / 2
    within = is_in_window(_directions(camera)[..., 2:], index)
    window = grey_scene.blocks(within, _BLOCK)[..., 0] > 0.5
    off = _delta_e(eevee, cycles)[window]
    noise = float(_delta_e(*halves)[window].mean()) / 2
    edges = edge_errors(case) if case.wind is None else None
    return Found(
        cycles, eevee, float(off.mean()), float(np.quantile(off, 0.95)), noise, seconds, edges
    )


def _delta_e(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    blocks = (grey_scene.blocks(picture, _BLOCK) for picture in (one, other))
    return delta_e_CIE2000_images(*blocks)


def edge_errors(case: Case) -> tuple[float, float]:
    """Mean and 95 % of how far edges of things in the air are off under a flat surface, degrees.

    The things glow; what a pixel has of them is compared with rays that are refracted one by one.
    """
    camera = build(case, _FINE)
    scene, plan = bpy.context.scene, case.plan(32)
    scene.render.filter_size = 0.01
    covered, dry = _traced(case, camera, plan.column.refractive_index)
    pictures = []
    for glow in (0.0, _GLOW):
        for item in scene.objects:
            if item.type == "MESH":
                item.data.materials[0] = _glowing(glow)
        extent = water_body.water_extent(scene, plan.column, case.depth)
        with engines.eevee_bands(scene, camera, plan, extent, case.depth) as engine:
            pictures.append(grey_scene.band_image(engine, plan, case.depth))
    up = np.maximum(_directions(camera, _FINE)[..., 2:], 1e-3)
    n, column = plan.column.refractive_index, plan.column
    c = column.absorption + column.scattering
    left = (1.0 - fresnel_reflectance(up, 1.0 / n)) * n**2 * np.exp(-c * case.depth / up)
    whole = left * (emission_basis(plan.bands) @ ([_GLOW] * 3))
    gained = ((pictures[1] - pictures[0]) / np.maximum(whole, 1e-6))[..., 1]
    edge = dry & (covered > 0.05) & (covered < 0.95)
    off = np.abs(np.clip(gained, 0.0, 1.0) - covered)[edge]
    pixel = math.degrees(2.0 * math.tan(_FIELD / 2)) / (_FINE * _WIDTH)  # at the middle
    return float(off.mean()) * pixel, float(np.quantile(off, 0.95)) * pixel


def _glowing(glow: float) -> bpy.types.Material:
    material = bpy.data.materials.new("glow")
    tree = material.node_tree
    tree.nodes.clear()
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = glow
    tree.links.new(
        emission.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"]
    )
    return material


def _traced(
    case: Case, camera: bpy.types.Object, index: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Share of each pixel that things in the air cover, and whether nothing in it is wet."""
    w = _directions(camera, _FINE * _RAYS)
    shape = w.shape[:2]
    w = w.reshape(-1, 3)
    meshes = Meshes(bpy.context.evaluated_depsgraph_get())
    inside = np.flatnonzero(is_in_window(w[:, 2], index) > 0.0)
    w = w[inside]
    away = case.depth / w[:, 2]
    eye = np.array(camera.matrix_world.translation)
    wet = ~meshes.clear(np.broadcast_to(eye, w.shape), w, away)
    place = eye + w * away[:, None]
    air = np.stack(direction_in_air(tuple(w.T), _UP, index), axis=1)
    met = ~meshes.clear(place + 1e-4 * air, air, np.full(len(w), 1e3))
    covered, in_water = np.zeros(shape[0] * shape[1]), np.ones(shape[0] * shape[1])
    covered[inside], in_water[inside] = met, wet
    covered, in_water = (
        grey_scene.blocks(x.reshape(*shape, 1), _RAYS)[..., 0] for x in (covered, in_water)
    )
    return covered, in_water == 0.0


_TEXT = """# Things in the air, seen from below

Cycles traces what is seen in Snell's window; EEVEE draws it in a second picture, where refraction
at a flat surface puts it, and follows rays that waves turn in a few steps.

Jerlov IB (HG 0.9), {bands} bands, clear sky, sun at 35°, cameras at 1.5 and 5 m that look up by
50°. Cycles: two pictures of {samples} samples, noise half their difference. ΔE2000 of {block} ×
{block} pixels of {width} × {height}, over the window; edges against rays that are refracted one
by one; CPU seconds of one picture, shaders compiled.

| scene | ΔE mean | 95 % | noise | edges, 95 % | CPU s |
|---|---|---|---|---|---|
{rows}

**The largest mean is {worst:.1f}; the target is {target:g} or less in each: {verdict}. Edges are
within {edge:.2f}° in 95 % of their pixels; the target is {edge_target:g}°: {edge_verdict}.**

![Cycles above, EEVEE below](window_things.jpg)

What is left of the posts in the wind is mostly a mirror image, which *Mirrored things* draws.
Without the second picture hull and pier took 3.5 and 3.7 CPU seconds; the pier took 10.5 instead
of 16.8 once what is hidden threw whole shadows. The surface mirrors the sun onto undersides in
EEVEE (2 to 3 % of its light), not in Cycles. Not drawn: [limits](../limits.md#surface).

Repeat: `python3 dev.py run -m benchmarks window_things`
"""


def report(found: dict[Case, Found], samples: int) -> str:
    """Return the page."""
    rows = []
    for case, x in found.items():
        edges = "" if x.edges is None else f"{x.edges[1]:.2f}°"
        cells = [case.title, *(f"{v:.1f}" for v in (x.mean, x.worst, x.noise)), edges]
        rows.append(f"| {' | '.join([*cells, f'{x.seconds:.1f}'])} |")
    worst = max(x.mean for x in found.values())
    edge = max(x.edges[1] for x in found.values() if x.edges is not None)
    return _TEXT.format(
        bands=_BANDS, samples=samples, block=_BLOCK,
        width=_WIDTH, height=_HEIGHT, rows="\n".join(rows), worst=worst,
        target=TARGET, verdict="met" if worst <= TARGET else "missed", edge=edge,
        edge_target=EDGE_TARGET, edge_verdict="met" if edge <= EDGE_TARGET else "missed",
    )  # fmt: skip


def _write(found: dict[Case, Found], samples: int, docs: Path) -> None:
    pairs = [Pair(case.title, x.cycles, x.eevee) for case, x in found.items()]
    write_sheet(pairs, len(pairs) // 2, (11.0, 5.2), docs / "window_things.jpg")
    (docs / "window_things.md").write_text(report(found, samples), encoding="utf-8")


def main(arguments: Sequence[str]) -> None:
    """Measure the scenes and write the page."""

    def numbers(x: Found) -> tuple[float, ...]:
        return x.mean, x.worst, x.noise, x.seconds, *(x.edges or ())

    run("window_things", CASES, measure, numbers, _write, arguments, samples=128)
