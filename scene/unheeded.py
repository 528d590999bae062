"""What a scene asks for that renders of the water do not heed: each is said, none is silent."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from . import units
from .rendered import rendered_layer


def unheeded(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return what to know about a scene before its water is rendered, a sentence each."""
    return tuple(_notes(scene))


def _notes(scene: bpy.types.Scene) -> Iterator[str]:
    unit = units.note(scene)
    if unit:
        yield unit
    render, view, layer = scene.render, scene.view_settings, rendered_layer(scene)
    if render.use_border:
        yield "the render region is not heeded: whole pictures are rendered"
    if render.film_transparent:
        yield "the transparent film is not heeded: water fills the background, there is no alpha"
    others = [repr(other.name) for other in scene.view_layers if other.use and other != layer]
    if others:
        yield (
            f"only view layer {layer.name!r} is rendered, not {', '.join(others)}; hide the others "
            "or switch to the one you want"
        )
    if render.use_compositing and scene.compositing_node_group is not None:
        yield "the scene's compositor is not run: use it on the pictures afterwards"
    editor = scene.sequence_editor
    if render.use_sequencer and editor is not None and len(editor.strips):
        yield "the video sequencer is not run: what is rendered is the scene"
    if render.use_freestyle:
        yield "Freestyle lines are not drawn: they are no light"
    for override in ("material_override", "world_override"):
        found = getattr(layer, override)
        if found is not None:
            words = override.replace("_", " ")
            yield f"the {words} {found.name!r} of view layer {layer.name!r} is not heeded"
    if view.exposure or view.gamma != 1.0:
        yield (
            f"exposure {view.exposure:g} and gamma {view.gamma:g} of Blender's colour management "
            "are not heeded: the water has an exposure of its own"
        )
    if view.use_white_balance:
        yield "Blender's white balance is not heeded: the water has one of its own"
