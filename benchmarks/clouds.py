"""Clouds of silt: EEVEE against Cycles, their light against photons, and what they cost.

``python3 dev.py run -m benchmarks clouds`` writes docs/measured/clouds.md and clouds.png. Takes
about twenty minutes.
"""

from __future__ import annotations

import argparse
import math
import resource
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..scene import stored_settings
from ..scene.engines import engines
from ..scene.seen import clouds, lamps, volume_grids
from ..scene.water import new_clouds, water_body
from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.clouds.cloud_light import CloudNumbers, Clouds, Several, with_escapes
from ..uw_spectral.clouds.density_grid import STEPS
from ..uw_spectral.clouds.lamp_lit_cloud import path_light
from ..uw_spectral.clouds.matter import BluntPhase, SuspendedMatter, blunt_phase, suspended_matter
from ..uw_spectral.clouds.puff import Puff
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_channels import fold_lamps
from ..uw_spectral.lamps.multiple_scattering import lamp_water
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing, write_png
from ..uw_spectral.transfer.channels import channels_of_bands
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.water.phase import parse_phase
from ..validation.cloud_photons import GreyPuff, radiance
from . import grey_scene

_ROOT = Path(__file__).resolve().parent.parent
_DEPTH, _FLOOR = 5.0, 6.5  # m
_SIZE = (48, 30)
_MORE = 8  # samples of Cycles by torch
_EEVEE_SAMPLES = 8
_SIGMA, _SEEN = 0.5, 0.5
_SUN = (0.373, 0.0, -0.928)
_VIEWS = {"level": (0.0, 1.0, 0.0), "down": (0.0, 0.766, -0.643), "up": (0.0, 0.866, 0.5)}
_COST_SIZE, _COST_SAMPLES = (240, 135), 16
_TARGET = 3.0
# A torch beside the camera, which shines to the middle of the cloud.
_TORCH, _WATTS, _CONE, _BLEND = (0.45, 0.0, -_DEPTH + 0.25), 400.0, math.radians(50.0), 0.5
_MIDDLE = (0.0, 3.0, -_DEPTH)
_VOXELS = 64  # along each side of a plume
_THICKEST = 4.0  # optical depth through which anything is seen
# Of a lamp before photons, from the middle of the puff.
_LAMP = (0.4, -3.0, 0.2)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Water, concentration, what there is so much of, and the light.

    ``look`` is the camera's angle from straight down in degrees, ``watts`` the power of a torch
    beside it, ``sunlight`` a factor on sun and sky, ``grid`` whether the cloud is a volume object
    of noise instead of a puff.
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
_SHOWN = {1: "clouds.png", 4: "clouds_by_torch.png"}
_GRIDS = (
    *(Case(f"jerlov:{x}", 12.0, grid=True) for x in ("II", "IB")),
    Case("jerlov:II", 12.0, watts=_WATTS, sunlight=0.0, grid=True),
)
_GRID_SHOWN = {1: "clouds_of_grids.png"}


@dataclass(frozen=True, eq=False)
class Compared:
    """Pictures of a case in linear Rec.709: EEVEE, and two of Cycles of independent noise."""

    case: Case
    eevee: Array
    halves: tuple[Array, Array]

    @property
    def cycles(self) -> Array:
        """Mean of both."""
        return 0.5 * (self.halves[0] + self.halves[1])

    def row(self) -> str:
        """Write it as cells of a table."""
        found = _delta_e(self.eevee, self.cycles, self.case.block)
        noise = _delta_e(*self.halves, self.case.block) / 2.0
        light = self.eevee[..., 1].sum() / self.cycles[..., 1].sum()
        return (
            f"| {self.case.water.removeprefix('jerlov:')} | {self.case.light} | "
            f"{self.case.concentration:g} | {found.mean():.2f} | {np.quantile(found, 0.95):.2f} | "
            f"{noise.mean():.2f} | {light:.3f} |"
        )


def _delta_e(one: Array, other: Array, block: int) -> Array:
    pictures = (srgb_encode(np.clip(grey_scene.blocks(x, block), 0.0, 1.0)) for x in (one, other))
    return delta_e_CIE2000_images(*pictures)


def build(case: Case, size: tuple[int, int], puffs: int = 1) -> bpy.types.Object:
    """Build a scene of three balls, sand and a cloud among them; return the camera."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -_DEPTH), (math.radians(case.look), 0, 0)
    camera.data.clip_start, camera.data.angle = 0.01, math.radians(60.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    bpy.context.view_layer.update()
    if case.grid:
        item = add_plume(scene, _MIDDLE)
        item.underwater.constituent, item.underwater.concentration = "minerals", case.concentration
    for number in range(puffs if case.concentration and not case.grid else 0):
        item = new_clouds.add_puff(scene, case.constituent)
        item.location.x += 1.5 * number
        item.location.y += 1.0 * number
        item.underwater.concentration = case.concentration
    if case.floor:
        for place, size_m, colour in (
            ((-0.6, 3.3, -5.2), 0.25, (0.8, 0.2, 0.1)),
            ((1.3, 5.0, -5.3), 0.6, (0.5, 0.5, 0.5)),
            ((0.2, 2.3, -5.4), 0.15, (0.7, 0.7, 0.7)),
        ):
            bpy.ops.mesh.primitive_uv_sphere_add(location=place, radius=size_m)
            _paint(bpy.context.object, colour)
        bpy.ops.mesh.primitive_plane_add(size=200.0, location=(0.0, 0.0, -_FLOOR))
        _paint(bpy.context.object, (0.35, 0.33, 0.28))
    if case.watts:
        _hang_torch(scene, case.watts)
    bpy.context.view_layer.update()
    return camera


def add_plume(scene: bpy.types.Scene, place: Sequence[float]) -> bpy.types.Object:
    """Add a volume object whose density is noise that ends in a ball of 1.2 m about a place."""
    tree = bpy.data.node_groups.new("Plume", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new, link = tree.nodes.new, tree.links.new
    cube, noise, where = (
        new(f"GeometryNode{x}") if x != "TexNoise" else new("ShaderNodeTexNoise")
        for x in ("VolumeCube", "TexNoise", "InputPosition")
    )
    cube.inputs["Min"].default_value, cube.inputs["Max"].default_value = (-1.2,) * 3, (1.2,) * 3
    for axis in "XYZ":
        cube.inputs[f"Resolution {axis}"].default_value = _VOXELS
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 1.6, 3.0

    def number(operation: str, one: bpy.types.NodeSocket, other: float) -> bpy.types.NodeSocket:
        node = new("ShaderNodeMath")
        node.operation, node.inputs[1].default_value = operation, other
        link(one, node.inputs[0])
        return node.outputs[0]

    away = new("ShaderNodeVectorMath")
    away.operation = "LENGTH"
    link(where.outputs[0], away.inputs[0])
    rim = number("SUBTRACT", number("MULTIPLY", away.outputs["Value"], -1.0), -1.2)
    rim = number("MINIMUM", number("MAXIMUM", number("MULTIPLY", rim, 2.5), 0.0), 1.0)
    thick = number("MAXIMUM", number("SUBTRACT", noise.outputs[0], 0.42), 0.0)
    product = new("ShaderNodeMath")
    product.operation = "MULTIPLY"
    link(rim, product.inputs[0])
    link(number("MULTIPLY", thick, 7.0), product.inputs[1])
    link(product.outputs[0], cube.inputs["Density"])
    link(cube.outputs[0], new("NodeGroupOutput").inputs[0])
    item = bpy.data.objects.new("Plume", bpy.data.volumes.new("Plume"))
    item.modifiers.new("Plume", "NODES").node_group = tree
    item.location, item.rotation_euler = place, (0.0, 0.0, 0.5)
    scene.collection.objects.link(item)
    return item


def _hang_torch(scene: bpy.types.Scene, watts: float) -> None:
    torch = bpy.data.objects.new("Torch", bpy.data.lights.new("Torch", "SPOT"))
    torch.data.energy, torch.data.shadow_soft_size = watts, 0.03
    torch.data.spot_size, torch.data.spot_blend = _CONE, _BLEND
    torch.location = _TORCH
    torch.rotation_euler = (Vector(_MIDDLE) - Vector(_TORCH)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(torch)


def _paint(item: bpy.types.Object, colour: tuple[float, ...]) -> None:
    material = bpy.data.materials.new(item.name)
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*colour, 1.0)
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs[0])
    item.data.materials.append(material)


def compare(case: Case, samples: int) -> Compared:
    """Render a case by both engines."""
    camera = build(case, _SIZE)
    plan = make_plan(
        SceneSettings(
            water=case.water, samples=_EEVEE_SAMPLES, sunlight=case.sunlight, bands=case.bands
        )
    )
    samples *= _MORE if case.watts else 1
    traced = replace(plan, settings=replace(plan.settings, samples=samples // 2))
    scene, extent = (
        bpy.context.scene,
        water_body.water_extent(bpy.context.scene, plan.column, _DEPTH),
    )
    with engines.eevee_bands(scene, camera, plan, extent, _DEPTH) as engine:
        eevee = grey_scene.band_image(engine, plan, _DEPTH)
    halves = []
    for seed in (1, 2):
        with engines.cycles_bands(scene, camera, traced, extent, seed=seed) as engine:
            halves.append(grey_scene.band_image(engine, traced, _DEPTH))
    lit = lamps.lamplight(scene, camera, plan) if case.watts else None
    develop = plan.reduction(_DEPTH, lit).apply
    return Compared(case, develop(eevee), (develop(halves[0]), develop(halves[1])))


def photons_row(concentration: float, constituent: str = "minerals") -> str:
    """Compare the light of a puff in a beam, and in light from all sides, with photons."""
    matter = suspended_matter(constituent, concentration, [550.0])
    a, b = float(matter.absorption[0]), float(matter.scattering[0])
    grey, blunt = GreyPuff(_SIGMA, a, b, matter.phase), blunt_phase(matter.phase)
    cells = []
    for isotropic in (False, True):
        traced = radiance(grey, _SUN, _VIEWS, isotropic=isotropic, count=300_000)
        found = {n: _formula(matter, blunt, v, isotropic=isotropic) for n, v in _VIEWS.items()}
        ratios = [found[name] / traced[name] for name in _VIEWS]
        cells.append("/".join(f"{x:.2f}" for x in ratios))
    tau = (a + b) * _SIGMA * math.sqrt(2.0 * math.pi)
    return f"| {concentration:g} | {tau:.1f} | {cells[0]} | {cells[1]} |"


def lamp_row(concentration: float, constituent: str = "minerals") -> str:
    """Compare the light of a puff in the light of a lamp with photons."""
    matter = suspended_matter(constituent, concentration, [550.0])
    a, b = float(matter.absorption[0]), float(matter.scattering[0])
    grey = GreyPuff(_SIGMA, a, b, matter.phase)
    views = _VIEWS | {"side": (1.0, 0.0, 0.0), "towards": (0.0, -1.0, 0.0)}
    traced = radiance(grey, _SUN, views, lamp=_LAMP, count=200_000)
    nothing = parse_phase("isotropic").for_bands([0.0] * 3)
    water = lamp_water([0.0] * 3, [0.0] * 3, nothing)
    lamp = Lamp(_LAMP, (0.0, 1.0, 0.0), np.ones(3))
    channels = channels_of_bands(Bands.uniform(3), [0, 1, 2])
    folded = fold_lamps([lamp], water, channels, clouds=_SIGMA)
    cloud = with_escapes(_grey_cloud(matter, blunt_phase(matter.phase), sun=0.0, ambient=0.0))
    clouds = Clouds(Several([cloud]), [matter.phase], _SUN)
    ratios = []
    for name, view in views.items():
        light = path_light(folded, clouds, *_parallel(view, 60.0), np.full((48, 1), 200.0))
        ratios.append(float(light[:, 0].mean()) / traced[name])
    tau = (a + b) * _SIGMA * math.sqrt(2.0 * math.pi)
    return f"| {concentration:g} | {tau:.1f} | {'/'.join(f'{x:.2f}' for x in ratios)} |"


def _parallel(view: Sequence[float], away: float) -> tuple[list[Array], list[float]]:
    """Rays about the middle of the puff: where they begin, and their direction."""
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
    puff = Puff.of_axes((0, 0, 0), 2.0 * _SIGMA * np.eye(3))
    return CloudNumbers(
        puff.middle, puff.rows, (a + b) * one, (a + wide) * one, wide / (a + wide) * one,
        sun * one, 0 * one, ambient * one, 0 * one, 0 * one, 0 * one, 0 * one,
        (a + turned) * one, turned / (a + turned) * one, 0.0,
        blunt.asymmetry, blunt.ceiling, blunt.peak,
    )  # fmt: skip


def column_row() -> str:
    """Compare what the plume lets through along rays, in the steps of shaders, with fine sums."""
    build(Case("jerlov:II", 12.0, grid=True), _SIZE)
    scene = bpy.context.scene
    found = clouds.clouds_of(scene, [550.0])
    ((cloud,), _) = volume_grids.KeptGrids().of(scene, found.grids)
    assert cloud.grid is not None, "it has a grid"
    grid = cloud.grid.lit(_SUN, 1.0)
    places = _MIDDLE + 0.5 * np.random.default_rng(1).normal(size=(400, 3))
    w = places - np.array([0.0, 0.0, -_DEPTH])
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    origin, way = [np.full((400, 1), x) for x in (0.0, 0.0, -_DEPTH)], list(w.T[..., None])
    start, step = grid.steps(origin, way, 20.0)

    def column(steps: int) -> Array:
        length = step * STEPS / steps
        total = np.zeros_like(step)
        for index in range(steps):
            s = start + (index + 0.5) * length
            total += grid.at([x + d * s for x, d in zip(origin, way, strict=True)])[0] * length
        return total

    few, many = column(STEPS), column(50 * STEPS)
    thickness = float(cloud.matter.extinction[0]) * many
    seen = thickness < _THICKEST
    off = np.abs(np.exp(float(cloud.matter.extinction[0]) * (many - few)) - 1.0)[seen]
    return (
        f"of {seen.sum()} rays with an optical depth of up to {thickness[seen].max():.1f} the mean "
        f"error is {100 * off.mean():.2f} %, that of 95 % is below "
        f"{100 * np.quantile(off, 0.95):.2f} %"
    )


def cost_row(
    puffs: int, watts: float = 0.0, constituent: str = "minerals", *, grid: bool = False
) -> str:
    """Measure CPU seconds of the first and of a later picture in real time."""
    case = Case("jerlov:II", 12.0, watts=watts, constituent=constituent, grid=grid)
    camera = build(case, _COST_SIZE, puffs)
    plan: RenderPlan = make_plan(
        SceneSettings(water="jerlov:II", samples=_COST_SAMPLES, diffuse_shadows=False)
    )
    scene = bpy.context.scene
    extent = water_body.water_extent(scene, plan.column, _DEPTH)
    seconds = [_cpu()]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        with engines.eevee_realtime(scene, camera, plan, extent, _DEPTH) as engine:
            draw = engine.frame(plan, _DEPTH)
            for _ in range(3):
                draw(engine.passes[0], path)
                seconds.append(_cpu())
    first, *later = np.diff(seconds)
    lamps_there = "a torch" if watts else "none"
    shown = "a grid" if grid else puffs
    return f"| {shown} | {lamps_there} | {first:.1f} | {min(later):.1f} |"


def _cpu() -> float:
    return sum(resource.getrusage(resource.RUSAGE_SELF)[:2])


def grids_section(compared: Sequence[str], columns: str) -> str:
    """Return what the page has of grids."""
    rows = "\n".join
    return f"""## Grids of volume objects
Noise in a ball of 1.2 m instead of the puff, {_VOXELS} voxels along each side; EEVEE follows each
ray in {STEPS} steps.

![EEVEE, Cycles](clouds_of_grids.png)

| water | light of | g/m³ | ΔE mean | 95 % | noise | light |
|---|---|---|---|---|---|---|
{rows(compared)}

Transmittance against a sum in {50 * STEPS} steps: {columns}.
"""


def report(
    compared: Sequence[str],
    grids: str,
    photons: Sequence[str],
    by_lamp: Sequence[str],
    costs: Sequence[str],
) -> str:
    """Return the page; ``grids`` is :func:`grids_section`."""
    rows = "\n".join
    return f"""# Clouds

Written by `python3 dev.py run -m benchmarks clouds`.

A puff of minerals (σ .5 m) 3 m before a camera at {_DEPTH:g} m, by day, and by a torch beside the
camera; {_SIZE[0]} × {_SIZE[1]} pixels, 8 bands by day and 3 with the torch.

![EEVEE, Cycles](clouds.png)

![EEVEE, Cycles, by torch](clouds_by_torch.png)

*By day and by night, type II, 12 g/m³: EEVEE, and Cycles with its noise.*

## EEVEE against Cycles
ΔE2000 of blocks of 3 × 3 pixels by day, 6 × 6 by torch; *noise*: of Cycles, in both; *light*:
green over that of Cycles. Wanted was a mean of {_TARGET:g}, **missed**
by torch, where lamps err without a cloud as well.

| water | light of | g/m³ | ΔE mean | 95 % | noise | light |
|---|---|---|---|---|---|---|
{rows(compared)}

{grids}
## The light of a puff against photons
In empty space, at 550 nm, radiance over that of photons (noise 1 to 3 %), in a beam 22° from the
vertical and in light from all sides, where a puff that absorbs nothing is invisible within .2 %.

| g/m³ | optical depth | beam: level / down / up | all sides: level / down / up |
|---|---|---|---|
{rows(photons)}

By a lamp 3 m away: seen along its light, down, up, from the side and towards the lamp.

| g/m³ | optical depth | along / down / up / side / towards |
|---|---|---|
{rows(by_lamp)}

## What they cost
CPU seconds in real time, {_COST_SIZE[0]} × {_COST_SIZE[1]}, {_COST_SAMPLES} samples: the first
picture, in which shaders are compiled, and the best of two more.

| clouds | lamps | first | later |
|---|---|---|---|
{rows(costs)}

## What is not drawn
By EEVEE: clouds' shadows in shafts, what clouds scatter into the water beside them (right below a
dense one its shadow is up to .05 too dark), and a bend of the light around clouds. Cycles has all.
"""


def _compared(
    cases: Sequence[Case], shown: Mapping[int, str], options: argparse.Namespace
) -> list[str]:
    """Render cases, write the pictures of some, and return the rows of all."""
    rows = []
    for number, case in enumerate(cases):
        found = compare(case, options.samples)
        rows.append(found.row())
        print(rows[-1], flush=True)
        if number in shown:
            both = np.concatenate([found.eevee, found.cycles], axis=1)
            larger = np.repeat(np.repeat(both, 6, axis=0), 6, axis=1)
            write_png(options.docs / shown[number], np.clip(larger, 0.0, 1.0))
    return rows


def main(arguments: Sequence[str]) -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="clouds")
    parser.add_argument("--samples", type=int, default=384)
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    options = parser.parse_args(arguments)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    photons = [photons_row(x) for x in (2.0, 8.0, 30.0)]
    by_lamp = [lamp_row(x) for x in (2.0, 8.0, 30.0)]
    print(*photons, *by_lamp, sep="\n", flush=True)
    compared = _compared(_CASES, _SHOWN, options)
    columns = column_row()
    print(columns, flush=True)
    grids = grids_section(_compared(_GRIDS, _GRID_SHOWN, options), columns)
    costs = [cost_row(*x) for x in ((0, 0.0), (1, 0.0), (3, 0.0), (0, _WATTS), (1, _WATTS))]
    costs += [cost_row(0, x, grid=True) for x in (0.0, _WATTS)]
    with replacing(options.docs / "clouds.md") as temporary:
        temporary.write_text(report(compared, grids, photons, by_lamp, costs))
