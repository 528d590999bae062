"""Material of the water body for Cycles: absorption and scattering per band."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Literal

import bpy
from nodebpy import shader as s
from nodebpy.builder import FloatSocket

from . import attributes

NAME = "UW Water"


@dataclass(frozen=True)
class ScatteringLobe:
    """One phase function that Cycles knows.

    Parameters
    ----------
    phase : {"HENYEY_GREENSTEIN", "DRAINE", "FOURNIER_FORAND", "RAYLEIGH"}
        Cycles' name.
    anisotropy : float
        Mean cosine, Henyey-Greenstein; asymmetry, Draine.
    alpha : float
        Weight of cos² beside 1, Draine only.
    index, backscatter : float
        Relative refractive index of the particles and bb/b, Fournier-Forand only.
    by_band : bool
        Anisotropy and alpha differ by band: the material reads them as it reads coefficients.
    """

    phase: Literal["HENYEY_GREENSTEIN", "DRAINE", "FOURNIER_FORAND", "RAYLEIGH"]
    anisotropy: float = 0.0
    alpha: float = 0.5
    index: float = 1.10
    backscatter: float = 0.0183
    by_band: bool = False


def build(lobes: tuple[ScatteringLobe, ...], layer: int = 0) -> bpy.types.Material:
    """Build the material of a layer of the water, which scatters with some lobes."""
    with s.material(NAME) as material:
        nodes = []
        for index, lobe in enumerate(lobes):
            absorption = (
                s.Attribute.view_layer(attributes.absorption(layer)).o.vector
                if index == 0
                else (0.0, 0.0, 0.0)
            )
            coefficients = s.VolumeCoefficients(
                weight=1.0,
                absorption_coefficients=absorption,
                scatter_coefficients=s.Attribute.view_layer(
                    attributes.scattering(layer, index)
                ).o.vector,
                anisotropy=_by_band(attributes.asymmetry(layer, index))
                if lobe.by_band
                else lobe.anisotropy,
                alpha=_by_band(attributes.alpha(layer, index)) if lobe.by_band else lobe.alpha,
                ior=lobe.index,
                backscatter=lobe.backscatter,
                phase=lobe.phase,
            )
            nodes.append(coefficients)
        functools.reduce(s.AddShader, nodes) >> s.MaterialOutput().i.volume
    return material.material


def _by_band(name: str) -> FloatSocket:
    """Mean over the bands of a pass, which share a phase function."""
    return s.Attribute.view_layer(name).o.factor
