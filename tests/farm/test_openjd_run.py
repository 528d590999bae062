"""A bundle renders what one process renders, bit for bit: in two sessions at once, and moved.

The workers' Blender has no extension; that of the artist has it from its zip, as users have. With
a real one: ``BLENDER=/usr/bin/blender python3 dev.py test -m slow tests/farm/test_openjd_run.py``.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from underwater_spectral.jobs.farm.openjd_template import DEVELOP, RENDER
from underwater_spectral.tests.farm.project import (
    FRAMES,
    PASSES,
    ROOT,
    assert_same_files,
    make_project,
)

EEVEE = ["--engine", "eevee", "--mode", "bands"]


def _openjd(bundle: Path, project: Path, blender: Path, *arguments: str) -> subprocess.Popen:
    values = {"Scene": project / "reef.blend", "OutputDir": project / "out", "Blender": blender}
    given = [part for name, value in values.items() for part in ("-p", f"{name}={value}")]
    command = [sys.executable, "-m", "openjd", "run", str(bundle / "template.json"), *given]
    return subprocess.Popen([*command, *arguments], stdout=subprocess.PIPE, text=True)


def _finished(process: subprocess.Popen) -> str:
    output, _ = process.communicate(timeout=900)
    assert process.returncode == 0, output
    return output


def _split(bundle: Path, project: Path, blender: Path, *sessions: list[str]) -> list[str]:
    """Run sessions of tasks at once, then develop; return what the sessions print."""
    running = [_openjd(bundle, project, blender, *tasks) for tasks in sessions]
    printed = [_finished(session) for session in running]
    develop = ["--step", DEVELOP, "--no-run-dependencies"]
    _finished(_openjd(bundle, project, blender, *develop))
    return printed


def _tasks(*rows: tuple[int, str]) -> list[str]:
    tasks = [{"Frame": frame, "Pass": passes} for frame, passes in rows]
    return ["--step", RENDER, "--tasks", json.dumps(tasks)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "files", "sessions"),
    [
        # Pass 2 of frame 1 is asked of both.
        ([], 2 * PASSES, [[(1, "0-2"), (2, "3-3")], [(1, "2-3"), (2, "0-2")]]),
        (EEVEE, 2, [[(1, "0-1"), (2, "1-1")], [(1, "1-1"), (2, "0-0")]]),
    ],
    ids=["cycles", "eevee"],
)
def test_two_sessions_at_once_render_what_one_process_renders(
    empty_blender, tmp_path, blender, artist, options, files, sessions
):
    project = tmp_path / "project"
    options = [*make_project(project), *options]
    artist(*options, "--out", tmp_path / "single")
    bundle = tmp_path / "bundle"
    artist(*options, "--out", project / "out", "--bundle", bundle)
    assert not (project / "out").exists()
    for printed in _split(bundle, project, blender, *(_tasks(*rows) for rows in sessions)):
        assert "openjd_progress: 100.0" in printed
    assert_same_files(tmp_path / "single", project / "out", len(FRAMES) * (files + 3))
    assert not list((tmp_path / "home").rglob("underwater_spectral*"))


@pytest.mark.slow
def test_the_reef_by_two_sessions_is_that_of_one_process(tmp_path, blender, artist):
    """Three frames of the draft reef, all passes."""
    project = tmp_path / "project"
    project.mkdir()
    build = [sys.executable, str(ROOT / "examples" / "build_scene.py"), "reef", "--detail", "draft"]
    subprocess.run([*build, str(project / "reef.blend")], check=True)
    options = [project / "reef.blend", "--water", "jerlov:IB", "--bands", 2, "--frames", "1-3"]
    options += ["--samples", 2, "--resolution", 32, 18, "--floor-depth", 7, "--surface", "flat"]
    artist(*options, "--out", tmp_path / "single")
    bundle = tmp_path / "bundle"
    artist(*options, "--out", project / "out", "--bundle", bundle)
    passes = len(json.loads((bundle / "manifest.json").read_text())["passes"])
    every = f"0-{passes - 1}"
    sessions = _tasks((1, every), (2, "0-0")), _tasks((3, every), (2, every))
    _split(bundle, project, blender, *sessions)
    assert_same_files(tmp_path / "single", project / "out", 3 * (2 * passes + 3))


@pytest.mark.slow
def test_a_moved_project_renders_the_same_by_path_mapping(empty_blender, tmp_path, blender, artist):
    first = tmp_path / "first"
    options = make_project(first)
    artist(*options, "--out", tmp_path / "single")
    bundle = tmp_path / "bundle"
    artist(*options, "--out", first / "out", "--bundle", bundle)
    # The bundle stays, so that what the plan says of the table is wrong as well.
    worker = first.rename(tmp_path / "worker")
    rule = {
        "source_path_format": "POSIX" if os.name == "posix" else "WINDOWS",
        "source_path": str(first),
        "destination_path": str(worker),
    }
    rules = json.dumps({"version": "pathmapping-1.0", "path_mapping_rules": [rule]})
    # The scheduler says where the scene was; the session maps it.
    arguments = ["--step", DEVELOP, "--run-dependencies", "--path-mapping-rules", rules]
    _finished(_openjd(bundle, first, blender, *arguments))
    assert_same_files(tmp_path / "single", worker / "out")
