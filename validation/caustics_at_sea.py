"""Caustics against the sea and a photon trace.

Measurements: Darecki et al. (2011), Gernez & Antoine (2009), from the package jerlov.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.spectra.illuminant import parse_illuminant
from ..uw_spectral.surface.caustics import (
    SUN_RADIUS,
    bake_layers,
    caustic_pattern,
    pattern_power,
    refracted_offset,
)
from ..uw_spectral.surface.refraction import (
    REFRACTIVE_INDEX,
    fresnel_reflectance,
    sun_travel_direction,
)
from ..uw_spectral.surface.wave_components import EVEN, WaveComponents
from ..uw_spectral.surface.waves import WaveSpectrum
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.transfer.sunlit_water import SunlitWater
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering

WIND_AZIMUTH = 40.0  # between the sun and the wind, degrees; unknown in the field


# Santa Barbara Channel, as a c-meter sees it: of the water only c(555) = 0.68 1/m is published. The
# rest is a model: chlorophyll C = 3.1 mg/m³ from b = 0.30 C^0.62 (550/λ) = 0.61 1/m at 555 nm
# (Gordon & Morel 1983); a = a_w (Pope & Fry 1997) + a_p (Bricaud et al. 1998) + 20 % of a(440)
# as CDOM.
SEEN_WATER = {443.0: (0.135, 0.764), 532.0: (0.090, 0.636), 670.0: (0.490, 0.505)}
ACCEPTANCE = 0.93
"""Half angle of acceptance of a WET Labs ac-9, degrees; of a C-Star it is 1.2."""


DARECKI_WINDS = (4.1, 5.25, 6.4)  # the range of the caption, and its middle


DARECKI_ZENITH = 31.5
DAYS_DEPTH, DAYS_ZENITH = 1.1, 44.0  # middles of 0.91 to 1.25 m and of 42 to 46°


# BOUSSOLE: the same model at C = 0.3 mg/m³, 510 nm; wind 5 m/s.
GERNEZ_WATER = {510.0: (0.050, 0.153)}


EXPOSURES = (0.0, 1.0 / 6.0, 1.0 / 3.0)
"""Seconds over which a record is averaged."""
_MOMENTS_OF_EXPOSURE = 16


TRACE_WINDS, TRACE_DEPTHS = (2.0, 5.0, 10.0), (0.5, 2.0, 5.0, 10.0)


TRACE_TILE, TRACE_WAVES, TRACE_BINS = 4.0, 256, 128


def sunlit_water(
    water: dict[float, tuple[float, float]], zenith: float, sky_fraction: float | None = None
) -> SunlitWater:
    """Solve deep water under a flat surface and a clear sky."""
    wavelengths = np.array(list(water))
    a, b = np.array(list(water.values())).T
    phase = parse_phase("mixture").for_bands(b, molecular_scattering(wavelengths))
    if sky_fraction is None:
        light = parse_illuminant("clear-sky", zenith)
        bands = Bands(wavelengths, np.full(len(wavelengths), 10.0))
        direct, diffuse = light.direct_in(bands), light.diffuse_in(bands)
    else:
        direct, diffuse = 1 - sky_fraction, sky_fraction
    entering = 1 - fresnel_reflectance(math.cos(math.radians(zenith)))
    one = np.ones(len(wavelengths))
    field = solve_discrete_ordinates(
        [OpticalLayer(math.inf, a, b, phase)],
        direct * entering * one,
        sun_travel_direction(zenith, WIND_AZIMUTH).tolist(),
        sky=Sky.standard(
            "clear", diffuse * one, sun_travel_direction(zenith, WIND_AZIMUTH, 1.0).tolist()
        ),
        surface=WaterSurface(REFRACTIVE_INDEX),
    )
    return SunlitWater(field)


def within(phase: BandPhase, degrees: float) -> NDArray[np.float64]:
    """Fraction of the light that is scattered by less than an angle, shape (n,)."""
    angle = np.geomspace(1e-9, max(math.radians(degrees), 1e-9), 4000)
    density = phase(np.cos(angle)) * np.sin(angle)[:, None]
    return 2.0 * math.pi * np.asarray(np.trapezoid(density, angle, axis=0))


def darecki_water(zenith: float, acceptance: float = ACCEPTANCE) -> SunlitWater:
    """Solve the water whose c a meter of that acceptance sees as :data:`SEEN_WATER`."""
    seen = sunlit_water(SEEN_WATER, zenith)
    lost = within(seen.field.phase_at(0.0), acceptance)
    return sunlit_water(
        {
            nm: (a, float(b / (1.0 - fraction)))
            for (nm, (a, b)), fraction in zip(SEEN_WATER.items(), lost, strict=True)
        },
        zenith,
    )


def variation(
    water: SunlitWater,
    wind: float,
    depth: float,
    collector: float,
    seeds: int = 1,
    *,
    patchy: bool = True,
) -> NDArray[np.float64]:
    """Coefficient of variation of Ed per band; the tile is 2.5 times the depth."""
    tile, resolution = 2.5 * depth, 1024
    squares = 0.0
    for seed in range(seeds):
        waves = WaveSpectrum(wind).realise(tile, resolution, seed)
        if not patchy:
            waves = dataclasses.replace(waves, ripples=EVEN)
        pattern = caustic_pattern(waves, np.asarray(water.field.sun), depth, 10.0, resolution)
        squares = squares + water.variation(pattern, tile, depth, collector) ** 2
    return np.sqrt(squares / seeds)


def against_darecki(
    wind: float, seeds: int = 1, *, acceptance: float = ACCEPTANCE, patchy: bool = True
) -> tuple[NDArray, NDArray, NDArray]:
    """Depths, measured and modelled CV (depths, wavelengths) of Darecki et al. 2011, Figure 13a."""
    import jerlov

    sea = jerlov.darecki2011_irradiance_cv()
    water = darecki_water(DARECKI_ZENITH, acceptance)
    modelled = [
        variation(water, wind, depth, sea.collector_mm / 1000, seeds, patchy=patchy)
        for depth in sea.depth_m.tolist()
    ]
    return sea.depth_m, sea.cv, np.array(modelled)


def against_days(
    seeds: int = 2, *, acceptance: float = ACCEPTANCE, patchy: bool = True
) -> tuple[NDArray, NDArray, NDArray]:
    """Winds of five days, measured and modelled CV near 1 m (days, wavelengths): Figure 13b."""
    import jerlov

    sea = jerlov.darecki2011_spectral_cv()
    water = darecki_water(DAYS_ZENITH, acceptance)
    at = np.isin(sea.wavelengths_nm, list(SEEN_WATER))
    modelled = [
        variation(water, wind, DAYS_DEPTH, sea.collector_mm / 1000, seeds, patchy=patchy)
        for wind in sea.wind_m_s.tolist()
    ]
    return sea.wind_m_s, sea.cv[:, at], np.array(modelled)


def against_gernez(zenith: float, wind: float = 5.0) -> list[float]:
    """Modelled over measured variation at 510 nm and 3.2 m, for each of :data:`EXPOSURES`."""
    import jerlov

    measured, sky = jerlov.gernez2009_cv_by_sun_zenith(), jerlov.gernez2009_diffuse_share()
    cv = float(measured.cv[np.flatnonzero(measured.sun_zenith_deg == zenith)[0]])
    fraction = float(np.interp(zenith, sky.sun_zenith_deg, sky.diffuse_fraction))
    water = sunlit_water(GERNEZ_WATER, zenith, fraction)
    waves, tile = WaveSpectrum(wind).realise(8.0, 512, 0), 8.0
    ratios = []
    for exposure in EXPOSURES:
        count = _MOMENTS_OF_EXPOSURE if exposure else 1
        times = 10.0 + exposure * (np.arange(count) + 0.5) / count
        sun = np.asarray(water.field.sun)
        moments = [caustic_pattern(waves, sun, 3.2, t, 512) for t in times.tolist()]
        ratios.append(float(water.variation(np.mean(moments, axis=0), tile, 3.2, 0.008)[0]) / cv)
    return ratios


def photon_trace(
    waves: WaveComponents, zenith: float, azimuth: float, depth: float, passes: int, seed: int = 0
) -> NDArray[np.float64]:
    """Irradiance by photons, counted in square bins: nothing shared with the splatting.

    Photons start at the nodes of a surface eight times finer than the waves,
    shifted at random within a node's cell to second order in the surface,
    from a random place on the sun's disc; Snell's law by angles.
    """
    n, bins = 2048, TRACE_BINS
    eta, sx, sy = waves.on_grid(n, 0.0)
    step = waves.tile / n
    xx, xy, yy = (
        (np.roll(f, -1, axis) - np.roll(f, 1, axis)) / (2 * step)
        for f, axis in ((sx, 1), (sx, 0), (sy, 0))
    )
    random = np.random.default_rng(seed)
    node = np.arange(n) * step
    count = np.zeros(bins * bins)
    for _ in range(passes):
        dx, dy = (random.random((2, n, n)) - 0.5) * step
        px, py = sx + xx * dx + xy * dy, sy + xy * dx + yy * dy
        height = eta + sx * dx + sy * dy
        radius, turn = (
            SUN_RADIUS * np.sqrt(random.random((n, n))),
            random.random((n, n)) * 2 * np.pi,
        )
        theta = math.radians(zenith) + radius * np.cos(turn)
        phi = math.radians(azimuth) + radius * np.sin(turn) / max(
            math.sin(math.radians(zenith)), 1e-9
        )
        toward = np.stack(
            [-np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), np.cos(theta)]
        )
        normal = np.stack([-px, -py, np.ones_like(px)]) / np.sqrt(1 + px**2 + py**2)
        cosine = np.clip((toward * normal).sum(axis=0), 0, 1)
        across = toward - cosine * normal  # in the surface, towards the sun
        across = across / np.maximum(np.linalg.norm(across, axis=0), 1e-12)
        refracted = np.arcsin(np.sqrt(1 - cosine**2) / REFRACTIVE_INDEX)
        ray = -np.cos(refracted) * normal - np.sin(refracted) * across
        reach = np.maximum(depth + height, 0) / -ray[2]
        x = node + dx + reach * ray[0]
        y = node[:, None] + dy + reach * ray[1]
        weight = cosine / normal[2] * (1 - fresnel_reflectance(cosine))
        i, j = (
            np.floor(np.mod(v, waves.tile) / waves.tile * bins).astype(int) % bins for v in (x, y)
        )
        count += np.bincount((j * bins + i).ravel(), weight.ravel(), minlength=bins * bins)
    return (count / count.mean()).reshape(bins, bins)


def traced(wind: float, depth: float, passes: int = 2) -> tuple[NDArray, NDArray]:
    """Pattern and photon trace of the same waves, in the same bins, at the same place."""
    zenith, azimuth = 30.0, 20.0
    waves = WaveSpectrum(wind).realise(TRACE_TILE, TRACE_WAVES, seed=7)
    sun = sun_travel_direction(zenith, azimuth)
    photons = photon_trace(waves, zenith, azimuth, depth, passes)
    # The pattern with all waves on the grid: no tail, as the photons have none.
    known = dataclasses.replace(waves, shorter=np.zeros(2), ripples=EVEN)
    fine = caustic_pattern(known, sun, depth, 0.0, 1024)
    # Back from the surface to the place where the light lands, and into bins.
    straight = refracted_offset(0.0, 0.0, sun)
    k = 2 * np.pi * np.fft.fftfreq(1024, TRACE_TILE / 1024)
    moved = np.exp(-1j * (k * (depth * straight[0]) + k[:, None] * (depth * straight[1])))
    spectrum = np.fft.fft2(fine) * moved
    # A sample stands for its surroundings; bins begin at their corner.
    half = np.exp(1j * (k + k[:, None]) * (TRACE_TILE / 1024 / 2))
    placed = np.fft.ifft2(spectrum * half).real
    size = 1024 // TRACE_BINS
    return placed.reshape(TRACE_BINS, size, TRACE_BINS, size).mean(axis=(1, 3)), photons


def histogram_distance(one: NDArray, other: NDArray) -> float:
    """Largest difference of the two cumulative distributions (Kolmogorov-Smirnov)."""
    values = np.sort(np.concatenate([one.ravel(), other.ravel()]))
    below = [np.searchsorted(np.sort(x.ravel()), values, "right") / x.size for x in (one, other)]
    return float(np.abs(below[0] - below[1]).max())


def layer_depths(shallowest: float, deepest: float) -> NDArray[np.float64]:
    """Depths of layers, about an octave apart, m."""
    if not 0 < shallowest <= deepest < math.inf:
        raise InputError(
            f"caustics: layers need depths 0 < shallowest ≤ deepest, got {shallowest:g} "
            f"and {deepest:g} m"
        )
    octaves = math.ceil(math.log2(deepest / shallowest) - 0.1)
    return np.geomspace(shallowest, deepest, max(octaves, 0) + 1)


def whole_contrast(
    water: SunlitWater, pattern: NDArray, tile: float, depth: float
) -> NDArray[np.float64]:
    """Factor per band, 0 to 1, that fits one grey pattern to the sunlight of the band, (n,).

    The direct and forward-scattered sun of a band is nearly its mean times ``1 + contrast
    (pattern - 1)``; the variance of Ed is exact. More than 1 would make the light negative in
    dark places.
    """
    grey = math.sqrt(np.sum(pattern_power(pattern)))
    fraction = water.sun_fraction(depth)
    if grey == 0:
        return np.ones_like(fraction)
    variation = water.variation(pattern, tile, depth) / grey
    ratio = np.divide(variation, fraction, out=np.zeros_like(fraction), where=fraction > 0)
    return np.minimum(ratio, 1.0)


def layer_cost(wind: float) -> list[tuple[float, NDArray, NDArray]]:
    """Relative error of the CV at depths between layers: with the gain, and plainly blended."""
    tile, resolution = 16.0, 512
    water = darecki_water(DARECKI_ZENITH)
    waves = WaveSpectrum(wind).realise(tile, resolution, 1)
    layers = bake_layers(
        waves, np.asarray(water.field.sun), layer_depths(1.0, 16.0), 0.0, resolution
    )
    rows = []
    for depth in (1.0, 1.41, 2.0, 2.83, 5.66, 11.3):
        truth = water.variation(
            caustic_pattern(waves, np.asarray(water.field.sun), depth, 0.0, resolution), tile, depth
        )
        grey, fraction = layers.blend(depth), water.sun_fraction(depth)
        with_gain = fraction * layers.contrast(water, depth) * grey.std() / truth - 1
        plain = fraction * whole_contrast(water, grey, tile, depth) * grey.std() / truth - 1
        rows.append((depth, with_gain, plain))
    return rows
