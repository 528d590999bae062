"""The working space of a file: colours of its materials are taken for linear Rec.709."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ..uw_spectral.errors import InputError
from .animation import curves_of

_REC709 = "Rec.709"
_NAMED = 3


def is_rec709() -> bool:
    """Whether colours of the open file are linear Rec.709."""
    return _REC709 in bpy.data.colorspace.working_space


def require_rec709() -> None:
    """Refuse a file whose colours are in another space.

    Raises
    ------
    InputError
        If they are.
    """
    if not is_rec709():
        raise InputError(
            f"the file's colours are in {bpy.data.colorspace.working_space}, and the water takes "
            "them for linear Rec.709; choose that as Working Space (Scene, Color Management), "
            "which converts them"
        )


def bring_to_rec709() -> str:
    """Convert the colours of the open file, as Blender does; for a process of one's own.

    Returns
    -------
    str
        What was done, empty if nothing had to be.

    Raises
    ------
    InputError
        If colours are animated, which Blender does not convert, or it has no such space.
    """
    if is_rec709():
        return ""
    space = bpy.data.colorspace
    before, moved = space.working_space, list(dict.fromkeys(_animated_colours()))
    if moved:
        more = f" and {len(moved) - _NAMED} more" if len(moved) > _NAMED else ""
        raise InputError(
            f"the file's colours are in {before}, and those of {', '.join(moved[:_NAMED])}{more} "
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
    return f"the file's colours were converted from {before} to {wanted}"


def _animated_colours() -> Iterator[str]:
    """Names of materials, worlds and lamps with an animated colour."""
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
