"""A render as a job of Open Job Description: plain data, without Blender.

Source: Open Job Description, Template Schemas, revision 2023-09, with the extension
``TASK_CHUNKING`` (RFC 0001). The files ``parameter_values`` and ``asset_references`` are those
of job bundles of AWS Deadline Cloud. All are JSON: it is what Python writes without a further
package, and both readers take ``.json`` and ``.yaml`` alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from ...scene.scripts import TRUST

TEMPLATE, VALUES, ASSETS = "template.json", "parameter_values.json", "asset_references.json"
MANIFEST, README = "manifest.json", "README.md"
EXTENSION = "underwater_spectral.zip"
RENDER, DEVELOP = "RenderPasses", "Develop"

SYSTEMS = ("linux", "windows", "macos")
"""Operating systems of workers, by their names in Open Job Description."""

_LONGEST_NAME = 128
# Seconds after which a task is taken for hung, and that one has to end: a pass lands whole or
# not at all, so nothing is lost but the pass.
_RENDER_TIMEOUT, _DEVELOP_TIMEOUT, _INSTALL_TIMEOUT = 172_800, 21_600, 1_800
_NOTIFY_SECONDS = 30
_MIB = 2**20
# Blender and the extension without a scene.
_BLENDER_MIB = 2048
# The fewest that farms rent.
_CORES = 2


@dataclass(frozen=True)
class FarmJob:
    """What a farm renders: a scene that is planned already.

    ``passes`` are those of a frame; ``memory`` in bytes is what a frame takes at least; ``gpu`` is
    whether the engine draws on a graphics card; ``system`` the workers' operating system, of
    :data:`SYSTEMS`; ``cameras`` are named where there are several, each rendered by tasks of its
    own; ``scripts`` is whether workers let the Python of the .blend run.
    """

    scene: Path
    out: Path
    frames: tuple[int, ...]
    passes: int
    memory: float = 0.0
    gpu: bool = False
    system: str = SYSTEMS[0]
    cameras: tuple[str, ...] = ()
    tables: tuple[Path, ...] = ()  #: That the settings of its frames name.
    scripts: bool = False


def ranges(numbers: Sequence[int]) -> str:
    """Write numbers as a range expression such as 1-3,7,9-10, in order and each once."""
    ordered = sorted(set(numbers))
    starts = [ordered[0], *(b for a, b in pairwise(ordered) if b != a + 1)]
    ends = [*(a for a, b in pairwise(ordered) if b != a + 1), ordered[-1]]
    return ",".join(f"{a}" if a == b else f"{a}-{b}" for a, b in zip(starts, ends, strict=True))


def template(job: FarmJob) -> dict[str, Any]:
    """Return the job template: passes of all frames, then their development."""
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": _name(job),
        "description": "Spectral bands of an underwater scene, rendered pass by pass from the "
        "plan in manifest.json and developed into pictures. The workers need Blender; the "
        "extension Underwater Spectral goes along.",
        "parameterDefinitions": _parameters(job),
        "jobEnvironments": [_extension()],
        "steps": [_render_step(job), _develop_step(job)],
    }


def parameter_values(job: FarmJob) -> dict[str, Any]:
    """Return the values of the parameters that have no default."""
    values = {"Scene": job.scene, "OutputDir": job.out}
    listed = [{"name": name, "value": str(value)} for name, value in values.items()]
    return {"parameterValues": listed}


def asset_references(
    job: FarmJob, files: Sequence[Path], folders: Sequence[Path]
) -> dict[str, Any]:
    """Return what the job reads besides scene and plan, and the folder that it writes."""
    return {
        "assetReferences": {
            "inputs": {
                "filenames": sorted({str(path) for path in (job.scene, *files)}),
                "directories": sorted({str(path) for path in folders}),
            },
            "outputs": {"directories": [str(job.out)]},
            "referencedPaths": [],
        }
    }


def readme(job: FarmJob) -> str:
    """Return how to run and to submit the bundle, as Markdown."""
    first = job.frames[0]
    return f"""\
# {job.scene.name} on a render farm

{len(job.frames)} frame(s) of {job.passes} pass(es), planned already: `{MANIFEST}`. Every machine
needs Blender, of the version that planned; the extension is `{EXTENSION}`, which each session
installs into a profile of its own. Write the bundle again after a change of the scene or of its
settings; a task refuses a scene that the plan does not fit.

## On this machine
`pip install openjd-cli`, then, in this folder:

```sh
openjd check {TEMPLATE}
openjd run {TEMPLATE} --step {DEVELOP} --run-dependencies \\
    -p "Scene={job.scene}" -p "OutputDir={job.out}" -p Blender=blender
```

One pass of one frame: `--step {RENDER} --tasks '[{{"Frame": {first}, "Pass": "0-0"}}]'`.

## AWS Deadline Cloud
```sh
deadline bundle submit .
deadline bundle gui-submit .
```

`{ASSETS}` lists the files that go along, `{VALUES}` where scene and output lie. What lies
elsewhere on a worker is found by the path mapping of its session.

| parameter | meaning |
|---|---|
| `Frames`, `Passes` | what to render of the plan, such as `1-24` and `0-{job.passes - 1}` |
| `PassesPerTask`, `FramesPerTask` | more where Blender takes long to start |
| `Blender` | Blender's executable on the workers |
| `System` | their operating system: {", ".join(SYSTEMS)} |

Tasks may be run again at any time: finished passes are kept.
"""


def _name(job: FarmJob) -> str:
    # Two braces would be a reference to a parameter.
    plain = job.scene.stem.replace("{{", "(").replace("}}", ")")
    return f"Underwater {plain}"[:_LONGEST_NAME]


def _parameters(job: FarmJob) -> list[dict[str, Any]]:
    return [
        _path("Scene", "Scene", "The .blend"),
        _path("Manifest", "Plan", "Plan of the job, written with the bundle", default=MANIFEST),
        {
            **_path("OutputDir", "Output folder", "Passes and pictures"),
            "objectType": "DIRECTORY",
            "dataFlow": "OUT",
            "userInterface": {"control": "CHOOSE_DIRECTORY", "label": "Output folder"},
        },
        _text("Frames", "Frames", ranges(job.frames), "Frames to render, such as 1-24 or 1,5,9"),
        _text("Passes", "Passes", ranges(range(job.passes)), "Render passes of each frame"),
        _count("PassesPerTask", "Passes per task", "Passes that one start of Blender renders"),
        _count("FramesPerTask", "Frames per development", "Frames that one start develops", 10),
        _text("Blender", "Blender", "blender", "Blender's executable on the workers"),
        _path("Extension", "Extension", "The extension that planned the job", default=EXTENSION),
        {
            **_text("System", "System", job.system, "Operating system of the workers"),
            "allowedValues": list(SYSTEMS),
            "userInterface": {"control": "DROPDOWN_LIST", "label": "System"},
        },
    ]


def _path(name: str, label: str, text: str, **default: str) -> dict[str, Any]:
    facts = {"objectType": "FILE", "dataFlow": "IN"}
    return _parameter(name, "PATH", label, text, "CHOOSE_INPUT_FILE", **facts, **default)


def _text(name: str, label: str, default: str, text: str) -> dict[str, Any]:
    return _parameter(name, "STRING", label, text, "LINE_EDIT", default=default)


def _count(name: str, label: str, text: str, default: int = 1) -> dict[str, Any]:
    return _parameter(name, "INT", label, text, "SPIN_BOX", default=default, minValue=1)


def _parameter(
    name: str, kind: str, label: str, text: str, control: str, **facts: object
) -> dict[str, Any]:
    shown = {"control": control, "label": label}
    return {"name": name, "type": kind, "description": text, "userInterface": shown, **facts}


def _extension() -> dict[str, Any]:
    """Return what each session begins with: the extension, in a profile of the session's own.

    A worker's own profile is neither read nor written, and goes with the session's folder.
    """
    profile = "{{Session.WorkingDirectory}}/blender"
    install = ["--command", "extension", "install-file", "-r", "user_default", "-e"]
    action = {
        "command": "{{Param.Blender}}",
        "args": [*install, "{{Param.Extension}}"],
        "timeout": _INSTALL_TIMEOUT,
    }
    return {
        "name": "Extension",
        "description": "Installs the extension of the bundle into a profile of the session.",
        # Extensions and preferences may have places of their own on a worker.
        "variables": {
            "BLENDER_USER_RESOURCES": profile,
            "BLENDER_USER_CONFIG": f"{profile}/config",
            "BLENDER_USER_EXTENSIONS": f"{profile}/extensions",
        },
        "script": {"actions": {"onEnter": action}},
    }


def _chunks(name: str, numbers: str, size: str) -> dict[str, Any]:
    """Return a task parameter of whole numbers of which a task takes several in a row."""
    return {
        "name": name,
        "type": "CHUNK[INT]",
        "range": numbers,
        "chunks": {"defaultTaskCount": size, "rangeConstraint": "CONTIGUOUS"},
    }


def _render_step(job: FarmJob) -> dict[str, Any]:
    frame = {"name": "Frame", "type": "INT", "range": "{{Param.Frames}}"}
    passes = _chunks("Pass", "{{Param.Passes}}", "{{Param.PassesPerTask}}")
    work = ["--frames", "{{Task.Param.Frame}}", "--passes", "{{Task.Param.Pass}}"]
    return {
        "name": RENDER,
        "description": "Renders passes; those that are there and whole are kept.",
        **_work(job, [frame, passes], work, _RENDER_TIMEOUT, gpu=job.gpu),
    }


def _develop_step(job: FarmJob) -> dict[str, Any]:
    frames = _chunks("Frame", "{{Param.Frames}}", "{{Param.FramesPerTask}}")
    work = ["--develop", "--frames", "{{Task.Param.Frame}}"]
    return {
        "name": DEVELOP,
        "description": "Develops the passes of each frame into pictures, spectra and a record.",
        "dependencies": [{"dependsOn": RENDER}],
        **_work(job, [frames], work, _DEVELOP_TIMEOUT, gpu=False),
    }


def _work(
    job: FarmJob, tasks: list[dict[str, Any]], work: list[str], timeout: int, *, gpu: bool
) -> dict[str, Any]:
    """Return what the tasks of a step are, how each is done, and what it takes."""
    arguments = ["--command", "underwater", "{{Param.Scene}}", "--from", "{{Param.Manifest}}"]
    arguments += ["--out", "{{Param.OutputDir}}", *work]
    if job.cameras:
        # A chunk stays within one value of the others.
        tasks = [{"name": "Camera", "type": "STRING", "range": list(job.cameras)}, *tasks]
        arguments += ["--cameras", "{{Task.Param.Camera}}"]
    arguments += [TRUST] if job.scripts else []
    arguments += ["--path-mapping", "{{Session.PathMappingRulesFile}}", "--progress", "openjd"]
    action = {
        "command": "{{Param.Blender}}",
        "args": arguments,
        "timeout": timeout,
        "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": _NOTIFY_SECONDS},
    }
    amounts = [("memory", _BLENDER_MIB + int(job.memory / _MIB)), ("vcpu", _CORES)]
    amounts += [("gpu", 1)] if gpu else []
    return {
        "parameterSpace": {
            "taskParameterDefinitions": tasks,
            "combination": " * ".join(task["name"] for task in tasks),
        },
        "script": {"actions": {"onRun": action}},
        "hostRequirements": {
            "amounts": [{"name": f"amount.worker.{name}", "min": least} for name, least in amounts],
            "attributes": [{"name": "attr.worker.os.family", "anyOf": ["{{Param.System}}"]}],
        },
    }
