"""Evaluates a scene for the viewport as for a render."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Mapping

import bpy

from . import contents
from .animation import curves
from .rendered import ever_rendered, is_hidden_by_animation, rendered_layer

_INSTANCING = ("OBJECT", "COLLECTION")  # ways in which particles are rendered

type _Value = bool | int | str
type _Change = tuple[bpy.types.bpy_struct, str, _Value]


@contextlib.contextmanager
def as_rendered(scene: bpy.types.Scene) -> Iterator[None]:
    """Let the viewport show what renders show while the block runs.

    What looks at a scene evaluates it as the viewport does; without this it would miss what is
    hidden there only, and see what is shown there only.
    """
    layer = rendered_layer(scene)
    with contextlib.ExitStack() as stack:

        def put(owner: bpy.types.bpy_struct, name: str, value: _Value) -> None:
            before = getattr(owner, name)
            if before != value:
                setattr(owner, name, value)
                stack.callback(setattr, owner, name, before)

        def visit(part: bpy.types.LayerCollection) -> None:
            if not part.collection.hide_render:
                put(part.collection, "hide_viewport", False)
                for child in part.children:
                    visit(child)

        def follow(now: bpy.types.Scene, _: object = None) -> None:
            """Take over what is keyed, once a frame is set; what water hides since stays hidden."""
            for change in _of_objects(contents.reached(scene.objects) if now == scene else {}):
                put(*change)

        visit(layer.layer_collection)
        every = contents.reached(scene.objects)
        for change in (*_of_instances(every), *_of_objects(every)):
            put(*change)
        bpy.app.handlers.frame_change_post.append(follow)
        stack.callback(bpy.app.handlers.frame_change_post.remove, follow)
        for item in ever_rendered(scene):
            for curve in curves(item, "hide_viewport"):
                put(curve, "mute", True)
            put(item, "hide_viewport", False)
            if item.hide_get(view_layer=layer):
                item.hide_set(False, view_layer=layer)
                stack.callback(item.hide_set, True, view_layer=layer)
        for tree in bpy.data.node_groups:
            if tree.bl_idname == "GeometryNodeTree":
                stack.enter_context(_not_in_viewport(tree))
        yield


def _of_instances(every: Mapping[bpy.types.Object, bool]) -> Iterator[_Change]:
    """Yield what decides for the viewport what of collections is instanced."""
    for collection in contents.instanced_collections(every):
        yield collection, "hide_viewport", collection.hide_render
    for item, is_instanced in every.items():
        # What is hidden is not evaluated; cameras are looked at all the same.
        if is_instanced and item.type != "CAMERA":
            yield item, "hide_viewport", item.hide_render and not is_hidden_by_animation(item)


def _of_objects(every: Iterable[bpy.types.Object]) -> Iterator[_Change]:
    for item in every:
        yield item, "show_instancer_for_viewport", item.show_instancer_for_render
        for modifier in item.modifiers:
            for curve in curves(item, modifier.path_from_id("show_viewport")):
                yield curve, "mute", True
            yield modifier, "show_viewport", modifier.show_render
        for system in item.particle_systems:
            settings = system.settings
            if settings.render_type in _INSTANCING:
                yield settings, "display_method", "RENDER"
                yield settings, "display_percentage", 100
                yield settings, "child_percent", settings.rendered_child_count


@contextlib.contextmanager
def _not_in_viewport(tree: bpy.types.NodeTree) -> Iterator[None]:
    """Let geometry nodes be as in a render while the block runs."""
    # To mute the node would change nothing.
    asking = [node for node in tree.nodes if node.bl_idname == "GeometryNodeIsViewport"]
    fed = [(node.outputs[0], link.to_socket) for node in asking for link in node.outputs[0].links]
    if not fed:
        yield
        return
    no = tree.nodes.new("FunctionNodeInputBool")
    for _, socket in fed:
        tree.links.new(no.outputs[0], socket)
    try:
        yield
    finally:
        for output, socket in fed:
            tree.links.new(output, socket)
        tree.nodes.remove(no)
