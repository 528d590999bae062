"""Tone curves: from scene-linear light to the light of a display. Measured outputs stay linear."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import constant
from ..errors import unknown_name
from .spectrum import shipped_table

MIDDLE_GREY = 0.18
"""Reflectance that a curve leaves where it is."""
STANDARD, AGX = "standard", "agx"
CAMERA_CURVES = ("nikon-d7000", "canon-5d-mark-ii")
"""Measured curves, see data/camera_tone_curves.csv."""
TONES = (STANDARD, AGX, *CAMERA_CURVES)
CONTRASTS = ("very-low", "low", "medium-low", "medium", "medium-high", "high", "very-high")
MEDIUM = "medium"
_SEARCHED = 1e-4


@dataclass(frozen=True, eq=False)
class ToneCurve:
    """A monotone curve from scene-linear values to display-linear ones, for each channel.

    Examples
    --------
    >>> curve = camera_curve("nikon-d7000")
    >>> round(float(curve(0.18)), 4), float(curve(curve.white))
    (0.18, 1.0)
    """

    #: Increasing nodes; between them cubics that do not overshoot (Fritsch & Carlson 1980), beyond
    #: them the ends, (k,).
    values: NDArray[np.float64]
    outputs: NDArray[np.float64]

    @property
    def white(self) -> float:
        """Value from which on everything is white."""
        return float(self.values[-1])

    def __call__(self, rgb: ArrayLike) -> NDArray[np.float64]:
        """Return display-linear values, of any shape."""
        return _monotone_cubic(np.asarray(rgb, dtype=np.float64), self.values, self.outputs)


@functools.cache
def camera_curve(name: str) -> ToneCurve:
    """Return the measured curve of a camera, exposed so that middle grey stays middle grey.

    Raises
    ------
    InputError
        If there is no such curve.
    """
    if name not in CAMERA_CURVES:
        raise unknown_name("tone curve", name, CAMERA_CURVES)
    table = shipped_table("camera_tone_curves.csv").columns
    raw, picture = table[f"{name}:raw"], table[f"{name}:picture"]
    grid = np.arange(0.0, 1.0, _SEARCHED)
    middle = float(np.interp(MIDDLE_GREY, _monotone_cubic(grid, raw, picture), grid))
    return ToneCurve(constant(raw * (MIDDLE_GREY / middle)), constant(picture))


def _monotone_cubic(
    x: NDArray[np.float64], nodes: NDArray[np.float64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Interpolate by Hermite cubics with the slopes of Fritsch and Carlson."""
    step = np.diff(nodes)
    secant = np.diff(values) / step
    slope = np.concatenate([secant[:1], (secant[:-1] + secant[1:]) / 2, secant[-1:]])
    one, other = slope[:-1] / secant, slope[1:] / secant
    steep = np.maximum(np.hypot(one, other) / 3.0, 1.0)
    slope = slope / np.maximum(np.append(steep, 1.0), np.append(1.0, steep))
    start, end = slope[:-1], slope[1:]
    x = np.clip(x, nodes[0], nodes[-1])
    k = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, len(step) - 1)
    t, h = (x - nodes[k]) / step[k], step[k]
    return (
        (1 + 2 * t) * (1 - t) ** 2 * values[k]
        + t * (1 - t) ** 2 * h * start[k]
        + t * t * (3 - 2 * t) * values[k + 1]
        - t * t * (1 - t) * h * end[k]
    )
