"""Panels of objects: clouds and lamps in their sections, and what a material stores."""

from __future__ import annotations

from typing import ClassVar, override

import bpy

from ..scene import stored_clouds, stored_lamps, stored_materials
from ..uw_spectral.clouds.matter import UNITS
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.fluorophore import parse_fluorophore
from ..uw_spectral.transfer.water_column import WAVES
from .panel_parts import say
from .reporting import sentence, water_settings
from .sections import SectionPanel


class ParticlesPanel(SectionPanel, bpy.types.Panel):
    """What floats in the water and is seen by itself."""

    section = "particles"

    @override
    def before(self, context: bpy.types.Context) -> None:
        self.column().label(text="Larger than 0.1 mm, per litre", icon="PARTICLES")

    @override
    def after(self, context: bpy.types.Context) -> None:
        from ..scene.readers import clouds

        column = self.column()
        column.separator()
        column.operator_menu_enum("underwater.add_cloud", "constituent", icon="OUTLINER_OB_VOLUME")
        water = water_settings(context)
        if water.surface == WAVES and water.raised_waves and water.whitecaps:
            column.operator("underwater.add_plumes", icon="MOD_OCEAN")
        found, active = clouds.marked(context.scene), context.object
        if active is not None and active not in found and active.type in (clouds.BLOB, clouds.GRID):
            own = getattr(active, stored_clouds.PROPERTY)
            column.prop(own, "constituent", text=active.name)
        for item in found:
            box = column.box().column()
            box.label(text=item.name, icon="OUTLINER_OB_VOLUME")
            own = getattr(item, stored_clouds.PROPERTY)
            box.prop(own, "constituent")
            box.prop(own, "concentration", text=f"Concentration ({UNITS[own.constituent]})")
            for said in clouds.diagnostics(item):
                say(box, sentence(said))


class LampsPanel(SectionPanel, bpy.types.Panel):
    """Torches, strobes and lights of vehicles, and how much sun there is beside them."""

    section = "lamps"

    @override
    def after(self, context: bpy.types.Context) -> None:
        from ..scene.readers import dark_lamps

        column = self.column()
        column.operator_menu_enum("underwater.add_lamps", "rig", icon="LIGHT_SPOT")
        for item, why in dark_lamps.left_out(context.scene).items():
            row = column.row()
            row.active = False
            row.label(text=f"{item.name}: dark here", icon=f"LIGHT_{item.data.type}")
            row.prop(getattr(item.data, stored_lamps.PROPERTY), "in_water", text="Light")
            say(column, sentence(why))
        for item in dark_lamps.objects_of(context.scene):
            light = item.data
            box = column.box().column()
            box.label(text=item.name, icon=f"LIGHT_{light.type}")
            own = getattr(light, stored_lamps.PROPERTY)
            box.prop(light, "energy", text=f"Power ({own.unit if own.spectrum else 'W'})")
            row = box.row(align=True)
            row.prop(own, "spectrum")
            chosen = row.operator_menu_enum(
                "underwater.choose_spectrum", "spectrum", text="", icon="COLLAPSEMENU"
            )
            chosen.lamp = light.name
            if own.spectrum:
                box.prop(own, "unit")
            else:
                box.prop(light, "color")
            box.prop(own, "profile")
            if own.profile or light.type == "SPOT":
                box.prop(own, "behind_port")
            box.prop(own, "from_above")
            box.prop(item, "visible_camera", text="Itself Seen")
            for said in dark_lamps.diagnostics(item):
                say(box, sentence(said))


class MaterialPanel(bpy.types.Panel):
    """What a material stores: in the Properties editor, tab Material."""

    bl_idname = "UNDERWATER_PT_material"
    bl_label = "Underwater"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    @override
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.material is not None

    @override
    def draw(self, context: bpy.types.Context) -> None:
        own = getattr(context.material, stored_materials.PROPERTY)
        self.layout.use_property_split = True
        self.layout.prop(own, "filled_with_air")
        self.layout.prop(own, "porous")
        self.layout.prop(own, "fluorophore")
        if not own.fluorophore.strip():
            return
        self.layout.prop(own, "fluorescence")
        say(self.layout, "Real time and bands draw it; the reference of Cycles leaves it out.")
        try:
            fluorescence = stored_materials.fluorescence_of(context.material)
            assert fluorescence is not None
            parse_fluorophore(fluorescence.fluorophore)
        except InputError as error:
            say(self.layout, str(error), "ERROR")
