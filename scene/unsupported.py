"""What a scene asks for that renders of the water do not support: each is said, none is silent."""

from __future__ import annotations

import math
from collections.abc import Iterator

import bpy
import numpy as np

from ..uw_spectral.errors import first_of
from . import scripts
from .rendered import collections_of, dry_switches, rendered_layer
from .session import is_live

_FAR = 10_000.0  # m, where single precision tells 1 mm apart
_SEEN = ("use_solid", "use_volumes")


def unsupported(scene: bpy.types.Scene, sky: str = "") -> tuple[str, ...]:
    """Return what to know about a scene before its water is rendered, a sentence each.

    ``sky`` is the picture of the sky that lights the water, if one does.
    """
    return tuple(_notes(scene, sky))


def unsupported_of_camera(
    scene: bpy.types.Scene, camera: bpy.types.Object, *, traced: bool
) -> tuple[str, ...]:
    """Return what to know about a camera before EEVEE, or a tracer of light, renders from it."""
    return tuple(_of_camera(scene, camera, traced))


def _of_camera(scene: bpy.types.Scene, camera: bpy.types.Object, traced: bool) -> Iterator[str]:
    distance = camera.matrix_world.translation.length
    if distance > _FAR:
        yield (
            f"camera {camera.name!r} is {distance:.3g} m from the origin, where Blender's single "
            f"precision tells {np.spacing(np.float32(distance)) * 1000:.2g} mm apart: light and "
            "surfaces are not accurate; move everything to the origin"
        )
    # Eyes of stereo hang on the camera that they are of.
    own = {camera.name, camera.parent.name if camera.parent is not None else ""}
    bound = {marker.camera.name for marker in scene.timeline_markers if marker.camera}
    if bound - own:
        yield (
            f"markers switch cameras ({first_of(map(repr, sorted(bound)))}), which is not "
            f"supported: a job renders {camera.name!r} in all frames; render those of each with "
            "--camera and --frames"
        )
    if not traced and camera.data.type not in {"PERSP", "ORTHO"}:
        yield (
            f"EEVEE draws camera {camera.name!r} as a perspective one: panoramas and cameras of "
            "one's own are Cycles'; use --engine cycles"
        )


def _notes(scene: bpy.types.Scene, sky: str) -> Iterator[str]:
    yield from _of_unit(scene)
    render, view, layer = scene.render, scene.view_settings, rendered_layer(scene)
    others = [repr(other.name) for other in scene.view_layers if other.use and other != layer]
    if others:
        yield (
            f"only view layer {layer.name!r} is rendered, not {', '.join(others)}; hide the others "
            "or switch to the one you want"
        )
    if render.use_compositing and scene.compositing_node_group is not None:
        yield "the scene's compositor is not run: use it on the pictures afterwards"
    editor = scene.sequence_editor
    if render.use_sequencer and editor is not None and len(editor.strips):
        yield "the video sequencer is not run: what is rendered is the scene"
    if render.use_freestyle:
        yield "Freestyle lines are not drawn: they are no light"
    for override in ("material_override", "world_override"):
        found = getattr(layer, override)
        if found is not None:
            words = override.replace("_", " ")
            yield f"the {words} {found.name!r} of view layer {layer.name!r} is not supported"
    if view.exposure or view.gamma != 1.0:
        yield (
            f"exposure {view.exposure:g} and gamma {view.gamma:g} of Blender's colour management "
            "are not supported: the water has an exposure of its own"
        )
    if view.use_white_balance:
        yield "Blender's white balance is not supported: the water has one of its own"
    if bpy.app.autoexec_fail:  # a look at every driver takes too long for a panel
        yield from scripts.notes()
    yield from _of_layer(layer)
    yield from _of_frames(scene)
    yield from _of_objects(scene)
    from .materials import material_kinds, own_water  # slow to import

    yield from material_kinds.notes_on_glow(scene)
    yield from own_water.notes(scene)
    if not is_live(scene):
        yield from _of_world(scene.world, sky)


def _of_unit(scene: bpy.types.Scene) -> Iterator[str]:
    # Coefficients are those of one metre per unit, as Blender's own volumes have it.
    units = scene.unit_settings
    if units.system != "NONE" and not math.isclose(units.scale_length, 1.0, rel_tol=1e-6):
        yield (
            f"the scene's unit scale is {units.scale_length:.4g}, but the water takes each Blender "
            "unit as 1 m; scale the scene, or set Unit Scale to 1"
        )


def _of_world(world: bpy.types.World | None, sky: str) -> Iterator[str]:
    if world is None or world.node_tree is None:
        return
    from .readers import world_state  # slow to import

    output = world.node_tree.get_output_node("ALL")
    if sky:
        yield from world_state.left_out(world)
    elif world_state.has_sky(world):
        yield (
            f"the sky of world {world.name!r} does not light the water: light is that of the "
            "settings' sun and sky; choose it as Sky picture (--sky-picture world)"
        )
    if output is not None and output.inputs["Volume"].is_linked:
        yield f"the volume of world {world.name!r} is not supported: the water takes its place"


def _of_layer(layer: bpy.types.ViewLayer) -> Iterator[str]:
    left_out = [name.removeprefix("use_") for name in _SEEN if not getattr(layer, name)]
    if left_out:
        yield f"view layer {layer.name!r} leaves out {' and '.join(left_out)}: not supported"
    held = [part.name for part in collections_of(layer) if part.holdout]
    if held:
        yield f"holdout of collection {first_of(map(repr, held))} is not supported"


def _of_frames(scene: bpy.types.Scene) -> Iterator[str]:
    if scene.background_set is not None:
        yield (
            f"the background set {scene.background_set.name!r} is not drawn: link its collections "
            "into this scene"
        )
    render = scene.render
    if render.use_multiview and render.views_format == "MULTIVIEW":
        yield "views by the names of cameras are not supported: name the cameras with --camera"


def _of_objects(scene: bpy.types.Scene) -> Iterator[str]:
    found: dict[str, list[str]] = {}
    for item in scene.objects:
        for name in dry_switches(item):
            what = "holdout" if name == "is_holdout" else "shadow catcher"
            found.setdefault(f"{what} {{}} is drawn as any other object", []).append(item.name)
        if item.type == "GREASEPENCIL":
            words = "Grease Pencil {} is not drawn: strokes are no light"
            found.setdefault(words, []).append(item.name)
        elif item.type == "LIGHT_PROBE":
            words = "light probe {} is not supported: it holds light without water"
            found.setdefault(words, []).append(item.name)
        elif item.type == "LIGHT":
            linking = item.light_linking
            if linking.receiver_collection or linking.blocker_collection:
                words = "light linking of lamp {} is not supported: it lights everything"
                found.setdefault(words, []).append(item.name)
    for words, names in found.items():
        yield words.format(first_of(map(repr, names)))
