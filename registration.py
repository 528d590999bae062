"""The one list of what the extension registers, in order."""

from __future__ import annotations

from .scene import stored_settings as optics
from .ui import handlers, operators, panels, presets, previews, property_group

_MODULES = (optics, property_group, previews, operators, presets, panels, handlers)


def register() -> None:
    """Register every module of the list; undo the ones done if one fails."""
    handlers.follow_properties()
    done = []
    try:
        for module in _MODULES:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister() -> None:
    """Unregister in the opposite order."""
    for module in reversed(_MODULES):
        module.unregister()
