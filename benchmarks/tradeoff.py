"""Speed against accuracy: every way to draw the water, its error and its cost.

    python3 dev.py run -m benchmarks tradeoff [--keep DIR] [--quick] [--all]

Renders the scenes of :mod:`._tradeoff_scenes` by every setting, against Cycles
with many bands. Each measurement is kept as a file, so an interrupted run goes
on where it stopped. Writes docs/measured/tradeoff.csv, docs/measured/tradeoff.png,
docs/measured/tradeoff_pictures.jpg and docs/measured/tradeoff.md.

Costs are ratios to EEVEE's render of the scene without water in the same run.
On a machine with a GPU, ``--resolution 1920 1080 --no-cycles`` prints the
milliseconds of a frame. ``--keep`` is for one machine and one run: costs are
ratios within it.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import math
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import bpy
import gpu
import numpy as np
from numpy.typing import NDArray

from ..scene.engines import eevee_engine, eevee_settings, engines, exr_output
from ..scene.engines.band_engine import Opening
from ..scene.water import frame_water, water_body
from ..settings import render_plan
from ..settings.scene_settings import SceneSettings
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr, replacing
from ..uw_spectral.transfer.folded_light import FoldedLight
from ..validation.monzon import path_radiance_Monzon2024_corrected
from . import _tradeoff_report, baselines, grey_scene
from ._fog import add_fog
from ._rays import blender_hits
from ._tradeoff_scenes import (
    FOG,
    PLAIN,
    REFERENCE,
    SCENES,
    SETTINGS,
    Configuration,
    Setting,
    TestScene,
)

_OVERSAMPLING = 2
_SHADOW = 0.01  # m, that of the water's sun
_COST_SAMPLES, _REPEATS = 8, 3
# Without a GPU, shadow maps take 20 times as long as everything else together: they are
# coarse in the pictures and left out of the costs, which more pixels make measurable.
_COARSE_SHADOWS = 0.1
_COST_SCALE = 2
_NOT_REAL_TIME = {"reference", "cycles"}


@dataclass(frozen=True)
class Options:
    """What the kept measurements depend on."""

    resolution: tuple[int, int]
    eevee_samples: int
    reference_samples: int


@dataclass(frozen=True, eq=False)
class Case:
    """A scene in Blender, moved to one of its configurations."""

    options: Options
    scene: TestScene
    camera: bpy.types.Object
    heights: Mapping[str, float]
    software: bool

    @property
    def shadow_detail(self) -> float:
        """EEVEE's factor on the resolution of shadows."""
        return _COARSE_SHADOWS if self.software else 1.0

    def place(self, configuration: Configuration) -> None:
        """Move what the scene holds to the depth of a configuration."""
        if self.scene.moves:
            for name, height in self.heights.items():
                bpy.data.objects[name].location.z = height - configuration.depth
            bpy.context.view_layer.update()

    def plan(
        self, configuration: Configuration, setting: Setting, **changes: float
    ) -> render_plan.RenderPlan:
        """Resolve a measurement; the setting's own samples win over those of EEVEE."""
        wanted = self.scene.scene_settings(configuration, setting)
        samples = setting.changes.get("samples", self.options.eevee_samples)
        return render_plan.make_plan(
            SceneSettings(**{**vars(wanted), "samples": samples, **changes})
        )

    def extent(
        self, plans: Sequence[tuple[Configuration, render_plan.RenderPlan]]
    ) -> water_body.WaterExtent:
        """Size of the water that holds every configuration."""
        found = []
        for configuration, plan in plans:
            self.place(configuration)
            found.append(
                water_body.water_extent(bpy.context.scene, plan.column, configuration.depth)
            )
        return water_body.WaterExtent(
            max(e.half_width for e in found), max(e.bottom for e in found)
        )


Measured = Iterator[tuple[Configuration, dict[str, Any]]]


def build(scene: TestScene, options: Options) -> Case:
    """Build a scene in an empty file."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    camera = scene.build(*options.resolution)
    bpy.context.view_layer.update()
    heights = {o.name: o.location.z for o in bpy.data.objects}
    gpu.init()
    return Case(options, scene, camera, heights, "llvmpipe" in gpu.platform.renderer_get())


def measure_cycles(case: Case, configuration: Configuration, setting: Setting) -> dict[str, Any]:
    """Render the bands by Cycles; the reference twice, with half of the samples each."""
    reference = setting.kind == "reference"
    samples = (
        case.options.reference_samples * configuration.noise
        if reference
        else setting.changes["samples"]
    )
    plan = case.plan(configuration, setting, samples=samples)
    case.place(configuration)
    extent = case.extent([(configuration, plan)])
    images, seconds, wall = [], [], []
    for seed in (1, 2) if reference else (3,):
        with engines.cycles_bands(
            bpy.context.scene, case.camera, plan, extent, seed=seed
        ) as engine:
            start, clock = time.process_time(), time.perf_counter()
            images.append(grey_scene.band_image(engine, plan, configuration.depth))
            seconds.append(time.process_time() - start)
            wall.append(time.perf_counter() - clock)
    return {
        "bands": np.stack(images).astype(np.float32),
        "weights": plan.reduction(configuration.depth).weights,
        "cpu": sum(seconds),
        "wall": sum(wall),
    }


def measure_drawn(
    case: Case, configurations: Sequence[Configuration], setting: Setting
) -> Measured:
    """Draw configurations in EEVEE, as batch renders do."""
    scene, kind = bpy.context.scene, engines.engine_of("eevee", setting.kind)
    for configuration in configurations:
        case.place(configuration)
        plan, depth = case.plan(configuration, setting), configuration.depth
        if not setting.floor_term:
            column = replace(plan.column, floor_reflectance=np.zeros(len(plan.bands)))
            plan = replace(plan, column=column)
        extent, weights = case.extent([(configuration, plan)]), plan.reduction(depth).weights
        opening = Opening(plan, extent, depth, weights, 0, guides=False, froxels=setting.froxels,
                          device="cpu")  # fmt: skip
        with _left_out(setting), kind.open(scene, case.camera, opening) as engine:
            scene.eevee.shadow_resolution_scale = case.shadow_detail
            scene.eevee.taa_render_samples = case.options.eevee_samples
            if kind.method.draws_colours:
                found = {"picture": _picture(engine, plan, depth)}
            else:
                bands = grey_scene.band_image(engine, plan, depth)
                found = {"bands": bands[None].astype(np.float32), "weights": weights}
            render, passes = engine.frame(plan, depth), len(engine.passes)
            cost = _cost(case, functools.partial(render, engine.passes[0]))
        yield configuration, {**found, **{name: each * passes for name, each in cost.items()}}


@contextlib.contextmanager
def _left_out(setting: Setting) -> Iterator[None]:
    """Leave out of real time what it has no setting for."""
    blind = _then(eevee_engine.eevee_water, _without_cover)
    often = _then(frame_water.fold, _without_once)
    with contextlib.ExitStack() as stack:
        if not setting.blocking:
            stack.enter_context(mock.patch.object(eevee_engine, "eevee_water", blind))
        if not setting.single:
            stack.enter_context(mock.patch.object(frame_water, "fold", often))
        yield


def _then[**P, R](call: Callable[P, R], change: Callable[[R], R]) -> Callable[P, R]:
    def changed(*given: P.args, **options: P.kwargs) -> R:
        return change(call(*given, **options))

    return changed


def _without_cover(water: frame_water.RealtimeWater) -> frame_water.RealtimeWater:
    seen, shape = replace(water.seen, cover=None), replace(water.shape, covers=False)
    return replace(water, seen=seen, shape=shape)


def _without_once(light: FoldedLight) -> FoldedLight:
    return replace(light, once=0.0 * light.once, drawn=0.0 * light.drawn)


def measure_plain(
    case: Case, configurations: Sequence[Configuration], setting: Setting
) -> Measured:
    """Draw the scene without water but with the same floor and a sun; its fog if asked for."""
    scene = bpy.context.scene
    configuration = configurations[0]
    case.place(configuration)
    plan = case.plan(configuration, Setting("", "", {}))
    added = []
    if math.isfinite(plan.column.floor_depth):
        material = bpy.data.materials.new("plain floor")
        extent = case.extent([(configuration, plan)])
        added.append(water_body.floor_plane(extent, material))
        added[0].location.z = -plan.column.floor_depth
    lamp = bpy.data.lights.new("plain sun", "SUN")
    lamp.shadow_maximum_resolution = _SHADOW
    added.append(bpy.data.objects.new(lamp.name, lamp))
    for item in added:
        scene.collection.objects.link(item)
    if setting is FOG:
        for material in bpy.data.materials:
            add_fog(material)
    with eevee_settings.realtime_settings(scene, case.camera, samples=1, water=None):
        cost = _cost(case, shadow_maps=True)
    for item in added:
        bpy.data.batch_remove([item, item.data])
    for other in configurations:
        yield other, cost


def measure_formula(case: Case, configuration: Configuration, setting: Setting) -> dict[str, Any]:
    """Draw what others draw, in numpy."""
    three = setting.kind == "fog" or "bands" not in setting.changes
    case.place(configuration)
    plan = case.plan(configuration, setting)
    plan = baselines.rgb_plan(plan.settings) if three else plan
    depth = configuration.depth
    hits = blender_hits(bpy.context.scene, case.camera, plan.column, _OVERSAMPLING)
    if setting.kind == "fog":
        rays = baselines.fog_image(plan, hits, depth)
    else:
        printed = "printed" in setting.name
        form = (
            baselines.PAPER_FORMS["paper, printed"]
            if printed
            else path_radiance_Monzon2024_corrected
        )
        rays = baselines.paper_image(plan, hits, depth, form)
    image = grey_scene.blocks(rays, _OVERSAMPLING)
    if three:
        return {"picture": baselines.as_rgb(plan, depth, image)}
    return {
        "bands": image[None].astype(np.float32),
        "weights": plan.reduction(depth).weights,
    }


def _picture(
    engine: engines.BandEngine, plan: render_plan.RenderPlan, depth: float
) -> NDArray[np.float32]:
    """Render all passes of a picture, which add up."""
    render, found = engine.frame(plan, depth), []
    with tempfile.TemporaryDirectory() as folder:
        for number, bands in enumerate(engine.passes):
            path = Path(folder, f"picture_{number}.exr")
            render(bands, path)
            found.append(read_exr(path)[0][..., :3])
    return np.sum(found, axis=0, dtype=np.float32)


def _cost(
    case: Case, write: Callable[[Path], object] | None = None, *, shadow_maps: bool = False
) -> dict[str, float]:
    """Cost of a frame of EEVEE at the resolution of the pictures; times in seconds.

    ``cpu_per_sample`` and ``wall_per_sample`` are what one more sample takes,
    ``shadowed_cpu_per_sample`` the same with ``shadow_maps``. Scenes that are not
    costed have none.
    """
    if not case.scene.costed:
        return {}

    scene = bpy.context.scene
    render, eevee = scene.render, scene.eevee
    eevee.shadow_resolution_scale = case.shadow_detail
    write = write or (lambda path: exr_output.write_float_exr(scene, path))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.exr"

        def frame(samples: int) -> NDArray[np.float64]:
            eevee.taa_render_samples = samples
            start = np.array([time.process_time(), time.perf_counter()])
            write(path)
            return np.array([time.process_time(), time.perf_counter()]) - start

        def per_sample(samples: int) -> NDArray[np.float64]:
            few, many = (
                np.min([frame(n) for _ in range(_REPEATS)], axis=0) for n in (1, 1 + samples)
            )
            return (many - few) / samples

        frame(1)
        cost = {}
        if not case.software:
            cpu, wall = per_sample(_COST_SAMPLES)
            return {"cpu_per_sample": cpu, "wall_per_sample": wall}
        if shadow_maps:
            cost["shadowed_cpu_per_sample"] = per_sample(1)[0]
        size = (render.resolution_x, render.resolution_y)
        eevee.use_shadows = False
        render.resolution_x, render.resolution_y = (_COST_SCALE * n for n in size)
        frame(1)
        cpu, wall = per_sample(_COST_SAMPLES) / _COST_SCALE**2
        render.resolution_x, render.resolution_y = size
        eevee.use_shadows = True
        return {**cost, "cpu_per_sample": cpu, "wall_per_sample": wall}


def run(
    scenes: Sequence[TestScene],
    keep: Path,
    options: Options,
    wanted: Callable[[TestScene], Sequence[Configuration]],
    skip: Callable[[Setting], bool],
) -> None:
    """Measure whatever is not kept yet."""
    for scene in scenes:
        configurations = wanted(scene)
        chosen = [SETTINGS[name] for name in scene.settings]
        every = [s for s in (PLAIN, REFERENCE, *chosen) if not skip(s)]
        if scene.costed:
            every.insert(1, FOG)
        else:
            every.remove(PLAIN)
        case = None
        for setting in every:
            missing = [
                c
                for c in configurations[: 1 if setting.first_only else None]
                if not kept_path(keep, scene, c, setting).exists()
            ]
            if not missing:
                continue
            if case is None:
                case = build(scene, options)
            start = time.process_time()
            for configuration, found in _measure(case, missing, setting):
                with (
                    replacing(kept_path(keep, scene, configuration, setting)) as temporary,
                    temporary.open("wb") as file,
                ):
                    np.savez_compressed(file, **found)
            spent = time.process_time() - start
            print(f"{scene.name}: {setting.name}, {spent:.0f} CPU s", flush=True)
            if setting is FOG:
                case = None  # its materials are foggy now


def _measure(case: Case, configurations: Sequence[Configuration], setting: Setting) -> Measured:
    if setting in (PLAIN, FOG):
        yield from measure_plain(case, configurations, setting)
    elif setting.kind in {"realtime", "bands"}:
        yield from measure_drawn(case, configurations, setting)
    else:
        one = measure_cycles if setting.kind in _NOT_REAL_TIME else measure_formula
        for configuration in configurations:
            yield configuration, one(case, configuration, setting)


def kept_path(keep: Path, scene: TestScene, configuration: Configuration, setting: Setting) -> Path:
    """Return the file of a measurement."""
    parts = (scene.name, configuration.name, setting.name)
    return keep / ("__".join(p.replace(", ", "_").replace(" ", "-") for p in parts) + ".npz")


def _claim(keep: Path, options: Options) -> None:
    """Refuse a folder whose measurements were made with other options."""
    path, now = keep / "options.json", json.loads(json.dumps(vars(options)))
    keep.mkdir(parents=True, exist_ok=True)
    if path.exists() and json.loads(path.read_text()) != now:
        raise InputError(f"{keep} holds measurements with other options; choose another --keep")
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(now), encoding="utf-8")


def main(arguments: Sequence[str]) -> None:
    """Measure, and write the report."""
    parser = argparse.ArgumentParser(prog="tradeoff")
    parser.add_argument("--keep", type=Path, default=Path("out/tradeoff"))
    parser.add_argument("--quick", action="store_true", help="the grey scene once, no report")
    parser.add_argument("--all", action="store_true", help="more configurations per scene")
    parser.add_argument("--scenes", nargs="+", default=[scene.name for scene in SCENES])
    parser.add_argument("--resolution", type=int, nargs=2, default=(96, 54))
    parser.add_argument("--samples", type=int, default=2, help="of EEVEE's pictures")
    parser.add_argument("--reference-samples", type=int, default=16, help="twice, in each band")
    parser.add_argument("--no-cycles", action="store_true", help="costs of EEVEE only")
    parser.add_argument("--report-only", action="store_true", help="from what is kept")
    chosen = parser.parse_args(arguments)
    options = Options(tuple(chosen.resolution), chosen.samples, chosen.reference_samples)
    scenes = [scene for scene in SCENES if scene.name in chosen.scenes]
    if chosen.quick or chosen.no_cycles:
        scenes = [scene for scene in scenes if scene.costed][: 1 if chosen.quick else None]

    def wanted(scene: TestScene) -> Sequence[Configuration]:
        if chosen.quick:
            return scene.configurations[:1]
        return [c for c in scene.configurations if chosen.all or not c.extra]

    def skip(setting: Setting) -> bool:
        if "band_placement" in setting.changes:
            return "band_placement" not in SceneSettings.__dataclass_fields__
        return chosen.no_cycles and setting.kind in {"reference", "cycles", "paper", "fog"}

    _claim(chosen.keep, options)
    if not chosen.report_only:
        run(scenes, chosen.keep, options, wanted, skip)
    results = _tradeoff_report.collect(
        [(s, c) for s in scenes for c in wanted(s)],
        lambda scene, c, setting: kept_path(chosen.keep, scene, c, setting),
    )
    if not (chosen.quick or chosen.no_cycles):
        docs = Path(__file__).resolve().parent.parent / "docs" / "measured"
        _tradeoff_report.write(results, docs, options.reference_samples)
