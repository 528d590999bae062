"""A small project on disk, rendered by one process and by many."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

ROOT = Path(__file__).resolve().parents[2]
FRAMES, BANDS = (1, 2), 6
PASSES = 4
"""Some hold two neighbouring bands or three; each has a file of guides for the denoiser."""
TABLE = "wavelength_nm,a,b\n400,0.02,0.2\n550,0.06,0.15\n700,0.6,0.1\n"


def make_project(folder: Path) -> list[str]:
    """Save a scene with a texture and a table, named absolutely; return the options."""
    folder.mkdir()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    image = bpy.data.images.new("paint", 8, 8)
    image.generated_type, image.file_format = "COLOR_GRID", "PNG"
    image.filepath_raw = str(folder / "paint.png")
    image.save()
    bpy.data.images.remove(image)
    material = scenes.textured()
    (texture,) = [n for n in material.node_tree.nodes if n.type == "TEX_IMAGE"]
    texture.image = bpy.data.images.load(str(folder / "paint.png"))
    item = scenes._cube("ball", (0.0, 6.0, -5.0))
    item.data.materials.append(material)
    scenes.add_camera()
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 12, 8, 100
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "reef.blend"), relative_remap=False)
    (folder / "water.csv").write_text(TABLE)
    water = f"file:{folder / 'water.csv'}"
    return [
        str(folder / "reef.blend"),
        *("--water", water, "--bands", str(BANDS), "--samples", "2", "--frames", "1-2"),
    ]


def run_batch(*arguments: object) -> None:
    command = [sys.executable, str(ROOT / "render_bands.py"), *map(str, arguments)]
    subprocess.run(command, check=True)


def assert_same_files(
    first: Path, second: Path, count: int = len(FRAMES) * (2 * PASSES + 3)
) -> None:
    suffixes = {".exr", ".png"}
    names = sorted(p.relative_to(first) for p in first.rglob("*") if p.suffix in suffixes)
    assert names == sorted(p.relative_to(second) for p in second.rglob("*") if p.suffix in suffixes)
    assert len(names) == count
    for name in names:
        if name.suffix == ".png":
            assert (first / name).read_bytes() == (second / name).read_bytes(), name
        else:
            assert np.array_equal(read_exr(first / name)[0], read_exr(second / name)[0]), name
