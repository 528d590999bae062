"""What a scene holds: its objects, those instanced there included, and their materials."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator

import bpy

from ..uw_spectral.errors import InputError, first_of
from .rendered import VERTEX_INSTANCERS, ever_rendered

_DRAWN_BY = "uw_drawn_by"  # on a tree: an engine, as outputs name it
_SOCKETS = {"OBJECT", "COLLECTION", "MATERIAL"}


def objects(
    scene: bpy.types.Scene, among: Iterable[bpy.types.Object] | None = None
) -> list[bpy.types.Object]:
    """Objects of a scene, all or some, and those that they instance, each once.

    Instanced are collections, and what geometry nodes and particle systems name.
    """
    return list(reached(scene.objects if among is None else among))


def reached(items: Iterable[bpy.types.Object]) -> dict[bpy.types.Object, bool]:
    """Objects and those that they instance, and whether one of them may instance it."""
    found: dict[bpy.types.Object, bool] = {}

    def visit(items: Iterable[bpy.types.Object], is_named: bool) -> None:
        for item in items:
            by_parent = item.parent is not None and item.parent.instance_type in VERTEX_INSTANCERS
            is_new = item not in found
            found[item] = found.get(item, False) or is_named or by_parent
            if is_new:
                for named in _instanced(item):
                    if isinstance(named, bpy.types.Object):
                        visit([named], True)
                    elif isinstance(named, bpy.types.Collection):
                        visit(named.all_objects, True)

    visit(items, False)
    return found


def instanced_collections(items: Iterable[bpy.types.Object]) -> list[bpy.types.Collection]:
    """Collections that objects may instance, and those in them, each once."""
    named = (block for item in items for block in _instanced(item))
    found = dict.fromkeys(block for block in named if isinstance(block, bpy.types.Collection))
    return list(dict.fromkeys(x for one in found for x in (one, *one.children_recursive)))


def require_local(scene: bpy.types.Scene) -> None:
    """Refuse what is linked from another file and would have to change with the water.

    The error names materials, node groups in them and lamps that renders show, and their libraries.
    """
    linked = _linked(scene)
    if linked:
        kinds = {"Material": "material", "Object": "lamp"}
        names = [
            f"{kinds.get(x.bl_rna.identifier, 'node group')} {x.name!r} of {x.library.filepath}"
            for x in linked
        ]
        raise InputError(
            f"{first_of(names)}: linked from another file, which keeps its RGB "
            "colours and stays dry; make it local (Object, Relations, Make Local, All) or append "
            "it instead of linking"
        )


def make_local(scene: bpy.types.Scene) -> str:
    """Make what is linked and would have to change with the water local to the open file.

    For a process of one's own, whose file is not saved: everything that is linked becomes local,
    library overrides with what they have changed. Returns what was done, empty if nothing had to
    be; InputError if something cannot be made local.
    """
    linked = _linked(scene)
    if not linked:
        return ""
    files = sorted({x.library.filepath for x in linked if x.library is not None})
    bpy.ops.object.make_local(type="ALL")
    require_local(scene)
    return f"what is linked from {', '.join(files)} is rendered as if it were local"


def _linked(scene: bpy.types.Scene) -> list[bpy.types.ID]:
    """Materials, node groups in them and lamps that renders show and that cannot be changed."""
    seen = objects(scene, ever_rendered(scene))
    lamps = [item for item in seen if item.type == "LIGHT"]
    wet = list(dict.fromkeys(m for item in seen for m in materials_of(item)))
    inner = inner_groups(m.node_tree for m in wet if m.is_editable)
    groups = [
        group
        for group in inner
        if any(output.type == "SHADER" for node in group.nodes for output in node.outputs)
    ]
    return [x for x in (*wet, *sorted(groups, key=lambda g: g.name), *lamps) if not x.is_editable]


def materials(scene: bpy.types.Scene) -> list[bpy.types.Material]:
    """Materials of the objects of a scene, those that geometry nodes set too, in stable order."""
    found = {m.name_full: m for item in objects(scene) for m in materials_of(item)}
    return [found[name] for name in sorted(found)]


@contextlib.contextmanager
def drawn_by(scene: bpy.types.Scene, engine: str) -> Iterator[None]:
    """Read materials by the outputs of ``CYCLES`` or ``EEVEE`` while the block runs."""
    trees = [material.node_tree for material in materials(scene) if material.is_editable]
    trees = [x for x in trees if x.get_output_node("CYCLES") != x.get_output_node("EEVEE")]
    for tree in trees:
        tree[_DRAWN_BY] = engine
    try:
        yield
    finally:
        for tree in trees:
            tree.pop(_DRAWN_BY, None)


def output_of(tree: bpy.types.ShaderNodeTree) -> bpy.types.Node | None:
    """Return the output of a material that is drawn, EEVEE's where :func:`drawn_by` says nothing.

    Where the user has given each engine one of its own, they are two.
    """
    return tree.get_output_node(tree.get(_DRAWN_BY, "EEVEE"))


def materials_of(item: bpy.types.Object) -> list[bpy.types.Material]:
    """Materials of an object, and those that its geometry nodes set."""
    named = [slot.material for slot in item.material_slots]
    named += [block for block in _named(item) if isinstance(block, bpy.types.Material)]
    return [m for m in named if m is not None and m.node_tree is not None]


def _instanced(item: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """Yield the collections and objects that an object may show, and others that it names."""
    systems = [system.settings for system in item.particle_systems]
    named = [item.instance_collection]
    named += [block for s in systems for block in (s.instance_object, s.instance_collection)]
    yield from (block for block in named if block is not None)
    yield from _named(item)


def _named(item: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """Yield the data-blocks that an object's geometry nodes name."""
    seen: set[bpy.types.NodeTree] = set()
    for modifier in item.modifiers:
        if modifier.type == "NODES" and modifier.node_group is not None:
            inputs = modifier.properties.inputs
            for socket in modifier.node_group.interface.items_tree:
                if socket.item_type != "SOCKET":  # a panel; its identifier is a number
                    continue
                given = getattr(inputs, socket.identifier, None)
                if isinstance(value := getattr(given, "value", None), bpy.types.ID):
                    yield value
            yield from _named_in(modifier.node_group, seen)


def _named_in(tree: bpy.types.NodeTree, seen: set[bpy.types.NodeTree]) -> Iterator[bpy.types.ID]:
    if tree in seen:
        return
    seen.add(tree)
    for node in tree.nodes:
        sockets = (socket for socket in node.inputs if socket.type in _SOCKETS)
        # Nodes that are nothing but a data-block have it as a property.
        blocks = [getattr(node, kind.lower(), None) for kind in _SOCKETS]
        for block in (*(socket.default_value for socket in sockets), *blocks):
            if isinstance(block, bpy.types.ID):
                yield block
        group = getattr(node, "node_tree", None)
        if group is not None:
            yield from _named_in(group, seen)


def inner_groups(trees: Iterable[bpy.types.NodeTree | None]) -> set[bpy.types.NodeTree]:
    """Node groups inside trees, at any depth."""
    found: set[bpy.types.NodeTree] = set()

    def visit(tree: bpy.types.NodeTree | None) -> None:
        for node in tree.nodes if tree is not None else ():
            group = node.node_tree if node.bl_idname == "ShaderNodeGroup" else None
            if group is not None and group not in found:
                found.add(group)
                visit(group)

    for tree in trees:
        visit(tree)
    return found
