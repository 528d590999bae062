"""Materials under water by Cycles, by EEVEE and by Mitsuba 3.

Three balls and a pane in the water of one scene, whose radiances are compared object by object. In
Mitsuba the interfaces have the indices of both sides: 1.5 in 1.34. The sun is a disc wide enough
for paths through glass to find it.
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType

import bpy
import numpy as np
from numpy.typing import NDArray

from ..scene import marks
from ..scene.engines import band_engine, engines
from ..scene.materials import clear_shadows
from ..scene.water import water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.spectra.reflectance import uplift_basis
from ..uw_spectral.surface.refraction import REFRACTIVE_INDEX
from ..uw_spectral.transfer.water_column import WaterColumn
from . import grey_scene
from ._material_kinds import RADIUS, slab, sphere
from ._rays import sphere_distance
from ._scenery import material, matt, new_file
from .mitsuba_reference import (
    HEIGHT,
    WIDTH,
    by_mitsuba,
    load_mitsuba,
    mean_and_error,
    mitsuba_scene,
    sky_picture,
    sky_pixels,
)
from .runner import Ask, Page, table

_DEPTH = 4.0  # of the camera, m
# From the camera. The pane stands lower, so that the floor is seen through it.
_PLACES = ((-1.35, 3.0, -0.3), (-0.45, 3.0, -0.3), (0.45, 3.0, -0.3), (1.35, 4.0, -1.8))
_LEAN, _THIN = math.radians(55.0), 0.08  # of the pane, as :func:`.slab` makes it
_SUN_WIDTH = math.radians(10.0)
_GLASS, _DIFFUSE, _DARK = 1.5, 0.5, 0.05
_GOLD, _METAL_ROUGHNESS, _PLASTIC_ROUGHNESS = (0.9, 0.6, 0.2), 0.3, 0.2
_INSIDE = 0.93  # of an object's size: its edges are left out
_EEVEE_SAMPLES = 64

DIFFUSE, METAL, PLASTIC, PANE = "diffuse ball", "rough metal ball", "plastic ball", "glass pane"
OCCLUSION, REST = "floor in the pane's shade", "all the rest"
PLACES = (DIFFUSE, METAL, PLASTIC, PANE, OCCLUSION, REST)
"""What is compared: pixels that show an object, or the floor."""
CYCLES, STRAIGHT, EEVEE = "Cycles", "Cycles, sun straight through", "EEVEE"
MITSUBA, INNER = "Mitsuba", "Mitsuba, roughplastic"


@dataclass(frozen=True, eq=False)
class Measured:
    """Mean radiances of the places by renderer, each of shape (seeds, places, bands)."""

    bands: NDArray[np.float64]
    means: Mapping[str, NDArray[np.float64]]

    def ratio(self, one: str, other: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Ratio of two renderers by place and band, and its standard error."""
        (a, a_error), (b, b_error) = (_mean_and_error(self.means[x]) for x in (one, other))
        return a / b, a / b * np.hypot(a_error / a, b_error / b)

    def of_all_bands(self, one: str, other: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Ratio by place, of the bands as they are certain; one path may carry all of them."""
        ratio, error = self.ratio(one, other)
        weights = error**-2.0 / (error**-2.0).sum(axis=-1, keepdims=True)
        relative = (
            (self.means[x] / self.means[x].mean(axis=0) * weights).sum(axis=-1)
            for x in (one, other)
        )
        errors = [_mean_and_error(x)[1] for x in relative]
        mean = (weights * ratio).sum(axis=-1)
        return mean, mean * np.hypot(*errors)

    def rows(self, one: str, other: str, places: Sequence[str]) -> list[list[str]]:
        """Rows of a table in per cent: by band, and of all."""
        found = np.stack(self.ratio(one, other), axis=-1)
        every = np.stack(self.of_all_bands(one, other), axis=-1)
        rows = []
        for place, bands, mean in zip(PLACES, found, every, strict=True):
            cells = [f"{100 * (r - 1):+.1f}±{100 * e:.1f}" for r, e in (*bands, mean)]
            cells[-1] = f"**{cells[-1]}**"
            if place in places:
                rows.append([place, one if other == MITSUBA else other, *cells])
        return rows


def _mean_and_error(
    samples: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and error over seeds; EEVEE has one picture, whose noise is not known."""
    if len(samples) == 1:
        return samples[0], np.zeros_like(samples[0])
    return mean_and_error(samples)


def plan_for(samples: int) -> render_plan.RenderPlan:
    """Return the plan: clear water over a grey floor, a clear sky, the sun behind the camera."""
    return render_plan.make_plan(
        SceneSettings(
            water="jerlov:IB", phase="hg:0.85", bands=3, surface="none", illuminant="clear-sky",
            sun_zenith=30.0, sun_azimuth=90.0, floor_depth=_DEPTH + grey_scene.ABOVE_FLOOR,
            floor_reflectance=str(grey_scene.FLOOR_REFLECTANCE), samples=samples,
        )
    )  # fmt: skip


def _where(number: int) -> NDArray[np.float64]:
    return np.array(_PLACES[number]) - (0.0, 0.0, _DEPTH)


def build_scene() -> bpy.types.Object:
    """Fill an empty file with the objects, and return the camera."""
    new_file()
    camera = grey_scene.build_scene(_DEPTH, WIDTH, HEIGHT)
    bpy.data.objects.remove(bpy.data.objects["sphere"])
    # GGX, for Mitsuba scatters once within a rough surface.
    principled = functools.partial(material, "BsdfPrincipled", distribution="GGX")
    for number, (body, made) in enumerate((
        (sphere, matt((_DIFFUSE, _DIFFUSE, _DIFFUSE))),
        (sphere, principled(Base_Color=_GOLD, Roughness=_METAL_ROUGHNESS, Metallic=1.0)),
        (sphere, principled(Base_Color=(_DARK,) * 3, Roughness=_PLASTIC_ROUGHNESS, IOR=_GLASS)),
        (slab, material("BsdfGlass", distribution="GGX", Color=(1.0,) * 3, Roughness=0.0,
                        IOR=_GLASS)),
    )):  # fmt: skip
        body(made).location = _where(number).tolist()
    bpy.context.view_layer.update()
    return camera


def objects_in_mitsuba(
    mitsuba: ModuleType, plan: render_plan.RenderPlan, band: int, *, inner: bool
) -> dict:
    """Describe the objects in a band; with ``inner``, plastic as Mitsuba has it.

    Otherwise it is what Blender means: a matte base and the mirror of a dielectric above it.
    """
    water = REFRACTIVE_INDEX
    gold = float((np.array(_GOLD) @ uplift_basis(plan.bands).T)[band])
    alpha = _PLASTIC_ROUGHNESS**2
    if inner:
        plastic = {
            "type": "roughplastic", "distribution": "ggx", "alpha": alpha, "int_ior": _GLASS,
            "ext_ior": water, "diffuse_reflectance": _DARK,
        }  # fmt: skip
    else:
        # Halves of a blend, each twice as bright. A conductor that absorbs nothing mirrors as a
        # dielectric does.
        plastic = {
            "type": "blendbsdf", "weight": 0.5,
            "matte": {"type": "diffuse", "reflectance": 2.0 * _DARK},
            "mirror": {
                "type": "roughconductor", "distribution": "ggx", "alpha": alpha,
                "eta": _GLASS / water, "k": 0.0, "specular_reflectance": 2.0,
            },
        }  # fmt: skip
    metal = {
        "type": "principled", "base_color": gold, "metallic": 1.0, "roughness": _METAL_ROUGHNESS
    }  # fmt: skip
    balls = ({"type": "diffuse", "reflectance": _DIFFUSE}, metal, plastic)
    described: dict = {
        f"ball_{number}": {
            "type": "sphere", "center": _where(number).tolist(), "radius": RADIUS, "bsdf": bsdf
        }
        for number, bsdf in enumerate(balls)
    }  # fmt: skip
    described["pane"] = {
        "type": "cube",
        "to_world": mitsuba.ScalarTransform4f()
        .translate(_where(3).tolist())
        .rotate([1.0, 0.0, 0.0], math.degrees(_LEAN))
        .scale([RADIUS, RADIUS, _THIN * RADIUS]),
        "bsdf": {"type": "dielectric", "int_ior": _GLASS, "ext_ior": water},
        "exterior": {"type": "ref", "id": "medium"},
    }
    return described


def _mitsuba_scene(
    mitsuba: ModuleType, plan: render_plan.RenderPlan, band: int, half_width: float, *, inner: bool
) -> dict:
    scene = mitsuba_scene(mitsuba, plan, band, _DEPTH, half_width)
    del scene["sphere"], scene["sun"]
    scene["sky"]["bitmap"] = mitsuba.Bitmap(sky_with_sun(plan.column, band))
    return {**scene, **objects_in_mitsuba(mitsuba, plan, band, inner=inner)}


def sky_with_sun(column: WaterColumn, band: int) -> NDArray[np.float32]:
    """Draw the sky of :func:`.sky_picture` in a band, with a disc that brings what the sun does."""
    picture = sky_picture(column.skylight, band)
    directions, solid_angles = sky_pixels(*picture.shape[:2])
    inside = -(directions @ column.sun_direction) > math.cos(_SUN_WIDTH / 2.0)
    normal = float(column.sun_irradiance[band] / column.sun_cosine)
    disc = inside * normal / float((inside * solid_angles).sum())
    return picture + disc[..., None].astype(np.float32)


def places_seen(column: WaterColumn) -> NDArray[np.bool_]:
    """Return which pixels show each of :data:`PLACES`, shape (places, h, w)."""
    ray = grey_scene.trace(column.sun_direction, WIDTH, HEIGHT, 1).direction
    eye = np.array([0.0, 0.0, -_DEPTH])
    seen = [_meets_ball(eye, ray, number, _INSIDE) for number in range(3)]
    seen.append(_meets_pane(eye, ray, _INSIDE))
    down = np.minimum(ray[..., 2:], -1e-3)
    floor = eye - ray * grey_scene.ABOVE_FLOOR / down
    touched = [_meets_ball(eye, ray, number, 1.1) for number in range(3)]
    covered = np.any([*touched, _meets_pane(eye, ray, 1.2)], axis=0)
    to_sun = np.broadcast_to(-column.sun_direction, floor.shape)
    occluded = _meets_pane(floor, to_sun, 0.85) & (ray[..., 2] < 0.0) & ~covered
    rest = ~(covered | _meets_pane(floor, to_sun, 1.4))
    return np.stack([*seen, occluded, rest])


def _meets_ball(
    start: NDArray[np.float64], ray: NDArray[np.float64], number: int, size: float
) -> NDArray[np.bool_]:
    return np.isfinite(sphere_distance(start, ray, _where(number), size * RADIUS))


def _meets_pane(
    start: NDArray[np.float64], ray: NDArray[np.float64], size: float
) -> NDArray[np.bool_]:
    c, s = math.cos(_LEAN), math.sin(_LEAN)
    up, out = np.array([0.0, c, s]), np.array([0.0, -s, c])
    offset = _where(3) - start
    along = (offset @ out) / (ray @ out)
    point = along[..., None] * ray - offset
    reach = np.maximum(np.abs(point[..., 0]), np.abs(point @ up))
    return (along > 0.0) & (reach < size * RADIUS)


@contextlib.contextmanager
def _cycles(
    camera: bpy.types.Object, plan: render_plan.RenderPlan, seed: int, *, straight: bool
) -> Iterator[band_engine.BandEngine]:
    """Open Cycles with the wide sun; ``straight`` as under a water surface."""
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, _DEPTH)
    with engines.cycles_bands(scene, camera, plan, extent, seed=seed) as engine:
        if straight:
            clear_shadows.insert(m for m in bpy.data.materials if m.name.startswith("BsdfGlass"))
        for item in marks.objects(scene):
            if marks.IS_SUN in item:
                item.data.angle = _SUN_WIDTH
                if straight:
                    item.visible_transmission = False
                    item.data.cycles.use_multiple_importance_sampling = False
        yield engine


def measured(seeds: int, samples: int, variant: str) -> Measured:
    """Render the scene by all; Mitsuba takes twice the samples of Cycles."""
    plan = plan_for(samples)
    camera = build_scene()
    seen = places_seen(plan.column)
    extent = water_body.water_extent(bpy.context.scene, plan.column, _DEPTH)
    mitsuba = load_mitsuba(variant)
    count = len(plan.bands)

    def cycles(seed: int, *, straight: bool) -> NDArray[np.float64]:
        with _cycles(build_scene(), plan, seed, straight=straight) as engine:
            return grey_scene.band_image(engine, plan, _DEPTH)

    def scenes(*, inner: bool) -> list[object]:
        return [
            mitsuba.load_dict(_mitsuba_scene(mitsuba, plan, band, extent.half_width, inner=inner))
            for band in range(count)
        ]

    def means(name: str, render: Callable[[int], NDArray[np.float64]]) -> NDArray[np.float64]:
        found = []
        for seed in range(1, seeds + 1):
            image = render(seed)
            found.append([image[place].mean(axis=0) for place in seen])
            print(name, seed, np.round(found[-1], 5).tolist(), flush=True)
        return np.array(found)

    image = grey_scene.eevee_image(plan, camera, _EEVEE_SAMPLES)
    by = {EEVEE: np.array([[image[place].mean(axis=0) for place in seen]])}
    by[CYCLES] = means(CYCLES, lambda seed: cycles(seed, straight=False))
    by[STRAIGHT] = means(STRAIGHT, lambda seed: cycles(seed, straight=True))
    by[MITSUBA] = means(MITSUBA, by_mitsuba(mitsuba, scenes(inner=False), 2 * samples))
    by[INNER] = means(INNER, by_mitsuba(mitsuba, scenes(inner=True), 2 * samples))
    return Measured(np.array(plan.bands.centres), by)


def measure(ask: Ask) -> Mapping[str, object]:
    """Render and compare."""
    found = measured(ask.seeds, ask.samples, ask.variant)
    rows = []
    for one, other, places in (
        (CYCLES, MITSUBA, PLACES), (STRAIGHT, MITSUBA, (OCCLUSION,)), (CYCLES, INNER, (PLASTIC,)),
        (EEVEE, MITSUBA, PLACES),
    ):  # fmt: skip
        rows += found.rows(one, other, places)
    heads = ("what is seen", "of", *(f"{nm:.0f} nm" for nm in found.bands), "all bands")
    return {"rows": table(heads, rows), "twice": 2 * ask.samples}


PAGE = Page(
    "Materials under water: Cycles and EEVEE against Mitsuba 3",
    """
Three balls and a leaning pane in Jerlov IB (HG 0.85), 90 × 54 pixels, camera 4 m deep, 3 m above a
grey floor, no surface, clear sky, sun at 30°, 10° wide (in EEVEE 0.4°). Difference of the mean
radiance in % ± the standard error of {seeds} seeds of {samples} samples in Cycles, {twice} in
Mitsuba (`{variant}`); EEVEE in band passes, one picture.

{rows}

## What is compared

- Metal: Principled, *GGX*; *Multiscatter GGX* adds up to 1 %. Plastic: index 1.5; in Mitsuba a
  mirror over a matte base, or its *roughplastic*. Of what it mirrors EEVEE draws the sun only: the
  dark ball is too dark.
- Pane: glass 6 cm thick. Under a surface Cycles lets sunlight straight through; what is traced
  comes by few paths.
- EEVEE is too bright in the far red, as on the [grey scene](realtime_accuracy.md).
- With *indices in water* off the plastic ball is 36/44/50 % brighter in Cycles, the pane 5/5/12 %.
""",
    settings={"seeds": 10, "samples": 96, "variant": "scalar_rgb"},
)
