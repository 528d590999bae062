"""What the real-time water costs, in one run on one machine.

    python3 dev.py run -m benchmarks realtime_cost [--bands 3 8 16 32] [--samples N]

CPU time per sample of a plain scene, of plain fog and of the water with and
without shafts, as ratios to the plain scene; and what a first frame and a
change of water take. Without a GPU EEVEE runs on the CPU: read the ratios.
"""

from __future__ import annotations

import argparse
import math
import resource
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ..node_groups.node_mathematics import Graph
from ..scene import eevee_settings, exr_output, realtime, water_body
from ..uw_spectral.bands import Bands
from ..uw_spectral.phase import parse_phase
from ..uw_spectral.sun import in_water_cosine, sun_travel_direction
from ..uw_spectral.water_column import WaterColumn

_DEPTH = 5.0


def main(arguments: Sequence[str]) -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bands", type=int, nargs="+", default=[3, 8, 16, 32])
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--resolution", type=int, nargs=2, default=(480, 270))
    options = parser.parse_args(arguments)
    print(
        "| scene | CPU s per sample | ratio | first frame, CPU s | changed water, CPU s | peak MB |"
    )
    print("|---|---|---|---|---|---|")
    plain = None
    cases = [("plain", 0, False), ("fog", 0, False)]
    cases += [("water", n, shafts) for n in options.bands for shafts in (False, True)]
    for kind, bands, shafts in cases:
        first, sample, changed = _measure(kind, bands, shafts, options)
        plain = sample if plain is None else plain
        name = f"{bands} bands{', shafts' if shafts else ''}" if bands else kind
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"| {name} | {sample:.3f} | {sample / plain:.2f} | {first:.1f} | {changed:.1f} "
            f"| {peak:.0f} |",
            flush=True,
        )


def _measure(
    kind: str, bands: int, shafts: bool, options: argparse.Namespace
) -> tuple[float, float, float]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, camera = bpy.context.scene, _scene(options.resolution)
    water = None
    if kind == "water":
        water = _water(bands, 1.0, shafts)
        realtime.add_realtime(scene, water, water_body.WaterExtent(300.0, 10.0))
    else:
        _sun(scene)
        if kind == "fog":
            add_fog(bpy.data.materials["Grey"])
    reach = water.shafts if water else None
    with eevee_settings.realtime_settings(scene, camera, samples=1, shafts=reach):
        first = _frame(scene, 1)
        few = min(_frame(scene, 1) for _ in range(2))
        many = min(_frame(scene, 1 + options.samples) for _ in range(2))
        if water:
            realtime.set_values(scene, _water(bands, 2.0, shafts))
        changed = _frame(scene, 1)
    return first, (many - few) / options.samples, changed


def _frame(scene: bpy.types.Scene, samples: int) -> float:
    scene.eevee.taa_render_samples = samples
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        exr_output.write_float_exr(scene, Path(folder) / "a.exr")
        return time.process_time() - start


def _water(n: int, turbidity: float, shafts: bool) -> realtime.RealtimeWater:
    bands = Bands.uniform(n)
    a = 0.03 + 0.3 * ((bands.centres - 400) / 300) ** 2
    b = turbidity * 0.1 * 550 / bands.centres
    column = WaterColumn(
        bands, a, b, np.ones(n), float(in_water_cosine(30.0)), sun_travel_direction(30.0, 60.0),
        np.zeros(n), 7.0, np.full(n, 0.3), "flat", 1.34,
    )  # fmt: skip
    phase = parse_phase("hg:0.924").for_bands(b)
    return realtime.realtime_water(column, phase, _DEPTH, np.full((3, n), 9.0 / n), shafts=shafts)


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
