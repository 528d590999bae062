"""The batch as a command of Blender: ``blender --command underwater scene.blend OPTIONS``."""

from __future__ import annotations

import bpy

NAME = "underwater"

# What Blender gives to unregister with.
_handles: list[object] = []


def run(arguments: list[str]) -> int:
    """Run the batch with the options of ``render_bands.py``; return the exit status."""
    from ..jobs import batch

    # blender scene.blend --command underwater OPTIONS
    return batch.main(arguments, program=NAME, inside_blender=bool(bpy.data.filepath))


def register() -> None:
    """Add the command."""
    _handles.append(bpy.utils.register_cli_command(NAME, run))


def unregister() -> None:
    """Take the command away."""
    bpy.utils.unregister_cli_command(_handles.pop())
