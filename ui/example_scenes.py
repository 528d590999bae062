"""Scenes that the panel builds: what stands in them, and the water that suits them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..scene import stored_settings
from .live_updates import transaction

_DETAIL = "panel"
_SEED = 1
_SETTINGS: Mapping[str, Any] = {
    "white_balance": "depth",
    "exposure": "auto-picture",
    "tone": "nikon-d7000",
    "illuminant": "clear-sky",
}


@dataclass(frozen=True)
class Example:
    """A scene to build; ``text`` says what is to be seen, and ``camera`` is the one that looks.

    ``settings`` are of its water, besides those of all examples; ``rig`` are lamps that hang on the
    camera, empty for none.
    """

    label: str
    text: str
    camera: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    rig: str = ""


EXAMPLES = {
    "reef": Example(
        "Reef",
        "A coral reef at 5 m under waves, with fish and a colour chart",
        "Reef",
        {"surface": "waves", "wind_speed": 4.0, "sun_zenith": 25.0},
    ),
    "wreck": Example(
        "Wreck",
        "A ship on its side at 20 m, in the light of two lamps beside the camera",
        "Breach",
        {"surface": "flat", "sun_zenith": 35.0},
        "rov2",
    ),
    "cave": Example(
        "Cave",
        "A tunnel in the rock, with beams of sunlight through holes in its roof",
        "Beams",
        {"water": "jerlov:IA", "surface": "flat", "sun_zenith": 15.0, "shafts": True},
    ),
    "pool": Example(
        "Pool Test Tank",
        "A tiled tank with targets at 2 to 10 m and a colour chart",
        "Pool",
        {"water": "jerlov:I", "surface": "waves", "wind_speed": 1.5, "sun_zenith": 20.0},
    ),
}


def build(context: bpy.types.Context, name: str) -> bpy.types.Scene:
    """Build one of :data:`EXAMPLES` as a scene that the window shows; it is still dry."""
    from ..examples import scenes
    from ..scene.water import lamp_rigs

    example = EXAMPLES[name]
    scene = bpy.data.scenes.new(example.label)
    scene.render.engine = "BLENDER_EEVEE"
    if context.window is not None:
        context.window.scene = scene
    with context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
        scenes.build_scene(name, _SEED, _DETAIL)
        scene.camera = next(
            item
            for item in scene.objects
            # A second one of the file gets a number behind a dot.
            if item.type == "CAMERA" and item.name.partition(".")[0] == example.camera
        )
        scene.view_layers[0].update()
        if example.rig:
            lamp_rigs.add_rig(scene, example.rig)
    group = getattr(scene, stored_settings.PROPERTY)
    with transaction():
        for setting, value in {**_SETTINGS, **example.settings}.items():
            setattr(group, setting, value)
    return scene
