"""Everything that a .blend holds, as plain values that can be compared."""

from __future__ import annotations

import warnings

import bpy

# Bookkeeping that Blender updates by itself.
_SKIPPED = {
    "bl_rna",
    "rna_type",
    "depsgraph",
    "is_updated",
    "is_updated_data",
    "session_uid",
    "original",
    "evaluated",
    "runtime",
    "is_runtime_data",
    "internal_links",
    "dimensions",
    "warning_propagation",
    "storage_type",
}
# Of the window, not of the scene; all_ids repeats the others.
_SKIPPED_BLOCKS = {"all_ids", "screens", "window_managers", "workspaces"}
_DEPTH = 6


def snapshot() -> dict[str, object]:
    """Return path → value of every property of every data-block."""
    result: dict[str, object] = {}
    for name in dir(bpy.data):
        collection = getattr(bpy.data, name)
        if not isinstance(collection, bpy.types.bpy_prop_collection):
            continue
        for block in collection:
            if getattr(block, "type", "") == "RENDER_RESULT":
                continue
            if isinstance(block, bpy.types.ID) and name not in _SKIPPED_BLOCKS:
                _walk(result, f"{name}[{block.name_full}]", block, 0)
    return result


def differences(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """Return what differs, one line each."""
    return [
        f"{key}: {before.get(key, '(absent)')} → {after.get(key, '(absent)')}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key, "(absent)") != after.get(key, "(absent)")
    ]


def _walk(result: dict[str, object], path: str, struct: object, depth: int) -> None:
    for key in (
        getattr(struct, "keys", list)() if isinstance(struct, bpy.types.ID | bpy.types.Node) else ()
    ):
        value = struct[key]
        plain = getattr(value, "to_dict", getattr(value, "to_list", lambda v=value: v))()
        result[f"{path}[{key!r}]"] = plain if isinstance(plain, list) else repr(plain)
    if isinstance(struct, bpy.types.NodeTree):
        result[f"{path}.link_set"] = sorted(
            f"{k.from_node.name}.{k.from_socket.identifier}>{k.to_node.name}.{k.to_socket.identifier}"
            f"{' muted' if k.is_muted else ''}"
            for k in struct.links
        )
    for prop in struct.bl_rna.properties:
        if prop.identifier in _SKIPPED or (
            isinstance(struct, bpy.types.NodeTree) and prop.identifier == "links"
        ):
            continue
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                value = getattr(struct, prop.identifier)
            except (AttributeError, RuntimeError, SystemError):
                continue
        here = f"{path}.{prop.identifier}"
        if prop.type == "COLLECTION":
            result[f"{here}.length"] = len(value)
            if depth < _DEPTH and len(value) < 200:
                for index, item in enumerate(value):
                    if isinstance(item, bpy.types.ID):
                        result[f"{here}[{index}]"] = item.name_full
                    elif isinstance(item, bpy.types.bpy_struct):
                        _walk(result, f"{here}[{index}]", item, depth + 1)
        elif prop.type == "POINTER":
            if isinstance(value, bpy.types.ID):
                result[here] = value.name_full
                embedded = isinstance(value, bpy.types.NodeTree) and value.is_embedded_data
                if embedded and depth < _DEPTH:
                    _walk(result, here, value, depth + 1)
            elif (
                isinstance(value, bpy.types.bpy_struct)
                and depth < _DEPTH
                and prop.identifier
                in {
                    "animation_data",
                    "cycles",
                    "image_settings",
                    "render",
                    "color_ramp",
                    "underwater",
                }
            ):
                _walk(result, here, value, depth + 1)
        elif getattr(prop, "is_array", False):
            result[here] = repr(
                [*value] if prop.array_dimensions[1] == 0 else [list(v) for v in value]
            )
        else:
            result[here] = repr(value)
