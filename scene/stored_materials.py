"""What a material stores besides Blender's own properties: ``material.underwater``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ..settings.known_words import suggestions

PROPERTY = "underwater"
_SCHEME = "file:"


@dataclass(frozen=True)
class FluorophoreFile:
    """A file that a material names as its fluorophore, and the path as it is stored."""

    material: bpy.types.Material
    path: str

    @property
    def whole(self) -> Path:
        """The full path; a relative one is seen from the .blend of the material."""
        return Path(bpy.path.abspath(self.path, library=self.material.library))

    def move(self, path: str) -> None:
        """Let the material read another file."""
        getattr(self.material, PROPERTY).fluorophore = f"{_SCHEME}{path}"


@dataclass(frozen=True)
class Fluorescence:
    """Name of a fluorophore, and the fraction of light that it absorbs where it absorbs most."""

    fluorophore: str
    strength: float


type OnChange = Callable[[Any, bpy.types.Context], None]


def properties(on_change: OnChange | None) -> dict[str, Any]:
    """What ``material.underwater`` has; changes are told with the group and the context."""
    return {
        "filled_with_air": bpy.props.BoolProperty(
            name="Filled with air",
            description="Refractive indices of the material stay as they are given, instead of "
            "being taken against the water: for panes with air behind them, or indices that are "
            "given against the water already",
            options=set(),
            update=on_change,
        ),
        "porous": bpy.props.BoolProperty(
            name="Porous, colours dry",
            description="The colours of the material are those of a dry object whose pores fill "
            "with water, as those of sand, soil, cloth and wood do: in water it is darker, sand "
            "by about half. Measured reflectances stay as they are",
            options=set(),
            update=on_change,
        ),
        "fluorophore": bpy.props.StringProperty(
            name="Fluorophore",
            description="What of the material glows in the light that it absorbs: coral-green, "
            "chlorophyll, another one by name, or file:PATH with wavelength_nm, excitation, "
            "emission. Empty: nothing. EEVEE draws it, in real time and in bands",
            search=suggestions("fluorophores"),
            options=set(),
            update=on_change,
        ),
        "fluorescence": bpy.props.FloatProperty(
            name="Absorbed",
            description="Fraction of the light that the fluorophore absorbs at the wavelength "
            "where it absorbs most; what it emits of that is its quantum yield",
            default=0.5,
            min=0.0,
            max=1.0,
            subtype="FACTOR",
            update=on_change,
        ),
    }


def is_porous(material: bpy.types.Material) -> bool:
    """Whether the colours of the material are those of a porous object when it is dry."""
    group = getattr(material, PROPERTY, None)
    return group is not None and group.porous


def is_filled_with_air(material: bpy.types.Material) -> bool:
    """Whether the refractive indices of a material stay as they are given."""
    group = getattr(material, PROPERTY, None)
    return group is not None and group.filled_with_air


def fluorescence_of(material: bpy.types.Material) -> Fluorescence | None:
    """Return by what a material fluoresces, if it does."""
    group = getattr(material, PROPERTY, None)
    if group is None:
        return None
    name = group.fluorophore.strip()
    if name.startswith(_SCHEME):
        name = f"{_SCHEME}{FluorophoreFile(material, name.removeprefix(_SCHEME)).whole}"
    return Fluorescence(name, group.fluorescence) if name else None


def fluorophore_files() -> Iterator[FluorophoreFile]:
    """Yield the files that materials of the open .blend name as fluorophores."""
    for material in bpy.data.materials:
        group = getattr(material, PROPERTY, None)
        name = "" if group is None else group.fluorophore.strip()
        if material.users and name.startswith(_SCHEME):
            yield FluorophoreFile(material, name.removeprefix(_SCHEME))
