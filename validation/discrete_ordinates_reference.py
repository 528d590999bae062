"""Closed-form path radiance and the papers' forms against discrete ordinates (PythonicDISORT)."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..uw_spectral.surface.refraction import in_water_cosine
from ..uw_spectral.transfer.radiance_field import distance_in_water, upwelling_irradiance
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import PhaseFunction
from ..uw_spectral.water.phase_functions import HenyeyGreenstein, parse_phase
from .closed_form.closed_form import solve_closed_form
from .closed_form.light_field import TwoStreamWater, solve_light_field
from .closed_form.pixel import Pixel
from .monzon import (
    path_radiance_Monzon2024,
    path_radiance_Monzon2024_corrected,
)

WATERS = ("I", "IA", "IB", "II", "3C")


WAVELENGTHS = (400.0, 450.0, 500.0, 550.0, 600.0, 650.0)


DEPTHS = (3.0, 5.0, 9.0)


DISTANCES = (2.0, 5.0, math.inf)


FLOOR_BELOW_CAMERA = 3.0


FLOORS = (0.0, 0.2)


SUN_ZENITH = 30.0


# Five elevations × three azimuths. Up and down: 15 to 75° from the level; level: within 5°.
VIEWS = {
    "up": (-0.97, -0.87, -0.71, -0.5, -0.26),
    "level": (-0.08, -0.04, 0.0, 0.04, 0.08),
    "down": (0.26, 0.5, 0.71, 0.87, 0.97),
}


AZIMUTHS = (0.0, math.radians(75), math.radians(150))


FORMS = ("Eq. 9 as printed", "Eq. 9 corrected", "closed form")


@dataclass(frozen=True)
class Reference:
    """Discrete-ordinates solution of one homogeneous slab, index-matched, no sky, E = 1."""

    mu: np.ndarray
    upward: Callable
    downward: Callable
    radiance: Callable
    a: float
    c: float
    scattering: Callable

    def L(self, y: list[float], w_y: float, azimuths: tuple[float, ...]) -> np.ndarray:
        """Radiance seen at depths y along w, shape (depths, azimuths).

        w_y must be a quadrature cosine, so that nothing is interpolated.
        """
        row = np.argmin(np.abs(self.mu - w_y))
        values = self.radiance(self.c * np.asarray(y), np.asarray(azimuths))
        values = values.reshape(len(self.mu), len(y), len(azimuths))[row]
        return values + self.scattering(np.asarray(y)[:, None], w_y, np.asarray(azimuths))

    def Ed(self, y: float) -> float:
        """Downwelling irradiance."""
        return float(sum(self.downward(self.c * y)))

    def Eu(self, y: float) -> float:
        """Upwelling irradiance."""
        return float(self.upward(self.c * y))

    def scalar_irradiance(self, y: float) -> float:
        """Scalar irradiance by Gershun's law, -d(Ed - Eu)/dy = a E0, exact in the slab."""
        step = 1e-4 / self.c
        above, below = (self.Ed(z) - self.Eu(z) for z in (y - step, y + step))
        return (above - below) / (2 * step * self.a)


def reference(
    a: float, b: float, mu_s: float, y_f: float, r: float, phase: PhaseFunction, streams: int = 48
) -> Reference:
    """Solve one band with PythonicDISORT: delta-M, Nakajima-Tanaka corrected.

    The correction sums 400 Legendre terms. A Fournier-Forand peak needs far
    more, so the sum is blurred by 0.4° and single scattering by the rest, the
    difference to the true phase function, is added in closed form.
    """
    from PythonicDISORT.pydisort import pydisort

    blur = np.exp(-4 * (np.arange(401) / 400) ** 2)
    moments = np.concatenate([[1.0], phase.moments(400)]) * blur
    c = a + b
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mu, upward, downward, _, radiance = pydisort(
            c * y_f,
            b / c,
            streams,
            moments,
            mu_s,
            1 / mu_s,
            0.0,
            NLeg=streams,
            f_arr=moments[streams],
            NT_cor=True,
            BDRF_Fourier_modes=[r] if r else [],
        )

    terms = moments * (2 * np.arange(401) + 1) / (4 * math.pi)
    scaled = c - b * moments[streams]

    def scattering(y: np.ndarray, w_y: float, azimuth: np.ndarray) -> np.ndarray:
        cosine = math.sqrt((1 - w_y**2) * (1 - mu_s**2)) * np.cos(azimuth) - w_y * mu_s
        missing = phase(cosine) - np.polynomial.legendre.legval(cosine, terms)
        length = (y_f - y) / w_y if w_y > 0 else y / -w_y
        q = scaled * (1 + w_y / mu_s)
        return b * missing / mu_s * np.exp(-scaled * y / mu_s) * -np.expm1(-q * length) / q

    return Reference(mu, upward, downward, radiance, a, c, scattering)


def compare(
    water: str,
    wavelengths: tuple[float, ...] = WAVELENGTHS,
    depths: tuple[float, ...] = DEPTHS,
    phase_name: str = "hg:0.8",
) -> list[dict]:
    """Compare the three forms with the reference for one water; one row per ray and band."""
    iops = Water.jerlov(water)
    a, b = iops.a(wavelengths), iops.b(wavelengths)
    phase = parse_phase(phase_name)
    assert isinstance(phase, PhaseFunction), "the same in all bands"
    bands = phase.for_bands(b)
    mu_s = float(in_water_cosine(SUN_ZENITH, 1.0))
    sun = np.array([math.sqrt(1 - mu_s**2), 0.0, -mu_s])
    rows = []
    for y_o, r in itertools.product(depths, FLOORS):
        y_f = y_o + FLOOR_BELOW_CAMERA
        solutions = [reference(*ab, mu_s, y_f, r, phase) for ab in zip(a, b, strict=True)]
        Kd = np.array([-math.log(s.Ed(y_o) / s.Ed(0.0)) / y_o for s in solutions])
        two_stream = TwoStreamWater(a, b, bands.chi1, bands.chi2)
        field = solve_light_field(two_stream, 1.0, mu_s, r=r, y_f=y_f)
        closed = solve_closed_form(field, bands, y_o, sun)
        for view, wanted in ((view, value) for view, values in VIEWS.items() for value in values):
            mu = solutions[0].mu
            w_y = float(mu[np.argmin(np.abs(mu - wanted))])
            ends = np.minimum(DISTANCES, distance_in_water(y_o, w_y, y_f))
            depths_of_ends = [min(max(y_o + w_y * end, 0.0), y_f) for end in ends]
            seen = [s.L([y_o, *depths_of_ends], w_y, AZIMUTHS) for s in solutions]
            for (i, azimuth), (j, end) in itertools.product(enumerate(AZIMUTHS), enumerate(ends)):
                across = math.sqrt(1 - w_y**2)
                w = (-across * math.cos(azimuth), -across * math.sin(azimuth), -w_y)
                truth = np.array([L[0, i] for L in seen]) - np.exp(-field.c * end) * np.array(
                    [L[1 + j, i] for L in seen]
                )
                beyond = closed.radiance(depths_of_ends[j], w)
                papers = (b, a + b, Kd, 1.0, r, y_o, w_y, end, y_f)
                values = np.stack(
                    [
                        path_radiance_Monzon2024(*papers),
                        path_radiance_Monzon2024_corrected(*papers),
                        Pixel(closed, y_o, w, end, 0.0, beyond).total,
                    ],
                    axis=-1,
                )
                rows += [
                    {"water": water, "r": r, "view": view, "truth": truth[k], "values": values[k]}
                    for k in range(len(a))
                ]
    return rows


def compare_irradiance() -> dict[str, np.ndarray]:
    """Relative errors of the irradiances: all waters and bands, floor at 8 m, depths 1 to 7.5 m.

    One array of shape (floors, cases) for each of Ed, Eu and the scalar
    irradiance of the two streams; ``"Eu fraction of Ed"`` is the error of Eu over
    Ed, ``"Eu, integrated"`` that of the closed form's radiance from below.
    """
    phase, mu_s, y_f = HenyeyGreenstein(0.8), float(in_water_cosine(SUN_ZENITH, 1.0)), 8.0
    sun = (-math.sqrt(1 - mu_s**2), 0.0, -mu_s)
    names = ("Ed", "Eu", "scalar_irradiance")
    found = {name: [] for name in (*names, "Eu, integrated", "Eu fraction of Ed")}
    for r, water in itertools.product(FLOORS, WATERS):
        iops = Water.jerlov(water)
        a, b = iops.a(WAVELENGTHS), iops.b(WAVELENGTHS)
        field = solve_light_field(TwoStreamWater(a, b, 0.8, 0.64), 1.0, mu_s, r=r, y_f=y_f)
        closed = {y: solve_closed_form(field, phase.for_bands(b), y, sun) for y in (1.0, 3.0, 7.5)}
        risen = {y: upwelling_irradiance(water.radiance, y) for y, water in closed.items()}
        for band, y in itertools.product(range(len(a)), (1.0, 3.0, 7.5)):
            truth = reference(a[band], b[band], mu_s, y_f, r, phase)
            for name in names:
                error = abs(getattr(field, name)(y)[band] - getattr(truth, name)(y))
                found[name].append(error / getattr(truth, name)(y))
            found["Eu, integrated"].append(abs(risen[y][band] / truth.Eu(y) - 1))
            found["Eu fraction of Ed"].append(abs(field.Eu(y)[band] - truth.Eu(y)) / truth.Ed(y))
    return {name: np.reshape(values, (len(FLOORS), -1)) for name, values in found.items()}


def errors(rows: list[dict]) -> np.ndarray:
    """Relative errors of the three forms, shape (rows, 3); no row is left out."""
    truth = np.array([row["truth"] for row in rows])
    return np.abs(np.array([row["values"] for row in rows]) / truth[:, None] - 1)
