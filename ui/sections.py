"""The settings of a section: drawn from the table of settings, and reset."""

from __future__ import annotations

from typing import override

import bpy
from bl_ui.utils import PresetPanel

from ..settings.scene_settings import SETTINGS
from ..settings.setting import SECTIONS
from . import panel_job
from .live_updates import transaction
from .panel_parts import SubPanel, panel_settings
from .reporting import ReportingOperator, water_settings

TICKED = ("inelastic", "layers")
"""Settings that are lists of words: in a panel, tick boxes."""


def settings_of(*sections: str) -> tuple[str, ...]:
    """Return the names of the settings of sections."""
    return tuple(name for name, setting in SETTINGS.items() if setting.section in sections)


class ResetSection(ReportingOperator):
    """Give every setting of this section its default."""

    bl_idname = "underwater.reset_section"
    bl_label = "Reset Section"

    section: bpy.props.EnumProperty(
        name="Section",
        description="Which",
        items=[(name, section.title, section.text) for name, section in SECTIONS.items()],
        options={"HIDDEN"},
    )

    @override
    def run(self, context: bpy.types.Context) -> None:
        group = water_settings(context)
        with transaction():
            for name in settings_of(self.section):
                # Setting lets live water follow, which unsetting alone would not.
                setattr(group, name, SETTINGS[name].default)
                group.property_unset(name)


class SectionPanel(SubPanel):
    """The settings of a section; what is drawn otherwise stands before them or behind."""

    bl_parent_id = "UNDERWATER_PT_advanced"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012 - as Blender wants it
    section: str
    apart: tuple[str, ...] = ()
    popover: type[PresetPanel] | None = None

    def __init_subclass__(cls) -> None:
        if "bl_idname" not in vars(cls):
            cls.bl_idname = f"UNDERWATER_PT_{cls.section}"
            cls.bl_label = SECTIONS[cls.section].title

    def draw_header_preset(self, _: bpy.types.Context) -> None:
        """Draw what resets the section, and its presets."""
        kind = ResetSection.bl_idname
        reset = self.layout.operator(kind, text="", icon="LOOP_BACK", emboss=False)
        reset.section = self.section
        if self.popover is not None:
            self.popover.draw_panel_header(self.layout)

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the settings, and what stands around them."""
        self.before(context)
        self.draw_settings(context)
        self.after(context)

    def before(self, context: bpy.types.Context) -> None:
        """Draw what stands before the settings."""

    def after(self, context: bpy.types.Context) -> None:
        """Draw what stands behind them."""

    def draw_settings(self, context: bpy.types.Context) -> None:
        """Draw those that have an effect now, what only researchers need last."""
        column, water, panel = self.column(), water_settings(context), panel_settings(context)
        engine = panel_job.method(context.scene).engine
        names = [name for name in settings_of(self.section) if name not in self.apart]
        for who in ("artist", "researcher"):
            rows = [setting for setting in map(SETTINGS.__getitem__, names) if setting.who == who]
            rows = [s.name for s in rows if s.engine in ("", engine) and s.applies(water)]
            if rows and who == "researcher":
                column.separator()
            for name in rows:
                column.prop(panel if name in TICKED else water, name)
