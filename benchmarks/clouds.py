"""Clouds of silt: EEVEE against Cycles, their light against photons, and what they cost.

``python3 dev.py run -m benchmarks clouds`` writes docs/measured/clouds.md and clouds.png. Takes
about ten minutes.
"""

from __future__ import annotations

import argparse
import math
import resource
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from numpy.typing import NDArray

from ..reference.cloud_photons import GreyPuff, radiance
from ..scene import stored_settings
from ..scene.engines import engines
from ..scene.seen import lamps
from ..scene.water import new_clouds, water_body
from ..settings.render_plan import RenderPlan, make_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.clouds.cloud_light import CloudNumbers, Clouds, Several
from ..uw_spectral.clouds.matter import BluntPhase, SuspendedMatter, blunt_phase, suspended_matter
from ..uw_spectral.clouds.puff import Puff
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, srgb_encode
from ..uw_spectral.spectra.spectral_image import replacing, write_png
from ..uw_spectral.transfer.sun_beam import half_angle2
from . import grey_scene

_ROOT = Path(__file__).resolve().parent.parent
_DEPTH, _FLOOR = 5.0, 6.5  # m
_SIZE, _BLOCK = (48, 30), 3
_EEVEE_SAMPLES = 32
_SIGMA, _SEEN = 0.5, 0.5
_SUN = (0.373, 0.0, -0.928)
_VIEWS = {"level": (0.0, 1.0, 0.0), "down": (0.0, 0.766, -0.643), "up": (0.0, 0.866, 0.5)}
_COST_SIZE, _COST_SAMPLES = (240, 135), 16
_TARGET = 3.0
# A torch beside the camera, which shines to the middle of the cloud.
_TORCH, _WATTS, _CONE, _BLEND = (0.45, 0.0, -_DEPTH + 0.25), 400.0, math.radians(50.0), 0.5
_MIDDLE = (0.0, 3.0, -_DEPTH)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Water, concentration in g/m³, and the light.

    ``look`` is the camera's angle from straight down in degrees, ``watts`` the power of a torch
    beside it, ``sunlight`` a factor on sun and sky.
    """

    water: str
    concentration: float
    look: float = 90.0
    floor: bool = True
    watts: float = 0.0
    sunlight: float = 1.0

    @property
    def light(self) -> str:
        """What lights it."""
        if not self.watts:
            return "day"
        return "day and torch" if self.sunlight else "torch"


_CASES = (
    *(Case("jerlov:II", 0.0), Case("jerlov:II", 12.0), Case("jerlov:IB", 12.0)),
    *(Case("jerlov:II", x, watts=_WATTS, sunlight=0.0) for x in (0.0, 12.0)),
    *(Case("jerlov:IB", x, watts=_WATTS, sunlight=0.0) for x in (0.0, 12.0)),
    *(Case(f"jerlov:{x}", 12.0, watts=_WATTS) for x in ("II", "IB")),
)
_SHOWN = {1: "clouds.png", 4: "clouds_by_torch.png"}


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
        found = _delta_e(self.eevee, self.cycles)
        noise = _delta_e(*self.halves) / 2.0
        light = self.eevee[..., 1].sum() / self.cycles[..., 1].sum()
        return (
            f"| {self.case.water.removeprefix('jerlov:')} | {self.case.light} | "
            f"{self.case.concentration:g} | {found.mean():.2f} | {np.quantile(found, 0.95):.2f} | "
            f"{noise.mean():.2f} | {light:.3f} |"
        )


def _delta_e(one: Array, other: Array) -> Array:
    pictures = (srgb_encode(np.clip(grey_scene.blocks(x, _BLOCK), 0.0, 1.0)) for x in (one, other))
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
    for number in range(puffs if case.concentration else 0):
        item = new_clouds.add_puff(scene)
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
        SceneSettings(water=case.water, samples=_EEVEE_SAMPLES, sunlight=case.sunlight)
    )
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


def photons_row(concentration: float) -> str:
    """Compare the light of a puff in a beam, and in light from all sides, with photons."""
    matter = suspended_matter("minerals", concentration, [550.0])
    a, b = float(matter.absorption[0]), float(matter.scattering[0])
    grey, blunt = GreyPuff(_SIGMA, a, b, matter.phase), blunt_phase(matter.phase)
    cells = []
    for isotropic in (False, True):
        traced = radiance(grey, _SUN, _VIEWS, isotropic=isotropic, count=300_000)
        found = {n: _formula(matter, blunt, v, isotropic=isotropic) for n, v in _VIEWS.items()}
        ratios = [found[name] / traced[name] for name in _VIEWS]
        cells.append(" / ".join(f"{x:.2f}" for x in ratios))
    tau = (a + b) * _SIGMA * math.sqrt(2.0 * math.pi)
    return f"| {concentration:g} | {tau:.1f} | {cells[0]} | {cells[1]} |"


def _formula(
    matter: SuspendedMatter, blunt: BluntPhase, view: Sequence[float], *, isotropic: bool
) -> float:
    a, b, one = float(matter.absorption[0]), float(matter.scattering[0]), np.ones(3)
    wide, turned = b * (1.0 - blunt.peak), b * (1.0 - matter.phase.g)
    puff, sun = Puff.of_axes((0, 0, 0), 2.0 * _SIGMA * np.eye(3)), np.array(_SUN)
    cloud = CloudNumbers(
        puff.middle, puff.rows, (a + b) * one, (a + wide) * one, wide / (a + wide) * one,
        (not isotropic) * one, 0 * one, isotropic * one, 0 * one, 0 * one, 0 * one, 0 * one,
        (a + turned) * one, turned / (a + turned) * one, 0.0,
        blunt.asymmetry, blunt.ceiling, blunt.peak,
    )  # fmt: skip
    clouds, v = Clouds(Several([cloud]), [matter.phase], _SUN), np.array(view)
    u = np.cross(v, [1.0, 0.2, 0.1])
    u /= np.linalg.norm(u)
    r = _SEEN * _SIGMA * np.sqrt((np.arange(6) + 0.5) / 6)[:, None]
    t = np.arange(8) * math.pi / 4
    sides = (r * np.cos(t)).ravel(), (r * np.sin(t)).ravel()
    places = -6.0 * v + np.outer(sides[0], u) + np.outer(sides[1], np.cross(v, u))
    veil = clouds.veil(
        list(places.T[..., None]), list(v), 60.0 * np.ones((48, 1)), half_angle2(list(v), list(sun))
    )
    return float(veil.light[:, 0].mean())


def cost_row(puffs: int) -> str:
    """Measure CPU seconds of the first and of a later picture in real time."""
    camera = build(Case("jerlov:II", 12.0), _COST_SIZE, puffs)
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
    return f"| {puffs} | {first:.1f} | {min(later):.1f} |"


def _cpu() -> float:
    return sum(resource.getrusage(resource.RUSAGE_SELF)[:2])


def report(compared: Sequence[str], photons: Sequence[str], costs: Sequence[str]) -> str:
    """Return the page."""
    rows = "\n".join
    return f"""# Clouds

Written by `python3 dev.py run -m benchmarks clouds`.

A puff of minerals (outline 1 m, σ .5 m) 3 m before a camera at {_DEPTH:g} m, by day. Shown are the
middle of the view and all round it, {_SIZE[0]} × {_SIZE[1]} pixels, 8 bands.

![EEVEE, Cycles](clouds.png)

*Type II, 12 g/m³, sand at {_FLOOR:g} m, three balls before, in and behind the cloud: EEVEE,
and Cycles with its noise.*

## EEVEE against Cycles
ΔE2000 of blocks of {_BLOCK} × {_BLOCK} pixels, the mean and 95 %; that of the noise of Cycles
alone, which is in both; the light of the green channel over that of Cycles. Wanted was a mean of
{_TARGET:g}. A row of 0 g/m³ is the same scene without the cloud.

| water | g/m³ | ΔE mean | 95 % | noise | light |
|---|---|---|---|---|---|
{rows(compared)}

## The light of a puff against photons
In empty space, at 550 nm, radiance about the middle over that of photons, one by one: seen
level, down and up, in a beam that comes down at 22° from the vertical, and in light from all sides.

| g/m³ | optical depth | beam: level / down / up | all sides: level / down / up |
|---|---|---|---|
{rows(photons)}

Photons have a noise of 1 to 3 %. A puff that absorbs nothing is invisible in light from all sides,
within .2 %. Transmission along rays is a closed form, within 10⁻⁴ of a sum.

## What they cost
CPU seconds in real time, {_COST_SIZE[0]} × {_COST_SIZE[1]}, {_COST_SAMPLES} samples, without
diffuse shadows: the first picture, in which shaders are compiled unless they are cached, and the
best of two more. Scenes without clouds have no nodes of them. Measured while other programs ran.

| clouds | first | later |
|---|---|---|
{rows(costs)}

## What is not drawn
By EEVEE: grids of volume objects, lamps' light in clouds, clouds' shadows in the water (on things
they are drawn) and in shafts, and a bend of the light around clouds: what a cloud scatters forward
of a thing's light is lost in the light of its surroundings. All is drawn by Cycles.
"""


def main(arguments: Sequence[str]) -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="clouds")
    parser.add_argument("--samples", type=int, default=384)
    parser.add_argument("--docs", type=Path, default=_ROOT / "docs" / "measured")
    options = parser.parse_args(arguments)
    if not hasattr(bpy.types.Scene, stored_settings.PROPERTY):
        stored_settings.register()
    photons = [photons_row(x) for x in (2.0, 8.0, 30.0)]
    print(*photons, sep="\n", flush=True)
    compared = []
    for number, case in enumerate(_CASES):
        found = compare(case, options.samples)
        compared.append(found.row())
        print(compared[-1], flush=True)
        if number == _SHOWN:
            both = np.concatenate([found.eevee, found.cycles], axis=1)
            larger = np.repeat(np.repeat(both, 6, axis=0), 6, axis=1)
            write_png(options.docs / "clouds.png", np.clip(larger, 0.0, 1.0))
    costs = [cost_row(x) for x in (0, 1, 3)]
    with replacing(options.docs / "clouds.md") as temporary:
        temporary.write_text(report(compared, photons, costs))
