"""A camera at a depth: the light there, the water around it, and the map to colours."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..content import ComparedByContent
from ..errors import InputError
from ..spectra.barrier_filter import NO_FILTER, transmittance
from ..spectra.colour_rendering import (
    SensorReduction,
    WhiteBalance,
    auto_exposure_stops,
    reduction,
)
from ..spectra.illuminant import Illuminant
from ..spectra.sensor import Sensor
from ..transfer.discrete_ordinates import OpticalLayer
from ..transfer.solved_field import SolvedField
from ..transfer.water_column import FEW_STREAMS, WaterColumn
from ..water.phase import BandPhase


@dataclass(frozen=True, eq=False)
class Viewpoint(ComparedByContent):
    """A camera at a depth in a column of water; what is computed from it is kept.

    Raises
    ------
    InputError
        If the camera is not between surface and floor; on first use of
        ``reduction`` where the sensor sees no light.
    """

    column: WaterColumn
    phase: BandPhase  #: Phase function on the bands of the column.
    illuminant: Illuminant
    sensor: Sensor
    depth: float  #: Depth of the camera, m.
    white_balance: WhiteBalance = "daylight"
    #: None exposes automatically: a white diffuser at depth has luminance 0.9.
    exposure_stops: float | None = None
    #: Irradiance that lamps put on objects before the camera (:func:`.lamplight`), (n,).
    lamplight: NDArray[np.float64] | None = None
    compensation: float = 0.0  #: Stops that are added to the automatic exposure.
    #: Before the sensor, as :func:`.barrier_filter.transmittance` takes it. White balance and
    #: automatic exposure are those without it.
    filter: str = NO_FILTER

    def __post_init__(self) -> None:
        if not 0 <= self.depth <= self.column.floor_depth:
            raise InputError(
                f"the camera is at depth {self.depth:g} m, but the water reaches from 0 to "
                f"{self.column.floor_depth:g} m; move the camera or the floor"
            )

    @functools.cached_property
    def field(self) -> SolvedField:
        """Light field of the column, in the streams of read-outs."""
        return self.column.solved_field(self.phase, FEW_STREAMS)

    @functools.cached_property
    def light(self) -> NDArray[np.float64]:
        """Irradiance of objects at the camera's depth: Ed, and lamps, shape (n,)."""
        Ed = self.column.Ed(self.depth, self.phase)
        return Ed if self.lamplight is None else Ed + self.lamplight

    @functools.cached_property
    def layer(self) -> OpticalLayer:
        """Water at the camera's depth."""
        return self.column.layer_at(self.depth, self.phase)

    @functools.cached_property
    def attenuation(self) -> NDArray[np.float64]:
        """Extinction c at the camera's depth, 1/m, shape (n,)."""
        return self.layer.absorption + self.layer.scattering

    @functools.cached_property
    def level(self) -> tuple[float, float, float]:
        """Level view direction at right angles to the sun."""
        x, y, _ = self.column.sun_direction
        length = math.hypot(x, y)
        return (-y / length, x / length, 0.0) if length > 1e-9 else (1.0, 0.0, 0.0)

    @functools.cached_property
    def background(self) -> NDArray[np.float64]:
        """Radiance of the open water along :attr:`level`, shape (n,)."""
        return self.field.radiance(self.depth, self.level)

    def seen_level(self, L: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
        """Radiance of surfaces of radiance L, shape (..., n), at a distance along :attr:`level`."""
        # Along a level ray the water is the same, and so is its radiance.
        transmittance = np.exp(-self.attenuation * np.asarray(distance))
        return transmittance * np.asarray(L) + (1.0 - transmittance) * self.background

    @functools.cached_property
    def reduction(self) -> SensorReduction:
        """Map from band radiances to scene-linear Rec.709."""
        exposed = self._balanced.exposed(self.stops)
        if self.filter == NO_FILTER:
            return exposed
        return exposed.behind(transmittance(self.filter, self.column.bands), self.filter)

    @functools.cached_property
    def stops(self) -> float:
        """Exposure in stops, the automatic one too."""
        if self.exposure_stops is None:
            return auto_exposure_stops(self._balanced, self.light) + self.compensation
        return self.exposure_stops

    @functools.cached_property
    def _balanced(self) -> SensorReduction:
        """The reduction at 0 stops."""
        if self.white_balance == "depth":
            return reduction(self.sensor, self.column.bands, self.illuminant, self.light, "depth")
        return _reduction_everywhere(
            self.sensor, self.column.bands, self.illuminant, white_balance=self.white_balance
        )


# Where it does not depend on depth.
_reduction_everywhere = functools.lru_cache(maxsize=8)(reduction)
