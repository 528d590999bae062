"""Digests of what is put into a scene, to show that a change of the code changes nothing.

    python3 dev.py run -m benchmarks digests out/before.json
    python3 dev.py run -m benchmarks digests out/now.json --against out/before.json

For each of some twenty settings the water is put into a small scene, as a render job does it, and
every node tree, image, lamp and setting of EEVEE is reduced to a digest. Names and places of nodes
do not count, their kind, numbers and links do. Pictures are compared by ``frozen``.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..settings.scene_settings import BANDS, REALTIME, Mode, SceneSettings
from . import grey_scene
from ._drawing import drawing, hang_lamps
from ._scenery import new_file

_DEPTH = 5.0
_SIZE = (32, 18)
_SKIPPED = {
    "name", "name_full", "label", "location", "location_absolute", "session_uid", "select", "width",
    "height", "hide", "parent", "color", "dimensions", "is_active_output", "internal_links",
    "show_options", "show_preview", "show_texture", "use_custom_color", "warning_propagation",
    "filepath", "is_evaluated", "users", "tag", "is_dirty", "frame_duration", "bindcode",
    "type_info", "is_runtime_data",
}  # fmt: skip


@dataclass(frozen=True)
class _Case:
    """Settings, and what else there is: a lamp, a glowing object, a mirror, a camera in the air."""

    settings: Mapping[str, Any]
    mode: Mode = REALTIME
    with_: str = ""


_WAVES = {"surface": "waves", "wave_resolution": 32}
_CASES = {
    "plain": _Case({"surface": "none"}),
    "flat": _Case({"surface": "flat"}),
    "no floor": _Case({"surface": "flat", "floor_depth": 0.0}),
    "waves": _Case(_WAVES),
    "occlusion": _Case({"surface": "flat", "diffuse_shadows": True}),
    "shafts": _Case({"surface": "flat", "shafts": True}),
    "waves and shafts": _Case({**_WAVES, "shafts": True}),
    "lamps": _Case({"surface": "flat"}, with_="lamps"),
    "night": _Case({"surface": "flat", "sunlight": 0.0}, with_="lamps"),
    "glow": _Case({"surface": "flat"}, with_="glow"),
    "mirror": _Case({"surface": "flat"}, with_="mirror"),
    "everything": _Case({**_WAVES, "diffuse_shadows": True, "shafts": True}, with_="lamps"),
    "overcast": _Case({"surface": "flat", "sky": "overcast", "sun_zenith": 60.0}),
    "inelastic": _Case({"water": "constituents", "inelastic": "raman", "surface": "flat"}),
    "particles": _Case({"surface": "flat", "snow": 5.0}),
    "layers": _Case({"surface": "flat", "layers": "all"}),
    "camera": _Case({"surface": "flat", "sensor": "Nikon D7000", "water": "jerlov:III"}),
    "from above": _Case({"surface": "flat", "sky": "clear"}, with_="air"),
    "half under waves": _Case(_WAVES, with_="air"),
    "bands": _Case({"surface": "flat", "bands": 3}, BANDS),
    "bands, everything": _Case({**_WAVES, "bands": 3, "diffuse_shadows": True}, BANDS, "lamps"),
}


def main(arguments: list[str]) -> None:
    """Write the digests, and compare."""
    options = argparse.ArgumentParser(prog="digests", description=(__doc__ or "").split("\n")[0])
    options.add_argument("out", type=Path)
    options.add_argument("--against", type=Path)
    options.add_argument("--cases", default="", help="names, with commas; default: all")
    chosen = options.parse_args(arguments)
    names = [name.strip() for name in chosen.cases.split(",") if name] or list(_CASES)
    found = {name: _digests_of(_CASES[name]) for name in names}
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    chosen.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if chosen.against is None:
        return
    before = json.loads(chosen.against.read_text(encoding="utf-8"))
    apart = [line for name in names for line in _apart(name, before.get(name, {}), found[name])]
    print("\n".join(apart) or f"equal: {sum(map(len, found.values()))} digests")
    sys.exit(bool(apart))


def _apart(name: str, before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for item in sorted({*before, *now}):
        if before.get(item) != now.get(item):
            what = "new" if item not in before else "gone" if item not in now else "differs"
            yield f"{name}: {item} {what}"


def _digests_of(case: _Case) -> dict[str, str]:
    new_file()
    camera = grey_scene.build_scene(_DEPTH, *_SIZE)
    if case.with_ == "lamps":
        hang_lamps("strobes")
    elif case.with_ == "air":
        camera.location.z = 0.5
        bpy.context.view_layer.update()
    elif case.with_:
        material = bpy.data.materials.new(case.with_)
        shader = next(n for n in material.node_tree.nodes if "Base Color" in n.inputs)
        number = "Emission Strength" if case.with_ == "glow" else "Metallic"
        shader.inputs[number].default_value = 1.0
        # Blender's own spheres differ in their last bits from one to the next.
        mesh = bpy.data.meshes.new(case.with_)
        mesh.from_pydata(*_octahedron())
        mesh.materials.append(material)
        ball = bpy.data.objects.new(case.with_, mesh)
        ball.location = (0.0, 3.0, -_DEPTH)
        bpy.context.scene.collection.objects.link(ball)
    floor = {"floor_depth": _DEPTH + grey_scene.ABOVE_FLOOR}
    settings = SceneSettings(**{**floor, **case.settings}).in_mode(case.mode)
    with drawing(settings, case.mode):
        scene = bpy.context.scene
        items: list[tuple[str, object]] = [
            *((f"tree {t.name}", _tree(t)) for t in bpy.data.node_groups),
            *((f"material {x.name}", _tree(x.node_tree)) for x in bpy.data.materials),
            *((f"world {x.name}", _tree(x.node_tree)) for x in bpy.data.worlds),
            *((f"image {x.name}", _pixels(x)) for x in bpy.data.images),
            *((f"lamp {x.name}", _properties(x)) for x in bpy.data.lights),
            *((f"object {x.name}", [list(row) for row in x.matrix_world]) for x in scene.objects),
            ("eevee", _properties(scene.eevee)),
            ("camera", _properties(camera.data)),
        ]
        return {name: hashlib.sha256(repr(what).encode()).hexdigest() for name, what in items}


def _octahedron() -> tuple[list[tuple[float, ...]], list[object], list[tuple[int, ...]]]:
    corners = [tuple(s * 0.5 * (a == b) for b in range(3)) for a in range(3) for s in (-1.0, 1.0)]
    faces = [(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    return corners, [], faces


def _pixels(image: bpy.types.Image) -> str:
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return f"{tuple(image.size)} {hashlib.sha256(found.tobytes()).hexdigest()}"


def _tree(tree: bpy.types.NodeTree | None) -> list[object]:
    """Nodes in the order they were made, and their links."""
    if tree is None:
        return []
    number = {node.as_pointer(): place for place, node in enumerate(tree.nodes)}
    nodes = [(node.bl_idname, _properties(node), _values(node)) for node in tree.nodes]
    links = [
        (number[link.from_node.as_pointer()], link.from_socket.identifier,
         number[link.to_node.as_pointer()], link.to_socket.identifier)
        for link in tree.links
    ]  # fmt: skip
    return [nodes, sorted(links)]


def _values(node: bpy.types.Node) -> list[object]:
    sockets = [s for s in (*node.inputs, *node.outputs) if hasattr(s, "default_value")]
    return [(s.identifier, _plain(s.default_value)) for s in sockets if not s.is_linked]


def _properties(owner: bpy.types.bpy_struct) -> list[object]:
    """Numbers, words and names of data-blocks of an object of Blender's."""
    found = []
    for prop in owner.bl_rna.properties:
        if prop.identifier in _SKIPPED or prop.type == "COLLECTION":
            continue
        value = getattr(owner, prop.identifier)
        if isinstance(value, bpy.types.ID):
            value = value.name
        elif prop.type == "POINTER":
            continue
        found.append((prop.identifier, _plain(value)))
    return found


def _plain(value: object) -> object:
    if isinstance(value, str | bool | int | float | None):
        return value
    try:
        return [_plain(part) for part in value]  # type: ignore[attr-defined]
    except TypeError:
        return type(value).__name__
