"""A camera in the water: its bands, its colours, and what a diver reads off."""

from .optimised_bands import fitted_reduction
from .readouts import Readouts, Viewpoint, make_viewpoint

__all__ = ["Readouts", "Viewpoint", "fitted_reduction", "make_viewpoint"]
