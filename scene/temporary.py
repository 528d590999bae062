"""Settings of Blender that hold while a block runs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import Any

import bpy

from .rendered import collections_of, dry_switches, rendered_layer

# Restored in the reverse of this order.
_IMAGE_SETTINGS = ("exr_codec", "color_depth", "color_mode", "file_format", "media_type")


@contextlib.contextmanager
def held(wanted: Iterable[tuple[Any, str, Any]]) -> Iterator[None]:
    """Give attributes values while the block runs: (owner, name, value) each."""
    with contextlib.ExitStack() as stack:
        for owner, name, value in wanted:
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)
        yield


@contextlib.contextmanager
def render_settings(
    scene: bpy.types.Scene, wanted: Iterable[tuple[Any, str, Any]]
) -> Iterator[bpy.types.ViewLayer]:
    """Apply settings, yield the one view layer to render, and restore everything afterwards."""
    rendered = rendered_layer(scene)
    collections = list(collections_of(rendered))
    layers: list[tuple[Any, str, Any]] = [
        *((layer, "use", layer == rendered) for layer in scene.view_layers),
        # The water is the world, a volume, and a light in materials.
        *((rendered, name, True) for name in ("use_sky", "use_solid", "use_volumes")),
        # Nothing of these has the water's light.
        (rendered, "use_grease_pencil", False),
        (scene, "background_set", None),
        *((item, name, False) for item in scene.objects for name in dry_switches(item)),
        *((part, "holdout", False) for part in collections if part.holdout),
        # Cycles knows these, EEVEE does not; to be unseen by the camera is the same.
        *(
            (item, "visible_camera", False)
            for part in collections
            if part.indirect_only
            for item in part.collection.objects
            if item.visible_camera
        ),
        # What they have baked is the light of a scene without water.
        *((item, "hide_render", True) for item in scene.objects if item.type == "LIGHT_PROBE"),
        # Blender's render follows them, whatever camera it is to have.
        *((marker, "camera", None) for marker in scene.timeline_markers if marker.camera),
        *((rendered, name, None) for name in ("material_override", "world_override")),
        (rendered, "samples", 0),
        (scene.render, "use_freestyle", False),
    ]
    # The writer of the image changes these.
    image = scene.render.image_settings
    written = [(scene.render, name) for name in ("filepath", "use_file_extension")]
    written += [(image, name) for name in _IMAGE_SETTINGS]
    kept = [(owner, name, getattr(owner, name)) for owner, name in written]
    with held([*wanted, *layers, *kept]):
        yield rendered
