"""The sum of a pixel once more, written by hand: what the pixel model is checked against."""

from __future__ import annotations

import numpy as np


def pixel(water, y_o, w, P, L_surface, L_beyond):
    """Radiance of a surface at distance P in water, L_beyond unoccluded behind it."""
    field = water.field
    through, together = np.exp(-field.c * P), np.exp(-field.cp * P)
    forward = np.maximum(together - through, 0.0)
    return water.path(y_o, w, P) + through * L_surface + forward * L_beyond
