"""Random waters under a sun and a sky, and the light in them without any table."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import in_water_cosine, sun_travel_direction
from ..uw_spectral.transfer.solved_field import SolvedField
from ..uw_spectral.transfer.water_column import DeeperWater, WaterColumn
from ..uw_spectral.water.optical_properties import Water
from ..uw_spectral.water.phase import BandPhase
from ..uw_spectral.water.phase_functions import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from .sun_beam import SunBeam

WATERS = ("I", "IA", "IB", "II", "III", "1C", "3C", "5C", "7C", "9C")
KINDS = (
    ("hg:0.8", "clear", "flat"),
    ("hg:0.924", "overcast", "flat"),
    ("hg:0.95", "uniform", "none"),
    ("fournier-forand:1.10,0.0183", "clear", "flat"),
    ("fournier-forand:1.10,0.0183", "uniform", "none"),
    ("mixture", "clear", "flat"),
    ("mixture", "overcast", "flat"),
    ("mixture", "uniform", "flat"),
)
"""Phase function, sky and surface; a uniform sky is black here."""

FROM_SUN = 10.0
"""Angle to the sun in degrees from which on radiances are compared."""

_SEED, _LAYERED = 7, 100
_ABOVE = ("flat", "clear", 0.1), ("flat", "overcast", 0.1), ("none", "uniform", 0.0)
_INDEX = 1.34
_BANDS = 3
_DARK = 1e-8  # fraction of the light below which there is nothing to see
_ELEVATIONS, _AROUND = 16, 128  # directions of the light on a patch: of each quarter, and all


@dataclass(frozen=True, eq=False)
class Case:
    """A water column of three bands, its phase function, and a camera before a square.

    ``turn`` tilts the camera from straight down, degrees. ``square`` is a corner and two
    edges in camera axes, if there is one.
    """

    name: str
    column: WaterColumn
    phase: BandPhase
    depth: float
    turn: float
    square: tuple[Sequence[float], Sequence[float], Sequence[float]] | None

    @property
    def field(self) -> SolvedField:
        """The solved light field."""
        return self.column.solved_field(self.phase)

    @property
    def lit(self) -> NDArray[np.bool_]:
        """Bands with light to see by at the camera."""
        E0 = self.field.scalar_irradiance(np.array([0.0, self.depth]))
        return E0[1] >= _DARK * E0[0]


def cases(kind: int, count: int) -> Iterator[Case]:
    """Random cases of one of :data:`KINDS`: they differ in numbers alone."""
    random = np.random.default_rng([_SEED, kind])
    phase, sky, surface = KINDS[kind]
    for _ in range(count):
        name, nm = str(random.choice(WATERS)), np.sort(random.uniform(400, 700, _BANDS))
        water = Water.jerlov(name)
        a, b = water.a(nm), water.b(nm)
        depth = math.exp(random.uniform(math.log(0.2), math.log(30.0)))
        below = random.uniform(1.0, 10.0) if random.random() < 0.6 else math.inf
        zenith, azimuth = random.uniform(0, 80), random.uniform(0, 360)
        column = WaterColumn(
            Bands.uniform(_BANDS), a, b, np.ones(_BANDS), float(in_water_cosine(zenith)),
            np.asarray(sun_travel_direction(zenith, azimuth)),
            np.full(_BANDS, 0.0 if sky == "uniform" else random.uniform(0.05, 0.3)),
            depth + below, np.full(_BANDS, random.choice([0.0, 0.3])), surface, _INDEX, sky=sky,
        )  # fmt: skip
        lobes = parse_phase(phase).for_bands(b, molecular_scattering(nm))
        # The square lies in the water whichever way the camera looks.
        free = 0.5 * min(depth, below)
        distance = min(free, random.uniform(0.2, 2.0) / float(np.median(a + b)))
        yield Case(
            f"{name} {nm.round()} nm, {phase}, {sky}, {surface}, sun {zenith:.0f}°, "
            f"{depth:.2g} m over {below:.2g} m",
            column, lobes, depth, random.uniform(0.0, 180.0), _square(random, distance),
        )  # fmt: skip


def layered_cases(count: int) -> Iterator[Case]:
    """Random waters of two to four layers, each of another type, without a square."""
    for number in range(count):
        random = np.random.default_rng([_SEED, _LAYERED, number])
        nm = np.sort(random.uniform(400, 700, _BANDS))
        names = random.choice(WATERS, int(random.integers(2, 5)), replace=False)
        depth, below = math.exp(random.uniform(0.0, 3.0)), random.uniform(1.0, 10.0)
        tops = np.sort(random.uniform(0.1, 1.0, len(names) - 1)) * (depth + below)
        waters = [Water.jerlov(str(name)) for name in names]
        each = [
            (w.a(nm), w.b(nm), parse_phase("mixture").for_bands(w.b(nm), molecular_scattering(nm)))
            for w in waters
        ]
        deeper = tuple(
            DeeperWater(float(top), *part) for top, part in zip(tops, each[1:], strict=True)
        )
        zenith, azimuth = random.uniform(0, 80), random.uniform(0, 360)
        surface, sky, E_sky = _ABOVE[number % len(_ABOVE)]
        column = WaterColumn(
            Bands.uniform(_BANDS), *each[0][:2], np.ones(_BANDS), float(in_water_cosine(zenith)),
            np.asarray(sun_travel_direction(zenith, azimuth)), np.full(_BANDS, E_sky),
            depth + below if number % 2 else math.inf, np.full(_BANDS, 0.3), surface, _INDEX,
            deeper, sky,
        )  # fmt: skip
        ends = ", ".join(f"{top:.2g} m" for top in tops)
        yield Case(
            f"{'/'.join(map(str, names))} from {ends}, {nm.round()} nm, {sky}, {surface}, sun "
            f"{zenith:.0f}°, camera at {depth:.2g} m",
            column, each[0][2], depth, random.uniform(0.0, 60.0), None,
        )  # fmt: skip


def _square(
    random: np.random.Generator, distance: float
) -> tuple[Sequence[float], Sequence[float], Sequence[float]]:
    """Lay a square ahead at a distance, tilted by up to 65°."""
    tilt, turn = math.radians(random.uniform(0.0, 65.0)), random.uniform(0.0, 2.0 * math.pi)
    normal = np.array(
        [math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn), math.cos(tilt)]
    )
    first = np.cross(normal, [0.0, 1.0, 0.0])
    first *= 0.8 * distance / np.linalg.norm(first)
    second = np.cross(normal, first)
    corner = np.array([0.0, 0.0, -distance]) - (first + second) / 2
    return corner.tolist(), first.tolist(), second.tolist()


@dataclass(frozen=True, eq=False)
class LightAround:
    """Light from all sides at depths, without the direct sun and its forward peak.

    Nothing is tabulated, and directions are no streams: it is the source function of the
    solution along each ray, sunlight that its truncated phase function scatters once, and the
    images of surface and floor.
    """

    w: Sequence[NDArray[np.float64]]
    solid_angle: NDArray[np.float64]
    radiance: NDArray[np.float64]

    @classmethod
    def at(cls, column: WaterColumn, phase: BandPhase, depths: NDArray[np.float64]) -> LightAround:
        """Collect the light at depths, shape (d,)."""
        field = column.solved_field(phase)
        critical = math.sqrt(1.0 - column.refractive_index**-2) if column.reflects else 0.5
        nodes, weights = np.polynomial.legendre.leggauss(_ELEVATIONS)
        edges = (-1.0, -critical, 0.0, critical, 1.0)
        panels = list(itertools.pairwise(edges))
        mu = np.concatenate([low + (high - low) * (nodes + 1) / 2 for low, high in panels])
        weights = np.concatenate([(high - low) / 2 * weights for low, high in panels])
        turns = 2.0 * math.pi * (np.arange(_AROUND) + 0.5) / _AROUND
        azimuth = turns + math.atan2(column.sun_direction[1], column.sun_direction[0])
        across = np.sqrt(1.0 - mu**2)[:, None]
        w = np.broadcast_arrays(-across * np.cos(azimuth), -across * np.sin(azimuth), mu[:, None])
        up = mu > 0
        image = np.tile(field.floor_radiance, (*w[0].shape, 1))
        image[up] = field.surface_radiance([part[up] for part in w])
        beam = SunBeam(
            column.scattering, column.attenuation, field.extinction, column.sun_irradiance,
            column.sun_cosine, column.floor_depth, phase,
            column.sun_direction.tolist(), p=_truncated(column, phase, w),
        )  # fmt: skip
        rays = tuple(part[..., None] for part in w)
        y = depths[:, None, None, None]
        P = beam.boundary(y, rays)
        seen = np.moveaxis(field.scattered_on_grid(depths, mu, turns), 0, -1)
        seen = seen + beam.single_scattering(y, rays, P, without_peak=True)
        seen = seen + np.exp(-field.extinction * P) * image
        return cls(w, weights[:, None] * (2.0 * math.pi / _AROUND), seen)

    def on_patch(self, normal: Sequence[float]) -> NDArray[np.float64]:
        """Irradiance on a patch, shape (d, n)."""
        cosine = sum(n * part for n, part in zip(normal, self.w, strict=True))
        return np.einsum("dvhn,vh->dn", self.radiance, np.maximum(cosine, 0.0) * self.solid_angle)


def _truncated(
    column: WaterColumn, phase: BandPhase, w: Sequence[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Phase function of the solution, its peak f taken out: the moments that the streams carry."""
    count = 2 * len(column.solved_field(phase).mu)
    chi = np.vstack([np.ones(len(phase)), phase.moments(count)])
    terms = (2.0 * np.arange(count) + 1.0)[:, None] * (chi[:count] - chi[count]) / (4.0 * math.pi)
    cosine = -sum(s * part for s, part in zip(column.sun_direction, w, strict=True))
    return np.moveaxis(np.polynomial.legendre.legval(cosine, terms), 0, -1)
