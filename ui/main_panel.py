"""The panel that adds and removes the water, and says what is wrong with the scene."""

from __future__ import annotations

import contextlib
from typing import override

import bpy

from ..scene import stored_settings
from ..scene.session import is_live
from ..scene.unsupported import unsupported, unsupported_of_camera
from ..uw_spectral.errors import InputError
from . import migration, presets
from .panel_parts import Panel, say, shows_water
from .reporting import sentence, water_settings


class MainPanel(Panel, bpy.types.Panel):
    """Adds and removes the water."""

    bl_idname = "UNDERWATER_PT_main"
    bl_label = "Underwater"

    @override
    def draw_header_preset(self, _: bpy.types.Context) -> None:
        presets.KINDS["look"].panel.draw_panel_header(self.layout)

    @override
    def draw(self, context: bpy.types.Context) -> None:
        from ..scene.engines import transparent_film
        from ..scene.materials import own_water
        from ..scene.readers.cameras import camera_of
        from ..scene.viewport import preview_depths, problems

        layout, scene = self.layout, context.scene
        column = layout.column()
        column.scale_y = 1.4
        if is_live(scene):
            row = column.row(align=True)
            row.operator("underwater.remove_water", icon="X")
            row.operator("underwater.rebuild", text="", icon="FILE_REFRESH")
        else:
            column.operator("underwater.add_water", icon="MOD_OCEAN")
        layout.operator_menu_enum("underwater.add_example", "example", icon="SCENE_DATA")
        if not scene.is_editable:
            say(layout, "This scene is linked: make it local to change its water.", "LINKED")
        if migration.is_newer(scene):
            say(layout, "A newer version of the extension has saved this file.", "ERROR")
        notes = unsupported(scene, water_settings(context).sky_picture)
        camera = camera_of(scene)
        if camera is not None:
            notes += unsupported_of_camera(scene, camera, traced=not is_live(scene))
            if not is_live(scene):  # there the film is Blender's own
                with contextlib.suppress(InputError):  # which a render tells
                    stored = stored_settings.stored_settings(scene)
                    notes += tuple(filter(None, [transparent_film.note(scene, camera, stored)]))
        for note in (*notes, *problems.standing_notes(scene)):
            say(layout, sentence(note), "ERROR")
        if any(own_water.ADVICE in note for note in notes):
            layout.prop(water_settings(context), "hide_own_water")
        problem = problems.problem(scene)
        if problem:
            say(layout, problem, "ERROR")
        depth = preview_depths.camera_depth(scene)
        # Add Water lowers a dry scene itself.
        if is_live(scene) and depth is not None and depth <= 0:
            say(layout, "The camera looks at the water from above.", "INFO")
            layout.operator("underwater.submerge", icon="TRIA_DOWN_BAR")
        if is_live(scene) and not shows_water(context):
            layout.operator("underwater.show", icon="SHADING_RENDERED")
