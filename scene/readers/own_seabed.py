"""Whether an added floor is that of the scene: two seabeds send up different light."""

from __future__ import annotations

import math

import numpy as np

from ...settings.render_plan import RenderPlan
from ...uw_spectral.spectra.reflectance import uplift_basis
from .surroundings import Ground

_APART = 0.1, 0.5  # of the depth, and m, from which two seabeds are told apart
_BRIGHTER = 1.4  # times from which their light is


def floor_note(plan: RenderPlan, own: Ground | None) -> str:
    """Return what to know of an added floor beside the scene's own seabed.

    The light of the water is that over the added floor, wherever the scene's own lies: EEVEE
    takes it for endless, Cycles traces both. Empty where they are alike, or there is only one.
    """
    depth = plan.column.floor_depth
    if not math.isfinite(depth) or own is None:
        return ""
    reflects = float(plan.column.floor_reflectance.mean())
    own_reflects = float(np.clip(uplift_basis(plan.bands) @ np.array(own.colour), 0.0, 1.0).mean())
    ratio = max(reflects, 1e-3) / max(own_reflects, 1e-3)
    apart = abs(own.depth - depth) > max(_APART[0] * depth, _APART[1])
    if not apart and 1.0 / _BRIGHTER < ratio < _BRIGHTER:
        return ""
    return (
        f"the added floor, {depth:.3g} m deep, reflects {reflects:.2g}, and the scene's own "
        f"seabed, {own.depth:.3g} m deep, {own_reflects:.2g}: the water is lit by the added one, "
        "and the engines differ; give --floor-depth 0, or depth and reflectance of the scene's own"
    )
