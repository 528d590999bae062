"""The water column of a scene: every optical quantity, resolved for the bands.

It is the one hand-over from the optics to whoever draws: the Cycles reference and the
real-time groups read these arrays.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent, constant
from ..errors import InputError, unknown_name
from ..spectra.bands import Bands
from ..surface.refraction import direction_in_air
from ..water.phase import BandPhase
from .discrete_ordinates import STREAMS, Emission, OpticalLayer, solve_discrete_ordinates
from .rough_surface import WaterSurface
from .sky import SKIES, UNIFORM, Sky
from .sky_picture import PictureSky, SkyPicture
from .solved_field import SolvedField

WAVES = "waves"
SURFACES = ("none", "flat", WAVES)
FEW_STREAMS = 16
"""Streams that serve read-outs: Ed to 0.1 %, radiance away from the sun to 1 %."""


@dataclass(frozen=True, eq=False)
class DeeperWater(ComparedByContent):
    """Other water from a depth on.

    Coefficients are in 1/m, per band.
    """

    top: float
    absorption: NDArray[np.float64]
    scattering: NDArray[np.float64]
    phase: BandPhase


@dataclass(frozen=True, eq=False)
class WaterColumn(ComparedByContent):
    """Plane-parallel water, its light and its floor, per band.

    Water that is the same at every depth is one layer. Where it is not, ``below`` holds
    the layers under the first; they need not end above the floor.

    Raises
    ------
    InputError
        If a quantity is negative or not finite, the surface or the sky is unknown, or the
        layers do not follow each other.
    """

    bands: Bands
    #: Coefficients of the water, or of its first layer, 1/m, (n,).
    absorption: NDArray[np.float64]
    scattering: NDArray[np.float64]
    #: Direct downwelling (horizontal) irradiance of the sun just below the surface, (n,).
    sun_irradiance: NDArray[np.float64]
    sun_cosine: float  #: Cosine of the in-water sun zenith angle.
    #: Direction the sunlight travels to in the water; x, y horizontal, z up, (3,).
    sun_direction: NDArray[np.float64]
    #: Radiance in air of the uniform sky that brings the same irradiance, (n,).
    sky_radiance: NDArray[np.float64]
    floor_depth: float  #: Depth of the floor in m; infinite for deep water.
    floor_reflectance: NDArray[np.float64]  #: Reflectance of the Lambertian floor, (n,).
    #: ``"none"`` (index-matched, sky radiance enters unchanged), ``"flat"``, or ``"waves"``, whose
    #: light is solved as an average over them.
    surface: str
    refractive_index: float
    below: tuple[DeeperWater, ...] = ()  #: Further layers, from above down.
    sky: str = UNIFORM
    #: Mean square slope of the waves; only ``surface="waves"`` takes note of it.
    slope_variance: float = 0.0
    #: Direction that sunlight travels to in air, where that in the water is not what a flat surface
    #: makes of it, (3,).
    sun_in_air: NDArray[np.float64] | None = None
    #: The sky without its sun, instead of ``sky``, and radiance of its red, green and blue, (n, 3).
    sky_picture: SkyPicture | None = None
    sky_basis: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        for name in (
            "absorption",
            "scattering",
            "sun_irradiance",
            "sky_radiance",
            "floor_reflectance",
        ):
            values = _checked(name.replace("_", " "), getattr(self, name), self.bands)
            object.__setattr__(self, name, values)
        object.__setattr__(self, "sun_direction", constant(self.sun_direction))
        if self.sun_in_air is not None:
            object.__setattr__(self, "sun_in_air", constant(self.sun_in_air))
        if np.any(self.floor_reflectance > 1):
            raise InputError("floor reflectance must be 0 to 1 in every band")
        if self.surface not in SURFACES:
            raise InputError(f"surface must be one of {', '.join(SURFACES)}, got {self.surface!r}")
        if self.sky not in SKIES:
            raise unknown_name("kind of sky", self.sky, SKIES)
        if not 0 <= self.slope_variance < math.inf:
            raise InputError(
                f"slope variance of the waves must be finite and not negative, got "
                f"{self.slope_variance:g}"
            )
        if not self.floor_depth > 0:
            raise InputError(f"floor depth must be positive, got {self.floor_depth:g} m")
        for upper, lower in itertools.pairwise((0.0, *(layer.top for layer in self.below))):
            if not upper < lower < math.inf:
                raise InputError(
                    f"a layer of water begins at {lower:g} m, below one at {upper:g} m; depths "
                    "must increase"
                )
        deeper = []
        for layer in self.below:
            a, b = (
                _checked(f"{name} from {layer.top:g} m", getattr(layer, name), self.bands)
                for name in ("absorption", "scattering")
            )
            deeper.append(dataclasses.replace(layer, absorption=a, scattering=b))
        object.__setattr__(self, "below", tuple(deeper))

    @property
    def reflects(self) -> bool:
        """Whether there is a surface that refracts and reflects."""
        return self.surface != "none"

    @property
    def roughness(self) -> float:
        """Mean square slope of the surface; 0 of a flat one."""
        return self.slope_variance if self.surface == WAVES else 0.0

    @property
    def mean_surface(self) -> WaterSurface | None:
        """The surface, waves averaged, if there is one."""
        return WaterSurface(self.refractive_index, self.roughness) if self.reflects else None

    @property
    def sun_at_rest(self) -> NDArray[np.float64]:
        """Direction that sunlight travels to below a level surface, shape (3,)."""
        if self.sun_in_air is None:
            return self.sun_direction
        return WaterSurface(self.refractive_index).beam_below(self.skylight.sun)

    @property
    def glitter(self) -> float:
        """Sun above the waves, over what :func:`.sun_image` takes it for by a flat surface."""
        if not self.roughness:
            return 1.0
        n, in_air = self.refractive_index, max(-float(self.skylight.sun[2]), 0.0)
        surfaces = WaterSurface(n), WaterSurface(n, self.roughness)
        flat, waves = (1.0 - surface.reflectance(in_air) for surface in surfaces)
        return float(flat / waves)

    @property
    def sky_irradiance(self) -> NDArray[np.float64]:
        """Irradiance of the sky just below the surface, shape (n,)."""
        mean = self.mean_surface
        fraction = 1.0 if mean is None else self.skylight.transmittance(mean)
        return math.pi * self.sky_radiance * fraction

    @property
    def attenuation(self) -> NDArray[np.float64]:
        """Extinction c = a + b of the water, or of its first layer, 1/m."""
        return self.absorption + self.scattering

    @property
    def decay(self) -> NDArray[np.float64]:
        """Lower bound of the rate at which light dies away with distance, 1/m.

        Half the geometric mean of a and c, which lies below the asymptotic
        diffuse attenuation for every phase function that scatters forward; of
        the layers, the least.
        """
        layers = [(x.absorption, x.scattering) for x in (self, *self.below)]
        return np.min([0.5 * np.sqrt(a * (a + b)) for a, b in layers], axis=0)

    def layers(self, phase: BandPhase) -> tuple[OpticalLayer, ...]:
        """Return the layers from the surface to the floor, given the first one's phase function."""
        parts = [(self.absorption, self.scattering, phase)]
        parts += [(x.absorption, x.scattering, x.phase) for x in self.below]
        bottoms = [x.top for x in self.below if x.top < self.floor_depth] + [self.floor_depth]
        return tuple(OpticalLayer(y, *part) for y, part in zip(bottoms, parts, strict=False))

    def layer_at(self, y: float, phase: BandPhase) -> OpticalLayer:
        """Return the layer at a depth; where two meet, the upper one."""
        layers = self.layers(phase)
        return next((layer for layer in layers if y <= layer.bottom), layers[-1])

    def mixed_above(self, y: float) -> WaterColumn:
        """Return one layer with the mean coefficients of the water above a depth.

        It stands for layers where a single number must do.
        """
        if not self.below:
            return self
        tops = np.array([0.0, *(layer.top for layer in self.below), math.inf])
        y = max(y, 1e-3)
        fractions = np.diff(np.minimum(tops, y)) / y
        parts = [(x.absorption, x.scattering) for x in (self, *self.below)]
        a, b = np.tensordot(fractions, np.array(parts), axes=1)
        return dataclasses.replace(self, absorption=a, scattering=b, below=())

    def require_one_layer(self, who: str) -> None:
        """Refuse layers on behalf of those that know none.

        Raises
        ------
        InputError
            If there are layers.
        """
        if self.below:
            raise InputError(
                f"{who} water of one layer only, and this has {len(self.below) + 1}; leave them, "
                "or take water that is the same at every depth"
            )

    def Ed(self, y: ArrayLike, phase: BandPhase) -> NDArray[np.float64]:
        """Downwelling irradiance at depths y, shape (..., n)."""
        return self.solved_field(phase, FEW_STREAMS, modes=1).Ed(y)

    @functools.cached_property
    def skylight(self) -> Sky:
        """The sky in air, with the sun before refraction."""
        if self.sun_in_air is None:
            n, down = self.refractive_index, (0.0, 0.0, -1.0)
            sun = direction_in_air(self.sun_direction.tolist(), down, n)
        else:
            sun = tuple(self.sun_in_air.tolist())
        if self.sky_picture is not None:
            return PictureSky(self.sky_basis, sun=sun, picture=self.sky_picture)
        return Sky.standard(self.sky, math.pi * self.sky_radiance, sun)

    def solved_field(
        self,
        phase: BandPhase,
        streams: int = STREAMS,
        emission: Emission | None = None,
        modes: int | None = None,
    ) -> SolvedField:
        """Return the light field of the column, solved by discrete ordinates once."""
        solved = _few_streams if streams <= FEW_STREAMS else _many_streams
        return solved(self, phase, streams, emission, modes)


def _solved_field(
    column: WaterColumn,
    phase: BandPhase,
    streams: int,
    emission: Emission | None,
    modes: int | None,
) -> SolvedField:
    return solve_discrete_ordinates(
        [dataclasses.replace(layer, emission=emission) for layer in column.layers(phase)],
        column.sun_irradiance,
        column.sun_direction.tolist(),
        sky=column.skylight.as_even(),
        surface=column.mean_surface,
        floor_reflectance=column.floor_reflectance,
        streams=streams,
        modes=modes,
    )


# Read-outs ask for many waters, pictures for large solutions of few.
_few_streams = functools.lru_cache(maxsize=64)(_solved_field)
_many_streams = functools.lru_cache(maxsize=8)(_solved_field)


def _checked(name: str, values: ArrayLike, bands: Bands) -> NDArray[np.float64]:
    found = np.broadcast_to(constant(values), len(bands))
    bad = ~(np.isfinite(found) & (found >= 0))
    if bad.any():
        raise InputError(
            f"{name} is {found[bad][0]:g} at {bands.centres[bad][0]:g} nm; it must be a finite "
            "number, not negative"
        )
    return found
