"""What the Monte Carlo returns: means with standard errors, events, energy."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

QUANTITIES = ("Ed", "Eu", "Eod", "Eou", "E0")


@dataclass(frozen=True, eq=False)
class Estimate:
    """Mean and standard error, arrays of the same shape."""

    mean: NDArray[np.float64]
    error: NDArray[np.float64]

    @property
    def relative_error(self) -> NDArray[np.float64]:
        """Standard error over mean; 0 where both are 0."""
        return np.divide(
            self.error, np.abs(self.mean), out=np.zeros_like(self.mean), where=self.mean != 0
        )


@dataclass(frozen=True, eq=False)
class Light:
    """Light in the water, in the spectral unit of the column's irradiance.

    ``Ed`` and ``Eu`` are planar irradiance, ``Eod``, ``Eou`` and ``E0`` downwelling, upwelling and
    total scalar irradiance at each depth and band, shape (d, n); ``L`` the radiance of each view,
    without the direct sun, shape (v, n).
    """

    Ed: Estimate
    Eu: Estimate
    Eod: Estimate
    Eou: Estimate
    E0: Estimate
    L: Estimate


@dataclass(frozen=True, eq=False)
class Event:
    """How often a type of event, such as ``"Raman"``, happened, by the band before it; shape (n,).

    ``count`` is of photon packets, ``power`` theirs, W/m² of the band (spectral irradiance times
    width); ``deposit`` the power that ended: all of an absorption, none of a scattering, of an
    inelastic event the part that is not re-emitted.
    """

    name: str
    count: NDArray[np.int64]
    power: NDArray[np.float64]
    deposit: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MonteCarloResult:
    """Result of :func:`.simulate`; n bands, d depths, v views."""

    wavelengths: NDArray[np.float64]  #: Shape (n,): Band centres, nm.
    depths: NDArray[np.float64]  #: Shape (d,): Of the irradiances, m.
    views: tuple[tuple, ...]  #: Depth, direction, and distance if given, of each radiance.
    total: Light
    parts: dict[str, Light]  #: ``"elastic"``, and by the inelastic process that made it last.
    events: tuple[Event, ...]  #: Every event type, then the two ends at the boundaries.
    incident: NDArray[np.float64]  #: Shape (n,): Power that entered the water per band, W/m².
    photons: int  #: Number of photons traced.
    engine: str
    seed: int

    @property
    def energy_balance(self) -> float:
        """Power that ended somewhere over the power that entered, less 1."""
        return float(sum(event.deposit.sum() for event in self.events) / self.incident.sum() - 1)

    def event(self, name: str) -> Event:
        """Return one event type by name."""
        return next(event for event in self.events if event.name == name)

    def write_csv(self, path: str | Path) -> None:
        """Write every estimate: quantity, part, depth, direction, wavelength, mean, error."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            file.write(
                f"# Monte Carlo, {self.photons} photons, engine {self.engine}, seed {self.seed}; "
                "unit of the given irradiance (L: per sr); w is the view direction, z up\n"
            )
            table = csv.writer(file, lineterminator="\n")
            place = ("depth_m", "w_x", "w_y", "w_z", "distance_m")
            table.writerow(["quantity", "part", *place, "wavelength_nm", "mean", "standard_error"])
            for part, light in {"total": self.total, **self.parts}.items():
                for quantity in QUANTITIES:
                    where = [(depth, *[""] * 4) for depth in self.depths]
                    estimate = getattr(light, quantity)
                    table.writerows(_rows(quantity, part, where, self.wavelengths, estimate))
                where = [(depth, *w, *(distance or [""])) for depth, w, *distance in self.views]
                table.writerows(_rows("L", part, where, self.wavelengths, light.L))


def _rows(
    quantity: str,
    part: str,
    where: list[tuple],
    wavelengths: NDArray,
    estimate: Estimate,
) -> Iterator[list[str]]:
    for place, means, errors in zip(where, estimate.mean, estimate.error, strict=True):
        cells = [x if isinstance(x, str) else f"{x:g}" for x in place]
        for row in zip(wavelengths, means, errors, strict=True):
            yield [quantity, part, *cells, *(f"{value:.8g}" for value in row)]


class Moments:
    """Sums of batch means and their squares: the memory does not grow with the batches."""

    def __init__(self) -> None:
        self._count = 0
        self._mean: NDArray | float = 0.0
        self._squares: NDArray | float = 0.0

    def add(self, values: NDArray) -> None:
        """Add the mean of one batch (Welford's update)."""
        self._count += 1
        away = values - self._mean
        self._mean = self._mean + away / self._count
        self._squares = self._squares + away * (values - self._mean)

    def estimate(self) -> Estimate:
        """Return mean and standard error over the batches."""
        variance = self._squares / max(self._count - 1, 1)
        return Estimate(np.asarray(self._mean), np.sqrt(variance / self._count))
