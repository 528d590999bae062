"""Spectral underwater rendering for Blender: what Blender loads."""

from __future__ import annotations


def register() -> None:
    """Register the classes of the extension (called by Blender)."""
    from . import registration

    registration.register()


def unregister() -> None:
    """Undo :func:`register` (called by Blender)."""
    from . import registration

    registration.unregister()
