"""What live water sets of Blender's own settings, and their way back.

What they were before the water came is kept on the scene, so that it goes through saving and
undo, and is given back when the water leaves.
"""

from __future__ import annotations

from typing import Any

import bpy

from .. import stored_settings, view_transform
from ..engines import eevee_settings
from ..readers.cameras import camera_of
from ..session import SESSION
from ..water.frame_water import RealtimeWater

_KEPT, _CAMERA, _VIEW, _TONE = "kept", "camera", "view", "tone"


def apply(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Set what the live water needs of Blender, and keep what was there."""
    camera = camera_of(scene)
    wanted: list[tuple[Any, str, Any]] = []
    if camera is not None:
        wanted = [
            (owner, name, value)
            for owner, name, value in eevee_settings.wanted_settings(
                scene, camera, scene.eevee.taa_render_samples, water
            )
            # The user's compositor, camera and film stay.
            if owner != scene and name != "film_transparent"
        ]
    else:
        wanted = [(scene.render, "engine", eevee_settings.ENGINE)]
    kept = {}
    for owner, name, value in wanted:
        kept[f"{type(owner).__name__}.{name}"] = getattr(owner, name)
        setattr(owner, name, value)
    scene[SESSION][_KEPT] = kept
    if camera is not None:
        scene[SESSION][_CAMERA] = camera.data
    scene[SESSION][_VIEW] = view_transform.saved_view(scene.view_settings)
    show(scene)


def show(scene: bpy.types.Scene) -> None:
    """Show the scene as its tone and contrast say; leave the view alone if it does so already."""
    group = getattr(scene, stored_settings.PROPERTY)
    wanted = f"{group.tone} {group.contrast}"
    if scene[SESSION].get(_TONE) != wanted:
        view_transform.show(scene.view_settings, group.tone, group.contrast)
        scene[SESSION][_TONE] = wanted


def use_shafts(scene: bpy.types.Scene, water: RealtimeWater) -> None:
    """Lead the froxels as far as the shafts reach; keep the user's values once."""
    if camera_of(scene) is None:
        return
    kept = scene[SESSION][_KEPT]
    for owner, name, value in eevee_settings.wanted_settings(scene, camera_of(scene), 1, water):
        if owner == scene.eevee and name.startswith(("volumetric_", "use_volume_custom")):
            key = f"{type(owner).__name__}.{name}"
            first = key not in kept
            if first:
                kept[key] = getattr(owner, name)
            if first or name == "volumetric_end":
                setattr(owner, name, value)


def restore(scene: bpy.types.Scene) -> list[str]:
    """Give back what :func:`apply` has kept; return what could not be."""
    session = scene[SESSION]
    owners = {
        type(owner).__name__: owner
        for owner in (scene.render, scene.eevee, scene.view_settings, session.get(_CAMERA))
        if owner is not None
    }
    if _VIEW in session:
        view_transform.give_back(scene.view_settings, session[_VIEW])
    # In the reverse order: a look exists only under its view transform.
    notes = []
    for key, value in reversed(list(session.get(_KEPT, {}).items())):
        owner, _, name = key.partition(".")
        if owner not in owners:
            continue
        kind = type(getattr(owners[owner], name))
        try:
            setattr(owners[owner], name, kind(value))
        except TypeError:  # such as an engine that is not installed any more
            notes.append(f"scene {scene.name!r} could not get back {name} {value!r}")
    return notes
