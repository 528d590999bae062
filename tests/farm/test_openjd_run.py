"""A bundle renders what one process renders, bit for bit: in two sessions at once, and moved."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest
from underwater_spectral.scene.openjd_template import DEVELOP, RENDER
from underwater_spectral.tests.scene import scenes
from underwater_spectral.uw_spectral.spectra.spectral_image import read_exr

ROOT = Path(__file__).resolve().parents[2]
FRAMES, PASSES = (1, 2), 4
TABLE = "wavelength_nm,a,b\n400,0.02,0.2\n550,0.06,0.15\n700,0.6,0.1\n"


def _project(folder: Path) -> list[str]:
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
        *("--water", water, "--bands", str(PASSES), "--samples", "2", "--frames", "1-2"),
    ]


def _batch(*arguments: object) -> None:
    command = [sys.executable, str(ROOT / "render_bands.py"), *map(str, arguments)]
    subprocess.run(command, check=True)


def _openjd(bundle: Path, project: Path, blender: Path, *arguments: str) -> subprocess.Popen:
    values = {"Scene": project / "reef.blend", "OutputDir": project / "out", "Blender": blender}
    given = [part for name, value in values.items() for part in ("-p", f"{name}={value}")]
    command = [sys.executable, "-m", "openjd", "run", str(bundle / "template.json"), *given]
    return subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, text=True)


def _finished(process: subprocess.Popen) -> str:
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output
    return output


def _tasks(*rows: tuple[int, str]) -> list[str]:
    tasks = [{"Frame": frame, "Pass": passes} for frame, passes in rows]
    return ["--step", RENDER, "--tasks", json.dumps(tasks)]


def _assert_same(first: Path, second: Path) -> None:
    suffixes = {".exr", ".png"}
    names = sorted(p.relative_to(first) for p in first.rglob("*") if p.suffix in suffixes)
    assert names == sorted(p.relative_to(second) for p in second.rglob("*") if p.suffix in suffixes)
    assert len(names) == len(FRAMES) * (PASSES + 3)
    for name in names:
        if name.suffix == ".png":
            assert (first / name).read_bytes() == (second / name).read_bytes(), name
        else:
            assert np.array_equal(read_exr(first / name)[0], read_exr(second / name)[0]), name


@pytest.mark.slow
def test_two_sessions_at_once_render_what_one_process_renders(empty_blender, tmp_path, blender):
    project = tmp_path / "project"
    options = _project(project)
    _batch(*options, "--out", tmp_path / "single")
    bundle = tmp_path / "bundle"
    _batch(*options, "--out", project / "out", "--bundle", bundle)
    assert not (project / "out").exists()
    # Pass 2 of frame 1 is asked of both.
    sessions = [
        _openjd(bundle, project, blender, *_tasks((1, "0-2"), (2, "3-3"))),
        _openjd(bundle, project, blender, *_tasks((1, "2-3"), (2, "0-2"))),
    ]
    for session in sessions:
        assert "openjd_progress: 100.0" in _finished(session)
    develop = ["--step", DEVELOP, "--no-run-dependencies"]
    _finished(_openjd(bundle, project, blender, *develop))
    _assert_same(tmp_path / "single", project / "out")


@pytest.mark.slow
def test_a_moved_project_renders_the_same_by_path_mapping(empty_blender, tmp_path, blender):
    home = tmp_path / "home"
    options = _project(home)
    _batch(*options, "--out", tmp_path / "single")
    bundle = tmp_path / "bundle"
    _batch(*options, "--out", home / "out", "--bundle", bundle)
    # The bundle stays, so that what the plan says of the table is wrong as well.
    worker = home.rename(tmp_path / "worker")
    rule = {
        "source_path_format": "POSIX" if os.name == "posix" else "WINDOWS",
        "source_path": str(home),
        "destination_path": str(worker),
    }
    rules = json.dumps({"version": "pathmapping-1.0", "path_mapping_rules": [rule]})
    # The scheduler says where the scene was; the session maps it.
    arguments = ["--step", DEVELOP, "--run-dependencies", "--path-mapping-rules", rules]
    _finished(_openjd(bundle, home, blender, *arguments))
    _assert_same(tmp_path / "single", worker / "out")
