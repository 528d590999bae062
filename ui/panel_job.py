"""What the panel asks for: the job that it describes, and what Auto has chosen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import bpy

from ..jobs.job import Job
from ..quality.methods import METHODS, REFERENCE, Method
from ..scene import stored_settings
from ..scene.session import is_live
from ..uw_spectral.errors import InputError
from .live_updates import transaction

if TYPE_CHECKING:
    from ..jobs.scene_requirements import Choice

PROPERTY = "underwater_panel"
"""Property of a scene: what the panel stores besides the optics (:mod:`.property_group`)."""


def method(scene: bpy.types.Scene) -> Method:
    """Return how the panel renders a scene."""
    return METHODS[getattr(scene, PROPERTY).quality.lower()]


def require_folder(scene: bpy.types.Scene) -> None:
    """Refuse a folder beside a .blend that was never saved: it would be anywhere."""
    output = getattr(scene, PROPERTY).output
    if output.startswith("//") and not bpy.data.filepath:
        raise InputError(
            f"the folder {output} lies beside the .blend, which was never saved; save it, or "
            "choose another folder"
        )


def job(scene: bpy.types.Scene, *, resume: bool = False) -> Job:
    """Return the job that the panel describes, as the command line would."""
    group, chosen = getattr(scene, PROPERTY), method(scene)
    frames = (scene.frame_current,)
    if group.animation:
        frames = tuple(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    return Job(
        blend=None,
        engine=chosen.engine,
        mode=chosen.mode,
        frames=frames,
        camera=None,
        resolution=None,
        seed=0,
        out=Path(bpy.path.abspath(group.output)),
        resume=resume,
        denoise=group.denoise and chosen.traced,
    )


def reference_job(scene: bpy.types.Scene) -> Job:
    """Return the job of the reference of the current frame, beside what the panel renders."""
    default = job(scene)
    return replace(
        default,
        engine=REFERENCE.engine,
        mode=REFERENCE.mode,
        frames=(scene.frame_current,),
        out=default.out / REFERENCE.name,
    )


def before_auto(scene: bpy.types.Scene) -> dict[str, Any]:
    """Values that Auto has changed and nobody since: what they were, by setting.

    So that waves, once left out, are there again for a stricter choice.
    """
    stored = stored_settings.stored_settings(scene)
    changed = json.loads(getattr(scene, PROPERTY).chosen or "{}")
    return {
        name: before
        for name, (before, after) in changed.items()
        if getattr(stored, name, None) == after
    }


def write_choice(scene: bpy.types.Scene, earlier: dict[str, Any], choice: Choice) -> None:
    """Write what was chosen into the settings, and keep what they were.

    The choice was made with the ``earlier`` values that :func:`before_auto` returned.
    """
    group, water = getattr(scene, PROPERTY), getattr(scene, stored_settings.PROPERTY)
    stored = stored_settings.stored_settings(scene)
    changed = {}
    with transaction():
        for name, value in (earlier | choice.settings).items():
            before = earlier.get(name, getattr(stored, name))
            if value != before:
                changed[name] = before, value
            if value != getattr(stored, name):
                setattr(water, name, value)
    group.chosen, group.decisions = json.dumps(changed), "\n".join(choice.lines)
    if choice.settings.get("shafts", stored.shafts) and is_live(scene):
        scene.eevee.volumetric_samples = choice.required.froxels
