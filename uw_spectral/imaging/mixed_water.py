"""The water of a description: every layer read and mixed, and its phase function."""

from __future__ import annotations

from dataclasses import dataclass

from ..spectra.bands import Bands
from ..water.bio_optics import Constituents
from ..water.named import constituents_of, parse_uniform_water, parse_water
from ..water.optical_properties import Water
from ..water.phase import BandPhase
from ..water.phase_functions import parse_phase
from ..water.profile import DepthProfile
from ..water.pure_water import molecular_scattering
from .description import WaterDescription


@dataclass(frozen=True)
class Mixture:
    """The water of a layer, and what it is made of if it is one bio-optical water."""

    water: Water
    constituents: Constituents | None


def mixtures_of(described: WaterDescription) -> DepthProfile[Mixture]:
    """Return the water of each layer, read and mixed."""
    water, second, known = described.water, described.second, None
    if isinstance(water, str):
        water, known = parse_water(water, described.source), constituents_of(water)
    if isinstance(second, str) and second:
        second = parse_uniform_water(second, described.source)

    def mixture(layer: Water | Constituents) -> Mixture:
        constituents = known
        if isinstance(layer, Constituents):
            layer, constituents = layer.water(), layer
        if second:
            layer, constituents = layer.mixed(second, described.second_fraction), None
        layer = layer.concentrated(described.concentration)
        scaled = layer.scaled(described.absorption_factor, described.scattering_factor)
        return Mixture(scaled, constituents)

    layers = water if isinstance(water, DepthProfile) else DepthProfile((0.0,), (water,))
    return layers.map(mixture)


def phase_of(described: WaterDescription, mixture: Mixture, bands: Bands) -> BandPhase:
    """Return the phase function of a layer: the one that is described, or that of its parts."""
    if described.phase is None and mixture.constituents is not None:
        if mixture.constituents is described.water:
            return mixture.constituents.phase_of_fixed_parts(bands.centres)
        return mixture.constituents.phase(bands.centres)
    model = mixture.water.phase_model if described.phase is None else described.phase
    if isinstance(model, str):
        model = parse_phase(model)
    return model.for_bands(mixture.water.b(bands.centres), molecular_scattering(bands.centres))
