"""The settings of a section: drawn from the table of settings, and reset."""

from __future__ import annotations

# pyright: reportInvalidTypeForm=false
# Blender declares properties as annotations that are calls.
from collections.abc import Collection
from typing import override

import bpy

from ..scene import stored_settings
from ..settings.scene_settings import SETTINGS
from ..settings.setting import SECTIONS
from . import panel_job
from .live_updates import transaction

TICKED = ("inelastic", "layers")
"""Settings that are lists of words: in a panel, tick boxes."""


def settings_of(*sections: str) -> tuple[str, ...]:
    """Return the names of the settings of sections."""
    return tuple(name for name, setting in SETTINGS.items() if setting.section in sections)


def draw(
    column: bpy.types.UILayout,
    scene: bpy.types.Scene,
    section: str,
    apart: Collection[str] = (),
) -> None:
    """Draw the settings of a section that have an effect now, what only researchers need last.

    ``section`` is one of :data:`.SECTIONS`; those ``apart`` are drawn otherwise.
    """
    group = getattr(scene, stored_settings.PROPERTY)
    panel = getattr(scene, panel_job.PROPERTY)
    engine = panel_job.method(scene).engine
    names = [name for name in settings_of(section) if name not in apart]
    for who in ("artist", "researcher"):
        rows = [setting for setting in map(SETTINGS.__getitem__, names) if setting.who == who]
        rows = [s for s in rows if s.engine in ("", engine) and s.applies(group)]
        if rows and who == "researcher":
            column.separator()
        for setting in rows:
            column.prop(*_shown_as(group, panel, setting.name))


def _shown_as(
    group: bpy.types.PropertyGroup, panel: bpy.types.PropertyGroup, name: str
) -> tuple[bpy.types.PropertyGroup, str]:
    """Return what shows a setting: lists of words are tick boxes."""
    return (panel, name) if name in TICKED else (group, name)


class ResetSection(bpy.types.Operator):
    """Gives the settings of a section their defaults."""

    bl_idname = "underwater.reset_section"
    bl_label = "Reset Section"
    bl_description = "Give every setting of this section its default"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender wants it

    section: bpy.props.EnumProperty(
        name="Section",
        description="Which",
        items=[(name, section.title, section.text) for name, section in SECTIONS.items()],
        options={"HIDDEN"},
    )

    @override
    def execute(self, context: bpy.types.Context) -> set[str]:
        group = getattr(context.scene, stored_settings.PROPERTY)
        with transaction():
            for name in settings_of(self.section):
                # Setting lets live water follow, which unsetting alone would not.
                setattr(group, name, SETTINGS[name].default)
                group.property_unset(name)
        return {"FINISHED"}


def draw_reset(layout: bpy.types.UILayout, section: str) -> None:
    """Draw the button of a section's header."""
    button = layout.operator(ResetSection.bl_idname, text="", icon="LOOP_BACK", emboss=False)
    button.section = section


register, unregister = bpy.utils.register_classes_factory((ResetSection,))
