"""What of a scene its renders show: Blender's own switches, wherever they are."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .animation import curves

VERTEX_INSTANCERS = ("VERTS", "FACES")
"""Ways in which an object instances its children; renders then do not show these themselves."""
_DRY = ("is_holdout", "is_shadow_catcher")


def rendered_layer(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """Return the view layer that jobs render: the first that is switched on."""
    return next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0])


def in_rendered_collections(layer: bpy.types.ViewLayer) -> set[bpy.types.Object]:
    """Objects of a view layer but those of collections that are left out or hidden in renders."""
    found: set[bpy.types.Object] = set()

    def visit(part: bpy.types.LayerCollection, hidden: bool) -> None:
        hidden = hidden or part.collection.hide_render
        if not (part.exclude or hidden):
            found.update(part.collection.objects)
        for child in part.children:
            visit(child, hidden)

    if layer.layer_collection is None:  # of a scene that was just made
        layer.update()
    visit(layer.layer_collection, False)
    return found


def collections_of(layer: bpy.types.ViewLayer) -> Iterator[bpy.types.LayerCollection]:
    """Yield the collections of a view layer that are not left out, its root first."""
    if layer.layer_collection is None:  # of a scene that was just made
        layer.update()

    def visit(part: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
        if not part.exclude:
            yield part
            for child in part.children:
                yield from visit(child)

    yield from visit(layer.layer_collection)


def dry_switches(item: bpy.types.Object) -> list[str]:
    """Switches of an object that are on and that water cannot be before; lamps have others."""
    return [name for name in _DRY if item.type != "LIGHT" and getattr(item, name)]


def is_hidden_by_animation(item: bpy.types.Object) -> bool:
    """Whether an animation or a driver decides if an object shows in renders."""
    return any(curves(item, "hide_render"))


def ever_rendered(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Objects that renders show at this frame, or may show at another, by name."""
    shown = (
        item
        for item in in_rendered_collections(rendered_layer(scene))
        if not item.hide_render or is_hidden_by_animation(item)
    )
    return sorted(shown, key=lambda item: item.name_full)
