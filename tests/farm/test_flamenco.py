"""Flamenco's job type, compiled in a JavaScript engine with a stand-in for the manager."""

from __future__ import annotations

import json
from pathlib import Path

import py_mini_racer
import pytest
from underwater_spectral.tests.farm.project import (
    PASSES,
    assert_same_files,
    make_project,
)

SCRIPT = Path(__file__).resolve().parents[2] / "flamenco" / "underwater_spectral.js"

# What Flamenco Manager gives to a script: internal/manager/job_compilers/scripts.go, author.go.
MANAGER = """
class Task {
    constructor(name, type) { Object.assign(this, {name, type, commands: [], dependencies: []}); }
    addCommand(command) { this.commands.push(command); }
    addDependency(task) { this.dependencies.push(task.name); }
}
var author = {
    Task: (name, type) => new Task(name, type),
    Command: (name, parameters) => ({name, parameters}),
};
var path = {join: (...parts) => parts.join("/")};
function print() {}
function formatTimestampLocal(created) { return created; }
function shellSplit(text) { return text.split(" ").filter(part => part); }
function frameChunker(text, size) {
    const frames = [];
    for (const part of text.split(",")) {
        const ends = part.trim().split("-").map(Number);
        for (let frame = ends[0]; frame <= ends[ends.length - 1]; frame++) frames.push(`${frame}`);
    }
    const chunks = [];
    for (let i = 0; i < frames.length; i += size) {
        chunks.push(merged(frames.slice(i, i + size).map(Number)));
    }
    return chunks;
}
function merged(frames) {
    const runs = [];
    for (const frame of frames) {
        const run = runs[runs.length - 1];
        if (run && run[1] + 1 === frame) run[1] = frame; else runs.push([frame, frame]);
    }
    return runs.map(([a, b]) => a === b ? `${a}` : b === a + 1 ? `${a},${b}` : `${a}-${b}`).join();
}
function compiled(settings) {
    const tasks = [];
    const job = {settings, created: "2026-01-02_030405", addTask: task => tasks.push(task)};
    compileJob(job);
    return JSON.stringify({tasks, settings});
}
"""

SETTINGS = {
    "frames": "1-2, 5",
    "passes": 3,
    "passes_per_task": 2,
    "options": "--engine eevee --mode bands",
    "render_output_path": "/shared/out/reef/{timestamp}",
    "blendfile": "/shared/reef with spaces.blend",
}
OUT = "/shared/out/reef/2026-01-02_030405"


@pytest.fixture(scope="module")
def engine():
    context = py_mini_racer.MiniRacer()
    context.eval(f"'use strict';\n{MANAGER}")
    # The manager compiles scripts as strict ones.
    context.eval(
        f"'use strict';\n{SCRIPT.read_text(encoding='utf-8').replace('const ', 'var ', 1)}"
    )
    return context


def _compiled(engine, **changes) -> dict:
    settings = json.dumps({**SETTINGS, **changes})
    return json.loads(engine.eval(f"compiled({settings})"))


def _arguments(task) -> list[str]:
    *before, command = task["commands"]
    folder = {"name": "make-directory", "parameters": {"path": OUT}}
    assert before == ([folder] if task["name"] == "plan" else [])
    assert command["name"] == "exec"
    assert command["parameters"]["exe"] == "{blender}"
    start, blend = command["parameters"]["args"][:2], command["parameters"]["args"][2]
    assert (start, blend) == (["--command", "underwater"], SETTINGS["blendfile"])
    return command["parameters"]["args"][3:]


def test_plan_comes_first_and_frames_are_developed_as_soon_as_their_passes_are_there(engine):
    tasks = {task["name"]: task for task in _compiled(engine)["tasks"]}
    assert list(tasks) == [
        "plan",
        *("render-1-pass-0-1", "render-1-pass-2", "develop-1"),
        *("render-2-pass-0-1", "render-2-pass-2", "develop-2"),
        *("render-5-pass-0-1", "render-5-pass-2", "develop-5"),
    ]
    assert tasks["plan"]["dependencies"] == []
    for frame in "125":
        renders = [f"render-{frame}-pass-0-1", f"render-{frame}-pass-2"]
        assert all(tasks[name]["dependencies"] == ["plan"] for name in renders)
        assert tasks[f"develop-{frame}"]["dependencies"] == renders
    assert {task["type"] for task in tasks.values()} == {"blender"}


def test_every_command_is_one_of_the_batch(engine):
    made = _compiled(engine)
    tasks = {task["name"]: _arguments(task) for task in made["tasks"]}
    manifest = f"{OUT}/manifest.json"
    assert made["settings"]["render_output_path"] == OUT
    planned = ["--engine", "eevee", "--mode", "bands", "--frames", "1,2,5"]
    assert tasks["plan"] == [*planned, "--out", OUT, "--plan", manifest]
    passes = ["--from", manifest, "--frames", "2", "--passes", "0-1"]
    assert tasks["render-2-pass-0-1"] == passes
    assert tasks["develop-5"] == ["--from", manifest, "--frames", "5", "--develop"]


@pytest.mark.slow
def test_its_commands_render_what_one_process_renders(engine, empty_blender, tmp_path, artist):
    scene, *options = make_project(tmp_path / "project")
    artist(scene, *options, "--out", tmp_path / "single")
    out = tmp_path / "out"
    given = options[: options.index("--frames")]
    made = _compiled(
        engine,
        frames="1-2",
        passes=PASSES,
        passes_per_task=3,
        options=" ".join(given),
        blendfile=scene,
        render_output_path=str(out),
    )
    finished = set()
    for task in made["tasks"]:
        assert set(task["dependencies"]) <= finished
        *before, command = task["commands"]
        for folder in before:
            Path(folder["parameters"]["path"]).mkdir(parents=True, exist_ok=True)
        assert command["parameters"]["exe"] == "{blender}"
        option, name, *arguments = command["parameters"]["args"]
        assert (option, name) == ("--command", "underwater")
        artist(*arguments)
        finished.add(task["name"])
    assert_same_files(tmp_path / "single", out)


def test_a_long_shot_is_planned_by_ranges(engine):
    plan, *_ = _compiled(engine, frames="1-2880, 3000", passes=1)["tasks"]
    assert "1-2880,3000" in _arguments(plan)


@pytest.mark.parametrize("per_task", [1, 3, 100])
def test_each_pass_is_rendered_once(engine, per_task):
    tasks = _compiled(engine, passes=7, passes_per_task=per_task, frames="4")["tasks"]
    spans = [_arguments(task)[-1] for task in tasks if task["name"].startswith("render")]
    rendered = []
    for span in spans:
        first, _, last = span.partition("-")
        rendered += range(int(first), int(last or first) + 1)
    assert rendered == list(range(7))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"passes": 0}, "passes is 0"),
        ({"passes_per_task": 1.5}, "passes_per_task is 1.5"),
        ({"render_output_path": ""}, "render_output_path is empty"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(engine, changes, message):
    with pytest.raises(py_mini_racer.JSEvalException, match=message):
        _compiled(engine, **changes)


def test_settings_of_the_job_type_are_those_that_the_add_on_knows(engine):
    settings = json.loads(engine.eval("JSON.stringify(JOB_TYPE.settings)"))
    known = {"key", "type", "subtype", "default", "eval", "evalInfo", "visible", "required"}
    known |= {"editable", "propargs", "description"}
    assert all(set(setting) <= known for setting in settings)
    assert {setting["type"] for setting in settings} <= {"string", "int32", "bool", "float"}
    for setting in settings:
        if "eval" in setting:
            compile(setting["eval"], setting["key"], "eval")
