"""The one list of what the extension registers, in order."""

from __future__ import annotations

import contextlib

from .scene import stored_settings
from .ui import (
    dropped_assets,
    dropped_files,
    handlers,
    help_pages,
    live_updates,
    operators,
    panels,
    preferences,
    presets,
    previews,
    property_group,
    translations,
)

_MODULES = (
    property_group,
    previews,
    operators,
    presets,
    panels,
    preferences,
    handlers,
    translations,
    help_pages,
    dropped_assets,
    dropped_files,
)


def register() -> None:
    """Register the settings and every module of the list; undo the ones done if one fails."""
    with contextlib.ExitStack() as undo:
        stored_settings.register(live_updates.follow_property, live_updates.follow_material)
        undo.callback(stored_settings.unregister)
        for module in _MODULES:
            module.register()
            undo.callback(module.unregister)
        undo.pop_all()


def unregister() -> None:
    """Unregister in the opposite order."""
    for module in reversed(_MODULES):
        module.unregister()
    stored_settings.unregister()
