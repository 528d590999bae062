"""Registering leaves no trace, is quick, and imports nothing heavy."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import bpy
from underwater_spectral import registration
from underwater_spectral.jobs import batch
from underwater_spectral.ui import panels

ROOT = Path(__file__).resolve().parents[2]

COLD_START = """
import json, runpy, sys
extension = runpy.run_path(sys.argv[1])["load"]()
import bpy
opened = []
sys.addaudithook(lambda event, arguments: opened.append(arguments[0]) if event == "open" else None)
before = set(sys.modules)
extension.register()
data = [str(path) for path in opened if "/data/" in str(path)]
loaded = sorted(name for name in set(sys.modules) - before)
print("FOUND " + json.dumps({"loaded": loaded, "data": data}))
"""
# Of what renders, enabling loads only what the panel stores and the table of terms.
LIGHT = {
    *("scene", "scene.session", "scene.stored_settings", "scene.stored_lamps"),
    "scene.stored_clouds",
    "scene.stored_materials",
    *("scene.raised_limits", "scene.scripts", "scene.unsupported", "scene.rendered"),
    *("scene.animation", "scene.water", "scene.water.lamp_rigs", "jobs", "jobs.job", "jobs.stage"),
    "scene.water.new_clouds",
    *("settings", "settings.scene_settings", "settings.setting", "settings.known_words"),
    "settings.water_settings",
    *("quality", "quality.methods"),
}
HEAVY = {"colour", "jerlov", "OpenImageIO", "scipy"}


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
    manuals = list(bpy.utils._manual_map)
    droppers = [cls.__name__ for cls in bpy.types.FileHandler.__subclasses__() if cls.is_registered]
    return handlers, ours, properties, operators, groups, paths, manuals, droppers


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


def test_enabling_loads_little_and_reads_no_data():
    command = [sys.executable, "-c", COLD_START, str(ROOT / "tools" / "load_checkout.py")]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    line = next(x for x in result.stdout.splitlines() if x.startswith("FOUND "))
    found = json.loads(line.removeprefix("FOUND "))
    loaded = [name.removeprefix("underwater_spectral.") for name in found["loaded"]]
    assert not HEAVY & {name.split(".")[0] for name in loaded}
    rendering = {
        name
        for name in loaded
        if name.split(".")[0] in {"scene", "settings", "jobs", "node_groups", "quality"}
    }
    assert rendering == LIGHT
    assert found["data"] == []


def test_no_panel_is_the_parent_class_of_another():
    """Blender would draw neither, and say so in a window only."""
    registered = (*panels.CLASSES, *panels.PROPERTIES)
    for cls in registered:
        assert not set(cls.__mro__[1:]) & set(registered), cls
        assert getattr(bpy.types, cls.bl_idname) is cls
    assert {cls.bl_space_type for cls in panels.PROPERTIES} == {"PROPERTIES"}


def test_the_command_of_blender_runs_the_batch(monkeypatch, capsys, tmp_path):
    registration.unregister()
    known = {}
    monkeypatch.setattr(
        bpy.utils, "register_cli_command", lambda name, run: known.update({name: run}) or name
    )
    monkeypatch.setattr(bpy.utils, "unregister_cli_command", known.pop)
    registration.register()
    bpy.ops.wm.read_homefile(use_empty=True)
    run = known["underwater"]
    assert run(["--list-waters"]) == 0
    assert "solonenko2015: jerlov:I, jerlov:IA" in capsys.readouterr().out
    assert run(["--help"]) == 0
    assert capsys.readouterr().out.startswith("usage: underwater ")
    assert run([]) == 2
    assert capsys.readouterr().err.startswith("underwater: name a scene before the options")
    opened = []
    blend = str(tmp_path / "open.blend")
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    monkeypatch.setattr(batch, "main", lambda _, **how: opened.append(how["inside_blender"]) or 0)
    assert run(["--from", "job.json"]) == 0
    assert opened == [True], "blender open.blend --command underwater --from job.json"
    registration.unregister()
    assert known == {}
    monkeypatch.undo()
    registration.register()


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
