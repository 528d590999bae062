"""Reach of the volume of EEVEE that draws shafts of light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...node_groups.realtime_volume import ANISOTROPY
from ...uw_spectral.transfer.channel_pixel import along_rays
from ...uw_spectral.transfer.channel_tables import ChannelTables
from ...uw_spectral.water.phase_functions import HenyeyGreenstein

# Shafts end where the attenuation band keeps 2 % of its light, or soon after the scene does.
_OPTICAL_DEPTH = 4.0
LONGEST = 200.0
# Share by which the volume may dim what is behind it; below, the rounding of its
# transmittance costs more light than that (8 to 14 % at 0.003, 4 to 6 % at 0.02).
_OPACITY = 0.02


@dataclass(frozen=True)
class ShaftRange:
    """Reach of the froxel volume in m, and the factor that makes it thin."""

    end: float
    scale: float


def shaft_range(
    light: ChannelTables, sun: Sequence[float], depth: float, attenuation: float
) -> ShaftRange:
    """Reach of the froxels, and a scale that keeps their volume thin away from the sun.

    ``depth`` is the camera's, m, ``attenuation`` the least attenuation of the bands, 1/m.
    """
    end = min(_OPTICAL_DEPTH / max(attenuation, 1e-6), LONGEST)
    angles = np.radians(np.linspace(5.0, 175.0, 35))
    ahead = np.asarray(sun, dtype=np.float64)
    across = np.cross(ahead, [1.0, 0.0, 0.0] if abs(ahead[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    w = list((-np.cos(angles)[:, None] * ahead + np.sin(angles)[:, None] * across).T[..., None])
    ray = along_rays(light, sun, w)
    y_o = np.full((len(angles), 1), max(depth, 0.0))
    y_e = np.maximum(y_o - w[2] * end, 0.0)
    P = np.where(w[2] > 0, np.minimum(end, y_o / np.maximum(w[2], 1e-6)), end)
    seen = np.maximum(ray.single_scattering(y_o, y_e, w, P), 0.0).max(axis=1)
    opacity = float((seen / HenyeyGreenstein(ANISOTROPY)(np.cos(angles))).max())
    return ShaftRange(end, _OPACITY / max(opacity, 1e-12))
