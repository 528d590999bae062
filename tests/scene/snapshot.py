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
_FOLLOWED = {
    "animation_data",
    "cycles",
    "image_settings",
    "render",
    "color_ramp",
    "underwater",
}
_DEPTH = 6


def snapshot() -> dict[str, object]:
    """Return path → value of every property of every data-block."""
    found = _Snapshot()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in dir(bpy.data):
            collection = getattr(bpy.data, name)
            if not isinstance(collection, bpy.types.bpy_prop_collection):
                continue
            for block in collection:
                if getattr(block, "type", "") == "RENDER_RESULT":
                    continue
                if isinstance(block, bpy.types.ID) and name not in _SKIPPED_BLOCKS:
                    found.walk(f"{name}[{block.name_full}]", block, 0)
    return found.result


def differences(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """Return what differs, one line each."""
    return [
        f"{key}: {before.get(key, '(absent)')} → {after.get(key, '(absent)')}"
        for key in sorted(before.keys() | after.keys())
        if before.get(key, "(absent)") != after.get(key, "(absent)")
    ]


class _Snapshot:
    """What was found so far, and what each type has: to ask Blender for it takes long."""

    def __init__(self) -> None:
        self.result: dict[str, object] = {}
        self._known: dict[type, list[tuple[str, str, bool]]] = {}

    def _properties(self, struct: object) -> list[tuple[str, str, bool]]:
        """Name, type, and whether it is an array of more than one dimension or one, or none."""
        kind = type(struct)
        if kind not in self._known:
            skipped = _SKIPPED | ({"links"} if isinstance(struct, bpy.types.NodeTree) else set())
            self._known[kind] = [
                (p.identifier, "ARRAY" if getattr(p, "is_array", False) else p.type,
                 bool(getattr(p, "is_array", False) and p.array_dimensions[1]))
                for p in struct.bl_rna.properties
                if p.identifier not in skipped
            ]  # fmt: skip
        return self._known[kind]

    def walk(self, path: str, struct: object, depth: int) -> None:
        result = self.result
        if isinstance(struct, bpy.types.ID | bpy.types.Node):
            for key in getattr(struct, "keys", list)():
                value = struct[key]
                plain = getattr(value, "to_dict", getattr(value, "to_list", lambda v=value: v))()
                result[f"{path}[{key!r}]"] = plain if isinstance(plain, list) else repr(plain)
        if isinstance(struct, bpy.types.NodeTree):
            result[f"{path}.link_set"] = sorted(
                f"{k.from_node.name}.{k.from_socket.identifier}"
                f">{k.to_node.name}.{k.to_socket.identifier}{' muted' if k.is_muted else ''}"
                for k in struct.links
            )
        for identifier, kind, nested in self._properties(struct):
            try:
                value = getattr(struct, identifier)
            except (AttributeError, RuntimeError, SystemError):
                continue
            here = f"{path}.{identifier}"
            if kind == "COLLECTION":
                result[f"{here}.length"] = len(value)
                if depth < _DEPTH and len(value) < 200:
                    for index, item in enumerate(value):
                        if isinstance(item, bpy.types.ID):
                            result[f"{here}[{index}]"] = item.name_full
                        elif isinstance(item, bpy.types.bpy_struct):
                            self.walk(f"{here}[{index}]", item, depth + 1)
            elif kind == "POINTER":
                if isinstance(value, bpy.types.ID):
                    result[here] = value.name_full
                    embedded = isinstance(value, bpy.types.NodeTree) and value.is_embedded_data
                    if embedded and depth < _DEPTH:
                        self.walk(here, value, depth + 1)
                elif (
                    isinstance(value, bpy.types.bpy_struct)
                    and depth < _DEPTH
                    and identifier in _FOLLOWED
                ):
                    self.walk(here, value, depth + 1)
            elif kind == "ARRAY":
                result[here] = repr([list(v) for v in value] if nested else [*value])
            else:
                result[here] = repr(value)
