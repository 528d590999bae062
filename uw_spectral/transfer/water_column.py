"""The water column of a scene: every optical quantity, resolved for the bands.

It is the one hand-over from the optics to whoever draws: the closed form, the
Cycles reference and the real-time groups all read these arrays.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError
from ..spectra.bands import Bands
from ..surface.refraction import diffuse_internal_reflectance, diffuse_transmittance
from ..water.phase import BandPhase
from .light_field import LightField, solve_light_field

SURFACES = ("none", "flat", "waves")


@dataclass(frozen=True, eq=False)
class WaterColumn(ComparedByContent):
    """Plane-parallel water, its light and its floor, per band.

    Parameters
    ----------
    bands : Bands
        The n bands.
    absorption, scattering : array, shape (n,)
        Coefficients, 1/m.
    sun_irradiance : array, shape (n,)
        Direct downwelling (horizontal) irradiance of the sun just below the surface.
    sun_cosine : float
        Cosine of the in-water sun zenith angle.
    sun_direction : array, shape (3,)
        Direction the sunlight travels to in the water; x, y horizontal, z up.
    sky_radiance : array, shape (n,)
        Radiance of the uniform sky, in air.
    floor_depth : float
        Depth of the floor in m; infinite for deep water.
    floor_reflectance : array, shape (n,)
        Reflectance of the Lambertian floor.
    surface : str
        ``"none"`` (index-matched, sky radiance enters unchanged), ``"flat"``, or
        ``"waves"``, whose light is that of a flat surface on average.
    refractive_index : float
        Of the water against air.

    Raises
    ------
    InputError
        If a quantity is negative or not finite, or the surface is unknown.
    """

    bands: Bands
    absorption: NDArray[np.float64]
    scattering: NDArray[np.float64]
    sun_irradiance: NDArray[np.float64]
    sun_cosine: float
    sun_direction: NDArray[np.float64]
    sky_radiance: NDArray[np.float64]
    floor_depth: float
    floor_reflectance: NDArray[np.float64]
    surface: str
    refractive_index: float

    def __post_init__(self) -> None:
        for name in (
            "absorption",
            "scattering",
            "sun_irradiance",
            "sky_radiance",
            "floor_reflectance",
        ):
            values = np.broadcast_to(constant(getattr(self, name)), len(self.bands))
            bad = ~(np.isfinite(values) & (values >= 0))
            if bad.any():
                raise InputError(
                    f"{name.replace('_', ' ')} is {values[bad][0]:g} at "
                    f"{self.bands.centres[bad][0]:g} nm; it must be a finite number, not negative"
                )
            object.__setattr__(self, name, values)
        object.__setattr__(self, "sun_direction", constant(self.sun_direction))
        if np.any(self.floor_reflectance > 1):
            raise InputError("floor reflectance must be 0 to 1 in every band")
        if self.surface not in SURFACES:
            raise InputError(f"surface must be one of {', '.join(SURFACES)}, got {self.surface!r}")
        if not self.floor_depth > 0:
            raise InputError(f"floor depth must be positive, got {self.floor_depth:g} m")

    @property
    def reflects(self) -> bool:
        """Whether there is a surface that refracts and reflects."""
        return self.surface != "none"

    @property
    def attenuation(self) -> NDArray[np.float64]:
        """Extinction c = a + b, 1/m."""
        return self.absorption + self.scattering

    @property
    def decay(self) -> NDArray[np.float64]:
        """Lower bound of the rate at which light dies away with distance, 1/m.

        Half the geometric mean of a and c, which lies below the asymptotic
        diffuse attenuation for every phase function that scatters forward.
        """
        return 0.5 * np.sqrt(self.absorption * self.attenuation)

    def light_field(self, phase: BandPhase) -> LightField:
        """Return the light field of the column for a phase function, solved once for both.

        Examples
        --------
        >>> from ..water.phase import parse_phase
        >>> column = WaterColumn(Bands.uniform(1), 0.05, 0.1, 1.0, 1.0, (0, 0, -1), 0.0,
        ...                      math.inf, 0.0, "none", 1.34)
        >>> column.light_field(parse_phase("hg:0.8").for_bands([0.1])).Ed(5.0).round(2)
        array([0.74])
        """
        return _light_field(self, phase)


@functools.lru_cache(maxsize=64)
def _light_field(column: WaterColumn, phase: BandPhase) -> LightField:
    n, flat = column.refractive_index, column.reflects
    return solve_light_field(
        column.absorption,
        column.scattering,
        phase.chi1,
        phase.chi2,
        column.sun_irradiance,
        column.sun_cosine,
        E_sky=math.pi * column.sky_radiance * (diffuse_transmittance(n) if flat else 1.0),
        R=diffuse_internal_reflectance(n) if flat else 0.0,
        r=column.floor_reflectance,
        y_f=column.floor_depth,
    )
