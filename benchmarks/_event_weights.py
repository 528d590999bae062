"""The ten event weights that Gutierrez et al. (2008), §4.1, print for 500 nm, and ours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.water.bio_optics import Constituents
from ..uw_spectral.water.inelastic_processes import inelastic_processes

WAVELENGTH = 500.0
PRINTED = {
    "absorption by water": 2.51e-1,
    "Raman scattering": 1.21e-9,
    "absorption by minerals and detritus": 7.12e-2,
    "absorption by phytoplankton": 4.90e-3,
    "fluorescence of phytoplankton": 2.18e-3,
    "absorption by CDOM": 7.83e-2,
    "fluorescence of CDOM": 1.21e-2,
    "scattering by water": 7.44e-3,
    "scattering by minerals and detritus": 2.94e-1,
    "scattering by phytoplankton": 2.79e-1,
}
"""Share of each event in the interactions of a photon."""
A_WATER = 0.0257
"""Absorption by water at 500 nm of the paper's Table 1 (Smith & Baker), 1/m."""


@dataclass(frozen=True)
class Parameters:
    """Water that the printed weights belong to; the paper does not say which.

    Attributes
    ----------
    extinction : float
        1/m, from the weight of the absorption by water.
    constituents : Constituents
        Chlorophyll from its scattering 0.30 C^0.62 (550/λ), CDOM and detritus from their
        absorption with the paper's slopes, minerals from their scattering.
    """

    extinction: float
    constituents: Constituents


def parameters() -> Parameters:
    """Solve the paper's equations for the parameters behind its weights."""
    extinction = A_WATER / PRINTED["absorption by water"]
    b = PRINTED["scattering by phytoplankton"] * extinction
    cdom = (PRINTED["absorption by CDOM"] + PRINTED["fluorescence of CDOM"]) * extinction
    detritus = PRINTED["absorption by minerals and detritus"] * extinction
    minerals = PRINTED["scattering by minerals and detritus"] * extinction
    per_gram = Constituents(minerals=1.0).scatterings([WAVELENGTH])["minerals"][0]
    return Parameters(
        extinction,
        Constituents(
            chlorophyll=(b / 0.30 * WAVELENGTH / 550.0) ** (1.0 / 0.62),
            minerals=float(minerals / per_gram),
            cdom=cdom * math.exp(0.014 * (WAVELENGTH - 440.0)),
            detritus=detritus * math.exp(0.011 * (WAVELENGTH - 400.0)),
        ),
    )


def ours() -> dict[str, float]:
    """Weights of the same events in the water of :func:`parameters` by our model."""
    water = parameters().constituents
    nm = np.array([WAVELENGTH])
    absorbed, scattered = (
        {name: float(values[0]) for name, values in parts.items()}
        for parts in (water.absorptions(nm), water.scatterings(nm))
    )
    excitation, emission = Bands(nm, np.array([10.0])), Bands.uniform(50, 400.0, 800.0)
    processes = inelastic_processes(water, excitation, emission)
    events = {p.name: float(p.coefficient[0] * p.photons[0].sum()) for p in processes}
    total = sum(absorbed.values()) + sum(scattered.values()) + events["raman"]
    weights = (
        absorbed["water"], events["raman"], absorbed["detritus"] + absorbed["minerals"],
        absorbed["phytoplankton"] - events["chlorophyll"], events["chlorophyll"],
        absorbed["cdom"] - events["cdom"], events["cdom"], scattered["water"],
        scattered["minerals"], scattered["phytoplankton"],
    )  # fmt: skip
    return {name: w / total for name, w in zip(PRINTED, weights, strict=True)}
