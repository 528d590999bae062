"""A render as a folder that a farm takes: template, plan, values, and the files that go along."""

from __future__ import annotations

import json
import platform
import runpy
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import bpy

from ...scene.readers import picture_size
from ...scene.readers.external_files import external_files
from ...scene.readers.missing_data import require_data
from ...settings.scene_settings import SceneSettings, flag
from ...uw_spectral.errors import InputError, first_of
from ...uw_spectral.spectra.spectral_image import temporary_name
from .. import planning
from ..job import Job
from ..manifest import Manifest, table_paths
from ..manifest_files import write_manifest
from ..rounds import require_fixed
from . import openjd_template
from .openjd_template import ASSETS, EXTENSION, MANIFEST, README, SYSTEMS, TEMPLATE, VALUES, FarmJob

_FILES = {ASSETS, EXTENSION, MANIFEST, README, TEMPLATE, VALUES}
_NAMED = 5
_ROOT = Path(__file__).resolve().parents[2]
_BUILDER = _ROOT / "tools" / "build_extension.py"
_CACHES = "__pycache__"
_SYSTEMS: dict[str, str] = dict(zip(("Linux", "Windows", "Darwin"), SYSTEMS, strict=True))

Planner = Callable[[Path], FarmJob]


def bundle_job(
    folder: Path, scene: bpy.types.Scene, settings_now: Callable[[], SceneSettings], job: Job
) -> FarmJob:
    """Plan a job of the open file and write it as a bundle; the scene's current frame moves.

    ``settings_now`` returns the settings at the scene's current frame; the rest is as in
    :func:`write_bundle` and :func:`.planning.plan_job`.
    """
    job = replace(job, out=job.out.absolute())

    def plan(path: Path) -> FarmJob:
        planned = planning.plan_job(scene, settings_now, job)
        require_fixed(planned, "--bundle")
        require_data(scene, planned.frames)
        write_manifest(path, planned)
        return farm_job(planned)

    return write_bundle(folder, settings_now(), plan)


def farm_job(planned: Manifest) -> FarmJob:
    """Return what a farm has to know of a plan."""
    if planned.scene is None:
        raise InputError("the scene was never saved, and a farm reads it from a file; save it")
    output, method = planned.output, planned.method
    bands = 3 if method.draws_colours else len(planned.bands_nm)
    names = tuple(camera.name for camera in planned.cameras)
    return FarmJob(
        planned.scene.absolute(),
        planned.out.absolute(),
        planned.frames,
        len(planned.passes),
        memory=picture_size.least_memory(output.size, bands),
        gpu=not method.traced or output.device == "gpu",
        system=_SYSTEMS.get(platform.system(), SYSTEMS[0]),
        cameras=names if len(names) > 1 else (),
        scripts=output.scripts,
        tables=tuple(
            path
            for settings in (planned.settings, *planned.changes.values())
            for path in table_paths(settings).values()
        ),
    )


def write_bundle(folder: Path, settings: SceneSettings, plan: Planner) -> FarmJob:
    """Write the open, saved file as a job of Open Job Description, into a folder of its own.

    Nothing is written if anything is amiss; an earlier bundle is replaced as a whole. The tables of
    ``settings`` go along; ``plan`` writes the plan of the job to a file, and returns what it holds.
    Raises InputError if the file is not saved, something that it reads is missing, or the folder
    holds something else or cannot be written.
    """
    folder = folder.resolve()
    check_saved()
    found = external_files()
    missing = [f"{owner} ({path})" for owner, path in found.missing]
    of_settings = {path: flag(name) for name, path in table_paths(asdict(settings)).items()}
    missing += [f"{option} ({path})" for path, option in of_settings.items() if not path.is_file()]
    if missing:
        raise InputError(
            f"{Path(bpy.data.filepath).name} reads files that are not there: "
            f"{first_of(missing, _NAMED)}; find them with File, External Data, "
            "or pack them, and save"
        )
    _check_folder(folder)
    with _replacing(folder) as temporary:
        job = plan(temporary / MANIFEST)
        write_extension(temporary / EXTENSION)
        # The picture of a world is there now.
        files = [*found.files, *(path.absolute() for path in (*of_settings, *job.tables))]
        _write_json(temporary / TEMPLATE, openjd_template.template(job))
        _write_json(temporary / VALUES, openjd_template.parameter_values(job))
        assets = openjd_template.asset_references(job, files, found.folders)
        _write_json(temporary / ASSETS, assets)
        (temporary / README).write_text(openjd_template.readme(job), encoding="utf-8")
    return job


def check_saved() -> None:
    """Refuse a file that is not on disk as it is."""
    if not bpy.data.filepath:
        raise InputError("the scene was never saved, and a farm reads it from a file; save it")
    if bpy.data.is_dirty:
        raise InputError(
            f"{bpy.data.filepath} has changes that are not saved, which a farm would not see; "
            "save it"
        )


def _check_folder(folder: Path) -> None:
    if folder.is_dir():
        others = sorted({path.name for path in folder.iterdir()} - _FILES)
    else:
        others = [folder.name] if folder.exists() else []
    if others:
        raise InputError(
            f"--bundle: {folder} holds other things than a bundle, such as {others[0]}; "
            "choose another folder"
        )


@contextmanager
def _replacing(folder: Path) -> Iterator[Path]:
    """Give a temporary folder, and put it in the place of another on success."""
    temporary, earlier = temporary_name(folder), temporary_name(folder, "old")
    try:
        temporary.mkdir(parents=True)
        yield temporary
        if folder.exists():
            folder.rename(earlier)
        temporary.rename(folder)
    except OSError as error:
        if earlier.exists() and not folder.exists():
            earlier.rename(folder)
        raise InputError(
            f"cannot write {folder}: {error.strerror}; choose another --bundle"
        ) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(earlier, ignore_errors=True)


def write_extension(path: Path) -> None:
    """Write the extension that runs here as a zip.

    A checkout is built. What is installed is packed as it is, with the wheels that Blender keeps
    beside it. Raises InputError if a checkout lacks what it has to bring.
    """
    if _BUILDER.is_file():
        try:
            runpy.run_path(str(_BUILDER))["pack"](path)
        except ConnectionError as error:
            raise InputError(f"a bundle brings the extension: {error}") from error
        return
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(_ROOT.rglob("*")):
            inside = file.relative_to(_ROOT)
            if file.is_file() and _CACHES not in inside.parts:
                archive.write(file, inside.as_posix())


def _write_json(path: Path, value: object) -> None:
    text = json.dumps(value, indent=2, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
