"""Render two seconds of caustics and light shafts that loop without a seam.

python3 dev.py run examples/render_caustics.py
"""

from __future__ import annotations

import importlib
import itertools
import math
import runpy
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "caustics"
FRAMES, RATE = 48, 25
COLUMNS = 8
OPTIONS = [
    *("--engine", "eevee", "--mode", "realtime", "--shafts", "--frames", f"1-{FRAMES}"),
    *("--water", "jerlov:IB", "--bands", "8", "--resume"),
    *("--illuminant", "clear-sky", "--irradiance", "above", "--sun-zenith", "25"),
    *("--sun-azimuth", "-75", "--floor-depth", "5.5", "--floor-reflectance", "0.35"),
    *("--surface", "waves", "--wind", "4", "--wind-direction", "-30", "--wave-tile", "8"),
    *("--wave-loop", str(FRAMES / RATE), "--resolution", "160", "90", "--samples", "2"),
]


def build(scene_path: Path) -> None:
    """Make boulders on the floor, a ball that swims a circle, and a camera."""
    package = runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"]()
    shapes = importlib.import_module(f"{package.__name__}.examples.parts.shapes")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start, scene.frame_end = RATE, 1, FRAMES
    material = bpy.data.materials.new("Stone")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    links.new(nodes.new("ShaderNodeObjectInfo").outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.9
    ball = shapes.icosphere(3)
    random = np.random.default_rng(4)
    places = [(-2.3, 5.0, 1.3), (2.6, 6.5, 1.8), (-0.6, 8.5, 1.0), (1.2, 3.6, 0.45), (-4.5, 9.0, 2)]
    for x, y, size in places:
        waves = random.normal(size=(6, 3)) * 2.0
        relief = 1.0 + 0.08 * np.sin(ball.vertices @ waves.T + random.uniform(0, 6, 6)).sum(axis=1)
        item = _object("Boulder", ball.vertices * relief[:, None], ball, material)
        item.location, item.scale = (x, y, -5.6), (size, size, 0.8 * size)
        item.color = (*random.uniform((0.35, 0.2, 0.15), (0.7, 0.5, 0.4)), 1.0)
    fish = _object("Fish", ball.vertices * (0.16, 0.5, 0.2), ball, material)
    fish.color = (0.8, 0.35, 0.1, 1.0)
    for frame in range(1, FRAMES + 2):
        turn = 2 * math.pi * (frame - 1) / FRAMES
        fish.location = (0.2 + 0.9 * math.cos(turn), 4.4 + 0.9 * math.sin(turn), -3.9)
        fish.rotation_euler = (0.0, 0.0, turn)
        fish.keyframe_insert("location", frame=frame)
        fish.keyframe_insert("rotation_euler", frame=frame)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 20.0
    camera.location, camera.rotation_euler = (0.0, 0.0, -3.6), (math.radians(80), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_path))


def _object(name: str, vertices: np.ndarray, shape: object, material: bpy.types.Material):  # noqa: ANN202
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], shape.triangles.tolist())
    mesh.shade_smooth()
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def report(pictures: list[np.ndarray]) -> str:
    """Say how far neighbouring frames differ, and the last from the first."""
    looped = [*pictures, pictures[0]]
    steps = 255 * np.array([np.abs(b - a).mean() for a, b in itertools.pairwise(looped)])
    return (
        f"Mean absolute difference of neighbouring frames in 8-bit sRGB steps: "
        f"{steps[:-1].mean():.2f}, from {steps[:-1].min():.2f} to {steps[:-1].max():.2f}; of the "
        f"last and the first: {steps[-1]:.2f}."
    )


def main() -> None:
    """Build, render what is missing, and write docs/measured/caustics_frames.jpg."""
    import OpenImageIO as oiio  # noqa: N813

    OUT.mkdir(parents=True, exist_ok=True)
    scene = OUT / "scene.blend"
    if not scene.exists():
        build(scene)
    command = [sys.executable, str(ROOT / "render_bands.py"), str(scene), *OPTIONS]
    subprocess.run([*command, *sys.argv[1:], "--out", str(OUT)], check=True)
    files = [OUT / f"{frame:04d}.png" for frame in range(1, FRAMES + 1)]
    pictures = [oiio.ImageBuf(str(f)).get_pixels()[..., :3] for f in files if f.exists()]
    if len(pictures) < FRAMES:
        return
    rows = [np.concatenate(pictures[i : i + COLUMNS], axis=1) for i in range(0, FRAMES, COLUMNS)]
    sheet = np.ascontiguousarray(np.concatenate(rows))
    image = oiio.ImageBuf(oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, "uint8"))
    image.set_pixels(oiio.ROI(), sheet)
    image.specmod().attribute("Compression", "jpeg:88")
    image.write(str(ROOT / "docs" / "measured" / "caustics_frames.jpg"))
    print(report(pictures))


if __name__ == "__main__":
    main()
