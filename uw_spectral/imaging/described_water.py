"""The water of a description: every layer read, mixed, and put on the bands."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.bands import Bands
from ..spectra.illuminant import RELATIVE, Illuminant, full_sun
from ..spectra.sky_colours import sky_basis
from ..surface.refraction import in_water_cosine, sun_travel_direction
from ..transfer.rough_surface import WaterSurface
from ..transfer.sky import UNIFORM
from ..transfer.sky_picture import SkyPicture
from ..transfer.water_column import WAVES, DeeperWater, WaterColumn
from ..water.bio_optics import Constituents
from ..water.inelastic_processes import EXCITATION, InelasticProcess, inelastic_processes
from ..water.named import parse_uniform_water, parse_water
from ..water.named_waters import constituents_of
from ..water.optical_properties import Water
from ..water.phase import BandPhase
from ..water.phase_functions import parse_phase
from ..water.profile import DepthProfile
from ..water.pure_water import molecular_scattering
from .description import Description, WaterDescription


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

    return (water if isinstance(water, DepthProfile) else DepthProfile.uniform(water)).map(mixture)


def _phase(described: WaterDescription, mixture: Mixture, bands: Bands) -> BandPhase:
    if described.phase is None and mixture.constituents is not None:
        if mixture.constituents is described.water:
            return mixture.constituents.phase_of_fixed_parts(bands.centres)
        return mixture.constituents.phase(bands.centres)
    model = mixture.water.phase_model if described.phase is None else described.phase
    if isinstance(model, str):
        model = parse_phase(model)
    return model.for_bands(mixture.water.b(bands.centres), molecular_scattering(bands.centres))


def column_of(
    description: Description,
    mixtures: DepthProfile[Mixture],
    illuminant: Illuminant,
    bands: Bands,
    floor_reflectance: NDArray[np.float64],
    picture: SkyPicture | None = None,
) -> tuple[WaterColumn, BandPhase]:
    """Return the column of water in bands, and the phase function of its first layer.

    ``picture`` is that of the sky, if one lights the water.
    """
    phases = mixtures.map(lambda mixture: _phase(description.water, mixture, bands))
    waters = mixtures.map(lambda mixture: mixture.water)
    light, surface = description.light, description.surface
    index, transmitted = surface.refractive_index, 1.0
    above = illuminant.above_surface if light.above_surface is None else light.above_surface
    zenith, azimuth, more, basis = light.zenith, light.azimuth, light.sky_radiance, None
    if picture is None:
        direct, diffuse = illuminant.direct_in(bands), illuminant.diffuse_in(bands)
    else:
        above, more, (x, y, z) = True, 0.0, picture.sun
        zenith, azimuth = math.degrees(math.acos(-z)), math.degrees(math.atan2(y, x))
        unit = 1.0 if illuminant.unit == RELATIVE else full_sun()
        basis = sky_basis(bands, picture.saturation) * unit
        # Rounding may leave less than nothing.
        direct, diffuse = (
            np.maximum(basis @ rgb, 0.0)
            for rgb in (picture.sun_irradiance, picture.without_sun.irradiance)
        )
        basis = basis * light.strength
    direct, diffuse = direct * light.strength, diffuse * light.strength
    waves = surface.slope_variance if surface.kind == WAVES else 0.0
    sun_cosine, in_air = float(in_water_cosine(zenith, index)), None
    sun = sun_travel_direction(zenith, azimuth, index)
    if waves:
        in_air = sun_travel_direction(zenith, azimuth, 1.0)
        sun = WaterSurface(index, waves).beam_below(in_air.tolist())
        sun_cosine = -float(sun[2])
    if above:
        cosine = math.cos(math.radians(zenith))
        transmitted -= float(WaterSurface(index, waves).reflectance(cosine))
    first, *deeper = (
        DeeperWater(top, water.a(bands.centres), water.b(bands.centres), phase)
        for top, water, phase in zip(waters.tops, waters.layers, phases.layers, strict=True)
    )
    column = WaterColumn(
        bands=bands,
        absorption=first.absorption,
        scattering=first.scattering,
        sun_irradiance=direct * transmitted,
        sun_cosine=sun_cosine,
        sun_direction=sun,
        sky_radiance=diffuse / math.pi + more * direct,
        floor_depth=description.floor.depth,
        floor_reflectance=floor_reflectance,
        surface=surface.kind,
        refractive_index=index,
        below=tuple(deeper),
        sky=light.sky if picture is None else UNIFORM,
        slope_variance=waves,
        sun_in_air=in_air,
        sky_picture=None if picture is None else picture.without_sun,
        sky_basis=basis,
    )
    return column, phases.layers[0]


def processes_of(
    described: WaterDescription, mixture: Mixture, switched_on: tuple[str, ...], bands: Bands
) -> tuple[InelasticProcess, ...]:
    """Return what changes the wavelength of light in a water.

    Raises
    ------
    InputError
        If its constituents are not known and would be needed.
    """
    constituents = mixture.constituents
    if constituents is None:
        fluorescent = [name for name in switched_on if name != "raman"]
        if fluorescent:
            raise InputError(
                f"inelastic light: {', '.join(fluorescent)} needs one water of known "
                f"constituents, bio: or case: or its amounts, not {mixture.water.name}"
                + ("; leave the second water out" if described.second else "")
            )
        constituents = Constituents()
    factor = described.absorption_factor * described.concentration
    found = inelastic_processes(constituents, EXCITATION, bands, switched_on)
    return tuple(
        process
        if process.name == "raman"
        else dataclasses.replace(process, coefficient=process.coefficient * factor)
        for process in found
    )
