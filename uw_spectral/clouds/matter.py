"""What clouds are made of: a constituent of waters, or bubbles, at a concentration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError, unknown_name
from ..water.bio_optics import Constituents
from ..water.bubbles import DIFFRACTED, BubblePhase, bubble_scattering
from ..water.phase import PhaseFunction, quadrature

MINERALS, PHYTOPLANKTON, BUBBLES = "minerals", "phytoplankton", "bubbles"
UNITS = {MINERALS: "g/m³", PHYTOPLANKTON: "mg/m³", BUBBLES: "l/m³"}
"""Unit of the concentration, by constituent: those of :class:`.Constituents`, and of air."""
MOST_AIR = 300.0
"""Litres of air in a cubic metre above which bubbles touch, and are foam."""
_HALVINGS, _FAINTEST = 60, 1e-6


@dataclass(frozen=True, eq=False)
class SuspendedMatter(ComparedByContent):
    """Matter besides the water, where a cloud is densest."""

    #: What it adds to the coefficients of the water, 1/m, (n,).
    absorption: NDArray[np.float64]
    scattering: NDArray[np.float64]
    phase: PhaseFunction

    def __post_init__(self) -> None:
        for name in ("absorption", "scattering"):
            values = constant(getattr(self, name))
            if not np.all(np.isfinite(values) & (values >= 0)):
                raise InputError(f"{name} of a cloud must be finite and not negative")
            object.__setattr__(self, name, values)

    @property
    def extinction(self) -> NDArray[np.float64]:
        """Sum of both, 1/m, shape (n,)."""
        return self.absorption + self.scattering


def suspended_matter(
    constituent: str, concentration: float, wavelengths: ArrayLike
) -> SuspendedMatter:
    """Return a constituent at a concentration.

    The scattering of phytoplankton grows less than its chlorophyll does.

    What bubbles only diffract counts as not scattered, see :mod:`.bubbles`.

    Raises
    ------
    InputError
        If there is no such constituent, or the concentration is out of range.
    """
    if constituent not in UNITS:
        raise unknown_name("constituent of a cloud", constituent, UNITS)
    if constituent == BUBBLES:
        return _bubbles(concentration, np.size(wavelengths))
    field = "chlorophyll" if constituent == PHYTOPLANKTON else MINERALS
    held = Constituents(**{field: concentration})
    return SuspendedMatter(
        held.absorptions(wavelengths)[constituent],
        held.scatterings(wavelengths)[constituent],
        held.phases[constituent],
    )


def _bubbles(concentration: float, bands: int) -> SuspendedMatter:
    if not 0.0 <= concentration <= MOST_AIR:
        raise InputError(
            f"bubbles must be 0 to {MOST_AIR:g} l/m³, got {concentration:g}; more is foam"
        )
    b = (1.0 - DIFFRACTED) * bubble_scattering(1e-3 * concentration)
    return SuspendedMatter(np.zeros(bands), np.full(bands, b), BubblePhase())


@dataclass(frozen=True)
class BluntPhase:
    """A phase function whose forward peak counts as not scattered at all.

    What is above a ceiling is cut away; the rest is scaled to integrate to 1.
    """

    peak: float  #: Fraction that is cut away: χ2, as the delta scaling of the closed form has it.
    ceiling: float  #: Largest value of the rest, 1/sr.
    asymmetry: float  #: Mean cosine of the rest.


def blunt_phase(phase: PhaseFunction) -> BluntPhase:
    """Cut the forward peak off a phase function."""
    peak = float(phase.moments(2)[1])
    angles, solid_angles = quadrature(phase.kinks)
    p = np.asarray(phase.per_steradian(np.sin(angles / 2.0) ** 2), dtype=np.float64)

    def kept(ceiling: float, of: ArrayLike = 1.0) -> float:
        return float(np.sum(np.minimum(p, ceiling) * of * solid_angles))

    low, high = 0.0, float(p.max())
    for _ in range(_HALVINGS):
        middle = math.sqrt(max(low, _FAINTEST) * high)
        low, high = (middle, high) if kept(middle) < 1.0 - peak else (low, middle)
    return BluntPhase(peak, high / (1.0 - peak), kept(high, np.cos(angles)) / (1.0 - peak))
