"""Views through and past the water surface: EEVEE against Cycles, three pages."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene.readers.ray_casting import Meshes
from ..uw_spectral.spectra.colour_rendering import srgb_encode
from ..uw_spectral.spectra.reflectance import emission_basis
from ..uw_spectral.surface.refraction import direction_in_air, fresnel_reflectance, is_in_window
from . import grey_scene
from ._places import Array, Compared, Place, sheet
from ._scenery import ball, block, camera_at, depth_of, material, post, view_rays
from .runner import Ask, Page, Target, table

_WATER = {"phase": "hg:0.9", "illuminant": "clear-sky", "floor_reflectance": "0.3"}
_BLOCK = 6
_WIDE = math.radians(75.0)
_FINE, _RAYS, _GLOW = 2, 6, 30.0  # of the edges: pixels, and rays per pixel, along a side
_WHITE = 0.995  # quantile of Cycles' picture that is shown white


def _place(
    title: str, objects: Callable[[], object], at: Array, turn: float, *, wind: float | None,
    floor: float = 8.0, angle: float = _WIDE, size: tuple[int, int] = (96, 54), drawn: int = 8,
    **more: object,
) -> Place:  # fmt: skip
    def build() -> bpy.types.Object:
        objects()
        return camera_at(at, (math.radians(turn), 0.0, 0.0), angle)

    sea = {"surface": "flat" if wind is None else "waves", "wind_speed": wind or 0.0}
    settings = {**_WATER, **sea, "floor_depth": floor, **more}
    return Place(title, build, sun=35.0, settings=settings, size=size, drawn=drawn)


def _below(title: str, up: float, wind: float | None, objects: Callable[[], object]) -> Place:
    sea = "flat" if wind is None else f"wind {wind:g} m/s"
    at = (0.0, 0.0, -1.5)
    return _place(f"{title}, {sea}", objects, at, 90.0 + up, wind=wind, size=(120, 66))


def _posts() -> None:
    post((-1.0, 4.0, -2.2), 0.15, 3.2, (0.5, 0.3, 0.15))
    post((0.6, 3.5, -3.0), 0.12, 8.0, (0.6, 0.6, 0.6))
    block("box", (2.0, 5.0, -0.5), (0.6, 0.6, 0.6), (0.7, 0.7, 0.1))


def _diver() -> None:
    suit, skin, level = (0.06, 0.06, 0.07), (0.55, 0.35, 0.25), math.pi / 2
    post((0.0, 3.2, -0.8), 0.2, 0.8, suit, level)
    ball((0.62, 3.2, -0.72), (0.14, 0.13, 0.16), skin)
    post((-0.1, 3.2, -0.52), 0.1, 0.6, (0.75, 0.6, 0.05), level)
    for side in (-0.12, 0.12):
        post((-0.8, 3.2 + side, -0.85), 0.08, 0.85, suit, level + 0.1)
        ball((-1.4, 3.2 + side, -0.9), (0.28, 0.1, 0.03), (0.1, 0.3, 0.7))


def _hull(turn: float) -> Callable[[], None]:
    return lambda: ball((0.2, 4.2, 0.0), (1.7, 0.65, 0.5), (0.6, 0.15, 0.1), math.radians(turn))


MIRRORED = (
    _below("posts", 10.0, None, _posts),
    _below("diver", 15.0, None, _diver),
    _below("hull from abeam", 10.0, None, _hull(0.0)),
    _below("hull at 45°", 10.0, None, _hull(45.0)),
    _below("hull from ahead", 10.0, None, _hull(90.0)),
    _below("posts", 10.0, 5.0, _posts),
    _below("diver", 15.0, 5.0, _diver),
    _below("hull at 45°", 10.0, 5.0, _hull(45.0)),
)


def _in_air(kind: str, depth: float) -> Callable[[], None]:
    def posts() -> None:
        ahead = 0.7 * (depth - 1.5)
        post((0.4, 1.0 + ahead, 0.5), 0.08, 4.0, (0.6, 0.5, 0.3))
        post((-0.9, 1.4 + ahead, 0.5), 0.12, 5.0, (0.7, 0.2, 0.1), 0.15)

    def pier() -> None:
        ahead = 0.4 * depth
        block("deck", (0.6, 1.6 + ahead, 1.6), (1.6, 2.4, 0.2), (0.5, 0.35, 0.2))
        for x in (0.0, 1.2):
            for y in (0.6 + ahead, 2.6 + ahead):
                post((x, y, -1.0), 0.1, 5.0, (0.4, 0.3, 0.2))

    def hull() -> None:
        ball((0.3, 1.6 + 0.4 * depth, 0.15), (1.5, 0.5, 0.5), (0.6, 0.15, 0.1), 0.6)

    return {"posts": posts, "pier": pier, "hull": hull}[kind]


WINDOW = tuple(
    _place(f"{kind}, {depth:g} m, {sea}", _in_air(kind, depth), (0.0, 0.0, -depth), 140.0,
           wind=wind)
    for wind, sea in ((None, "flat"), (5.0, "wind 5 m/s"))
    for depth in (1.5, 5.0)
    for kind in ("posts", "pier", "hull")
)  # fmt: skip


def _mound_and_post() -> None:
    ball((-0.8, 3.5, -4.0), 1.4, (0.5, 0.5, 0.5))
    post((1.4, 3.5, -1.5), 0.2, 5.0, (0.55, 0.35, 0.2))


def _above(title: str, height: float, turn: float, *, floor: bool = True, objects: bool = True,
           wind: float | None = None, coarser: int = 1, drawn: int = 16) -> Place:  # fmt: skip
    return _place(
        title, _mound_and_post if objects else lambda: None, (0.0, 0.0, height), turn, wind=wind,
        floor=4.0 if floor else 0.0, angle=math.radians(65.0), drawn=drawn,
        size=(96 // coarser, 54 // coarser), diffuse_shadows=False,
    )  # fmt: skip


WATERLINE = (
    _above("straight down, deep water", 2.0, 0.0, floor=False, objects=False),
    _above("45°, deep water", 2.0, 45.0, floor=False, objects=False),
    _above("45°, floor and objects", 2.0, 45.0),
    _above("75°, floor, objects and horizon", 1.5, 75.0),
    _above("75°, floor, waves", 1.5, 75.0, objects=False, wind=4.0, drawn=2, coarser=2),
    _above("half under water, level", 0.005, 88.0),
)


def measure(ask: Ask) -> Mapping[str, object]:
    """Render the scenes of a page."""
    places, of, heads = _OF[ask.name]
    rows, pictures, means, edges = [], {}, [], []
    for place in places[: ask.cases]:
        place = replace(place, samples=ask.samples)
        found, row, bound, edge = of(place, ask)
        rows.append([place.name, *row])
        means.append(bound)
        edges += edge
        white = float(np.quantile(found.reference, _WHITE))
        pictures[place.name] = [
            srgb_encode(np.clip(x / white, 0.0, 1.0))
            for x in (found.reference, found.pictures["bands"])
        ]
        print(*rows[-1], sep=" | ", flush=True)
    sheet(ask.shown(f"{ask.name}.jpg"), pictures, ("Cycles", "EEVEE"), across=2)
    worst = np.mean(means) if ask.name == "waterline" else max(means)
    return {"rows": table(heads, rows), "worst": float(worst),
            "edge": max(edges, default=0.0)}  # fmt: skip


def _mirrored(place: Place, ask: Ask) -> tuple[Compared, list[str], float, list[float]]:
    forms = {"without": {"planar_reflections": False}, "bands": {}}
    found = place.compared(place.open(), _BLOCK, ask.kept, forms=forms, clock=time.process_time)
    off = [found.delta_e(name) for name in ("without", "bands", "real time")]
    numbers = (*(x.mean() for x in off), np.quantile(off[1], 0.95), found.noise.mean())
    cells = [f"{x:.1f}" for x in numbers]
    cells.append(", ".join(f"{x:.1f}" for x in found.seconds.values()))
    return found, cells, float(max(numbers[1:3])), []


def window_errors(place: Place, kept: Callable[..., Array]) -> tuple[Compared, Array, Array]:
    """Render objects in the air; ΔE2000 and noise of the blocks in Snell's window."""
    camera = place.open()
    found = place.compared(camera, _BLOCK, kept, fast=False, clock=time.process_time)
    within = is_in_window(view_rays(camera)[..., 2:], _index(place))
    window = grey_scene.blocks(within, _BLOCK)[..., 0] > 0.5
    return found, found.delta_e("bands")[window], found.noise[window]


def _in_window(place: Place, ask: Ask) -> tuple[Compared, list[str], float, list[float]]:
    found, off, noise = window_errors(place, ask.kept)
    edge = [edge_errors(place)[1]] if place.settings["surface"] == "flat" else []
    cells = [f"{x:.1f}" for x in (off.mean(), np.quantile(off, 0.95), noise.mean())]
    cells += [f"{edge[0]:.2f}°" if edge else "", f"{found.seconds['bands']:.1f}"]
    return found, cells, float(off.mean()), edge


def _above_water(place: Place, ask: Ask) -> tuple[Compared, list[str], float, list[float]]:
    found = place.compared(place.open(), _BLOCK * place.size[0] // 96, ask.kept)
    bands, fast = found.delta_e("bands"), found.delta_e("real time")
    numbers = (bands.mean(), fast.mean(), np.quantile(bands, 0.95), found.noise.mean())
    return found, [f"{x:.1f}" for x in numbers], float(bands.mean()), []


def _index(place: Place) -> float:
    return place.plan(1).column.refractive_index


def edge_errors(place: Place) -> tuple[float, float]:
    """Mean and 95 % of how far edges of objects in the air are off under a flat surface, degrees.

    The objects glow; what a pixel has of them is compared with rays that are refracted one by one.
    """
    fine = replace(place, size=tuple(_FINE * n for n in place.size))
    camera, plan = fine.open(), fine.plan(1)
    scene, depth = bpy.context.scene, depth_of(camera)
    scene.render.filter_size = 0.01
    covered, dry = _traced(camera, depth, _index(place))
    pictures = []
    for glow in (0.0, _GLOW):
        for item in scene.objects:
            if item.type == "MESH":
                item.data.materials[0] = material("Emission", Strength=glow)
        pictures.append(grey_scene.eevee_image(plan, camera, 32))
    up = np.maximum(view_rays(camera)[..., 2:], 1e-3)
    n, column = plan.column.refractive_index, plan.column
    c = column.absorption + column.scattering
    left = (1.0 - fresnel_reflectance(up, 1.0 / n)) * n**2 * np.exp(-c * depth / up)
    whole = left * (emission_basis(plan.bands) @ ([_GLOW] * 3))
    gained = ((pictures[1] - pictures[0]) / np.maximum(whole, 1e-6))[..., 1]
    edge = dry & (covered > 0.05) & (covered < 0.95)
    off = np.abs(np.clip(gained, 0.0, 1.0) - covered)[edge]
    pixel = math.degrees(2.0 * math.tan(_WIDE / 2)) / fine.size[0]  # at the middle
    return float(off.mean()) * pixel, float(np.quantile(off, 0.95)) * pixel


def _traced(
    camera: bpy.types.Object, depth: float, index: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Fraction of each pixel that objects in the air cover, and whether nothing in it is wet."""
    w = view_rays(camera, _RAYS)
    shape = w.shape[:2]
    w = w.reshape(-1, 3)
    meshes = Meshes(bpy.context.evaluated_depsgraph_get())
    inside = np.flatnonzero(is_in_window(w[:, 2], index) > 0.0)
    w = w[inside]
    away = depth / w[:, 2]
    eye = np.array(camera.matrix_world.translation)
    wet = ~meshes.clear(np.broadcast_to(eye, w.shape), w, away)
    at = eye + w * away[:, None]
    air = np.stack(direction_in_air(tuple(w.T), (0.0, 0.0, 1.0), index), axis=1)
    met = ~meshes.clear(at + 1e-4 * air, air, np.full(len(w), 1e3))
    covered, in_water = np.zeros(shape[0] * shape[1]), np.ones(shape[0] * shape[1])
    covered[inside], in_water[inside] = met, wet
    covered, in_water = (
        grey_scene.blocks(x.reshape(*shape, 1), _RAYS)[..., 0] for x in (covered, in_water)
    )
    return covered, in_water == 0.0


_OF = {
    "planar_reflection": (
        MIRRORED, _mirrored,
        ("scene", "without", "bands", "real time", "bands, 95 %", "noise", "seconds"),
    ),
    "planar_refraction": (
        WINDOW, _in_window, ("scene", "ΔE mean", "95 %", "noise", "edges, 95 %", "CPU s"),
    ),
    "waterline": (
        WATERLINE, _above_water,
        ("view", "EEVEE, bands: ΔE mean", "real time", "bands, 95 %", "Cycles' noise"),
    ),
}  # fmt: skip
PAGES = {
    "planar_reflection": Page(
        "Objects mirrored in the surface",
        """
Cycles traces what the surface mirrors; EEVEE draws it in a second picture, from the mirror image of
the camera, and follows rays that waves turn in a few steps. Jerlov IB (HG 0.9), clear sky, sun at
35°, camera at 1.5 m. Cycles: two pictures of {samples} samples, noise half their difference. ΔE2000
of 6 × 6 of 120 × 66 pixels; CPU seconds of one pass.

{rows}

![Cycles and EEVEE](planar_reflection.jpg)

Not drawn: [limits](../limits.md#surface).
""",
        (Target("largest mean ΔE2000 of a scene", "worst", 2.0),),
        {"samples": 128, "cases": 99},
    ),
    "planar_refraction": Page(
        "Objects in the air, seen from below",
        """
Cycles traces what is seen in Snell's window; EEVEE draws it in a second picture, where refraction
at a flat surface puts it, and follows rays that waves turn in a few steps.

Jerlov IB (HG 0.9), 3 bands, clear sky, sun at 35°, cameras at 1.5 and 5 m that look up by 50°.
Cycles: two pictures of {samples} samples, noise half their difference. ΔE2000 of 6 × 6 pixels of 96
× 54, over the window; edges against rays that are refracted one by one; CPU seconds of one picture,
shaders compiled.

{rows}

![Cycles and EEVEE](planar_refraction.jpg)

What is left of the posts in the wind is mostly a mirror image, which *Planar reflections* draws.
Without the second picture hull and pier took 3.5 and 3.7 CPU seconds; the pier took 10.5 instead of
16.8 once what is hidden threw whole shadows. The surface mirrors the sun onto undersides in EEVEE
(2 to 3 % of its light), not in Cycles. Not drawn: [limits](../limits.md#surface).
""",
        (
            Target("largest mean ΔE2000 of a scene", "worst", 2.0),
            Target("edges under a flat surface, 95 %, degrees", "edge", 0.3),
        ),
        {"samples": 128, "cases": 99},
    ),
    "waterline": Page(
        "From above, and at the waterline",
        """
EEVEE moves the vertices of what lies under water to where refraction makes them seem to lie, and
each pixel works out its ray in the water from there; Cycles traces rays. Where the waterline is on
the glass of the port EEVEE draws both worlds; a meniscus of 3.1 mm stands at the line.

Jerlov IB (HG 0.9), clear sky, sun at 35°, no occlusion. Cycles: two pictures of {samples} samples,
noise half their difference. ΔE2000 of 6 × 6 of 96 × 54 pixels; angles from straight down.

{rows}

![Cycles and EEVEE](waterline.jpg)

Not drawn: [limits](../limits.md#from-above-and-at-the-waterline). Auto expected ΔE 0.6 and 0.9 in
the third and fourth view, 1.0 and 0.7 were found.
""",
        (Target("mean ΔE2000 of the views", "worst", 2.0),),
        {"samples": 256, "cases": 99},
    ),
}
