"""What materials of a scene may do, which decides the nodes of its water."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import bpy

from ...node_groups import realtime_highlights
from ...node_groups.node_mathematics import MARK
from ...uw_spectral.errors import first_of
from .. import contents
from ..rendered import ever_rendered
from . import bare_colours
from .shader_nodes import row_of


@dataclass(frozen=True)
class Kinds:
    """What any of the materials of a scene may do.

    Mirror what is around it, emit light, throw on light from behind it, filter what is seen
    through it, have highlights that are longer than wide, be toons; and how many of
    :data:`.realtime_lamps.FACETS` they have.
    """

    mirrors: bool = False
    glows: bool = False
    translucent: bool = False
    filters: bool = False
    stretched: bool = False
    toons: bool = False
    facets: int = 0

    @property
    def highlights(self) -> tuple[str, ...]:
        """Groups of :mod:`.realtime_highlights` that are needed."""
        stretched, toon = realtime_highlights.STRETCHED, realtime_highlights.TOON
        return (stretched,) * self.stretched + (toon,) * self.toons


def kinds(materials: Iterable[bpy.types.Material]) -> Kinds:
    """Return what any of some materials may do."""
    trees = {material.node_tree for material in materials if MARK not in material}
    own = [tree for tree in trees | contents.inner_groups(trees) if MARK not in tree]
    nodes = [(tree, node) for tree in own for node in tree.nodes if MARK not in node]
    rows = [(row, at) for at in nodes if (row := row_of(at[1])) is not None]
    drawn_by = {row.drawn_by(*at) for row, at in rows}
    return Kinds(
        mirrors=any(row.may_mirror(*at) for row, at in rows),
        glows=any(row.may_glow(*at) for row, at in rows)
        or any(next(bare_colours.bare(tree), None) is not None for tree in own),
        translucent=any(row.behind for row, _ in rows),
        filters=any(row.may_filter(*at) for row, at in rows),
        stretched=realtime_highlights.STRETCHED in drawn_by,
        toons=realtime_highlights.TOON in drawn_by,
        facets=max((row.count_facets(*at) for row, at in rows), default=0),
    )


def notes_on_glow(scene: bpy.types.Scene) -> Iterator[str]:
    """Yield what to know of meshes that glow, which light others only where light is traced."""
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
