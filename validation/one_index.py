"""What one refractive index for all wavelengths leaves out."""

from __future__ import annotations

import dataclasses
import math
import warnings

import numpy as np

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    in_water_cosine,
    refractive_index_QuanFry1995,
    sun_travel_direction,
)
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.pure_water import molecular_scattering
from .closed_form.internal_reflectance import diffuse_internal_reflectance

NM = np.array([400.0, 450.0, 500.0, 550.0, 600.0, 650.0, 700.0])


SUNS = (0.0, 30.0, 60.0)


WATERS = ("IB", "3C")


DEPTH, STREAMS = 5.0, 16


@dataclasses.dataclass(frozen=True)
class Row:
    """Quantities of one wavelength, and those that the constant index gives."""

    index: float
    transmittance: dict[float, float]
    refracted: float
    window: float
    internal: float


def row(index: float) -> Row:
    """Compute what depends on the index alone; angles in degrees, the sun at 60° refracted."""
    cosines = {zenith: math.cos(math.radians(zenith)) for zenith in (*SUNS, 80.0)}
    return Row(
        index,
        {z: 1 - float(fresnel_reflectance(cosine, index)) for z, cosine in cosines.items()},
        math.degrees(math.acos(float(in_water_cosine(60.0, index)))),
        math.degrees(math.asin(1 / index)),
        diffuse_internal_reflectance(index),
    )


def _solved(name: str, zenith: float, index: float) -> tuple[SolvedField, WaterColumn]:
    water, bands = Water.jerlov(name), Bands.at_wavelengths(NM)
    sky = parse_illuminant("clear-sky", zenith)
    transmitted = 1 - float(fresnel_reflectance(math.cos(math.radians(zenith)), index))
    column = WaterColumn(
        bands=bands,
        absorption=water.a(NM),
        scattering=water.b(NM),
        sun_irradiance=sky.direct_in(bands) * transmitted,
        sun_cosine=float(in_water_cosine(zenith, index)),
        sun_direction=sun_travel_direction(zenith, 90.0, index),
        sky_radiance=sky.diffuse_in(bands) / math.pi,
        floor_depth=math.inf,
        floor_reflectance=np.zeros(len(bands)),
        surface="flat",
        refractive_index=index,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DataWarning)
        phase: BandPhase = water.phase_model.for_bands(water.b(NM), molecular_scattering(NM))
    return column.solved_field(phase, STREAMS, modes=1), column


def light(name: str, zenith: float) -> dict[str, np.ndarray]:
    """Light of the solved field with the index of each wavelength over that with 1.34.

    Keys ``Ed``, ``Eu`` at 5 m and ``Kd`` from the surface to 10 % of the light; shape (n,).
    """

    def quantities(index: float) -> np.ndarray:
        field, column = _solved(name, zenith, index)
        y = math.log(10) / (1.2 * column.absorption)
        Ed = np.stack([field.Ed(depth) for depth in y.tolist()])[range(len(NM)), range(len(NM))]
        return np.stack([field.Ed(DEPTH), field.Eu(DEPTH), np.log(field.Ed(0.0) / Ed) / y])

    constant = quantities(REFRACTIVE_INDEX)
    varying = np.stack(
        [
            quantities(float(index))[:, band]
            for band, index in enumerate(refractive_index_QuanFry1995(NM))
        ],
        axis=1,
    )
    return dict(zip(("Ed", "Eu", "Kd"), varying / constant, strict=True))
