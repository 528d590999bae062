"""The settings as properties of a scene, so that they are saved in the .blend."""

from __future__ import annotations

from dataclasses import Field, fields

import bpy

from .settings import SceneSettings

PROPERTY = "underwater"


def _property(setting: Field) -> object:
    text, choices = setting.metadata["help"], setting.metadata["choices"]
    common = {"name": setting.name.replace("_", " ").capitalize(), "description": text}
    common["default"] = setting.default
    common["options"] = {"ANIMATABLE"} if setting.metadata["animatable"] else set()
    if choices:
        return bpy.props.EnumProperty(items=[(c, c.capitalize(), "") for c in choices], **common)
    if isinstance(setting.default, bool):
        return bpy.props.BoolProperty(**common)
    if isinstance(setting.default, str):
        return bpy.props.StringProperty(**common)
    low, high = setting.metadata["limits"]
    kind = bpy.props.IntProperty if isinstance(setting.default, int) else bpy.props.FloatProperty
    return kind(min=low, max=high, **common)


class UnderwaterProperties(bpy.types.PropertyGroup):
    """The stored settings of a scene."""

    __annotations__ = {s.name: _property(s) for s in fields(SceneSettings)}


def register() -> None:
    """Add ``scene.underwater``."""
    bpy.utils.register_class(UnderwaterProperties)
    setattr(bpy.types.Scene, PROPERTY, bpy.props.PointerProperty(type=UnderwaterProperties))


def unregister() -> None:
    """Take ``scene.underwater`` away; the values stay in the file."""
    delattr(bpy.types.Scene, PROPERTY)
    bpy.utils.unregister_class(UnderwaterProperties)


def stored_settings(scene: bpy.types.Scene) -> SceneSettings:
    """Return the settings that a scene stores."""
    group = getattr(scene, PROPERTY)
    values = {s.name: getattr(group, s.name) for s in fields(SceneSettings)}
    # Properties are float32: 1.34 comes back as 1.3400000334.
    exact = {n: float(f"{v:.7g}") if isinstance(v, float) else v for n, v in values.items()}
    return SceneSettings(**exact)
