"""Water as others measured it: a, b and Kd of the Jerlov types, scattering functions, a sun.

Measurements are those of the package jerlov: Williamson & Hollins (2022), the points behind their
fit; Jerlov (1976), Kd; Petzold (1972); Boss & Pegau (2001).
"""

from __future__ import annotations

import csv
import math
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import DataWarning
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    sun_travel_direction,
)
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import BLACK, Sky
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.water.optical_properties import JERLOV_TYPES, Water
from ..uw_spectral.water.phase import PhaseFunction
from ..uw_spectral.water.phase_functions import FournierForand, PetzoldAverage, parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from .sunlight import entering, sky_fraction

Array = NDArray[np.float64]
MEASURED_TYPES = ("IB", "II", "III", "1C", "3C", "5C")
MEASURED_ZENITH = 45.0
"""Of the sun over the measured waters, degrees; the campaigns had all heights."""
PROFILE_WAVELENGTHS = np.array([450.0, 550.0, 650.0])
ZENITHS = np.arange(0.0, 81.0, 3.0)
_STREAMS, _LEFT = 16, 0.1


def deep_water(
    a: Array, b: Array, wavelengths: Array, zenith: float, *, sky: bool = True
) -> SolvedField:
    """Solve deep water below a flat surface; the light in air is 1, its sky SPECTRL2's or black."""
    fraction, seen = np.zeros(len(a)), BLACK
    if sky:
        fraction = sky_fraction(zenith, Bands(wavelengths, np.full(len(wavelengths), 10.0)))
        seen = Sky.standard("clear", fraction, sun_travel_direction(zenith, 0.0, 1.0).tolist())
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(wavelengths))
    return solve_discrete_ordinates(
        [OpticalLayer(math.inf, a, b, phase)], (1.0 - fraction) * entering(zenith),
        sun_travel_direction(zenith, 0.0).tolist(), sky=seen,
        surface=WaterSurface(REFRACTIVE_INDEX), streams=_STREAMS, modes=1,
    )  # fmt: skip


def mean_Kd(field: SolvedField) -> Array:
    """Kd from the surface to where a tenth of the light is left, 1/m, shape (n,)."""
    y = np.geomspace(0.02, 400.0, 500)
    lost = -np.log(field.Ed(y) / field.Ed(0.0))
    return math.log(1 / _LEFT) / np.array([np.interp(math.log(1 / _LEFT), x, y) for x in lost.T])


@dataclass(frozen=True)
class MeasuredWater:
    """One Jerlov type as measured, up to 700 nm; arrays of shape (n,).

    ``a`` and ``b`` are means over campaigns, 1/m, the spreads standard deviations among them.
    """

    name: str
    wavelengths: Array
    a: Array
    b: Array
    a_spread: Array
    b_spread: Array

    def default_b(self) -> Array:
        """Scattering of the default source over that measured."""
        return Water.jerlov(self.name).b(self.wavelengths) / self.b

    def Kd_ratio(self) -> Array:
        """Kd of the measured a and b, solved, over the Kd that Jerlov measured."""
        found = mean_Kd(deep_water(self.a, self.b, self.wavelengths, MEASURED_ZENITH))
        return found / Kd_Jerlov1976(self.name, self.wavelengths)


def measured_water(name: str) -> MeasuredWater:
    """Return the points that Williamson & Hollins (2022) averaged over five campaigns or more."""
    import jerlov

    a, b = (jerlov.measured_points(name, quantity) for quantity in "ab")
    nm = np.intersect1d(a.wavelengths, b.wavelengths)
    nm = nm[nm <= 700.0]
    at = [np.isin(points.wavelengths, nm) for points in (a, b)]
    return MeasuredWater(
        name, nm, a.values[at[0]], b.values[at[1]], a.std_dev[at[0]], b.std_dev[at[1]]
    )


def Kd_Jerlov1976(name: str, wavelengths: Array) -> Array:
    """Kd of a type by Jerlov (1976), 1/m."""
    import jerlov

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jerlov.ProvenanceWarning)
        return np.asarray(jerlov.water(name, "jerlov1976").kd(wavelengths))


def explaining_suns() -> dict[str, tuple[float, Array, Array]]:
    """Zenith angle of the sun whose Kd comes closest to the published one, by type, degrees.

    Besides Kd published over solved at 30° and at that angle, shape (3,) each. Water of Solonenko &
    Mobley (2015), black sky as in Figure 15 of Monzon et al. (2024).
    """
    found = {}
    for name in JERLOV_TYPES:
        water = Water.jerlov(name)
        a, b = water.a(PROFILE_WAVELENGTHS), water.b(PROFILE_WAVELENGTHS)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DataWarning)
            published = water.Kd(PROFILE_WAVELENGTHS)
        ratios = np.array([
            published / mean_Kd(deep_water(a, b, PROFILE_WAVELENGTHS, zenith, sky=False))
            for zenith in ZENITHS
        ])  # fmt: skip
        best = int(np.argmin((np.log(ratios) ** 2).sum(axis=1)))
        at_30 = int(np.argmin(np.abs(ZENITHS - 30.0)))
        found[name] = float(ZENITHS[best]), ratios[at_30], ratios[best]
    return found


@dataclass(frozen=True)
class StationFit:
    """One of Petzold's stations, and phase functions over its own: medians by range of angles.

    ``backscatter`` is bb/b as printed. The ratios, shape (3,), are of Fournier-Forand of that bb/b,
    of the default particles and of the Petzold average; medians from 0.5 to 5°, 10 to 90° and 90 to
    170°.
    """

    name: str
    backscatter: float
    fitted: Array
    default: Array
    average: Array


def petzold_stations() -> list[StationFit]:
    """Compare phase functions with those of Petzold's eight stations, water included."""
    import jerlov

    fits = []
    for name in jerlov.PETZOLD_STATIONS:
        station = jerlov.petzold_scattering(name)
        angles, own = station.angles_deg, station.phase_function()
        ranges = [
            (angles >= low) & (angles <= high) for low, high in ((0.5, 5), (10, 90), (90, 170))
        ]

        def medians(
            phase: PhaseFunction, angles: Array = angles, own: Array = own, ranges: list = ranges
        ) -> Array:
            ratio = phase(np.cos(np.radians(angles))) / own
            return np.array([np.median(ratio[inside]) for inside in ranges])

        fits.append(
            StationFit(
                name,
                station.backscatter_ratio,
                medians(FournierForand.of_backscatter_Mobley2002(station.backscatter_ratio)),
                medians(FournierForand()),
                medians(PetzoldAverage()),
            )
        )
    return fits


def boss_chi(phase: PhaseFunction) -> tuple[Array, Array, Array, Array]:
    """Angles 90 to 160°; χ = bb/(2π β) measured, its error, and that of a phase function."""
    import jerlov

    path = Path(jerlov.__file__).parent / "data" / "boss2001_chi.csv"
    with path.open(encoding="utf-8") as file:
        rows = [
            (float(row["angle_deg"]), float(row["chi"]), float(row["percent_error"]) / 100.0)
            for row in csv.DictReader(file)
            if row["source"] == "boss2001" and row["status"] == "ok"
        ]
    angles, chi, error = np.array(rows).T
    ours = phase.backscatter_ratio / (2.0 * math.pi * phase(np.cos(np.radians(angles))))
    return angles, chi, error, np.asarray(ours, np.float64)
