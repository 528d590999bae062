"""What panels are made of: their place, sentences and plots."""

from __future__ import annotations

import textwrap

import bpy

from . import previews
from .panel_job import PROPERTY

TAB = "Underwater"
"""Of the sidebar, unless the preferences name it otherwise."""
SWATCH_SCALE = 5.0
_PLOT_SCALE = 9.0
LOOK_SCALE = 4.5
# Average width of a character of the interface's font, in pixels at scale 1.
_CHARACTER = 7.2
_MARGIN = 70


def panel_settings(context: bpy.types.Context) -> bpy.types.PropertyGroup:
    """Return what the panels of a window show."""
    return getattr(context.scene, PROPERTY)


def say(layout: bpy.types.UILayout, text: str, icon: str = "INFO") -> None:
    """Write a text over as many lines as it needs."""
    box = layout.box().column(align=True)
    scale, region = bpy.context.preferences.system.ui_scale, bpy.context.region
    width = region.width if region is not None else 0
    longest = max(int((width / scale - _MARGIN) / _CHARACTER), 20)
    lines = textwrap.wrap(text, longest, break_long_words=False, break_on_hyphens=False)
    for line in lines:
        box.label(text=line, icon=icon)
        icon = "BLANK1"


def plot(layout: bpy.types.UILayout, name: str) -> None:
    """Draw a plot as wide as the panel."""
    icon = previews.icon_id(name)
    if icon:
        layout.template_icon(icon_value=icon, scale=_PLOT_SCALE)


class Panel:
    """What all panels have in common: their tab."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = TAB


def shows_water(context: bpy.types.Context) -> bool:
    """Return whether a space may show water: no viewport, or one that is rendered."""
    space = context.space_data
    return space is None or space.type != "VIEW_3D" or space.shading.type == "RENDERED"


class SubPanel(Panel):
    """A panel below the main one, where water is shown."""

    layout: bpy.types.UILayout
    bl_parent_id = "UNDERWATER_PT_main"

    def column(self) -> bpy.types.UILayout:
        """Return the layout of a list of properties."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = True
        return self.layout.column()
