"""Which cause makes modelled caustics stronger than those measured deep in the sea.

Darecki et al. (2011): what the model takes for b comes from a beam attenuation c; a c-meter counts
light scattered by less than its acceptance angle as not scattered. Gernez & Antoine (2009): their
record does not resolve a third of a second.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..uw_spectral.surface.caustics import caustic_pattern
from ..uw_spectral.surface.waves import GRAVITY, WaveSpectrum
from ..uw_spectral.water.phase import BandPhase
from . import caustics_at_sea as sea

Array = NDArray[np.float64]
ACCEPTANCE = 0.93
"""Half angle of acceptance of a WET Labs ac-9, degrees; of a C-Star it is 1.2."""
CAUSES = (
    "as in caustics.md",
    "sun's disc three times as wide",
    "collector of 10 mm",
    "no waves shorter than 0.3 m",
    "tile twice as wide",
    "short waves of Romeiser & Alpers (1997)",
    "twice the waves of 6 to 30 cm",
    "the same, and b seen by a c-meter of 0.93°",
    "b seen by a c-meter of 0.93°",
)
EXPOSURES = (0.0, 1.0 / 6.0, 1.0 / 3.0)
"""Seconds over which a record is averaged."""
_JOINED_AT = 10.0  # rad/m
_DECIMETRES = 20.0, 100.0  # rad/m
_RESOLUTION, _MOMENTS_OF_EXPOSURE, _CREST_SEEDS = 1024, 16, 3


class ShortWavesOfRomeiser(WaveSpectrum):
    """A sea whose waves below about half a metre are those of Romeiser & Alpers (1997).

    They join the long ones of Elfouhaily et al. (1997) without a factor: the slope variance is
    within 4 % of Cox & Munk's at 2 and 5 m/s, and 11 % below it at 10 m/s.
    """

    def curvature(self, k: ArrayLike) -> Array:
        """Saturation, as of :meth:`.WaveSpectrum.curvature`."""
        k = np.asarray(k, dtype=np.float64)
        short = k * k / (k * k + _JOINED_AT * _JOINED_AT)
        long = self.curvature_Elfouhaily1997(k)
        return long + short * (saturation_RomeiserAlpers1997(k, self.wind_speed) - long)


class MoreShortWaves(WaveSpectrum):
    """A sea with twice the variance of waves of 6 to 30 cm, and less of shorter ones."""

    def curvature(self, k: ArrayLike) -> Array:
        """Saturation, as of :meth:`.WaveSpectrum.curvature`."""
        k = np.asarray(k, dtype=np.float64)
        everywhere = np.geomspace(1e-2, 6e3, 3000)
        B, ripples = super().curvature(everywhere), everywhere > _DECIMETRES[1]
        inside = _inside(everywhere)
        more = np.trapezoid(B * inside, np.log(everywhere))
        rest = np.trapezoid(B * ripples * (1.0 - inside), np.log(everywhere))
        less = np.where(k > _DECIMETRES[1], 1.0 - (1.0 - _inside(k)) * more / rest, 1.0)
        return super().curvature(k) * (1.0 + _inside(k)) * less


def _inside(k: Array) -> Array:
    low, high = _DECIMETRES
    return np.asarray(1.0 / ((1.0 + (low / np.maximum(k, 1e-9)) ** 4) * (1.0 + (k / high) ** 4)))


def saturation_RomeiserAlpers1997(k: Array, wind: float) -> Array:
    """Saturation k³ S(k) of waves of the wave numbers k, rad/m, at a wind in m/s.

    R. Romeiser & W. Alpers, J. Geophys. Res. 102, 25237 (1997), equations 38 to 42.
    """
    peak = GRAVITY / math.sqrt(2.0) / wind**2
    bump = np.exp(-((np.sqrt(k) - math.sqrt(peak)) ** 2) / (0.32 * peak))
    long = 0.00195 * np.exp(-((peak / k) ** 2) + 0.53 * bump)
    power = (1.0 - np.exp(-((k / 183.0) ** 2))) * np.exp(-k / 3333.0)
    power = power + (1.0 - np.exp(-k / 33.0)) * np.exp(-(((k - 140.0) / 220.0) ** 2))
    shape = np.sqrt(1.0 + (k / 280.0) ** 7.2) * np.exp(-((k / 8885.0) ** 2))
    shape = shape / ((1.0 + (k / 75.0) ** 2.2) * (1.0 + (k / 1300.0) ** 3.2) ** 2)
    return np.asarray(long * shape * wind**power)


def whitecaps(wind: float) -> float:
    """Fraction of the sea that foam covers at a wind in m/s: Monahan & O'Muircheartaigh (1980)."""
    return 3.84e-6 * wind**3.41


def within(phase: BandPhase, degrees: float) -> Array:
    """Fraction of the light that is scattered by less than an angle, shape (n,)."""
    angle = np.geomspace(1e-6, math.radians(degrees), 4000)
    density = phase(np.cos(angle)) * np.sin(angle)[:, None]
    return 2.0 * math.pi * np.asarray(np.trapezoid(density, angle, axis=0))


def seen_by_meter(
    water: dict[float, tuple[float, float]], degrees: float = ACCEPTANCE
) -> dict[float, tuple[float, float]]:
    """Return the water whose b is larger by what a c-meter with that acceptance does not see."""
    lost = within(sea.sunlit_water(water, sea.DARECKI_ZENITH).field.phase_at(0.0), degrees)
    return {
        nm: (a, float(b / (1.0 - fraction)))
        for (nm, (a, b)), fraction in zip(water.items(), lost, strict=True)
    }


def darecki(wind: float) -> tuple[Array, dict[str, Array]]:
    """Depths, and modelled over measured variation of Ed by cause, (depths, wavelengths)."""
    import jerlov

    measured = jerlov.darecki2011_irradiance_cv()
    depths, collector = measured.depth_m, measured.collector_mm / 1000.0
    wider = seen_by_meter(sea.DARECKI_WATER)
    plain, meter = (sea.sunlit_water(w, sea.DARECKI_ZENITH) for w in (sea.DARECKI_WATER, wider))

    def pattern(
        depth: float,
        *,
        tile: float = 2.5,
        k_max: float = 0.0,
        disc: float = 1.0,
        sea_of: type[WaveSpectrum] = WaveSpectrum,
    ) -> Array:
        waves = sea_of(wind).realise(tile * depth, _RESOLUTION, 0)
        if k_max:
            waves = dataclasses.replace(waves.below(k_max), shorter=np.zeros(2))
        radius = disc * sea.SUN_RADIUS
        return caustic_pattern(
            waves, np.asarray(plain.field.sun), depth, 10.0, _RESOLUTION, sun_radius=radius
        )

    found = {cause: np.zeros_like(measured.cv) for cause in CAUSES}
    for i, depth in enumerate(depths.tolist()):
        grey, tile = pattern(depth), 2.5 * depth
        more = pattern(depth, sea_of=MoreShortWaves)
        rows = (
            plain.variation(grey, tile, depth, collector),
            plain.variation(pattern(depth, disc=3.0), tile, depth, collector),
            plain.variation(grey, tile, depth, 0.010),
            plain.variation(pattern(depth, k_max=2 * math.pi / 0.3), tile, depth, collector),
            plain.variation(pattern(depth, tile=5.0), 2.0 * tile, depth, collector),
            plain.variation(pattern(depth, sea_of=ShortWavesOfRomeiser), tile, depth, collector),
            plain.variation(more, tile, depth, collector),
            meter.variation(more, tile, depth, collector),
            meter.variation(grey, tile, depth, collector),
        )
        for cause, row in zip(CAUSES, rows, strict=True):
            found[cause][i] = row / measured.cv[i]
    return depths, found


def sharp_crests(wind: float) -> list[tuple[float, Array, Array, Array, Array]]:
    """CV over that of Darecki et al. by depth: of linear and of choppy waves, in two waters.

    The second water has what a c-meter does not see of its scattering.
    """
    import jerlov

    measured = jerlov.darecki2011_irradiance_cv()
    collector = measured.collector_mm / 1000
    waters = [
        sea.sunlit_water(water, sea.DARECKI_ZENITH)
        for water in (sea.DARECKI_WATER, seen_by_meter(sea.DARECKI_WATER))
    ]
    rows = []
    for depth, cv in zip(measured.depth_m.tolist(), measured.cv, strict=True):
        linear, choppy, linear_seen, choppy_seen = (
            sea.variation(water, wind, depth, collector, _CREST_SEEDS, crests) / cv
            for water in waters
            for crests in (0.0, 1.0)
        )
        rows.append((depth, linear, choppy, linear_seen, choppy_seen))
    return rows


def gernez(zenith: float, wind: float = 5.0) -> list[float]:
    """Modelled over measured variation at 510 nm and 3.2 m, for each of :data:`EXPOSURES`."""
    import jerlov

    measured, sky = jerlov.gernez2009_cv_by_sun_zenith(), jerlov.gernez2009_diffuse_share()
    cv = float(measured.cv[np.flatnonzero(measured.sun_zenith_deg == zenith)[0]])
    fraction = float(np.interp(zenith, sky.sun_zenith_deg, sky.diffuse_fraction))
    water = sea.sunlit_water(sea.GERNEZ_WATER, zenith, fraction)
    waves, tile = WaveSpectrum(wind).realise(8.0, 512, 0), 8.0
    ratios = []
    for exposure in EXPOSURES:
        count = _MOMENTS_OF_EXPOSURE if exposure else 1
        times = 10.0 + exposure * (np.arange(count) + 0.5) / count
        sun = np.asarray(water.field.sun)
        moments = [caustic_pattern(waves, sun, 3.2, t, 512) for t in times.tolist()]
        ratios.append(float(water.variation(np.mean(moments, axis=0), tile, 3.2, 0.008)[0]) / cv)
    return ratios
