"""Develops the passes of a job again, otherwise and elsewhere, by its manifest alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..datasets.files import make_folder
from ..settings.scene_settings import BY_PICTURE, flag
from ..settings.water_settings import AUTO
from ..uw_spectral.errors import InputError
from . import job_files
from .frame_plans import FramePlans
from .manifest import SHOWN, Exposed, Manifest, View
from .manifest_files import JOB_FILE, read_manifest, write_manifest
from .picture_files import files_of
from .planning import Light, developed_views


def redeveloped(
    manifest: Manifest, changed: Mapping[str, Any], denoise: bool | None, out: Path
) -> Manifest:
    """Return a job whose passes are another's, and whose pictures are its own.

    ``manifest`` is the job that rendered the passes, or developed them already; ``changed`` are of
    :data:`.manifest.CHANGEABLE`, in all frames, keyframed or not; ``denoise`` is None as it was;
    the pictures go to ``out``. Raises InputError if the passes do not allow it, or the folder is
    theirs.
    """
    output, rendered_in = manifest.output, manifest.rendered_in or manifest.out
    flags = ", ".join(map(flag, changed))
    if out.resolve() in {rendered_in.resolve(), manifest.out.resolve()}:
        raise InputError(
            f"--develop: {out} holds the job's own pictures; name another --out, nothing is "
            "overwritten"
        )
    drawn = manifest.method.draws_colours
    if drawn and not SHOWN.issuperset(changed):
        raise InputError(
            f"{flags}: passes of {output.mode} are colours of the sensor already; render bands, or "
            "render again"
        )
    if manifest.noise and not SHOWN.issuperset(changed):
        raise InputError(
            f"{flags}: with --noise, samples were decided by the sensor; --resume with the scene "
            "renders what another one lacks"
        )
    settings = {**manifest.settings, **changed}
    files = (
        *(item for item in manifest.files if item.setting not in changed),
        *(item for item in job_files.setting_files(settings) if item.setting in changed),
    )
    job_files.require_all(files)
    made = replace(
        manifest,
        out=out,
        rendered_in=rendered_in,
        settings=settings,
        changes={
            frame: {name: value for name, value in values.items() if name not in changed}
            for frame, values in manifest.changes.items()
        },
        output=output if denoise is None else replace(output, denoise=denoise),
        files=files,
    )
    return made if drawn else _weighed(manifest, made)


def _weighed(before: Manifest, made: Manifest) -> Manifest:
    """Return a job with the weights that its settings ask for."""
    plans = FramePlans(made)

    def light_of(frame: int) -> Light:
        lit = before.exposed_of(frame)
        lamplight = lit.lamplight or (None,) * len(made.cameras)
        return plans.of(frame), lamplight, _stops(before, made, frame, lit)

    developments, views = developed_views(made.views, light_of)
    return replace(made, developments=developments, views=views)


def _stops(before: Manifest, made: Manifest, frame: int, lit: Exposed) -> float | None:
    """Return the stops that the picture of a frame asked for, if it is exposed so."""
    old, new = before.settings_of(frame), made.settings_of(frame)
    if new.exposure != BY_PICTURE:
        return None
    if old.exposure != BY_PICTURE:
        raise InputError(
            f"--exposure {BY_PICTURE}: the manifest does not know what the picture asks for; give "
            f"{AUTO} or a number of stops"
        )
    if lit.stops is None:
        return None
    return lit.stops - old.exposure_compensation + new.exposure_compensation


def take_folder(manifest: Manifest, views: Sequence[View]) -> None:
    """Make the output folder that of a job that only develops; refuse one of other pictures."""
    place = manifest.out / JOB_FILE
    if place.exists():
        earlier = read_manifest(place)
        alike = earlier.rendered_in is not None and (
            earlier.rendered_in.resolve() == (manifest.rendered_in or manifest.out).resolve()
        )
        if not alike or list(map(earlier.view_key, earlier.views)) != list(
            map(manifest.view_key, manifest.views)
        ):
            raise InputError(
                f"{manifest.out} holds another job; name another --out, nothing was overwritten"
            )
    else:
        there = [files_of(manifest, view).picture for view in views]
        taken = next((path for path in there if path.exists()), None)
        if taken is not None:
            raise InputError(f"{taken} is there; name another --out, nothing was overwritten")
    for view in views:
        make_folder(manifest.folder(view))
    write_manifest(place, manifest)
