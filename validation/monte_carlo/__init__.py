"""Monte Carlo solver: the light field of plane-parallel water, photon by photon.

The independent truth that the closed forms are judged by. Nothing is
approximated but by the statistics: any phase function, a flat Fresnel surface,
a Lambertian floor, scattering that changes the wavelength. numpy suffices;
with numba the same steps run compiled. ``python -m validation``
is its command line.
"""

from .bio_optical import bio_optical_medium
from .medium import Constituent, InelasticInteraction, interactions
from .results import Estimate, Event, Light, MonteCarloResult
from .solver import BOUNDARY_EVENTS, numba_available, simulate

__all__ = [
    "BOUNDARY_EVENTS",
    "Constituent",
    "Estimate",
    "Event",
    "InelasticInteraction",
    "Light",
    "MonteCarloResult",
    "bio_optical_medium",
    "interactions",
    "numba_available",
    "simulate",
]
