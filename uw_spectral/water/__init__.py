"""What is in the water and what it does to light: absorption, scattering, wavelength changes."""

from .bio_optics import Constituents
from .named import list_waters, parse_water
from .optical_properties import JERLOV_TYPES, Water
from .phase import BandPhase
from .phase_functions import FournierForand, HenyeyGreenstein, parse_phase
from .profile import DepthProfile, read_profile
from .pure_water import molecular_scattering

__all__ = [
    "JERLOV_TYPES",
    "BandPhase",
    "Constituents",
    "DepthProfile",
    "FournierForand",
    "HenyeyGreenstein",
    "Water",
    "list_waters",
    "molecular_scattering",
    "parse_phase",
    "parse_water",
    "read_profile",
]
