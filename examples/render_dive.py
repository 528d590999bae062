"""Render a dive: from 1 m to 15 m while the water goes from Jerlov IB to 3C by keyframes.

python3 dev.py run examples/render_dive.py
"""

from __future__ import annotations

import importlib
import itertools
import runpy
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "out" / "dive"
FRAMES = 24
START, END = 1.0, 15.0
FLOOR = 17.0
BOULDERS = 36
COLUMNS = 6
OPTIONS = [
    *("--engine", "eevee", "--mode", "realtime", "--frames", f"1-{FRAMES}", "--resume"),
    *("--water", "jerlov:IB", "--second-water", "jerlov:3C"),
    *("--bands", "8", "--illuminant", "clear-sky", "--irradiance", "above", "--surface", "flat"),
    *("--sun-zenith", "30", "--sun-azimuth", "60", "--floor-reflectance", "0.3"),
    *("--floor-depth", str(FLOOR), "--resolution", "160", "90", "--samples", "8"),
]


def build(scene_path: Path) -> None:
    """Make a wall of boulders down to the floor, and give camera and water their keyframes."""
    package = runpy.run_path(str(ROOT / "tools" / "load_checkout.py"))["load"]()
    shapes = importlib.import_module(f"{package.__name__}.examples.parts.shapes")
    settings = importlib.import_module(f"{package.__name__}.scene.stored_settings")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    settings.register()
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, FRAMES
    material = coloured_by_object()
    random = np.random.default_rng(7)
    for number in range(BOULDERS):
        ball = shapes.icosphere(3).vertices
        waves = random.normal(size=(6, 3)) * 2.0
        relief = 1.0 + 0.12 * np.sin(ball @ waves.T + random.uniform(0, 6, 6)).sum(axis=1)
        mesh = bpy.data.meshes.new("Boulder")
        mesh.from_pydata(ball * relief[:, None], [], shapes.icosphere(3).triangles.tolist())
        mesh.shade_smooth()
        mesh.materials.append(material)
        item = bpy.data.objects.new("Boulder", mesh)
        depth = 2.0 + (FLOOR - 2.5) * number / (BOULDERS - 1)
        # The wall leans back towards the surface and spreads at its foot.
        item.location = (
            random.uniform(-4.5, 4.5),
            9.0 - 0.25 * depth + random.uniform(-1, 1),
            -depth,
        )
        item.scale = random.uniform(0.5, 1.3, 3)
        item.color = (*random.uniform((0.25, 0.12, 0.08), (0.8, 0.5, 0.4)), 1.0)
        scene.collection.objects.link(item)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.lens = 24.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    for frame, depth, tilt in ((1, START, 62.0), (FRAMES, END, 86.0)):
        camera.location, camera.rotation_euler = (0.0, 0.0, -depth), (np.radians(tilt), 0.0, 0.0)
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_euler", frame=frame)
        scene.underwater.second_water_fraction = float(frame == FRAMES)
        scene.underwater.keyframe_insert("second_water_fraction", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(scene_path))


def coloured_by_object() -> bpy.types.Material:
    """Make one material that takes its colour from each object: one shader to compile."""
    material = bpy.data.materials.new("Boulder")
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    links.new(nodes.new("ShaderNodeObjectInfo").outputs["Color"], shader.inputs["Base Color"])
    shader.inputs["Roughness"].default_value = 0.9
    return material


def report(pictures: list[np.ndarray]) -> str:
    """Say how large the steps from frame to frame are, and how they change."""
    steps = np.array([np.abs(b - a).mean() for a, b in itertools.pairwise(pictures)])
    changes = np.abs(np.diff(steps))
    middle = (steps[:-2] + steps[2:]) / 2
    jump = float(np.max(np.abs(steps[1:-1] - middle) / middle))
    rows = " ".join(f"{255 * step:.1f}" for step in steps)
    return "\n".join(
        [
            "# A dive from 1 m to 15 m, from Jerlov IB to 3C",
            "",
            "![Twenty-four frames](dive.jpg)",
            "",
            "EEVEE in real-time mode, 8 bands, flat surface, a wall of boulders over a",
            "floor at 17 m. Depth, camera and fraction of the second water are keyframes; exposure",
            "follows the light at the camera's depth. Node values change; nothing is rebuilt.",
            "",
            f"Mean absolute difference of neighbouring frames, in 8-bit sRGB steps: {rows}.",
            "",
            f"Largest step {255 * steps.max():.1f}, largest change from one step to the next "
            f"{255 * changes.max():.1f}; a step differs from the mean of its neighbours by at most "
            f"{100 * jump:.0f} %.",
            "",
            "Repeat: `python3 dev.py run examples/render_dive.py`",
            "",
        ]
    )


def main() -> None:
    """Build, render what is missing, and write docs/measured/dive.md."""
    import OpenImageIO as oiio  # noqa: N813

    OUT.mkdir(parents=True, exist_ok=True)
    scene_path = OUT / "dive.blend"
    if not scene_path.exists():
        build(scene_path)
    command = [sys.executable, ROOT / "render_bands.py", scene_path, *OPTIONS]
    subprocess.run([*command, "--out", OUT / "frames"], check=True)
    pictures = [
        oiio.ImageBuf(str(OUT / "frames" / f"{frame:04d}.png")).get_pixels(oiio.FLOAT)[..., :3]
        for frame in range(1, FRAMES + 1)
    ]
    rows = [np.hstack(pictures[i : i + COLUMNS]) for i in range(0, FRAMES, COLUMNS)]
    sheet = np.vstack(rows)
    image = oiio.ImageBuf(oiio.ImageSpec(sheet.shape[1], sheet.shape[0], 3, "uint8"))
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(sheet))
    image.write(str(ROOT / "docs" / "measured" / "dive.jpg"))
    (ROOT / "docs" / "measured" / "dive.md").write_text(report(pictures), encoding="utf-8")


if __name__ == "__main__":
    main()
