"""Presets through Blender's own preset system: waters, looks, cameras."""

# pyright: reportInvalidTypeForm=false
# Blender declares properties as annotations that are calls.

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import override

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..settings.former_names import FORMER_NAMES
from ..settings.setting import SECTIONS
from ..uw_spectral.errors import unknown_name
from .live_updates import transaction
from .sections import settings_of

_FOLDER = Path(__file__).resolve().parent.parent
_SCENE = "bpy.context.scene.underwater"

_WATER, _CAMERA = settings_of("water"), settings_of("sensor")
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


def _values(names: tuple[str, ...]) -> list[str]:
    return [f"{_SCENE}.{name}" for name in names]


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


class ApplyPreset(bpy.types.Operator):
    """Runs a preset as Blender does; live water follows once, and undo is one step."""

    bl_idname = "underwater.apply_preset"
    bl_label = "Apply Preset"
    bl_description = "Apply a preset to the water of the scene"
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


class _PresetPanel(PresetPanel, bpy.types.Panel):
    """Popover with the presets of one kind."""

    preset_operator = ApplyPreset.bl_idname

    def __init_subclass__(cls) -> None:
        cls.preset_operator_defaults = {"menu_idname": cls.__name__}


class UNDERWATER_PT_water_presets(_PresetPanel):  # noqa: N801 - the name is the identifier
    """Waters."""

    bl_label = "Water Presets"
    preset_subdir = "underwater_spectral/water"
    preset_add_operator = "underwater.water_preset_add"


class UNDERWATER_PT_look_presets(_PresetPanel):  # noqa: N801 - the name is the identifier
    """Waters with their light and floor."""

    bl_label = "Looks"
    preset_subdir = "underwater_spectral/look"
    preset_add_operator = "underwater.look_preset_add"


class UNDERWATER_PT_camera_presets(_PresetPanel):  # noqa: N801 - the name is the identifier
    """Cameras and how they are developed."""

    bl_label = "Camera Presets"
    preset_subdir = "underwater_spectral/camera"
    preset_add_operator = "underwater.camera_preset_add"


class WaterPresetAdd(AddPresetBase, bpy.types.Operator):
    """Add or remove a water preset."""

    bl_idname = "underwater.water_preset_add"
    bl_description = "Add or remove a water preset"
    bl_label = "Add Water Preset"
    preset_menu = "UNDERWATER_PT_water_presets"
    preset_subdir = UNDERWATER_PT_water_presets.preset_subdir
    preset_values = _values(_WATER)


class LookPresetAdd(AddPresetBase, bpy.types.Operator):
    """Add or remove a look."""

    bl_idname = "underwater.look_preset_add"
    bl_description = "Add or remove a look: water, light, floor and development"
    bl_label = "Add Look"
    preset_menu = "UNDERWATER_PT_look_presets"
    preset_subdir = UNDERWATER_PT_look_presets.preset_subdir
    preset_values = _values(_LOOK)


class CameraPresetAdd(AddPresetBase, bpy.types.Operator):
    """Add or remove a camera preset."""

    bl_idname = "underwater.camera_preset_add"
    bl_description = "Add or remove a camera preset"
    bl_label = "Add Camera Preset"
    preset_menu = "UNDERWATER_PT_camera_presets"
    preset_subdir = UNDERWATER_PT_camera_presets.preset_subdir
    preset_values = _values(_CAMERA)


KINDS = {
    "water": UNDERWATER_PT_water_presets,
    "look": UNDERWATER_PT_look_presets,
    "camera": UNDERWATER_PT_camera_presets,
}

CLASSES = (
    ApplyPreset,
    *KINDS.values(),
    WaterPresetAdd,
    LookPresetAdd,
    CameraPresetAdd,
)


def held_by(kind: str) -> tuple[str, ...]:
    """Return the names of the settings that a preset of a kind holds."""
    return {"water": _WATER, "look": _LOOK, "camera": _CAMERA}[kind]


def names(kind: str) -> dict[str, Path]:
    """Return the presets of a kind (``water``, ``look``, ``camera``): name to file."""
    folders = bpy.utils.preset_paths(KINDS[kind].preset_subdir)
    files = (path for folder in folders for path in sorted(Path(folder).glob("*.py")))
    return {bpy.path.display_name(path.name, title_case=False): path for path in files}


def apply(kind: str, name: str) -> None:
    """Apply a preset to the scene of the context, as the menu does.

    Raises InputError if there is no such preset; near names are suggested.
    """
    known = names(kind)
    if name not in known:
        raise unknown_name(f"{kind} preset", name, list(known))
    bpy.ops.underwater.apply_preset(filepath=str(known[name]), menu_idname=KINDS[kind].__name__)


def register() -> None:
    """Register classes and the folder of the factory presets."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.utils.register_preset_path(str(_FOLDER))


def unregister() -> None:
    """Undo :func:`register`; the user's presets stay."""
    bpy.utils.unregister_preset_path(str(_FOLDER))
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
