"""Registering leaves no trace, is quick, and imports nothing heavy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
from underwater_spectral import registration

ROOT = Path(__file__).resolve().parents[2]

COLD_START = """
import json, runpy, sys, time
extension = runpy.run_path(sys.argv[1])["extension"]()
import bpy
start, cpu = time.perf_counter(), time.process_time()
extension.register()
print("FOUND " + json.dumps({
    "seconds": time.process_time() - cpu,
    "heavy": sorted({"colour", "jerlov", "nodebpy", "OpenImageIO", "scipy"} & set(sys.modules)),
}))
"""


def _everything():
    handlers = {
        name: list(value)
        for name in dir(bpy.app.handlers)
        if isinstance(value := getattr(bpy.app.handlers, name), list)
    }
    ours = [name for name in dir(bpy.types) if "underwater" in name.lower()]
    properties = [p for p in bpy.types.Scene.bl_rna.properties.keys() if "underwater" in p]  # noqa: SIM118
    operators = dir(bpy.ops.underwater)
    groups = [g.name for g in bpy.data.node_groups]
    paths = sorted(bpy.utils._preset_path_registry)
    return handlers, ours, properties, operators, groups, paths


def test_twenty_times_leaves_no_trace():
    registration.unregister()
    before = _everything()
    for _ in range(20):
        registration.register()
        registration.unregister()
    assert _everything() == before
    assert before[1:4] == ([], [], [])
    registration.register()
    assert _everything() != before


def test_enabling_is_quick_and_light():
    command = [sys.executable, "-c", COLD_START, str(ROOT / "render_bands.py")]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    line = next(x for x in result.stdout.splitlines() if x.startswith("FOUND "))
    found = json.loads(line.removeprefix("FOUND "))
    assert found["heavy"] == []
    assert found["seconds"] < 0.3


def test_a_failure_undoes_what_was_done(monkeypatch):
    registration.unregister()
    before = _everything()

    def fail():
        raise RuntimeError("no")

    monkeypatch.setattr(registration.handlers, "register", fail)
    try:
        registration.register()
    except RuntimeError:
        pass
    else:
        raise AssertionError("the failure was swallowed")
    assert _everything() == before
    monkeypatch.undo()
    registration.register()
