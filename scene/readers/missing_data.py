"""What the objects that a scene renders need and do not find: files, linked data, simulations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import bpy

from ...uw_spectral.errors import InputError
from ..contents import objects
from ..rendered import collections_of, ever_rendered, rendered_layer
from .external_files import is_read, named_files

_NAMED = 3
_MAGENTA = "Blender draws magenta in its place"
_LEFT_OUT = "what it holds is not drawn"
_FIND = "put it back, find it with File, External Data, or pack it into the .blend"
_BAKE = "a frame that is rendered on its own may have it as at the start; bake it"
# Users of data that renders do not look at: the light is that of the settings, pictures behind
# a camera are the viewport's.
_UNSEEN = {"SCENE", "WORLD", "CAMERA", "SCREEN", "BRUSH", "PALETTE", "LINESTYLE", "TEXT", "SOUND"}
_ELSEWHERE = bpy.types.Image | bpy.types.Volume | bpy.types.Library  # of which more is said
_DIGITS = re.compile(r"(\d+)(?=\D*$)")
_SIMULATED = {"CLOTH": "cloth", "SOFT_BODY": "soft body"}


def missing_notes(scene: bpy.types.Scene, frames: Sequence[int]) -> tuple[str, ...]:
    """Return what is said of a job of which something is not there."""
    return (*missing_data(scene, frames), *not_baked(scene), *node_errors(scene))


def missing_data(scene: bpy.types.Scene, frames: Sequence[int]) -> tuple[str, ...]:
    """Return what is not there and renders of a scene need, a clause each: what, where, what to do.

    Asked before the water is put in. Pictures are read, at all frames: for jobs, not for a panel.
    """
    used = _used(scene)
    found = [*_linked(used), *_files(used), *_pictures(used, frames), *_volumes(used, frames)]
    return tuple(dict.fromkeys(found))


def require_data(scene: bpy.types.Scene, frames: Sequence[int]) -> None:
    """Refuse to hand a job to other machines whose scene lacks something; the first is named."""
    missing = missing_data(scene, frames)
    if missing:
        more = f" (and {len(missing) - _NAMED} more)" if len(missing) > _NAMED else ""
        raise InputError(f"{'. '.join(missing[:_NAMED])}{more}")


def not_baked(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return the simulations of a scene without a bake, a clause each."""
    found = []
    for item in _used(scene):
        if isinstance(item, bpy.types.Object):
            found += [f"{what} of object {item.name!r}: {why}" for what, why in _baked(item)]
    world = scene.rigidbody_world
    if world is not None and world.enabled and world.collection and world.collection.objects:
        found += [f"the rigid bodies: {why}" for why in _cached(world.point_cache)]
    return tuple(found)


def node_errors(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return what geometry nodes of rendered objects say that they cannot do."""
    bpy.context.evaluated_depsgraph_get()  # which evaluates them; what they say is the original's
    found = []
    for item in objects(scene, ever_rendered(scene)):
        for modifier in item.modifiers:
            if modifier.type == "NODES":
                said = [w.message for w in modifier.node_warnings if w.type == "ERROR"]
                found += [f"geometry nodes of {item.name!r}: {text}" for text in said]
    return tuple(dict.fromkeys(found))


def _used(scene: bpy.types.Scene) -> list[bpy.types.ID]:
    """What is rendered, and all that it needs."""
    needs: dict[bpy.types.ID, list[bpy.types.ID]] = {}
    for block, users in bpy.data.user_map().items():
        for user in users:
            needs.setdefault(user, []).append(block)
    shown = [part.collection for part in collections_of(rendered_layer(scene))]
    left: list[bpy.types.ID] = list(objects(scene, ever_rendered(scene)))
    found = dict.fromkeys(part for part in shown if not part.hide_render)
    while left:
        block = left.pop()
        if block not in found and block.id_type not in _UNSEEN:
            found[block] = None
            left += needs.get(block, ())
    return list(found)


def _linked(used: Sequence[bpy.types.ID]) -> Iterator[str]:
    for block in used:
        library = block.library
        if block.is_missing and library is not None and is_read(library):
            path = Path(bpy.path.abspath(library.filepath))
            why = (
                f"is linked from {path}, which is not there"
                if library.is_missing
                else f"is linked from {path}, which does not hold it"
            )
            yield (
                f"{block.id_type.lower()} {block.name!r} {why}: {_LEFT_OUT}; put the library back, "
                "or link it again (Outliner, Blender File, Relocate)"
            )


def _files(used: Sequence[bpy.types.ID]) -> Iterator[str]:
    owners = {block: block for block in used}
    owners |= {tree: block for block in used if (tree := getattr(block, "node_tree", None))}
    for file in named_files():
        block = owners.get(file.block)
        if block is None or isinstance(block, _ELSEWHERE):
            continue
        if not file.is_needed or file.path.exists():
            continue
        yield (
            f"{block.id_type.lower()} {block.name!r}: {file.path} is not there: it is drawn "
            f"without; {_FIND}"
        )


def _pictures(used: Sequence[bpy.types.ID], frames: Sequence[int]) -> Iterator[str]:
    for image in used:
        if not isinstance(image, bpy.types.Image) or image.packed_files:
            continue
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        lost: list[Path] = []
        if image.source == "TILED":
            lost = [_tile(path, t) for t in image.tiles if not t.size[0]]
        elif image.source == "SEQUENCE":
            lost = _lost_frames(path, image, used, frames)
        elif image.source in {"FILE", "MOVIE"} and not image.size[0]:
            lost = [path]
        if lost:
            why = "no picture that Blender reads" if lost[0].is_file() else "not there"
            yield f"image {image.name!r}: {_list(lost)} is {why}: {_MAGENTA}; {_FIND}"


def _list(lost: Sequence[Path]) -> str:
    more = f" (and {len(lost) - 1} more)" if len(lost) > 1 else ""
    return f"{lost[0]}{more}"


def _tile(path: Path, tile: bpy.types.UDIMTile) -> Path:
    number = tile.number - 1001
    name = path.name.replace("<UDIM>", str(tile.number))
    return path.with_name(name.replace("<UVTILE>", f"u{number % 10 + 1}_v{number // 10 + 1}"))


def _lost_frames(
    path: Path, image: bpy.types.Image, used: Sequence[bpy.types.ID], frames: Sequence[int]
) -> list[Path]:
    """Files of a sequence that its nodes show at frames, and that are not there."""
    found: dict[Path, None] = {}
    trees = [getattr(block, "node_tree", None) or block for block in used]
    for tree in trees:
        for node in tree.nodes if isinstance(tree, bpy.types.NodeTree) else ():
            if getattr(node, "image", None) == image:
                user = node.image_user
                for frame in frames:
                    number = _shown(
                        frame, user.frame_start, user.frame_duration, repeats=user.use_cyclic
                    )
                    found[_numbered(path, number + user.frame_offset)] = None
    return [file for file in found if not file.is_file()]


def _shown(frame: int, start: int, length: int, *, repeats: bool) -> int:
    """Return which frame of a sequence is shown, as Blender counts them."""
    place = frame - start
    return 1 + (place % length if repeats else min(max(place, 0), length - 1)) if length else 1


def _numbered(path: Path, number: int) -> Path:
    name = _DIGITS.sub(lambda found: f"{number:0{len(found[1])}d}", path.name)
    return path.with_name(name)


def _volumes(used: Sequence[bpy.types.ID], frames: Sequence[int]) -> Iterator[str]:
    for volume in used:
        if not isinstance(volume, bpy.types.Volume) or not volume.filepath or volume.packed_file:
            continue
        path = Path(bpy.path.abspath(volume.filepath, library=volume.library))
        files = [path]
        if volume.is_sequence:
            length = volume.frame_duration
            inside = frames
            if volume.sequence_mode == "CLIP":
                inside = [n for n in frames if 0 <= n - volume.frame_start < length]
            repeats = volume.sequence_mode == "REPEAT"
            numbers = [_shown(n, volume.frame_start, length, repeats=repeats) for n in inside]
            if volume.sequence_mode == "PING_PONG":
                numbers = list(range(1, length + 1))
            files = [_numbered(path, number + volume.frame_offset) for number in numbers]
        lost = [file for file in dict.fromkeys(files) if not file.is_file()]
        if lost:
            yield f"volume {volume.name!r}: {_list(lost)} is not there: {_LEFT_OUT}; {_FIND}"


def _baked(item: bpy.types.Object) -> Iterator[tuple[str, str]]:
    """Yield the simulations of an object that need a bake: what, and why."""
    for modifier in item.modifiers:
        if not modifier.show_render:
            continue
        if modifier.type in _SIMULATED:
            for why in _cached(modifier.point_cache):
                yield _SIMULATED[modifier.type], why
        elif modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN":
            domain = modifier.domain_settings
            if domain.cache_type == "REPLAY" or not domain.has_cache_baked_any:
                yield "fluid", f"it is not baked; {_BAKE}"
            elif not _holds(domain.cache_directory, item):
                yield "fluid", _gone(domain.cache_directory, item)
        elif modifier.type == "DYNAMIC_PAINT" and modifier.canvas_settings is not None:
            for surface in modifier.canvas_settings.canvas_surfaces:
                for why in _cached(surface.point_cache):
                    yield "dynamic paint", why
        elif modifier.type == "NODES":
            for bake in modifier.bakes:
                place = bake.directory if bake.use_custom_path else modifier.bake_directory
                target = modifier.bake_target if bake.bake_target == "INHERIT" else bake.bake_target
                if target == "DISK" and place and not _holds(place, item):
                    yield "geometry nodes", _gone(place, item)
    for system in item.particle_systems:
        if system.settings.type == "EMITTER" or system.use_hair_dynamics:
            for why in _cached(system.point_cache):
                yield f"particle system {system.name!r}", why


def _cached(cache: bpy.types.PointCache) -> Iterator[str]:
    if cache.use_external:
        if not _holds(cache.filepath, cache.id_data):
            yield _gone(cache.filepath, cache.id_data)
    elif not cache.is_baked:
        yield f"it is not baked; {_BAKE}"
    elif cache.use_disk_cache and bpy.data.filepath:
        place = f"//blendcache_{Path(bpy.data.filepath).stem}"
        if not _holds(place, cache.id_data):
            yield _gone(place, cache.id_data)


def _folder(place: str, owner: bpy.types.ID) -> Path:
    return Path(bpy.path.abspath(place, library=owner.library))


def _holds(place: str, owner: bpy.types.ID) -> bool:
    folder = _folder(place, owner)
    return folder.is_dir() and any(folder.iterdir())


def _gone(place: str, owner: bpy.types.ID) -> str:
    return f"the folder of its bake, {_folder(place, owner)}, is not there; bake it again"
