"""How far objects matter in a water: objects, shafts, orders of scattering, samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.imaging.viewpoint import Viewpoint
from ..uw_spectral.spectra.colour_rendering import delta_e_CIE2000_images, luminance
from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table
from ..uw_spectral.transfer.water_column import FEW_STREAMS, DeeperWater, WaterColumn

BOUNCES = (4, 8, 12, 16, 24, 32, 48, 64)
FROXELS = (32, 64, 128, 256)

_DISTANCES = np.geomspace(0.25, 500.0, 45)
_WHITE = 0.9
_GENERATING = np.linspace(0.04, 0.96, 12)


def clip_to_display(rgb: NDArray[np.float64]) -> NDArray[np.float64]:
    """Clip to what a display shows."""
    return np.clip(rgb, 0.0, 1.0)


def visible_distance(view: Viewpoint, delta_e: float) -> float:
    """Distance (m) from which on an object changes its pixel by less than a ΔE2000.

    The object is white or black, lit from above, seen level before the open water. Infinite if 500
    m are not enough.
    """
    P = _DISTANCES[:, None]
    water = view.reduction.apply(view.background)
    worst = np.zeros(len(P))
    for reflectance in (0.0, _WHITE):
        L = reflectance / math.pi * view.light
        seen = view.seen_level(L, P)
        difference = delta_e_CIE2000_images(
            clip_to_display(view.reduction.apply(seen)), clip_to_display(water)
        )
        worst = np.maximum(worst, difference)
    return _first_below(_DISTANCES, worst, delta_e)


def shaft_range(view: Viewpoint, delta_e: float) -> float:
    """Distance beyond which single scattering changes a level pixel by less than a ΔE2000, m."""
    # Along a level ray the water is the same, and so is the light that it scatters.
    single = view.field.single_scattering(view.depth, view.level)
    beyond = single * np.exp(-view.attenuation * _DISTANCES[:, None])
    water = view.background
    change = delta_e_CIE2000_images(
        clip_to_display(view.reduction.apply(water - beyond)),
        clip_to_display(view.reduction.apply(water)),
    )
    return _first_below(_DISTANCES, change, delta_e)


def lost_beyond(view: Viewpoint, bounces: Sequence[int] = BOUNCES) -> NDArray[np.float64]:
    """Upper bound of the fraction of diffuse light that was scattered more than k times.

    With every scattering and every reflection of the floor counted s times (b → s b at the same
    extinction, r → s r), the light field is the generating function Σ Eₙ sⁿ of its orders. For any
    s > 1 where it is finite, Σ_{n>k} Eₙ ≤ E(s)/s^{k+1}; the least of a few s is taken. Reflections
    of the surface are not counted.

    ``bounces`` are the k; the fraction, shape (k,), is the mean over the bands, weighted with the
    luminance of the diffuse light.
    """
    column, k = view.column, np.asarray(bounces)[:, None]
    light = _scattered(column, view)
    layers = column, *column.below
    albedo = np.max(
        [x.scattering / np.maximum(x.absorption + x.scattering, 1e-12) for x in layers], 0
    )
    room = 1.0 / np.maximum(albedo, 1e-9) - 1.0
    least = np.ones((len(k), len(light)))

    def more[Water: (WaterColumn, DeeperWater)](layer: Water, s: NDArray[np.float64]) -> Water:
        absorption = np.maximum(layer.absorption - (s - 1.0) * layer.scattering, 0.0)
        return replace(layer, absorption=absorption, scattering=s * layer.scattering)

    for part in _GENERATING:
        s = np.minimum(1.0 + part * room, 4.0)
        floor = np.minimum(s * column.floor_reflectance, 1.0)
        below = tuple(more(layer, s) for layer in column.below)
        brighter = replace(more(column, s), floor_reflectance=floor, below=below)
        orders = np.maximum(_scattered(brighter, view), light)
        least = np.minimum(least, orders / light * s ** -(k + 1.0))
    weights = np.maximum(luminance(view.reduction.weights.T), 0.0) * light
    return least @ (weights / weights.sum())


def _scattered(column: WaterColumn, view: Viewpoint) -> NDArray[np.float64]:
    """Scalar irradiance at a view's depth in some water, unscattered sunlight apart."""
    field = column.solved_field(view.phase, FEW_STREAMS, modes=1)
    sun = column.sun_irradiance / column.sun_cosine
    c = field.extinction_between(0.0, view.depth, scaled=False)
    direct = sun * np.exp(-c * view.depth / column.sun_cosine)
    light = field.scalar_irradiance(view.depth) - direct
    return np.maximum(light, np.finfo(np.float64).tiny)


def first_within[T](
    values: Sequence[T], errors: NDArray[np.float64], allowed: float
) -> tuple[T, float]:
    """Return the first value whose error is allowed, else the last, and its error."""
    index = int(np.argmax(errors <= allowed)) if (errors <= allowed).any() else len(values) - 1
    return values[index], float(errors[index])


@dataclass(frozen=True)
class CyclesSample:
    """A sample of Cycles: noise of a pixel in ΔE2000, which falls with the root of the samples.

    ``seconds`` is the CPU time of a pass of a megapixel, on the machine of the cost table.
    """

    delta_e: float
    seconds: float


def cycles_sample(view: Viewpoint) -> CyclesSample:
    """Return noise and time of a sample with the default phase function, within a factor of two.

    Interpolated, over the scatterings on the sun's slant path to the camera, of measured pictures.
    """
    columns = "scatterings", "delta_e", "seconds"
    table = read_table(DATA_DIRECTORY / "cycles_noise.csv", columns).columns
    weights = np.maximum(luminance(view.reduction.weights.T), 0.0) * view.light
    b = float(view.column.mixed_above(view.depth).scattering @ weights / weights.sum())
    x = b * view.depth / view.column.sun_cosine
    known, place = np.log(table["scatterings"]), math.log(max(x, 1e-9))
    delta_e, seconds = (np.interp(place, known, np.log(table[name])) for name in columns[1:])
    return CyclesSample(math.exp(delta_e), math.exp(seconds))


def _first_below(distances: NDArray, values: NDArray, limit: float) -> float:
    above = np.flatnonzero(values >= limit)
    if not above.size:
        return float(distances[0])
    return float(distances[above[-1] + 1]) if above[-1] + 1 < len(distances) else math.inf
