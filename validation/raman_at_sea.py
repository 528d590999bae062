"""Raman light at and below the surface of case 1 water, solved, against what others fitted."""

from __future__ import annotations

import csv
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY
from ..uw_spectral.surface.refraction import REFRACTIVE_INDEX, fresnel_reflectance
from ..uw_spectral.transfer.inelastic_emission import inelastic_emission
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.inelastic_processes import EXCITATION, inelastic_processes
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.pure_water import pure_water_absorption
from ..validation.sunlight import entering
from .constituent_seas import SUN_ZENITH, column

CHLOROPHYLL = (0.03, 0.1, 0.3, 1.0)
_POPE_FRY_BEGINS = 420.0  # nm
_NADIR, _STREAMS, _WIDTH = (0.0, 0.0, -1.0), 16, 10.0


def published(quantity: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths in nm and values of a quantity of data/raman_validation.csv."""
    with (DATA_DIRECTORY / "raman_validation.csv").open(encoding="utf-8") as file:
        rows = [
            (float(row["wavelength_nm"]), float(row["value"]))
            for row in csv.DictReader(line for line in file if not line.startswith("#"))
            if row["quantity"] == quantity
        ]
    wavelengths, values = np.array(rows).T
    return wavelengths, values


def fields(
    chlorophyll: float, wavelengths: NDArray[np.float64], *, older: bool = False
) -> tuple[SolvedField, SolvedField]:
    """Elastic and Raman light of deep case 1 water, flat surface, clear sky, sun at 30°.

    With ``older`` pure water absorbs below 420 nm as Smith & Baker (1981) have it.
    """
    water = Constituents.case1(chlorophyll)
    emission = Bands(wavelengths, np.full(len(wavelengths), _WIDTH))

    def lit(bands: Bands) -> tuple[WaterColumn, BandPhase]:
        nm = bands.centres
        a = water.absorption(nm)
        if older:
            more = pure_water_absorption(nm, "smith_baker_1981") - pure_water_absorption(nm)
            a = a + np.where(nm < _POPE_FRY_BEGINS, more, 0.0)
        return column(bands, a, water.scattering(nm)), water.phase(nm)

    raman = inelastic_processes(water, EXCITATION, emission, ("raman",))
    light, phase = lit(EXCITATION)
    exciting = light.solved_field(phase, _STREAMS, modes=1)
    emitted = inelastic_emission(raman, exciting, EXCITATION, emission)
    light, phase = lit(emission)
    dark = dataclasses.replace(light, sun_irradiance=0.0, sky_radiance=0.0)
    return light.solved_field(phase, _STREAMS), dark.solved_field(phase, _STREAMS, emitted)


def fraction(chlorophyll: float, wavelength: float, depth: float) -> float:
    """Fraction of Raman light in the radiance seen straight down."""
    elastic, raman = fields(chlorophyll, np.array([wavelength]))
    changed = float(raman.radiance(depth, _NADIR)[0])
    return changed / (changed + float(elastic.radiance(depth, _NADIR)[0]))


def at_the_surface(chlorophyll: float, *, older: bool = False) -> tuple[NDArray, NDArray, NDArray]:
    """Wavelengths, and Raman over elastic light that leaves the water: ours, Lee et al. (2013).

    With the older absorption of pure water see :func:`fields`.
    """
    wavelengths, alpha = published("alpha")
    beta1, beta2 = (published(name)[1] for name in ("beta1", "beta2"))
    every = np.union1d(wavelengths, [440.0, 550.0])
    elastic, raman = fields(chlorophyll, every, older=older)
    upwelling, changed = (each.radiance(0.0, _NADIR) for each in (elastic, raman))
    # Out of the water a radiance loses 1/n² and what the surface reflects; Ed gains the sky's.
    leaving = (1.0 - float(fresnel_reflectance(1.0))) / REFRACTIVE_INDEX**2
    above = elastic.light.E / entering(SUN_ZENITH)
    above = above + math.pi * np.asarray(elastic.light.sky.level)
    reflectance = leaving * (upwelling + changed) / above
    blue, green = np.interp([440.0, 550.0], every, reflectance)
    fitted = alpha * blue / green + beta1 * green**beta2
    return wavelengths, (changed / upwelling)[np.isin(every, wavelengths)], fitted
