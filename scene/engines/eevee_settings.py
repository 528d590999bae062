"""EEVEE settings under which it shows the water: no clamping, froxels where the light is."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import bpy

from ..readers.cameras import clip_range
from ..temporary import render_settings
from ..water.frame_water import RealtimeWater

ENGINE = "BLENDER_EEVEE"
"""As Blender calls it."""
TYPICAL_FROXELS = 32
"""Steps of the froxel volume: each costs, and with 256 no pixel changes by a ΔE2000 of 0.3."""
_FROXEL_TILE = "4"
_FROXEL_DISTRIBUTION = 0.95
_FROXEL_START = 0.01
_CLIP_START = 0.01


def wanted_settings(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    samples: int,
    water: RealtimeWater | None,
    froxels: int | None = None,
) -> list[tuple[Any, str, Any]]:
    """Owner, name and value of every setting of the real-time mode."""
    render, eevee = scene.render, scene.eevee
    start, end = camera.data.clip_start, camera.data.clip_end
    wanted: list[tuple[Any, str, Any]] = [
        (scene, "camera", camera),
        (scene, "compositing_node_group", None),
        (render, "engine", ENGINE),
        (render, "film_transparent", False),
        (render, "use_sequencer", False),
        (render, "use_stamp", False),
        # Lines of a pixel hardly throw shadows.
        (render, "hair_type", "STRIP" if render.hair_type == "STRAND" else render.hair_type),
        (eevee, "taa_render_samples", samples),
        (eevee, "use_raytracing", False),
        (eevee, "use_fast_gi", False),
        (eevee, "use_shadows", True),
        (eevee, "clamp_surface_direct", 0.0),
        (eevee, "clamp_surface_indirect", 0.0),
        (eevee, "clamp_volume_direct", 0.0),
        (eevee, "clamp_volume_indirect", 0.0),
        (eevee, "direct_light_intensity", 1.0),
        (eevee, "use_volumetric_shadows", False),
    ]
    if water is not None and (water.layers or any(x.is_near for x in water.inputs.terms)):
        # Particles come closer than objects do, and depths are finer then; else what is nearer
        # stays cut away, as a housing about the camera is.
        start = min(start, _CLIP_START)
    for name, value in zip(("clip_start", "clip_end"), clip_range(start, end), strict=True):
        if value != getattr(camera.data, name):
            wanted.append((camera.data, name, value))
    if water is not None and water.shafts is not None:
        wanted += [
            (eevee, "use_volume_custom_range", True),
            (eevee, "volumetric_start", _FROXEL_START),
            (eevee, "volumetric_end", water.shafts.end),
            (eevee, "volumetric_samples", froxels or TYPICAL_FROXELS),
            (eevee, "volumetric_tile_size", _FROXEL_TILE),
            (eevee, "volumetric_sample_distribution", _FROXEL_DISTRIBUTION),
            (eevee, "volumetric_light_clamp", 0.0),
        ]
    return wanted


@contextlib.contextmanager
def realtime_settings(
    scene: bpy.types.Scene,
    camera: bpy.types.Object,
    *,
    samples: int,
    water: RealtimeWater | None,
    froxels: int | None = None,
) -> Iterator[bpy.types.ViewLayer]:
    """EEVEE's settings while the block runs, the scene's own afterwards; yields the layer rendered.

    Shafts of the water need a volume of ``froxels`` steps, None for the usual ones.
    """
    wanted = wanted_settings(scene, camera, samples, water, froxels)
    with render_settings(scene, wanted) as layer:
        yield layer
