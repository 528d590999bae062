"""What all buttons share."""

from __future__ import annotations

from typing import override

import bpy

from ..scene import stored_settings as optics
from ..uw_spectral.errors import InputError


def water_settings(context: bpy.types.Context) -> bpy.types.PropertyGroup:
    """Return the settings of the scene that a context has."""
    return getattr(context.scene, optics.PROPERTY)


def sentence(text: str) -> str:
    """Return a note as a sentence; empty without one."""
    return f"{text[:1].upper()}{text[1:]}." if text else ""


class Described:
    """Has its docstring as its tooltip."""

    def __init_subclass__(cls) -> None:
        if "bl_description" not in vars(cls):
            cls.bl_description = " ".join((cls.__doc__ or "").split()).removesuffix(".")


class ReportingOperator(Described, bpy.types.Operator):
    """Reports errors of the input instead of raising them."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012 - as Blender wants it

    @override
    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            self.run(context)
        except InputError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}

    def run(self, context: bpy.types.Context) -> None:
        """Do the work."""
        raise NotImplementedError

    def tell(self, notes: list[str]) -> None:
        """Report what could not be treated."""
        for note in notes:
            self.report({"WARNING"}, note)


class CameraOperator(ReportingOperator):
    """Needs a camera."""

    @classmethod
    @override
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.scene.camera is not None
