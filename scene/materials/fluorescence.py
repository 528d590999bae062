"""Which materials of a scene fluoresce, and by what."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.errors import InputError
from ...uw_spectral.spectra.bands import Bands
from ...uw_spectral.spectra.fluorophore import Fluorophore, parse_fluorophore
from ..stored_materials import Fluorescence, fluorescence_of

MOST = 3
"""Fluorophores of a scene: a shader's vector has so many parts."""


@dataclass(frozen=True, eq=False)
class FluorescentObjects:
    """The materials that fluoresce."""

    fluorophores: tuple[Fluorophore, ...] = ()  #: At most :data:`MOST`.
    #: Absorptance of each where it is highest, (3,), by names.
    materials: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)

    def excitation_in(self, bands: Bands) -> NDArray[np.float64]:
        """Weights of the irradiance of bands, shape (3, n), or (0, n) of nothing.

        Where there are fewer fluorophores than three, the last one's short and long wavelengths
        follow, which tell more of the spectrum of occlusion.
        """
        rows = [one.excitation_in(bands) for one in self.fluorophores]
        if not rows:
            return np.zeros((0, len(bands)))
        ramp = np.linspace(1.0, 0.0, len(bands))
        return np.array([*rows, rows[-1] * ramp, rows[-1] * (1.0 - ramp)][:MOST])

    def emissions_in(self, bands: Bands) -> list[NDArray[np.float64]]:
        """Radiance of each, of bands, per unit of what excites it, over π."""
        return [one.emission_in(bands) for one in self.fluorophores]

    def brightened(self, light: NDArray[np.float64], bands: Bands) -> NDArray[np.float64]:
        """Return an irradiance of bands, and what all fluorophores make of it at most, (n,)."""
        made = (one.reradiation(bands) @ light for one in self.fluorophores)
        return sum(made, start=light)


def of(materials: Iterable[bpy.types.Material]) -> dict[str, Fluorescence]:
    """Return what fluoresces, by the names of materials."""
    found = {material.name: fluorescence_of(material) for material in materials}
    return {name: one for name, one in found.items() if one is not None}


def fluorescent_objects(materials: Iterable[bpy.types.Material]) -> FluorescentObjects:
    """Read the spectra of all fluorophores of materials.

    InputError if one cannot be read, or there are more than :data:`MOST`.
    """
    found = of(materials)
    names = list(dict.fromkeys(one.fluorophore for one in found.values()))
    if len(names) > MOST:
        raise InputError(
            f"materials of the scene fluoresce by {len(names)} fluorophores ({', '.join(names)}); "
            f"a picture can have {MOST}: let some share one"
        )
    known = []
    for name in names:
        try:
            known.append(parse_fluorophore(name))
        except InputError as error:
            owner = next(key for key, one in found.items() if one.fluorophore == name)
            raise InputError(f"material {owner!r}: {error}") from error
    absorptance = {
        material: one.strength * np.eye(MOST)[names.index(one.fluorophore)]
        for material, one in found.items()
    }
    return FluorescentObjects(tuple(known), absorptance)


def unseen(materials: Iterable[bpy.types.Material], by: str) -> list[str]:
    """Notes on materials that fluoresce where a renderer does not draw it."""
    names = ", ".join(map(repr, of(materials)))
    if not names:
        return []
    return [
        f"the fluorescence of {names} is not drawn by {by}, whose passes of bands exchange no "
        "light; EEVEE draws it, in real time and in bands"
    ]
