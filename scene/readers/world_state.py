"""A scene's own world: what decides how it looks, to be compared, and what of it is not drawn."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from ...uw_spectral.errors import InputError
from .. import contents, marks

_MOVING = ("SEQUENCE", "MOVIE")
_SKIES = {"TEX_ENVIRONMENT", "TEX_IMAGE", "TEX_SKY"}
# Of the editor, of a node alone, and ways back.
_OF_NODE = {
    *("location", "location_absolute", "width", "height", "dimensions", "label", "select", "hide"),
    *("color", "color_tag", "use_custom_color", "show_options", "show_preview", "show_texture"),
    "warning_propagation",
}
_APART = {
    *("rna_type", "parent", "panel_states", "internal_links", "node", "original", "id_data"),
    *("show_expanded", "hide_value", "link_limit", "display_shape", "is_icon_visible"),
}
_ANIMATED = {"ARRAY", "FLOAT", "INT", "BOOLEAN"}
_DEEPEST = 6  # of what belongs to a node


def own_world(scene: bpy.types.Scene) -> bpy.types.World | None:
    """Return the world that a scene has without water."""
    return scene.get(marks.OWN_WORLD) if marks.WATER in scene else scene.world


def has_sky(world: bpy.types.World | None) -> bool:
    """Whether a world may look like a sky: a picture or a sky texture is in its nodes."""
    return world is not None and any(n.type in _SKIES for t in _trees(world) for n in t.nodes)


def left_out(world: bpy.types.World) -> Iterator[str]:
    """Say what is left out where a world lights the water, a sentence each."""
    if any(n.type == "LIGHT_PATH" for tree in _trees(world) for n in tree.nodes):
        yield (
            f"world {world.name!r} looks otherwise to other rays (Light Path): the water is lit by "
            "what cameras see of it"
        )


def state_of(world: bpy.types.World, frame: int) -> str:
    """Return what decides the look of a world at a frame; InputError if a picture is missing."""
    trees = _trees(world)
    nodes = [node for tree in trees for node in tree.nodes]
    for node in nodes:
        _require_image(world, node)
    images = [image for node in nodes if (image := getattr(node, "image", None)) is not None]
    moves = any(image.source in _MOVING for image in images)
    found = [
        (
            tree.name,
            [(node.name, _values(node, 0)) for node in tree.nodes],
            [
                (link.from_socket.path_from_id(), link.to_socket.path_from_id(), link.is_muted)
                for link in tree.links
            ],
        )
        for tree in trees
    ]
    return repr((tuple(world.color), found, frame if moves else 0))


def fixed(world: bpy.types.World) -> bpy.types.World:
    """Make a copy that looks for good as a world does now, evaluated or not."""
    copy = world.original.copy()
    copy.animation_data_clear()
    copy.color = world.color
    if copy.node_tree is not None:
        copy.node_tree.animation_data_clear()
        for node, now in zip(copy.node_tree.nodes, world.node_tree.nodes, strict=True):
            _bring(node, now, 0)
    return copy


def _trees(world: bpy.types.World) -> list[bpy.types.NodeTree]:
    if world.node_tree is None:
        return []
    inner = contents.inner_groups({world.node_tree})
    return [world.node_tree, *sorted(inner - {world.node_tree}, key=lambda tree: tree.name_full)]


def _require_image(world: bpy.types.World, node: bpy.types.Node) -> None:
    """Refuse a picture that Blender would draw in magenta."""
    image = getattr(node, "image", None)
    if image is None or image.source not in ("FILE", *_MOVING) or image.packed_file:
        return
    path = Path(image.filepath_from_user(image_user=node.image_user))
    if not path.is_file():
        raise InputError(
            f"world {world.name!r} lights the water, and the file of its picture {image.name!r} is "
            f"missing: {path}; find it (File > External Data > Find Missing Files), or leave "
            "--sky-picture empty"
        )


def _values(item: bpy.types.bpy_struct, depth: int) -> list[Any]:
    found: list[Any] = []
    for name, kind, _ in _properties(type(item)) if depth <= _DEEPEST else ():
        if depth == 0 and name in _OF_NODE:
            continue
        value = getattr(item, name)
        if kind == "COLLECTION":
            found.append([_values(each, depth + 1) for each in value])
        elif kind != "POINTER":
            found.append(tuple(value) if kind == "ARRAY" else value)
        elif isinstance(value, bpy.types.Image):
            found.append(_image(value))
        elif isinstance(value, bpy.types.ID):
            place = [tuple(row) for row in getattr(value, "matrix_world", ())]
            found.append((value.name_full, place))
        elif value is not None:
            found.append(_values(value, depth + 1))
    return found


def _bring(item: bpy.types.bpy_struct, now: bpy.types.bpy_struct, depth: int) -> None:
    """Give something the values of another of its kind."""
    for name, kind, is_set in _properties(type(item)) if depth <= _DEEPEST else ():
        value = getattr(now, name)
        if kind == "COLLECTION":
            for one, other in zip(getattr(item, name), value, strict=True):
                _bring(one, other, depth + 1)
        elif kind != "POINTER":
            if is_set and kind in _ANIMATED and getattr(item, name) != value:
                setattr(item, name, value)
        elif value is not None and not isinstance(value, bpy.types.ID):
            _bring(getattr(item, name), value, depth + 1)


@functools.cache
def _properties(kind: type[bpy.types.bpy_struct]) -> list[tuple[str, str, bool]]:
    """Names and kinds of what a type of Blender's holds, and whether that can be set.

    It takes Blender long to tell.
    """
    return [
        (
            prop.identifier,
            "ARRAY" if getattr(prop, "is_array", False) else prop.type,
            not prop.is_readonly,
        )
        for prop in kind.bl_rna.properties
        if prop.identifier not in _APART and not prop.identifier.startswith("bl_")
    ]


def _image(image: bpy.types.Image) -> tuple[Any, ...]:
    path = Path(bpy.path.abspath(image.filepath, library=image.library))
    stat = path.stat() if path.is_file() else None
    file = (stat.st_size, stat.st_mtime_ns) if stat is not None else None
    packed = image.packed_file.size if image.packed_file else 0
    made = image.source, image.generated_type, tuple(image.generated_color)
    space = image.colorspace_settings.name, image.alpha_mode
    return image.name_full, file, packed, made, space, tuple(image.size)
