"""Manifests on disk: written whole, read with their kind and format checked."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, get_args

from ..datasets.files import joined, relative, write_text
from ..quality.methods import Device, Engine, Mode
from ..uw_spectral.errors import InputError
from .manifest import (
    FORMAT,
    CameraOutput,
    Development,
    Exposed,
    ExternalFile,
    Manifest,
    Output,
    Pass,
    View,
)
from .render_region import Region
from .stage import stage_of

JOB_FILE = "job.json"
"""The manifest of a job in its output folder."""
_KIND = "underwater-spectral job"


def write_manifest(path: Path, manifest: Manifest) -> None:
    """Write a manifest; whole under its name, or not at all."""
    path, stage = path.absolute(), manifest.stage
    content = {
        "kind": _KIND,
        "format": FORMAT,
        "scene": relative(manifest.scene, path.parent) if manifest.scene else "",
        "scene_sha256": manifest.scene_sha256,
        "out": relative(manifest.out, path.parent),
        "versions": dict(manifest.versions),
        "output": asdict(manifest.output),
        "settings": _placed(manifest.settings, path.parent, relative),
        "frames": manifest.frames,
        "changes": {
            frame: _placed(values, path.parent, relative)
            for frame, values in manifest.changes.items()
        },
        "cameras": [asdict(camera) for camera in manifest.cameras],
        "passes": [asdict(item) for item in manifest.passes],
        "bands_nm": manifest.bands_nm,
        "widths_nm": manifest.widths_nm,
        "files": [
            asdict(item) | ({"path": relative(item.path, path.parent)} if item.setting else {})
            for item in manifest.files
        ],
        "developments": [asdict(item) for item in manifest.developments],
        "views": [[v.frame, v.camera, v.depth, v.development, v.eye] for v in manifest.views],
        "lamps": manifest.lamps,
        **({"clouds": manifest.clouds} if manifest.clouds else {}),
        "stage": stage.moved(lambda name: relative(name, path.parent)).record() if stage else {},
        "exposed": {frame: asdict(item) for frame, item in manifest.exposed.items()},
        "rendered_in": relative(manifest.rendered_in, path.parent) if manifest.rendered_in else "",
    }
    text = ",\n".join(f"{json.dumps(name)}: {_rows(value)}" for name, value in content.items())
    write_text(path, f"{{\n{text}\n}}\n")


def read_manifest(path: Path) -> Manifest:
    """Read a manifest; raise InputError if it cannot be read, is damaged or of another format."""
    path = path.absolute()
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}; write it with --plan") from error
    except ValueError as error:
        raise InputError(
            f"{path} is damaged or not a manifest ({error}); write it again with --plan"
        ) from error
    if not isinstance(content, dict) or content.get("kind") != _KIND:
        raise InputError(f"{path} is damaged or not a manifest; write it again with --plan")
    found = content.get("format")
    if not isinstance(found, int) or found != FORMAT:
        advice = (
            "use the version of the extension that wrote it"
            if isinstance(found, int) and found > FORMAT
            else "write it again with --plan"
        )
        raise InputError(
            f"{path} has format {found!r}, and this extension reads {FORMAT}; {advice}"
        )
    try:
        return _manifest(content, path.parent)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise InputError(
            f"{path} is damaged ({type(error).__name__}: {error}); write it again with --plan"
        ) from error


def _manifest(content: dict[str, Any], folder: Path) -> Manifest:
    output = Output(
        **{
            **content["output"],
            **{name: tuple(content["output"][name]) for name in _TUPLES},
            "hidden": tuple(content["output"].get("hidden", ())),
            "region": Region(**region) if (region := content["output"].get("region")) else None,
        }
    )
    for value, known in ((output.engine, Engine), (output.mode, Mode), (output.device, Device)):
        if value not in get_args(known):
            raise ValueError(f"{value!r} is not one of {', '.join(get_args(known))}")
    manifest = Manifest(
        scene=Path(joined(content["scene"], folder)) if content["scene"] else None,
        out=Path(joined(content["out"], folder)),
        scene_sha256=content["scene_sha256"],
        versions=content["versions"],
        output=output,
        settings=_placed(content["settings"], folder, joined),
        changes={
            int(frame): _placed(values, folder, joined)
            for frame, values in content["changes"].items()
        },
        frames=tuple(map(int, content["frames"])),
        cameras=tuple(CameraOutput(**item) for item in content["cameras"]),
        passes=tuple(
            Pass(**{**item, "bands": tuple(map(int, item["bands"]))}) for item in content["passes"]
        ),
        bands_nm=tuple(content["bands_nm"]),
        widths_nm=tuple(content["widths_nm"]),
        developments=tuple(
            Development(item["description"], tuple(map(tuple, item["weights"])))
            for item in content["developments"]
        ),
        views=tuple(View(*row[:4], eye=tuple(*row[4:])) for row in content["views"]),
        files=tuple(
            ExternalFile(
                **item | ({"path": joined(item["path"], folder)} if item["setting"] else {})
            )
            for item in content["files"]
        ),
        lamps={int(frame): tuple(rows) for frame, rows in content.get("lamps", {}).items()},
        clouds={int(frame): tuple(rows) for frame, rows in content.get("clouds", {}).items()},
        stage=stage_of(found).moved(lambda name: joined(name, folder))
        if (found := content.get("stage"))
        else None,
        exposed={
            int(frame): Exposed(
                item["stops"], tuple(None if x is None else tuple(x) for x in item["lamplight"])
            )
            for frame, item in content.get("exposed", {}).items()
        },
        rendered_in=Path(joined(place, folder)) if (place := content.get("rendered_in")) else None,
    )
    if not (manifest.views and manifest.passes and manifest.frames):
        raise ValueError("no passes")
    known, names = set(manifest.frames), {camera.name for camera in manifest.cameras}
    for view in manifest.views:
        if manifest.stage is not None:
            manifest.stage.places[view.frame]
        if view.frame not in known or view.camera not in names:
            raise ValueError(f"a view of frame {view.frame} of camera {view.camera}")
        manifest.developments[view.development]
    manifest.settings_of(manifest.frames[0])
    return manifest


_TUPLES = ("resolution", "extent", "decisions")


def _rows(value: object) -> str:
    """JSON with one item of a list or mapping a line, so that files can be compared by line."""
    if isinstance(value, list) and value:
        return "[\n" + ",\n".join(json.dumps(item) for item in value) + "\n]"
    if isinstance(value, Mapping) and value:
        rows = (f"{json.dumps(str(k))}: {json.dumps(v)}" for k, v in value.items())
        return "{\n" + ",\n".join(rows) + "\n}"
    return json.dumps(value)


def _placed(
    settings: Mapping[str, Any], folder: Path, place: Callable[[str, Path], str]
) -> dict[str, Any]:
    """Return settings with the paths of their files seen from a folder."""
    return {
        name: f"file:{place(value.removeprefix('file:'), folder)}"
        if isinstance(value, str) and value.startswith("file:")
        else value
        for name, value in settings.items()
    }
