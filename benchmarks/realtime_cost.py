"""What the real-time water costs, in one run on one machine.

    python3 dev.py run -m benchmarks realtime_cost [--bands 3 8 16 32] [--samples N]

CPU time per sample of a plain scene, of plain fog and of the water with and
without shafts and waves, as ratios to the plain scene; and what a first frame,
a change of water and frame, and the frame after it take. Without a GPU EEVEE
runs on the CPU: read the ratios.
"""

from __future__ import annotations

import argparse
import math
import resource
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy
from mathutils import Matrix

from ..node_groups.node_mathematics import Graph
from ..scene import (
    caustics,
    eevee_settings,
    exr_output,
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


def main(arguments: Sequence[str]) -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bands", type=int, nargs="+", default=[3, 8, 16])
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--resolution", type=int, nargs=2, default=(480, 270))
    parser.add_argument("--no-shafts", action="store_true", help="they take most of the time")
    options = parser.parse_args(arguments)
    print(
        "| scene | CPU s per sample | ratio | first frame, CPU s | other values, CPU s "
        "| frame after, CPU s | peak MB |\n|---|---|---|---|---|---|---|"
    )
    plain = None
    cases = [_Case("plain"), _Case(_FOG)]
    for n in options.bands:
        cases += [_Case(f"{n} bands", n), _Case(f"{n} bands, shafts", n, shafts=True)]
        if n == _WAVES_BANDS:
            cases += [
                _Case(f"{n} bands, waves", n, "waves"),
                _Case(f"{n} bands, waves, shafts", n, "waves", shafts=True),
            ]
    for case in cases:
        if case.shafts and options.no_shafts:
            continue
        first, sample, update, after = _measure(case, options)
        plain = sample if plain is None else plain
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"| {case.name} | {sample:.3f} | {sample / plain:.2f} | {first:.1f} | {update:.2f} "
            f"| {after:.1f} | {peak:.0f} |",
            flush=True,
        )


def _measure(case: _Case, options: argparse.Namespace) -> tuple[float, float, float, float]:
    """Return the CPU time of the first frame, a sample, new values, and the frame after."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, camera = bpy.context.scene, _scene(options.resolution)
    water = None
    if case.bands:
        water = _water(case, 1.0)
        realtime.add_realtime(scene, water, water_body.WaterExtent(300.0, 10.0))
    else:
        _sun(scene)
        if case.name == _FOG:
            add_fog(bpy.data.materials["Grey"])
    reach, update = water.shafts if water else None, 0.0
    with eevee_settings.realtime_settings(scene, camera, samples=1, shafts=reach):
        first = _frame(scene, 1)
        few = min(_frame(scene, 1) for _ in range(2))
        many = min(_frame(scene, 1 + options.samples) for _ in range(2))
        if water:
            scene.frame_set(2)
            start = time.process_time()
            realtime.set_values(scene, _water(case, 2.0))
            update = time.process_time() - start
        after = _frame(scene, 1)
    return first, (many - few) / options.samples, update, after


def _frame(scene: bpy.types.Scene, samples: int) -> float:
    scene.eevee.taa_render_samples = samples
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        exr_output.write_float_exr(scene, Path(folder) / "a.exr")
        return time.process_time() - start


def _water(case: _Case, turbidity: float) -> realtime.RealtimeWater:
    """Return the water of the current frame."""
    scene = bpy.context.scene
    plan = render_plan.make_plan(
        settings.SceneSettings(
            turbidity=turbidity,
            phase="hg:0.924",
            bands=case.bands,
            floor_depth=7.0,
            floor_reflectance="0.3",
            surface=case.surface,
        )
    )
    weights = plan.reduction(_DEPTH).weights
    water = plan.realtime(scene, _DEPTH, weights, shafts=case.shafts)
    return caustics.with_waves(scene, plan, water)


def _scene(resolution: Sequence[int]) -> bpy.types.Object:
    import bmesh  # exists once bpy is loaded

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = resolution
    material = bpy.data.materials.new("Grey")
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
    for data in (mesh, ground):
        data.materials.append(material)
        scene.collection.objects.link(bpy.data.objects.new(data.name, data))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, 0.0, -_DEPTH), (math.radians(80), 0.0, 0.0)
    scene.collection.objects.link(camera)
    return camera


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
    graph.put(colour, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
