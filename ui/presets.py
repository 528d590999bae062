"""Presets through Blender's own preset system: waters, looks, cameras."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, override

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..settings.setting import FORMER_NAMES, SECTIONS
from ..uw_spectral.errors import unknown_name
from .live_updates import transaction
from .reporting import Described
from .sections import settings_of

_FOLDER = Path(__file__).resolve().parent.parent
_SCENE = "bpy.context.scene.underwater"

# Of the camera that one dives with, whatever the look.
_DEVICE = {
    *("filter", "raw", "iso", "full_well", "read_noise", "receptors", "false_colour"),
    *settings_of("housing"),
}
_LOOK = tuple(
    name
    for name in settings_of(*(section for section in SECTIONS if section != "quality"))
    if name not in _DEVICE
)


@contextmanager
def _in_present_names(path: Path) -> Iterator[Path]:
    """Yield a preset, or a copy of one that an earlier version has written, in today's names."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        text = ""
    present = text
    for was, name in FORMER_NAMES.items():
        present = re.sub(rf"\.{was}\b", f".{name}", present)
    if present == text:
        yield path
        return
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name  # its name is shown
        copy.write_text(present, encoding="utf-8")
        yield copy


class ApplyPreset(Described, bpy.types.Operator):
    """Apply a preset to the water of the scene."""

    bl_idname = "underwater.apply_preset"
    bl_label = "Apply Preset"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender wants it

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", options={"SKIP_SAVE", "HIDDEN"})
    menu_idname: bpy.props.StringProperty(options={"SKIP_SAVE", "HIDDEN"})

    @override
    def execute(self, _: bpy.types.Context) -> set[str]:
        try:
            with transaction(), _in_present_names(Path(self.filepath)) as path:
                return bpy.ops.script.execute_preset(
                    filepath=str(path), menu_idname=self.menu_idname
                )
        except RuntimeError as error:  # what Blender has reported
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}


@dataclass(frozen=True)
class PresetKind:
    """Presets that hold some settings: their popover, and what adds and removes them."""

    panel: Any
    adder: Any
    settings: tuple[str, ...]


def _kind(name: str, label: str, settings: tuple[str, ...], holds: str = "") -> PresetKind:
    """Make the classes that Blender wants of each kind; ``label`` names one of its presets."""
    menu, folder = f"UNDERWATER_PT_{name}_presets", f"underwater_spectral/{name}"
    panel = {
        "bl_label": f"{label}s",
        "preset_subdir": folder,
        "preset_operator": ApplyPreset.bl_idname,
        "preset_operator_defaults": {"menu_idname": menu},
        "preset_add_operator": f"underwater.{name}_preset_add",
    }
    adder = {
        "bl_idname": panel["preset_add_operator"],
        "bl_label": f"Add {label}",
        "bl_description": f"Add or remove a {label.lower()}{holds}",
        "preset_menu": menu,
        "preset_subdir": folder,
        "preset_values": [f"{_SCENE}.{setting}" for setting in settings],
    }
    return PresetKind(
        type(menu, (PresetPanel, bpy.types.Panel), panel),
        type(f"{name.title()}PresetAdd", (AddPresetBase, bpy.types.Operator), adder),
        settings,
    )


KINDS = {
    "water": _kind("water", "Water Preset", settings_of("water")),
    "look": _kind("look", "Look", _LOOK, ": water, light, floor and development"),
    "camera": _kind("camera", "Camera Preset", settings_of("sensor")),
}

_register, _unregister = bpy.utils.register_classes_factory(
    (ApplyPreset, *(x.panel for x in KINDS.values()), *(x.adder for x in KINDS.values()))
)


def names(kind: str) -> dict[str, Path]:
    """Return the presets of a kind (``water``, ``look``, ``camera``): name to file."""
    folders = bpy.utils.preset_paths(KINDS[kind].panel.preset_subdir)
    files = (path for folder in folders for path in sorted(Path(folder).glob("*.py")))
    return {bpy.path.display_name(path.name, title_case=False): path for path in files}


def apply(kind: str, name: str) -> None:
    """Apply a preset to the scene of the context, as the menu does.

    Raises InputError if there is no such preset; near names are suggested.
    """
    known = names(kind)
    if name not in known:
        raise unknown_name(f"{kind} preset", name, list(known))
    bpy.ops.underwater.apply_preset(
        filepath=str(known[name]), menu_idname=KINDS[kind].panel.__name__
    )


def register() -> None:
    """Register classes and the folder of the factory presets."""
    _register()
    bpy.utils.register_preset_path(str(_FOLDER))


def unregister() -> None:
    """Undo :func:`register`; the user's presets stay."""
    bpy.utils.unregister_preset_path(str(_FOLDER))
    _unregister()
