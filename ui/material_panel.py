"""What a material stores, in the Properties editor."""

from __future__ import annotations

from typing import ClassVar, override

import bpy

from ..scene import stored_materials
from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.fluorophore import parse_fluorophore
from .panel_parts import say


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


register, unregister = bpy.utils.register_classes_factory((MaterialPanel,))
