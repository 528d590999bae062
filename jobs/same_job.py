"""Whether this machine would render the job that a manifest plans; if not, what differs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy

from ..scene import scripts
from ..scene.session import select_scene
from ..uw_spectral.errors import InputError
from . import job_files
from .manifest import Manifest


def check_programs(manifest: Manifest) -> None:
    """Refuse a job that was planned by other programs, or whose tables have changed."""
    _refuse(_programs(manifest) + _tables(manifest))


def check_scene(manifest: Manifest, blend: Path | None, placed: Callable[[str], str] = str) -> None:
    """Refuse to render if anything differs from what was planned; the scene is open.

    ``blend`` is the .blend that is open; ``placed`` returns where a file of the scene lies here.
    """
    found = _programs(manifest) + _tables(manifest)
    if job_files.scene_digest(blend) != manifest.scene_sha256:
        found.append(f"the scene {blend or '(none)'} is not the file that was planned")
    if manifest.output.scene_name:
        select_scene(manifest.output.scene_name)
    bpy.context.view_layer.update()  # drivers that may not run are known once they were tried
    if scripts.scripts_run() != manifest.output.scripts:
        found.append(
            f"Python of the scene ran as it was planned, and does not here: add {scripts.TRUST}"
            if manifest.output.scripts
            else "Python of the scene runs, and did not as it was planned"
        )
    here = {item.path: item for item in job_files.scene_files()}
    planned = {item.path: item for item in manifest.files if not item.setting}
    for path, item in planned.items():
        now = here.get(placed(path))
        if now is None or now.sha256 != item.sha256:
            found.append(_changed(item.what, now.sha256 if now else ""))
    _refuse(found)


def _programs(manifest: Manifest) -> list[str]:
    return [
        f"{name} is {here}, not {manifest.versions.get(name)}"
        for name, here in job_files.versions().items()
        if manifest.versions.get(name) != here
    ]


def _tables(manifest: Manifest) -> list[str]:
    found = []
    for item in manifest.files:
        if item.setting:
            here = job_files.digest_of(Path(item.path))
            if here != item.sha256:
                found.append(_changed(item.what, here))
    return found


def _changed(what: str, digest: str) -> str:
    return f"{what} has changed" if digest else f"{what} is missing"


def _refuse(found: list[str]) -> None:
    if found:
        raise InputError(
            f"this is not the job that was planned: {'; '.join(found)}. Bring it back to what it "
            "was, or plan again with --plan and another --out; nothing was rendered or overwritten"
        )
