"""The settings as properties of a scene, so that they are saved in the .blend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, fields
from typing import Any

import bpy

from ..settings.scene_settings import SceneSettings
from . import stored_lamps

PROPERTY = "underwater"


_CLASS = "UnderwaterProperties"

OnChange = Callable[[bpy.types.PropertyGroup, bpy.types.Context], None]


def _property(setting: Field, on_change: OnChange | None) -> object:
    text, choices = setting.metadata["help"], setting.metadata["choices"]
    common = {"name": setting.name.replace("_", " ").capitalize(), "description": text}
    common["default"] = setting.default
    common["options"] = {"ANIMATABLE"} if setting.metadata["animatable"] else set()
    common["update"] = on_change
    if choices:
        return bpy.props.EnumProperty(items=[(c, c.capitalize(), "") for c in choices], **common)
    if isinstance(setting.default, bool):
        return bpy.props.BoolProperty(**common)
    if isinstance(setting.default, str):
        return bpy.props.StringProperty(**common)
    low, high = setting.metadata["limits"]
    kind = bpy.props.IntProperty if isinstance(setting.default, int) else bpy.props.FloatProperty
    return kind(min=low, max=high, **common)


def register(on_change: OnChange | None = None) -> None:
    """Add ``scene.underwater``, and what lamps store.

    Parameters
    ----------
    on_change : callable, optional
        Called with the group and the context whenever a setting is set.
    """
    properties = {s.name: _property(s, on_change) for s in fields(SceneSettings)}
    description = {"__doc__": "The stored settings of a scene.", "__annotations__": properties}
    group = type(_CLASS, (bpy.types.PropertyGroup,), description)
    bpy.utils.register_class(group)
    setattr(bpy.types.Scene, PROPERTY, bpy.props.PointerProperty(type=group))
    stored_lamps.register()


def unregister() -> None:
    """Take them away; the values stay in the file."""
    stored_lamps.unregister()
    delattr(bpy.types.Scene, PROPERTY)
    bpy.utils.unregister_class(bpy.types.PropertyGroup.bl_rna_get_subclass_py(_CLASS))


def stored_settings(scene: bpy.types.Scene) -> SceneSettings:
    """Return the settings that a scene stores."""
    group = getattr(scene, PROPERTY)
    values = {s.name: getattr(group, s.name) for s in fields(SceneSettings)}
    # Properties are float32: 1.34 comes back as 1.3400000334.
    exact: dict[str, Any] = {
        n: float(f"{v:.7g}") if isinstance(v, float) else v for n, v in values.items()
    }
    return SceneSettings(**exact)
