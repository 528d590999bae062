"""The settings as properties of a scene, so that they are saved in the .blend."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

from ..settings.known_words import suggestions
from ..settings.scene_settings import SETTINGS, SceneSettings
from ..settings.setting import Setting
from . import stored_clouds, stored_lamps, stored_materials

PROPERTY = "underwater"

_GROUPS = {
    "UnderwaterProperties": bpy.types.Scene,
    "UnderwaterCloud": bpy.types.Object,
    "UnderwaterLamp": bpy.types.Light,
    "UnderwaterMaterial": bpy.types.Material,
}

OnChange = Callable[[bpy.types.PropertyGroup, bpy.types.Context], None]


# How Blender shows a unit of its own; others stand behind the label.
_UNITS: dict[str, dict[str, str]] = {
    "m": {"subtype": "DISTANCE", "unit": "LENGTH"},
    "m/s": {"unit": "VELOCITY"},
    "s": {"subtype": "TIME_ABSOLUTE", "unit": "TIME_ABSOLUTE"},
}


def _property(setting: Setting, on_change: OnChange | None) -> object:
    words = setting.unit and setting.unit not in _UNITS
    common: dict[str, Any] = {
        "name": f"{setting.label} ({setting.unit})" if words else setting.label,
        "description": setting.text,
        "default": setting.default,
        "options": {"ANIMATABLE"} if setting.animatable else set(),
        "update": on_change,
    }
    if setting.choices:
        items = [(word, *shown) for word, shown in setting.choices.items()]
        return bpy.props.EnumProperty(items=items, **common)
    if isinstance(setting.default, bool):
        return bpy.props.BoolProperty(**common)
    if isinstance(setting.default, str):
        if setting.known:
            common["search"] = suggestions(setting.known)
        return bpy.props.StringProperty(**common)
    (low, high), (least, most) = setting.limits, setting.soft_limits or setting.limits
    common |= {"min": low, "max": high, "soft_min": least, "soft_max": most}
    if isinstance(setting.default, int):
        return bpy.props.IntProperty(**common)
    shown = _UNITS.get(setting.unit, {})
    return bpy.props.FloatProperty(precision=setting.digits, **shown, **common)


def register(on_change: OnChange | None = None, on_material_change: OnChange | None = None) -> None:
    """Add ``underwater`` to scenes, and to what else stores something.

    The callables get group and context whenever a setting, or what a material stores, is set.
    """
    stored = (
        {name: _property(setting, on_change) for name, setting in SETTINGS.items()},
        stored_clouds.properties(),
        stored_lamps.properties(),
        stored_materials.properties(on_material_change),
    )
    for (name, owner), properties in zip(_GROUPS.items(), stored, strict=True):
        description = {"__doc__": "What is stored.", "__annotations__": properties}
        group = type(name, (bpy.types.PropertyGroup,), description)
        bpy.utils.register_class(group)
        setattr(owner, PROPERTY, bpy.props.PointerProperty(type=group))


def unregister() -> None:
    """Take them away; the values stay in the file."""
    for name, owner in reversed(_GROUPS.items()):
        delattr(owner, PROPERTY)
        bpy.utils.unregister_class(bpy.types.PropertyGroup.bl_rna_get_subclass_py(name))


def stored_settings(scene: bpy.types.Scene) -> SceneSettings:
    """Return the settings that a scene stores."""
    group = getattr(scene, PROPERTY)
    values = {name: getattr(group, name) for name in SETTINGS}
    # Properties are float32: 1.34 comes back as 1.3400000334.
    exact: dict[str, Any] = {
        n: float(f"{v:.7g}") if isinstance(v, float) else v for n, v in values.items()
    }
    return SceneSettings(**exact)
