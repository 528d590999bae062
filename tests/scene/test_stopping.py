"""What a batch prints, and how it is stopped: nothing that is finished is lost."""

from __future__ import annotations

import io
import os
import re
import signal
from collections.abc import Iterator
from pathlib import Path

import bpy
import pytest
from bpy.app.handlers import persistent
from underwater_spectral.jobs import batch
from underwater_spectral.jobs.band_passes import RenderedPass
from underwater_spectral.jobs.progress import Progress
from underwater_spectral.jobs.render_job import Step
from underwater_spectral.scene.blender_prints import without_file_lines
from underwater_spectral.tests.scene import scenes

FAST = ["--engine", "cycles", "--samples", 1, "--resolution", 16, 9, "--phase", "hg:0.8",
        "--bands", 6, "--frames", "1-2", "--no-denoise"]  # fmt: skip
PASSES = 4


@pytest.fixture
def blend(tmp_path, empty_blender) -> Path:
    scenes._cube("box", (0.0, 6.0, -5.0)).data.materials.append(scenes.principled("paint"))
    scenes.add_camera()
    path = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path


@pytest.fixture(autouse=True)
def interruptible() -> Iterator[None]:
    """What is started in the background ignores Ctrl+C, its tests too."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def during_render():
    """Call a function in the renders of the passes, with the number of each, from 1."""
    added = []

    def call(function) -> None:
        count = iter(range(1, 1000))
        added.append(persistent(lambda *_: function(next(count))))
        bpy.app.handlers.render_pre.append(added[-1])

    yield call
    for handler in added:
        bpy.app.handlers.render_pre.remove(handler)


def _run(*arguments: object) -> int:
    return batch.main([str(a) for a in arguments], inside_blender=False)


def _passes(out: Path) -> list[str]:
    return sorted(f"{p.parent.name}/{p.name}" for p in (out / "passes").rglob("pass_??.exr"))


def _interrupt() -> None:
    signal.raise_signal(signal.SIGINT)


def _cancel() -> None:
    """Do as Blender's own Ctrl+C does."""
    for handler in list(bpy.app.handlers.render_cancel):
        handler(bpy.context.scene, None)


# The third render develops the first frame, the fourth is the second frame's first pass.
@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("stop", "at", "finished"), [(_interrupt, 3, 2), (_interrupt, 4, 3), (_cancel, 4, 2)]
)
def test_a_stopped_batch_goes_on_as_if_it_had_not(
    blend, tmp_path, during_render, capfd, stop, at, finished
):
    whole, out = tmp_path / "whole", tmp_path / "out"
    assert _run(blend, *FAST, "--out", whole) == 0
    during_render(lambda number: stop() if number == at else None)
    assert _run(blend, *FAST, "--out", out) == 130
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    assert "stopped; finished passes stay" in capfd.readouterr().err
    done = _passes(out)
    assert done == _passes(whole)[:finished]
    assert len(_passes(whole)) == PASSES
    names = {path.name for path in out.rglob("*") if path.is_file()}
    assert not [name for name in names if name.startswith(".")], "claims or raw passes are left"
    before = {name: (out / "passes" / name).stat().st_mtime_ns for name in done}
    assert _run(blend, *FAST, "--resume", "--out", out) == 0
    assert before == {name: (out / "passes" / name).stat().st_mtime_ns for name in done}
    for name in ("0001.png", "0002.png"):
        assert (out / name).read_bytes() == (whole / name).read_bytes()


def test_a_log_is_short_and_all_ours(blend, tmp_path, capfd):
    out = tmp_path / "out"
    assert _run(blend, *FAST, "--out", out) == 0
    lines = capfd.readouterr().out.splitlines()
    first, last, done = (re.sub(r"\d+\.\d s", "T s", line) for line in lines)
    assert first.startswith("frame 1: pass_00.exr T s, pass 1 of 4, 0:00:0")
    assert last == "frame 2: pass_01.exr T s, pass 4 of 4, 0:00:00 left"
    assert done == f"done: 2 frame(s) in {out}"
    assert _run(blend, *FAST, "--quiet", "--resume", "--out", out) == 0
    assert capfd.readouterr().out == ""


def test_what_blender_says_otherwise_is_kept(capfd):
    with without_file_lines():
        os.write(1, b"00:01.794  render           | Saved: '/tmp/x.exr'\n")
        os.write(1, b"00:01.795  render           | WARNING odd\n")
    assert capfd.readouterr().out == "00:01.795  render           | WARNING odd\n"


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _steps(progress: Progress, seconds: float | None, total: int = 4) -> None:
    for number in range(1, total + 1):
        file = RenderedPass(Path(f"pass_{number:02}.exr"), (0,), seconds)
        progress.report(Step(1, file, number, total))


def test_a_terminal_has_one_line(monkeypatch):
    monkeypatch.setattr("sys.stdout", shown := _Terminal())
    monkeypatch.setenv("COLUMNS", "60")
    progress = Progress()
    progress.note("a lamp is left out")
    _steps(progress, 30.0)
    progress.note("a lamp is left out")
    progress.say("done")
    text = shown.getvalue()
    assert text.count("\n") == 3
    assert text.count("note: ") == 1
    assert "pass 1 of 4, 0:01:30 left" in text
    assert max(map(len, re.split(r"\r\x1b\[K|\n", text))) < 60


def test_passes_that_were_there_tell_no_time(capsys):
    _steps(Progress(), None, 1)
    assert capsys.readouterr().out == "frame 1: pass_01.exr kept, pass 1 of 1\n"


def test_a_farm_hears_of_every_pass(capsys):
    _steps(Progress("openjd", quiet=True), 30.0)
    found = [line.split(": ", 1) for line in capsys.readouterr().out.splitlines()]
    assert [word for word, _ in found] == ["openjd_progress", "openjd_status"] * 4
    assert [float(text) for _, text in found[::2]] == [25.0, 50.0, 75.0, 100.0]
