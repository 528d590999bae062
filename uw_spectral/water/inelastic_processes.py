"""Processes that change the wavelength of light in water: Raman scattering and fluorescence.

A process is a coefficient per excitation band and a redistribution matrix in photons;
:mod:`..transfer.inelastic_emission` drives it with the light in the water.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import constant
from ..errors import InputError, unknown_name
from ..spectra.bands import Bands
from ..spectra.spectrum import shipped_table
from .bio_optics import Constituents
from .diffuse_attenuation import checked_coefficient
from .phase import PhaseFunction
from .phase_functions import EinsteinSmoluchowski, Isotropic

PROCESSES = ("raman", "chlorophyll", "cdom")
RAMAN_PHASE = EinsteinSmoluchowski(0.53)
"""(1 + 0.53 cos²)/(4π 1.177), as the Ocean Optics Web Book has it."""

# HydroLight, energy units, 1/m at 488 nm; exponent of J. S. Bartlett et al., Appl. Opt. 37, 3324
# (1998), in energy units too.
_RAMAN_488, _RAMAN_EXPONENT = 2.6e-4, 5.5
# G. E. Walrafen, J. Chem. Phys. 47, 114 (1967): amplitude, shift and full width in 1/cm.
RAMAN_LINES = np.array(
    [(0.41, 3250.0, 210.0), (0.39, 3425.0, 175.0), (0.10, 3530.0, 140.0), (0.10, 3625.0, 140.0)]
)
# Ocean Optics Web Book, Chlorophyll Fluorescence: fractions of the photons, centres and standard
# deviations, nm, of photosystem II and of the shoulder, mostly of photosystem I. One line at
# 685 nm, as of C. D. Mobley, Light and Water (1994), leaves the shoulder out.
_CHLOROPHYLL_LINES = ((0.75, 685.0, 10.6), (0.25, 730.0, 21.2))
_CHLOROPHYLL_EXCITATION = (370.0, 690.0)
EXCITATION = Bands.uniform(20, 300.0, 700.0)
"""Bands of the light that excites: no process of ours starts elsewhere."""
# S. K. Hawes (1992), fulvic acid FA7; B1, B2 in 1/nm.
_A1, _A2, _B1, _B2 = 0.470, 0.407, 8.077e-4, -4.57e-4
_FULL_WIDTH = 2 * math.sqrt(2 * math.log(2))
_NODES, _NODE_WEIGHTS = np.polynomial.legendre.leggauss(8)
_error_function = np.vectorize(math.erf, otypes=[float])


@dataclass(frozen=True, eq=False)
class InelasticProcess:
    """One way in which photons change wavelength, on bands."""

    name: str  #: ``"raman"``, ``"chlorophyll"`` or ``"cdom"``.
    #: b_I: events per metre of a photon in each excitation band, 1/m, (n,). Those of fluorescence
    #: are part of the absorption of the water; those of Raman scattering, 3e-4 1/m, come on top of
    #: it.
    coefficient: NDArray[np.float64]
    #: f: photons that come out in each emission band per event, (n, k). A row adds up to the
    #: quantum yield, 1 for Raman, as far as the bands reach.
    photons: NDArray[np.float64]
    phase: PhaseFunction  #: Where they go.

    def energy_matrix(self, excitation: Bands, emission: Bands) -> NDArray[np.float64]:
        """Emitted power per spectral scalar irradiance, 1/m, shape (n, k).

        The power that leaves a cubic metre in emission band j, per nm, is
        ``Σ_i E0_i matrix_ij``, E0 per nm: photons times energy per photon,
        λ_i/λ_j, times the widths Δλ_i/Δλ_j.
        """
        ratio = excitation.centres[:, None] / emission.centres
        widths = excitation.widths[:, None] / emission.widths
        return self.coefficient[:, None] * self.photons * ratio * widths


def energy_matrix(
    processes: Sequence[InelasticProcess], excitation: Bands, emission: Bands
) -> NDArray[np.float64]:
    """Emitted power per spectral scalar irradiance of all processes together, shape (n, k).

    See :meth:`InelasticProcess.energy_matrix`; zeros for no process.

    Raises
    ------
    InputError
        If a process is on other bands.
    """
    matrix = np.zeros((len(excitation), len(emission)))
    for process in processes:
        if process.photons.shape != matrix.shape:
            raise InputError(
                f"inelastic {process.name}: the matrix has shape {process.photons.shape} for "
                f"{len(excitation)} excitation and {len(emission)} emission bands"
            )
        matrix += process.energy_matrix(excitation, emission)
    return matrix


def raman_coefficient(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Raman scattering coefficient of water in energy units, 1/m, by excitation wavelength.

    ``2.6e-4 (488/λ')^5.5``: the power that comes out per metre and scalar irradiance.
    """
    nm = _checked(wavelengths)
    return _RAMAN_488 * (488.0 / nm) ** _RAMAN_EXPONENT


def raman_emission(excitation: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectrum of Raman scattered photons, 1/nm; integrates to 1.

    Walrafen's four Gaussians of the wavenumber shift 1e7/λ' - 1e7/λ, times the
    Jacobian 1e7/λ² of the emission wavelength.
    """
    nm = _checked(wavelengths)
    shift = 1e7 / excitation - 1e7 / nm
    amplitude, centre, width = RAMAN_LINES.T
    sigma = width / _FULL_WIDTH
    peaks = np.exp(-0.5 * ((shift[:, None] - centre) / sigma) ** 2) / (
        sigma * math.sqrt(2 * math.pi)
    )
    return 1e7 / nm**2 * (peaks @ amplitude) / amplitude.sum()


def chlorophyll_emission(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectrum of the photons that chlorophyll emits, 1/nm; integrates to 1.

    Three quarters in a Gaussian at 685 nm, full width 25 nm at half of it, and a quarter in its
    shoulder at 730 nm, 50 nm wide.
    """
    x = _checked(wavelengths)[:, None]
    fractions, centres, sigmas = np.transpose(_CHLOROPHYLL_LINES)
    lines = np.exp(-0.5 * ((x - centres) / sigmas) ** 2) / (sigmas * math.sqrt(2 * math.pi))
    return lines @ fractions


def cdom_emission(excitation: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectral quantum efficiency η(λ', λ) of CDOM, 1/nm (Hawes 1992, sample FA7).

    Zero for excitation outside 310 to 550 nm, and at wavelengths shorter than it.
    """
    nm = _checked(wavelengths)
    table = shipped_table("cdom_fluorescence_hawes_fa7.csv")
    efficiency = table.spectrum("A0", "fluorescence of CDOM").at_or_zero([excitation])[0]
    width = 0.6 * (_A2 / excitation + _B2)
    x = (1 / nm - _A1 / excitation - _B1) / width
    return np.where(nm > excitation, efficiency * np.exp(-(x**2)), 0.0)


# The water does not change it; frames of an animation share it.
@functools.lru_cache(maxsize=8)
def raman_process(excitation: Bands, emission: Bands) -> InelasticProcess:
    """Raman scattering by water between two sets of bands; one photon out per event.

    The coefficient of events is that in energy units times the mean λ/λ',
    so that both photons and :func:`raman_coefficient` are kept.
    """
    edges = _edges(emission)
    amplitude, centre, width = RAMAN_LINES.T
    scale = width / _FULL_WIDTH * math.sqrt(2)

    def below(nm: NDArray[np.float64], from_nm: NDArray[np.float64]) -> NDArray[np.float64]:
        shift = 1e7 / from_nm[:, None, None] - 1e7 / nm
        parts = 0.5 * (1 + _error_function((shift[..., None] - centre) / scale))
        return parts @ amplitude / amplitude.sum()

    photons = np.zeros((len(excitation), len(emission)))
    for node, weight in zip(_NODES, _NODE_WEIGHTS / 2, strict=True):
        fractions = below(edges, excitation.centres + node * excitation.widths / 2)
        photons += weight * (fractions[..., 1] - fractions[..., 0])
    # λ/λ' of the mean shift: 1/(1 - λ' shift).
    mean_shift = float(amplitude @ centre / amplitude.sum())
    stretch = 1 / (1 - excitation.centres * mean_shift * 1e-7)
    coefficient = constant(raman_coefficient(excitation.centres) * stretch)
    return InelasticProcess("raman", coefficient, constant(photons), RAMAN_PHASE)


def chlorophyll_process(
    absorption: ArrayLike, excitation: Bands, emission: Bands, quantum_yield: float
) -> InelasticProcess:
    """Fluorescence of chlorophyll between two sets of bands.

    ``absorption`` (n,) is that of the phytoplankton in the excitation bands, 1/m; ``quantum_yield``
    are photons out per photon absorbed between 370 and 690 nm.
    """
    low, high = _CHLOROPHYLL_EXCITATION
    excites = (excitation.centres >= low) & (excitation.centres <= high)
    fractions, centres, sigmas = np.transpose(_CHLOROPHYLL_LINES)
    below = 0.5 * _error_function((_edges(emission)[..., None] - centres) / (sigmas * math.sqrt(2)))
    line = (below[:, 1] - below[:, 0]) @ fractions
    return InelasticProcess(
        "chlorophyll",
        _coefficient(absorption, excitation, "phytoplankton") * excites,
        np.tile(quantum_yield * line, (len(excitation), 1)),
        Isotropic(),
    )


@functools.cache
def largest_cdom_yield() -> float:
    """Photons that CDOM emits per photon absorbed, where light excites it best (Hawes 1992)."""
    excited = shipped_table("cdom_fluorescence_hawes_fa7.csv").columns["wavelength_nm"]
    grid = np.arange(excited[0], 1500.0)
    return max(float(cdom_emission(nm, grid).sum()) for nm in excited)


def cdom_process(
    absorption: ArrayLike, excitation: Bands, emission: Bands, quantum_yield: float | None = None
) -> InelasticProcess:
    """Fluorescence of CDOM between two sets of bands.

    ``absorption`` (n,) is that of the CDOM in the excitation bands, 1/m; ``quantum_yield`` are
    photons out per photon absorbed where light excites it best, None for Hawes's.
    """
    factor = 1.0 if quantum_yield is None else quantum_yield / largest_cdom_yield()
    half = emission.widths[:, None] / 2
    grid = emission.centres[:, None] + half * _NODES
    photons = np.stack(
        [
            (cdom_emission(nm, grid.ravel()).reshape(grid.shape) * half) @ _NODE_WEIGHTS
            for nm in excitation.centres
        ]
    )
    return InelasticProcess(
        "cdom", _coefficient(absorption, excitation, "CDOM"), factor * photons, Isotropic()
    )


def parse_processes(text: str) -> tuple[str, ...]:
    """Read which of :data:`PROCESSES` a comma-separated option switches on, or ``"all"``.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    names = [part.strip().lower() for part in text.split(",") if part.strip()]
    if names == ["all"]:
        return PROCESSES
    for name in names:
        if name not in PROCESSES:
            raise unknown_name("inelastic process", name, (*PROCESSES, "all"))
    return tuple(name for name in PROCESSES if name in names)


def inelastic_processes(
    constituents: Constituents,
    excitation: Bands,
    emission: Bands,
    switched_on: Sequence[str] = PROCESSES,
) -> tuple[InelasticProcess, ...]:
    """Return the processes of a bio-optical water.

    The excitation should reach down to 300 nm, in bands of at most 20 nm.

    Raises
    ------
    InputError
        If a process is unknown or a band lies outside the tables.
    """
    for name in switched_on:
        if name not in PROCESSES:
            raise unknown_name("inelastic process", name, PROCESSES)
    parts = constituents.absorptions(excitation.centres)
    makers = {
        "raman": lambda: raman_process(excitation, emission),
        "chlorophyll": lambda: chlorophyll_process(
            parts["phytoplankton"], excitation, emission, constituents.chlorophyll_yield
        ),
        "cdom": lambda: cdom_process(parts["cdom"], excitation, emission, constituents.cdom_yield),
    }
    return tuple(makers[name]() for name in PROCESSES if name in switched_on)


def _checked(wavelengths: ArrayLike) -> NDArray[np.float64]:
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    if not np.all(np.isfinite(nm) & (nm > 0)):
        raise InputError("inelastic scattering: wavelengths must be finite and positive, in nm")
    return nm


def _edges(bands: Bands) -> NDArray[np.float64]:
    """Lower and upper edge of each band, shape (k, 2)."""
    half = bands.widths / 2
    return np.stack([bands.centres - half, bands.centres + half], axis=-1)


def _coefficient(values: ArrayLike, bands: Bands, name: str) -> NDArray[np.float64]:
    return np.broadcast_to(checked_coefficient(values, f"absorption of {name}"), (len(bands),))
