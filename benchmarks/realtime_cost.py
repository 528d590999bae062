"""What the real-time water costs, in one run on one machine.

    python3 dev.py run -m benchmarks realtime_cost [--bands 3 8 16] [--materials N] [--terms]

CPU time per sample of a plain scene, of plain fog and of the water, its light solved or
in closed form, as ratios to the plain scene; and what a first frame, a change of water
and frame, and the frame after it take. ``--materials`` gives the spheres so many different
ones. ``--terms`` adds shafts, waves and shadows of diffuse light, and a pass of three bands in
Cycles. Each case has a process of its own, whose peak memory is given; cases are
repeated in turn, and the least counts. Without a GPU EEVEE runs on the CPU: read the
ratios.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
from mathutils import Matrix

from ..node_groups.node_mathematics import Graph
from ..scene import (
    eevee_settings,
    engines,
    exr_output,
    moving_surface,
    realtime,
    render_plan,
    settings,
    water_body,
)

_DEPTH = 5.0
_FOG = "fog"
_WAVES_BANDS = 8


@dataclass(frozen=True)
class _Case:
    """What is measured: a plain scene, plain fog, or water of some bands."""

    name: str
    bands: int = 0
    surface: str = "flat"
    shafts: bool = False
    diffuse_shadows: bool = True
    cycles: bool = False
    field: str = settings.SOLVED


def main(arguments: Sequence[str]) -> None:
    """Measure each case in a process of its own, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bands", type=int, nargs="+", default=[3, 6, 9, 16, 32, 64])
    parser.add_argument("--closed-form", type=int, nargs="*", default=[8])
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--materials", type=int, default=1)
    parser.add_argument("--resolution", type=int, nargs=2, default=(480, 270))
    parser.add_argument("--terms", action="store_true", help="shafts and others as well")
    parser.add_argument("--case", help="one case as JSON, measured in this process")
    options = parser.parse_args(arguments)
    if options.case:
        print(json.dumps(_measure(_Case(**json.loads(options.case)), options)))
        return
    print(
        "| scene | CPU s per sample | ratio | first frame, CPU s | other values, CPU s "
        "| frame after, CPU s | peak MB |\n|---|---|---|---|---|---|---|"
    )
    cases, found = _cases(options), {}
    for case in cases * options.repeats:
        command = [sys.executable, "-m", __package__.rpartition(".")[2], Path(__file__).stem]
        command += [*arguments, "--case", json.dumps(asdict(case))]
        root = Path(__file__).resolve().parent.parent
        # A shader that the software rasteriser has kept would make the first frame short.
        with tempfile.TemporaryDirectory() as cache:
            done = subprocess.run(
                command, cwd=root, stdout=subprocess.PIPE, text=True, check=True,
                env={**os.environ, "MESA_SHADER_CACHE_DIR": cache},
            )  # fmt: skip
        measured = json.loads(done.stdout.splitlines()[-1])
        found[case] = [min(two) for two in zip(found.get(case, measured), measured, strict=True)]
        print(case.name, *(f"{value:.3g}" for value in measured), file=sys.stderr, flush=True)
    plain = found[cases[0]][1]
    for case in cases:
        first, sample, update, after, peak = found[case]
        print(
            f"| {case.name} | {sample:.3f} | {sample / plain:.2f} | {first:.1f} | {update:.2f} "
            f"| {after:.1f} | {peak:.0f} |"
        )


def _cases(options: argparse.Namespace) -> list[_Case]:
    cases = [_Case("plain"), _Case(_FOG)]
    cases += [
        _Case(f"closed form, {n} bands", n, field=settings.CLOSED_FORM) for n in options.closed_form
    ]
    cases += [_Case(f"{n} bands", n) for n in options.bands]
    if options.terms:
        n = _WAVES_BANDS
        cases += [
            _Case(f"{n} bands, no diffuse shadows", n, diffuse_shadows=False),
            _Case(f"{n} bands, waves", n, "waves"),
            _Case(f"{n} bands, shafts", n, shafts=True),
            _Case(f"{n} bands, waves, shafts", n, "waves", shafts=True),
            _Case("Cycles, a pass of 3 bands", 3, cycles=True),
        ]
    return cases


def _measure(case: _Case, options: argparse.Namespace) -> tuple[float, ...]:
    """CPU time of the first frame, a sample, new values, and the frame after; peak MB."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, camera = bpy.context.scene, _scene(options.resolution, options.materials)
    times = (_cycles if case.cycles else _eevee)(scene, camera, case, options.samples)
    return (*times, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)


def _eevee(
    scene: bpy.types.Scene, camera: bpy.types.Object, case: _Case, samples: int
) -> tuple[float, ...]:
    water = None
    if case.bands:
        water = _water(case, 1.0)
        realtime.add_realtime(scene, water, water_body.WaterExtent(300.0, 10.0))
    else:
        _sun(scene)
        if case.name == _FOG:
            for material in bpy.data.materials:
                add_fog(material)

    def frame(count: int) -> float:
        scene.eevee.taa_render_samples = count
        return _time(lambda path: exr_output.write_float_exr(scene, path))

    update = 0.0
    with eevee_settings.realtime_settings(scene, camera, samples=1, water=water):
        first, sample = frame(1), _per_sample(frame, samples)
        if water:
            scene.frame_set(2)
            start = time.process_time()
            realtime.set_values(scene, _water(case, 2.0))
            update = time.process_time() - start
        return first, sample, update, frame(1)


def _cycles(
    scene: bpy.types.Scene, camera: bpy.types.Object, case: _Case, samples: int
) -> tuple[float, ...]:
    now, later = _plan(case, 1.0), _plan(case, 2.0)
    extent = water_body.WaterExtent(300.0, 10.0)
    with engines.cycles_bands(scene, camera, now, extent, seed=0, denoise=False) as engine:

        def frame(count: int, plan: render_plan.RenderPlan = now) -> float:
            scene.cycles.samples = count
            render = engine.frame(plan, _DEPTH)
            return _time(lambda path: render(engine.passes[0], path))

        return frame(1), _per_sample(frame, samples), 0.0, frame(1, later)


def _per_sample(frame: Callable[[int], float], samples: int) -> float:
    few, many = (min(frame(n) for _ in range(2)) for n in (1, 1 + samples))
    return (many - few) / samples


def _time(write: Callable[[Path], None]) -> float:
    """CPU time that it takes to write a picture."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        write(Path(folder) / "a.exr")
        return time.process_time() - start


def _water(case: _Case, scattering_factor: float) -> realtime.RealtimeWater:
    """Return the water of the current frame."""
    scene, plan = bpy.context.scene, _plan(case, scattering_factor)
    weights = plan.reduction(_DEPTH).weights
    water = plan.realtime(scene, _DEPTH, weights)
    return moving_surface.with_waves(scene, plan, water)


def _plan(case: _Case, scattering_factor: float) -> render_plan.RenderPlan:
    return render_plan.make_plan(
        settings.SceneSettings(
            scattering_factor=scattering_factor,
            bands=case.bands,
            field=case.field,
            floor_depth=7.0,
            floor_reflectance="0.3",
            surface=case.surface,
            diffuse_shadows=case.diffuse_shadows,
            shafts=case.shafts,
        )
    )


def _scene(resolution: Sequence[int], materials: int) -> bpy.types.Object:
    """Return the camera before spheres on the ground, of materials with different nodes."""
    import bmesh  # exists once bpy is loaded

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = resolution
    shades = [_material(index) for index in range(materials)]
    shapes = bmesh.new()
    for x in (-1.5, 0.0, 1.5):
        bmesh.ops.create_uvsphere(
            shapes, u_segments=64, v_segments=32, radius=0.7, matrix=Matrix.Translation((x, 4, -6))
        )
    mesh = bpy.data.meshes.new("Spheres")
    shapes.to_mesh(mesh)
    shapes.free()
    ground = bpy.data.meshes.new("Ground")
    ground.from_pydata(
        [(x, y, -6.9) for x, y in ((-50, -50), (50, -50), (50, 50), (-50, 50))], [], [(0, 1, 2, 3)]
    )
    for index, polygon in enumerate(mesh.polygons):
        polygon.material_index = index * materials // len(mesh.polygons)
    for data in (mesh, ground):
        for shade in shades:
            data.materials.append(shade)
        scene.collection.objects.link(bpy.data.objects.new(data.name, data))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -_DEPTH), (math.radians(80), 0.0, 0.0)
    scene.collection.objects.link(camera)
    return camera


def _material(index: int) -> bpy.types.Material:
    """Return a material whose shader differs from those of other indices."""
    material = bpy.data.materials.new(f"Grey {index}")
    graph = Graph(material.node_tree)
    colour = graph.vector(0.5, 0.5, 0.5)
    for power in range(index):
        colour = colour * graph.operation("SINE", (graph.vector(1.0 + power, 1.0, 1.0),))
    shader = next(n for n in material.node_tree.nodes if "Base Color" in n.inputs)
    graph.assign(colour, shader.inputs["Base Color"])
    return material


def _sun(scene: bpy.types.Scene) -> None:
    lamp = bpy.data.lights.new("Sun", "SUN")
    lamp.energy = 3.0
    scene.collection.objects.link(bpy.data.objects.new("Sun", lamp))


def add_fog(material: bpy.types.Material) -> None:
    """Plain exponential fog in RGB: the lit colour, dimmed, plus a colour."""
    tree = material.node_tree
    graph = Graph(tree)
    output = tree.get_output_node("EEVEE")
    if output is None or not output.inputs["Surface"].is_linked:
        return
    lit = graph.node("ShaderNodeShaderToRGB")
    tree.links.new(output.inputs["Surface"].links[0].from_socket, lit.inputs[0])
    distance = graph.term(graph.node("ShaderNodeCameraData").outputs["View Distance"])
    density = graph.vector(0.3, 0.1, 0.05)
    kept = graph.operation("POWER", (math.e, density * distance * -1.0))
    colour = graph.term(lit.outputs[0]) * kept + (1.0 - kept) * graph.vector(0.02, 0.1, 0.2)
    emission = graph.node("ShaderNodeEmission")
    graph.assign(colour, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
