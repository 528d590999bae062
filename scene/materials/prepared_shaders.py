"""Nodes that shaders get before EEVEE's water does anything with them."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from . import (
    band_colors,
    bare_colours,
    inlined_shaders,
    matte_fallbacks,
    refractive_indices,
    wet_colours,
)


def insert(
    materials: Sequence[bpy.types.Material], clear: bpy.types.ShaderNodeTree | None
) -> list[str]:
    """Put them in; ``clear`` is the group for what lets light through, if channels need one.

    Returns what will not follow its animation, one line each.
    """
    notes = inlined_shaders.insert(materials)
    bare_colours.insert(materials)
    bare_colours.blacken(materials)
    refractive_indices.insert(materials)
    wet_colours.insert(materials)
    matte_fallbacks.insert(materials)
    if clear is not None:
        band_colors.filter_clear(materials, clear)
    return notes
