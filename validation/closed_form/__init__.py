"""The papers' way: analytic multiple scattering, short enough for shader nodes.

Nothing outside asks it but its node group, its engine and what is compared with it; the light
of the water is the solved field of `uw_spectral.transfer`.
"""

from .closed_form import ClosedForm, solve_closed_form
from .light_field import LightField, TwoStreamWater, light_field_of, solve_light_field
from .one_lobe import PlainLight, plain_water
from .unoccluded_water import UnoccludedWater

__all__ = [
    "ClosedForm",
    "LightField",
    "PlainLight",
    "TwoStreamWater",
    "UnoccludedWater",
    "light_field_of",
    "plain_water",
    "solve_closed_form",
    "solve_light_field",
]
