"""Bubbles of air in the sea: how much light they scatter, and where to.

They are far larger than the wavelength, so light of all colours is scattered alike. Half of what
the theory of diffraction counts as scattered turns by less than a tenth of a degree: no camera
tells that from light that goes straight on, and it counts as such here.
"""

from __future__ import annotations

from dataclasses import dataclass

from .phase_functions import TabulatedPhase

HINZE_RADIUS = 1.0e-3
"""Radius in m above which the turbulence of a breaker tears bubbles apart, and buoyancy lifts them
out of its plume within a second or two: G. B. Deane & M. D. Stokes, Nature 418, 839 (2002);
0.7 to 1.7 mm, Deane, Stokes & Callaghan, J. Phys. Oceanogr. 46, 975 (2016)."""
SMALLEST_RADIUS = 2.0e-5
"""Radius in m down to which bubbles of a plume are counted."""
SIZE_SLOPE = -1.5
"""Power of the radius that their number follows below the Hinze radius: Deane & Stokes (2002)."""
EFFICIENCY = 2.0
"""Cross-section over the area of the disc, of what is far larger than the wavelength."""
DIFFRACTED = 0.5
"""Fraction of the scattered light that is only diffracted, as by a disc."""


def sauter_radius() -> float:
    """Return the radius, m, of bubbles with the volume per area of those of a plume."""

    def moment(power: float) -> float:
        power += SIZE_SLOPE + 1.0
        return (HINZE_RADIUS**power - SMALLEST_RADIUS**power) / power

    return moment(3.0) / moment(2.0)


def bubble_scattering(void_fraction: float) -> float:
    """Return the scattering coefficient, 1/m, of the volume of air in a volume of water and air.

    Diffraction is included.

    b = 3 Q f / (4 r), r the Sauter radius: areas and volumes of spheres.
    """
    return 3.0 * EFFICIENCY * void_fraction / (4.0 * sauter_radius())


@dataclass(frozen=True)
class BubblePhase(TabulatedPhase):
    """Phase function of bubbles in the sea, without what is only diffracted.

    Lorenz-Mie series of clean spheres of the relative index 1 / 1.34, averaged over the sizes of a
    plume, and spread by 6°, since bubbles of about a millimetre are flattened and tumble. Spheres
    mirror totally within 83° of scattering angle and hardly beyond, which is a step; this is a
    slope there, with the light of a step. Diffraction included, g is 0.84 and bb/b 0.015: clean
    spheres have 0.012, and an organic film makes that up to five times as much (X. Zhang,
    M. Lewis & B. Johnson, Appl. Opt. 37, 6525 (1998)).
    """

    TABLE = "bubble_phase_function.csv"
