"""Meshes that glow, which light other objects only where light is traced."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...uw_spectral.errors import first_of
from .. import contents
from ..rendered import ever_rendered
from .material_kinds import kinds


def notes(scene: bpy.types.Scene) -> Iterator[str]:
    """Yield what to know of the meshes of a scene that glow."""
    glowing: dict[bpy.types.Material, bool] = {}
    names = []
    for item in contents.objects(scene, ever_rendered(scene)):
        materials = contents.materials_of(item)
        glowing |= {m: kinds([m]).glows for m in materials if m not in glowing}
        if any(glowing[m] for m in materials):
            names.append(repr(item.name))
    if names:
        yield (
            f"{first_of(names)}: a mesh that glows is seen in EEVEE, and lights "
            "nothing there; put a lamp in its place, or render with Cycles"
        )
