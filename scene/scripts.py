"""Python of a .blend, drivers and text blocks, which Blender runs only in files that it trusts."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

_WITH_NODES = bpy.types.Material | bpy.types.Light | bpy.types.World
TRUST = "--trust-scripts"
"""The option of a job that lets them run."""
_ALLOW = (
    f"if the file is your own, allow it: {TRUST} in a job, blender -y, or Preferences, Save & "
    "Load, Auto Run Python Scripts in a window"
)


def scripts_run() -> bool:
    """Whether the open file has Python of its own, and Blender runs it."""
    own = (driver for _, driver in _drivers() if driver.driver.type == "SCRIPTED")
    return not bpy.app.autoexec_fail and (
        bool(_registered()) or any(not driver.driver.is_simple_expression for driver in own)
    )


def notes() -> Iterator[str]:
    """Yield what the Python of the open file does not do: drivers that stand still, scripts."""
    held = bpy.app.autoexec_fail
    for block, driver in _drivers():
        if not driver.driver.is_valid:
            why = (
                f"Blender runs no Python of this file; {_ALLOW}"
                if held and driver.driver.type == "SCRIPTED"
                else "it has an error; mend it in the Drivers Editor"
            )
            yield (
                f"the driver {driver.driver.expression!r} of {block.bl_rna.name.lower()} "
                f"{block.name!r} ({driver.data_path}) does not run, its value stands still: {why}"
            )
    texts = _registered()
    if held and texts:
        yield f"the scripts {', '.join(map(repr, texts))} of the file are not run; {_ALLOW}"


def _registered() -> list[str]:
    return [text.name for text in bpy.data.texts if text.use_module]


def _drivers() -> Iterator[tuple[bpy.types.ID, bpy.types.FCurve]]:
    for block in bpy.data.all_ids:
        tree = block.node_tree if isinstance(block, _WITH_NODES) else None
        for owner in (block, tree):
            data = getattr(owner, "animation_data", None)
            for curve in data.drivers if data is not None else ():
                yield block, curve
