"""Clouds of silt: EEVEE against Cycles, their light against photons, and what they cost."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..node_groups.node_mathematics import NODES, Graph
from ..scene.water import new_clouds
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.clouds.cloud_light import Clouds, Several
from ..uw_spectral.clouds.cloud_numbers import CloudNumbers, with_escapes
from ..uw_spectral.clouds.gaussian_blob import GaussianBlob
from ..uw_spectral.clouds.lamp_lit_cloud import path_light
from ..uw_spectral.clouds.matter import BluntPhase, SuspendedMatter, blunt_phase, suspended_matter
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_projection import project_lamps
from ..uw_spectral.lamps.multiple_scattering import lamp_water
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import srgb_encode
from ..uw_spectral.transfer.channels import channels_of_bands
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.water.phase_functions import parse_phase
from ..validation.cloud_photons import GreyBlob, radiance
from ._drawing import drawing
from ._places import Compared, Place, sheet
from ._scenery import ball, camera_at, ground, new_file
from .runner import Ask, Page, Target, table

_DEPTH, _FLOOR = 5.0, 6.5  # m
_SIZE = (48, 30)
_SIGMA, _SEEN = 0.5, 0.5
_SUN = (0.373, 0.0, -0.928)
_VIEWS = {"level": (0.0, 1.0, 0.0), "down": (0.0, 0.766, -0.643), "up": (0.0, 0.866, 0.5)}
_COST_SIZE, _COST_SAMPLES = (240, 135), 16
# A torch beside the camera, which shines to the middle of the cloud.
_TORCH, _WATTS, _CONE, _BLEND = (0.45, 0.0, -_DEPTH + 0.25), 400.0, math.radians(50.0), 0.5
_MIDDLE = (0.0, 3.0, -_DEPTH)
_VOXELS = 64  # along each side of a plume
# Of a lamp before photons, from the middle of the blob.
_LAMP = (0.4, -3.0, 0.2)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Water, concentration, what there is so much of, and the light.

    ``look`` is the camera's angle from straight down in degrees, ``watts`` the power of a torch
    beside it, ``sunlight`` a factor on sun and sky, ``grid`` whether the cloud is a volume object
    of noise instead of a blob.
    """

    water: str
    concentration: float
    look: float = 90.0
    floor: bool = True
    watts: float = 0.0
    sunlight: float = 1.0
    grid: bool = False
    constituent: str = "minerals"

    @property
    def bands(self) -> int:
        """How many; few where Cycles takes long."""
        return 3 if self.watts else 8

    @property
    def block(self) -> int:
        """Pixels along a side of what is compared."""
        return 6 if self.watts else 3

    @property
    def light(self) -> str:
        """What lights it."""
        if not self.watts:
            return "day"
        return "day and torch" if self.sunlight else "torch"


_CASES = (
    *(Case("jerlov:II", 0.0), Case("jerlov:II", 12.0), Case("jerlov:IB", 12.0)),
    *(Case("jerlov:II", x, watts=_WATTS, sunlight=0.0) for x in (0.0, 12.0)),
    Case("jerlov:IB", 12.0, watts=_WATTS, sunlight=0.0),
    *(Case(f"jerlov:{x}", 12.0, watts=_WATTS) for x in ("II", "IB")),
)
_GRIDS = (
    *(Case(f"jerlov:{x}", 12.0, grid=True) for x in ("II", "IB")),
    Case("jerlov:II", 12.0, watts=_WATTS, sunlight=0.0, grid=True),
)


def build(case: Case, blobs: int = 1) -> bpy.types.Object:
    """Build three balls, sand and a cloud among them in the open file; return the camera."""
    scene = bpy.context.scene
    camera = camera_at((0.0, 0.0, -_DEPTH), (math.radians(case.look), 0, 0), math.radians(60.0))
    camera.data.clip_start = 0.01
    if case.grid:
        item = add_plume(scene, _MIDDLE)
        item.underwater.constituent, item.underwater.concentration = "minerals", case.concentration
    for number in range(blobs if case.concentration and not case.grid else 0):
        item = new_clouds.add_blob(scene, case.constituent)
        item.location.x += 1.5 * number
        item.location.y += 1.0 * number
        item.underwater.concentration = case.concentration
    if case.floor:
        ball((-0.6, 3.3, -5.2), 0.25, (0.8, 0.2, 0.1))
        ball((1.3, 5.0, -5.3), 0.6, (0.5, 0.5, 0.5))
        ball((0.2, 2.3, -5.4), 0.15, (0.7, 0.7, 0.7))
        ground(-_FLOOR, (0.35, 0.33, 0.28), 200.0)
    if case.watts:
        torch = bpy.data.objects.new("Torch", bpy.data.lights.new("Torch", "SPOT"))
        torch.data.energy, torch.data.shadow_soft_size = case.watts, 0.03
        torch.data.spot_size, torch.data.spot_blend = _CONE, _BLEND
        torch.location, look = _TORCH, Vector(_MIDDLE) - Vector(_TORCH)
        torch.rotation_euler = look.to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(torch)
    bpy.context.view_layer.update()
    return camera


def add_plume(scene: bpy.types.Scene, place: Sequence[float]) -> bpy.types.Object:
    """Add a volume object whose density is noise that ends in a ball of 1.2 m about a place."""
    tree = bpy.data.node_groups.new("Plume", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    graph = Graph(tree)
    cube, noise, away = (
        graph.node(kind) for kind in ("GeometryNodeVolumeCube", "ShaderNodeTexNoise",
                                      "ShaderNodeVectorMath")
    )  # fmt: skip
    cube.inputs["Min"].default_value, cube.inputs["Max"].default_value = (-1.2,) * 3, (1.2,) * 3
    for axis in "XYZ":
        cube.inputs[f"Resolution {axis}"].default_value = _VOXELS
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 1.6, 3.0
    away.operation = "LENGTH"
    tree.links.new(graph.node("GeometryNodeInputPosition").outputs[0], away.inputs[0])
    rim = NODES.minimum(NODES.maximum(3.0 - 2.5 * graph.term(away.outputs["Value"]), 0.0), 1.0)
    thick = NODES.maximum(graph.term(noise.outputs[0]) - 0.42, 0.0)
    graph.assign(7.0 * thick * rim, cube.inputs["Density"])
    tree.links.new(cube.outputs[0], graph.node("NodeGroupOutput").inputs[0])
    item = bpy.data.objects.new("Plume", bpy.data.volumes.new("Plume"))
    item.modifiers.new("Plume", "NODES").node_group = tree
    item.location, item.rotation_euler = place, (0.0, 0.0, 0.5)
    scene.collection.objects.link(item)
    return item


def _parallel(view: Sequence[float], away: float) -> tuple[list[Array], list[float]]:
    """Rays about the middle of the blob: where they begin, and their direction."""
    v = np.array(view)
    u = np.cross(v, [1.0, 0.2, 0.1])
    u /= np.linalg.norm(u)
    r = _SEEN * _SIGMA * np.sqrt((np.arange(6) + 0.5) / 6)[:, None]
    t = np.arange(8) * math.pi / 4
    sides = (r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()
    places = -away * v + np.outer(sides[0], u) + np.outer(sides[1], np.cross(v, u))
    return list(places.T[..., None]), list(v)


def _formula(
    matter: SuspendedMatter, blunt: BluntPhase, view: Sequence[float], *, isotropic: bool
) -> float:
    cloud = _grey_cloud(matter, blunt, sun=float(not isotropic), ambient=float(isotropic))
    clouds, origins = Clouds(Several([cloud]), [matter.phase], _SUN), _parallel(view, 6.0)
    veil = clouds.veil(*origins, 60.0 * np.ones((48, 1)), half_angle2(origins[1], list(_SUN)))
    return float(veil.light[:, 0].mean())


def _grey_cloud(
    matter: SuspendedMatter, blunt: BluntPhase, *, sun: float, ambient: float
) -> CloudNumbers:
    a, b, one = float(matter.absorption[0]), float(matter.scattering[0]), np.ones(3)
    wide, turned = b * (1.0 - blunt.peak), b * (1.0 - matter.phase.g)
    blob = GaussianBlob.of_axes((0, 0, 0), 2.0 * _SIGMA * np.eye(3))
    return CloudNumbers(
        blob.middle, blob.rows, (a + b) * one, (a + wide) * one, wide / (a + wide) * one,
        sun * one, 0 * one, ambient * one, 0 * one, 0 * one, 0 * one, 0 * one,
        (a + turned) * one, turned / (a + turned) * one, 0.0,
        blunt.asymmetry, blunt.ceiling, blunt.peak,
    )  # fmt: skip


def compare(case: Case, samples: int, ask: Ask) -> Compared:
    """Render a case by both engines."""
    typical = {
        k: getattr(SceneSettings(), k) for k in ("surface", "sky", "sun_zenith", "sun_azimuth")
    }
    settings = {**typical, "sunlight": case.sunlight, "bands": case.bands}
    name = f"{case.water} {case.light} {case.concentration:g} {case.constituent} {case.grid}"
    place = Place(
        name, lambda: build(case), case.water.removeprefix("jerlov:"), size=_SIZE, drawn=8,
        samples=samples * (8 if case.watts else 1) // 2, settings=settings,
    )  # fmt: skip
    return place.compared(place.open(), case.block, ask.kept, fast=False)


def compared_rows(
    cases: Sequence[Case], shown: Mapping[int, str], ask: Ask
) -> tuple[list[list[str]], float]:
    """Render cases, write the pictures of some; rows of all, and the largest mean ΔE by day."""
    rows, worst = [], 0.0
    for number, case in enumerate(cases[: ask.cases]):
        found = compare(case, ask.samples, ask)
        off, seen = found.delta_e("bands"), found.pictures["bands"]
        light = seen[..., 1].sum() / found.reference[..., 1].sum()
        numbers = (off.mean(), np.quantile(off, 0.95), found.noise.mean())
        rows.append([case.water.removeprefix("jerlov:"), case.light, f"{case.concentration:g}",
                     *(f"{x:.2f}" for x in numbers), f"{light:.3f}"])  # fmt: skip
        worst = max(worst, float(off.mean())) if case.light == "day" else worst
        if number in shown:
            both = {"": [srgb_encode(np.clip(x, 0.0, 1.0)) for x in (seen, found.reference)]}
            sheet(ask.shown(shown[number]), both, ("EEVEE", "Cycles"), size=3.6)
    return rows, worst


def _grey(concentration: float, constituent: str) -> tuple[SuspendedMatter, GreyBlob, str]:
    matter = suspended_matter(constituent, concentration, [550.0])
    a, b = float(matter.absorption[0]), float(matter.scattering[0])
    depth = f"{(a + b) * _SIGMA * math.sqrt(2.0 * math.pi):.1f}"
    return matter, GreyBlob(_SIGMA, a, b, matter.phase), depth


def photons_row(concentration: float, constituent: str = "minerals") -> list[str]:
    """Compare the light of a blob in a beam, and in light from all sides, with photons."""
    matter, grey, depth = _grey(concentration, constituent)
    blunt, cells = blunt_phase(matter.phase), []
    for isotropic in (False, True):
        traced = radiance(grey, _SUN, _VIEWS, isotropic=isotropic, count=300_000)
        found = {n: _formula(matter, blunt, v, isotropic=isotropic) for n, v in _VIEWS.items()}
        cells.append("/".join(f"{found[name] / traced[name]:.2f}" for name in _VIEWS))
    return [f"{concentration:g}", depth, *cells]


def lamp_row(concentration: float, constituent: str = "minerals") -> list[str]:
    """Compare the light of a blob in the light of a lamp with photons."""
    matter, grey, depth = _grey(concentration, constituent)
    views = _VIEWS | {"side": (1.0, 0.0, 0.0), "towards": (0.0, -1.0, 0.0)}
    traced = radiance(grey, _SUN, views, lamp=_LAMP, count=200_000)
    nothing = parse_phase("isotropic").for_bands([0.0] * 3)
    water = lamp_water([0.0] * 3, [0.0] * 3, nothing)
    lamp = Lamp(_LAMP, (0.0, 1.0, 0.0), np.ones(3))
    channels = channels_of_bands(Bands.uniform(3), [0, 1, 2])
    projected = project_lamps([lamp], water, channels, clouds=_SIGMA)
    cloud = with_escapes(_grey_cloud(matter, blunt_phase(matter.phase), sun=0.0, ambient=0.0))
    clouds = Clouds(Several([cloud]), [matter.phase], _SUN)
    ratios = []
    for name, view in views.items():
        light = path_light(projected, clouds, *_parallel(view, 60.0), np.full((48, 1), 200.0))
        ratios.append(float(light[:, 0].mean()) / traced[name])
    return [f"{concentration:g}", depth, "/".join(f"{x:.2f}" for x in ratios)]


def seconds_of_frames(
    blobs: int, watts: float = 0.0, constituent: str = "minerals", *, grid: bool = False
) -> tuple[float, float]:
    """CPU seconds of the first and of a later picture in real time."""
    new_file(_COST_SIZE)
    build(Case("jerlov:II", 12.0, watts=watts, constituent=constituent, grid=grid), blobs)
    chosen = SceneSettings(water="jerlov:II", samples=_COST_SAMPLES, diffuse_shadows=False)
    start = time.process_time()
    with drawing(chosen) as drawn:
        drawn.picture(_COST_SAMPLES)
        first = time.process_time() - start
        return first, min(drawn.seconds(_COST_SAMPLES) for _ in range(2))


def measure(ask: Ask) -> Mapping[str, object]:
    """Trace, render and time."""
    amounts = (2.0, 8.0, 30.0)
    compared, worst = compared_rows(_CASES, {1: "clouds.png", 4: "clouds_by_torch.png"}, ask)
    grids, _ = compared_rows(_GRIDS, {1: "clouds_of_grids.png"}, ask)
    costs = [
        ["a grid" if grid else blobs, "a torch" if watts else "none",
         *(f"{x:.1f}" for x in seconds_of_frames(blobs, watts, grid=grid))]
        for blobs, watts, grid in ((0, 0.0, False), (1, 0.0, False), (3, 0.0, False),
                                   (0, _WATTS, False), (1, _WATTS, False), (0, 0.0, True),
                                   (0, _WATTS, True))[: ask.costs]
    ]  # fmt: skip
    return {
        "compared": table(COMPARED, compared), "grids": table(COMPARED, grids), "worst": worst,
        "photons": table(PHOTONS, [photons_row(x) for x in amounts]),
        "lamps": table(BY_LAMP, [lamp_row(x) for x in amounts]),
        "seconds": table(("clouds", "lamps", "first", "later"), costs),
    }  # fmt: skip


COMPARED = ("water", "light of", "g/m³", "ΔE mean", "95 %", "noise", "light")
PHOTONS = ("g/m³", "optical depth", "beam: level / down / up", "all sides: level / down / up")
BY_LAMP = ("g/m³", "optical depth", "along / down / up / side / towards")
PAGE = Page(
    "Clouds",
    """
A blob of minerals (σ .5 m) 3 m before a camera at 5 m, by day, and by a torch beside the camera; 48
× 30 pixels, 8 bands by day and 3 with the torch.

![EEVEE, Cycles](clouds.png)

![EEVEE, Cycles, by torch](clouds_by_torch.png)

*By day and by night, type II, 12 g/m³: EEVEE, and Cycles with its noise.*

## EEVEE against Cycles
ΔE2000 of blocks of 3 × 3 pixels by day, 6 × 6 by torch; *noise*: of Cycles, in both; *light*: green
over that of Cycles. Wanted was a mean of 3, **missed** by torch, where lamps err without a cloud as
well.

{compared}

## Grids of volume objects
Noise in a ball of 1.2 m instead of the blob, 64 voxels along each side; EEVEE follows each ray in
40 steps.

![EEVEE, Cycles](clouds_of_grids.png)

{grids}

## The light of a blob against photons
In empty space, at 550 nm, radiance over that of photons (noise 1 to 3 %), in a beam 22° from the
vertical and in light from all sides, where a blob that absorbs nothing is invisible within .2 %.

{photons}

By a lamp 3 m away: seen along its light, down, up, from the side and towards the lamp.

{lamps}

## What they cost
CPU seconds in real time, 240 × 135, 16 samples: the first picture, in which shaders are compiled,
and the best of two more.

{seconds}

## What is not drawn
By EEVEE: clouds' shadows in shafts, what clouds scatter into the water beside them (right below a
dense one its shadow is up to .05 too dark), and a bend of the light around clouds. Cycles has all.
""",
    (Target("mean ΔE2000 by day, worst case", "worst", 3.0),),
    {"samples": 384, "cases": 99, "costs": 99},
)
