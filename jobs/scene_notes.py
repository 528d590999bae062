"""What is to be known of a scene before it is rendered: what is missing, or not treated."""

from __future__ import annotations

import math

import bpy

from ..scene import scripts, unlit_scans
from ..scene.engines import transparent_film
from ..scene.engines.band_engine import Opening
from ..scene.materials import own_water
from ..scene.readers import unusable_places
from ..scene.readers.missing_data import missing_notes
from ..scene.readers.own_seabed import floor_note
from ..scene.readers.surroundings import has_objects
from ..scene.session import other_scenes
from ..scene.unsupported import unsupported, unsupported_of_camera
from . import staging
from .manifest import Manifest


def notes_of_scene(scene: bpy.types.Scene, manifest: Manifest) -> tuple[str, ...]:
    """Return what to know of a scene as it came, a line each."""
    hidden, sky = manifest.output.hidden, manifest.settings.get("sky_picture", "")
    said = (
        *missing_notes(scene, manifest.frames),
        *(*scripts.notes(), *unsupported(scene, sky), *unlit_scans.notes(scene)),
        other_scenes(scene),
        *staging.notes(scene, manifest.stage),
        own_water.hidden_note(hidden) if hidden else "",
    )
    return tuple(filter(None, dict.fromkeys(said)))


def notes_of_camera(
    scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening, manifest: Manifest
) -> tuple[str, ...]:
    """Return what to know of a camera at the first frame of a job, before the water is there."""
    plan, eyes, ground = opening.plan, opening.eyes, None
    if math.isfinite(plan.column.floor_depth) and has_objects(scene) and opening.cache is not None:
        ground = opening.cache.look(scene, camera, plan.column, eyes).ground
    opaque = not manifest.output.transparent
    said = (
        *unsupported_of_camera(scene, camera, traced=manifest.method.traced),
        transparent_film.note(scene, camera, plan.settings, eyes) if opaque else "",
        floor_note(plan, ground),
        *unusable_places.notes(),
    )
    return tuple(filter(None, said))
