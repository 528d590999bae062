"""Whether Cycles finds the daylight at a camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...uw_spectral.transfer.water_column import WaterColumn

_MOST = 15.0
"""Lengths of scattering below the surface, from which on usual samples find too little of it:
.02 to .6 of it 15 to 29 lengths deep at 256 samples, .9 to 1.2 at 19 with 8192."""


def notes(column: WaterColumn, depths: Sequence[float]) -> list[str]:
    """Say if cameras are so deep, m, that rays find the surface only by very many samples."""
    deepest = max([0.0, *depths])
    if not (np.any(column.sun_irradiance > 0) or np.any(column.sky_radiance > 0)):
        return []
    tops = [0.0, *(layer.top for layer in column.below)]
    rates = [column.scattering, *(layer.scattering for layer in column.below)]
    ends = np.clip([*tops[1:], deepest], 0.0, deepest)
    passed = sum(
        rate * max(end - top, 0.0) for rate, top, end in zip(rates, tops, ends, strict=True)
    )
    most = float(np.max(passed))
    if most < _MOST:
        return []
    return [
        f"the camera is {most:.0f} lengths of scattering below the surface, in the band with most; "
        "Cycles finds daylight there by very many samples only, and is too dark with fewer: give "
        "more samples, or take EEVEE"
    ]
