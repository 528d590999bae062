"""Meshes that glow, which light other objects only where light is traced."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from .. import contents
from ..rendered import ever_rendered
from .realtime_materials import kinds

_NAMED = 3


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
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        yield (
            f"{', '.join(names[:_NAMED])}{more}: a mesh that glows is seen in EEVEE, and lights "
            "nothing there; put a lamp in its place, or render with Cycles"
        )
