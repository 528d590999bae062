"""The working space of a file: colours of its materials are taken for linear Rec.709."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import bpy

from ..uw_spectral.errors import InputError, first_of
from .animation import curves_of

_REC709 = "Rec.709"
_ENCODED = re.compile(r"sRGB( - Texture| Encoded Rec\.709.*)?")
# Where the colour of an image is no colour.
_NUMBERS = {"NORMAL_MAP", "BUMP", "DISPLACEMENT", "VECTOR_DISPLACEMENT"}


def is_rec709() -> bool:
    """Whether colours of the open file are linear Rec.709."""
    return _REC709 in bpy.data.colorspace.working_space


def require_rec709() -> None:
    """Refuse a file whose colours are in another space."""
    if not is_rec709():
        raise InputError(
            f"the file's colours are in {bpy.data.colorspace.working_space}, and the water takes "
            "them for linear Rec.709; choose that as Working Space (Scene, Color Management), "
            "which converts them"
        )


def bring_to_rec709() -> str:
    """Convert the colours of the open file, as Blender does; for a process of one's own.

    Returns what was done, empty if nothing had to be. InputError if colours are animated, which
    Blender does not convert, or it has no such space.
    """
    if is_rec709():
        return ""
    space = bpy.data.colorspace
    before, moved = space.working_space, list(dict.fromkeys(_animated_colours()))
    if moved:
        raise InputError(
            f"the file's colours are in {before}, and those of {first_of(moved)} "
            "are animated, which Blender does not convert; take linear Rec.709 as Working Space "
            "and key them again"
        )
    known = space.bl_rna.properties["working_space"].enum_items.keys()
    wanted = next((name for name in known if _REC709 in name), None)
    if wanted is None:
        raise InputError(
            f"the file's colours are in {before}, and this colour configuration has no linear "
            f"Rec.709 among its working spaces ({', '.join(known)}); use Blender's own"
        )
    bpy.ops.wm.set_working_color_space(working_space=wanted, convert_colors=True)
    said = f"the file's colours were converted from {before} to {wanted}"
    kept = [
        mesh
        for mesh in bpy.data.meshes
        if any(found.data_type == "FLOAT_COLOR" for found in mesh.color_attributes)
    ]
    if kept:
        said += (
            f"; float colour attributes of {_names(kept)} were not, since Blender takes them for "
            f"numbers: they count as {wanted}"
        )
    return said


def images_without_space() -> list[bpy.types.Image]:
    """Images whose colour space the configuration that Blender runs with does not know.

    Blender reads them in some space of that configuration, which for ACES is a logarithmic one.
    """
    read = (image for image in bpy.data.images if image.source != "VIEWER")
    # Blender names that space as soon as it has read an image.
    return [image for image in read if not image.colorspace_settings.name]


def bring_images() -> str:
    """Give images without a space the one that they had by all appearances; returns what was done.

    Eight bits are sRGB, but numbers where they only turn normals and the like; floats are linear
    Rec.709. For a process of one's own. InputError if the configuration has no sRGB.
    """
    lost = images_without_space()
    if not lost:
        return ""
    settings = bpy.types.ColorManagedInputColorspaceSettings.bl_rna
    known = settings.properties["name"].enum_items.keys()
    encoded = next((name for name in known if _ENCODED.fullmatch(name)), None)
    linear = next((name for name in known if name == bpy.data.colorspace.working_space), None)
    if encoded is None or linear is None:
        raise InputError(
            f"the colour spaces of {_names(lost)} are not in the colour configuration that Blender "
            "runs with, nor are sRGB and linear Rec.709; choose spaces of it, or unset OCIO"
        )
    coloured = _images_as_colours()
    for image in lost:
        space = image.colorspace_settings
        if image.is_float:
            space.name = linear
        elif image in coloured:
            space.name = encoded
        else:
            space.is_data = True
    return (
        f"the colour configuration that Blender runs with does not know the spaces of images "
        f"{_names(lost)}: taken for sRGB, linear Rec.709 if they are floats, and numbers where "
        "they turn normals"
    )


def _names(blocks: Sequence[bpy.types.ID]) -> str:
    return first_of(repr(block.name) for block in blocks)


def _images_as_colours() -> set[bpy.types.Image]:
    """Images that are more than numbers somewhere: linked to a colour, or to what is not known."""
    trees = [t for t in bpy.data.node_groups if t.bl_idname == "ShaderNodeTree"]
    owners = (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights)
    trees += [owner.node_tree for owner in owners if owner.node_tree is not None]
    return {
        link.from_node.image
        for tree in trees
        for link in tree.links
        if getattr(link.from_node, "image", None) is not None
        and link.to_node.type not in _NUMBERS
        and link.to_socket.type not in {"VALUE", "VECTOR"}
    }


def _animated_colours() -> Iterator[str]:
    owners = [*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights, *bpy.data.node_groups]
    for owner in owners:
        for block in (owner, getattr(owner, "node_tree", None)):
            data = None if block is None else block.animation_data
            if block is None or data is None:
                continue
            action = [] if data.action is None else list(curves_of(data.action))
            for curve in (*action, *data.drivers):
                if _is_colour(block, curve.data_path):
                    yield repr(owner.name)


def _is_colour(block: bpy.types.ID, path: str) -> bool:
    owner, _, name = path.rpartition(".")
    try:
        found = block.path_resolve(owner) if owner else block
    except ValueError:  # what is animated is gone
        return False
    if isinstance(found, bpy.types.NodeSocketColor):
        return True
    prop = found.bl_rna.properties.get(name)
    return prop is not None and prop.subtype in {"COLOR", "COLOR_GAMMA"}
