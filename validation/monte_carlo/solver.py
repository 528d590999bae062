"""Set up the photons of a water column, run them in batches, and gather the result."""

from __future__ import annotations

import collections
import importlib.util
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...uw_spectral.errors import InputError, unknown_name
from ...uw_spectral.surface.refraction import fresnel_reflectance
from ...uw_spectral.transfer.sky import UNIFORM
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase
from . import photons as numpy_engine
from .medium import Constituent, InelasticInteraction, Interactions, interactions
from .phase_tables import LOOKUP_CELLS, cone_average, cumulative, on_even_grid, s2_grid
from .photons import PhaseTables, Tallies
from .results import Estimate, Event, Light, Moments, MonteCarloResult

ENGINES = ("auto", "numpy", "numba")
SKIES = (UNIFORM, "cardioidal")
BOUNDARY_EVENTS = ("left through the surface", "absorption by the floor")

_BATCH = 20_000
_FEWEST_BATCHES = 20
_LEVEL = 1e-3  # vertical cosine below which a view never leaves a layer of the water
_MOST_PHOTONS = 10**13

View = tuple[float, Sequence[float]] | tuple[float, Sequence[float], float]
"""Depth and direction; with a distance, only the water up to it is seen."""


def simulate(
    column: WaterColumn,
    water: BandPhase | Sequence[Constituent],
    depths: ArrayLike = (),
    *,
    views: Sequence[View] = (),
    inelastic: Sequence[InelasticInteraction] = (),
    photons: int = 1_000_000,
    seed: int = 0,
    engine: str = "auto",
    threads: int = 1,
    sky: str = "uniform",
    cone: float = 1.0,
    progress: Callable[[int, int], None] | None = None,
) -> MonteCarloResult:
    """Trace photons through a plane-parallel water column.

    Every band starts the same number of photons. At each event one roulette
    chooses among all absorptions, scatterings and inelastic processes; photons
    carry their power unchanged until they are absorbed, leave, or change band.

    Parameters
    ----------
    column : WaterColumn
        Water, sun below the surface, sky, floor and surface. Irradiances are
        spectral; the widths of the bands carry power from one to another.
    water : BandPhase or sequence of Constituent
        Phase function of the column's scattering, or its constituents.
    depths : array_like, shape (d,)
        Where to measure irradiance, m, increasing, from 0 to the floor.
    views : sequence of (depth, direction) or (depth, direction, distance)
        Radiance meters: depth in m, and the unit direction that they look in
        (x, y horizontal, z up), not level. With a distance in m, or infinity,
        the path radiance: only the light scattered up to there, at most to the
        surface or floor.
    seed : int
        The same seed, engine and inputs give the same numbers.
    engine : str
        ``"numpy"``, ``"numba"``, or ``"auto"``: numba where it is installed.
    threads : int
        Batches traced at the same time; does not change the numbers.
    sky : str
        ``"uniform"``, or ``"cardioidal"`` (∝ 1 + 2 cos of the zenith angle)
        of the same horizontal irradiance.
    cone : float
        Half angle in degrees over which a radiance is averaged, 0.1 to 10.
    progress : callable, optional
        Called with the photons done and in total.

    Raises
    ------
    InputError
        If anything given cannot be used.

    Notes
    -----
    Irradiances are expected values: each flight adds the probability to reach
    each depth, so that every photon counts everywhere. Light that a scattering
    sends back is rare; it is estimated twice, from the direction that the
    photon takes and from an even one, weighted by the balance heuristic of
    E. Veach & L. J. Guibas, SIGGRAPH 95, 419. Radiances are next-event
    estimates: each scattering adds the light that it sends towards the meter,
    also by way of the surface; the water being level, no distance can vanish.
    Standard errors are those of independent batches. 1/cos makes the variance
    of E0 diverge, as the logarithm of the number of photons only.
    """
    trace, engine = _engine(engine)
    count, threads = _whole("photons", photons), _whole("threads", threads)
    seed = _whole("seed", seed, 0)
    if count > _MOST_PHOTONS or seed >= 2**63:
        raise InputError("Monte Carlo: at most 1e13 photons, and a seed below 2^63")
    if not 0.1 <= cone <= 10:
        raise InputError(f"Monte Carlo: the cone of a view must be 0.1 to 10 degrees, got {cone:g}")
    medium = interactions(column, water, inelastic)
    depths = _depths(column, depths)
    views = tuple(_view(column, view) for view in views)
    sky_light = _Sky(column, sky)
    _check_light(column, medium, sky_light)
    t = _tables(column, medium, depths, views, sky_light, math.radians(cone))

    n = len(column.bands)
    batches = max(_FEWEST_BATCHES, math.ceil(count / _BATCH))
    per_band = math.ceil(count / (batches * n))

    def run(batch: int) -> Tallies:
        rng = np.random.Generator(np.random.Philox(key=[seed, batch]))
        out = Tallies.empty(t)
        trace(rng, per_band, t, out)
        return out

    flux, radiance = Moments(), Moments()
    events = np.zeros((3, len(t.roulette) + 2, n))
    for done, out in enumerate(_in_order(run, batches, threads), start=1):
        per_photon = 1.0 / (per_band * column.bands.widths)
        scalar = out.flux[numpy_engine.EOD] + out.flux[numpy_engine.EOU]
        flux.add(_with_total(np.concatenate([out.flux, scalar[None]]), axis=1) * per_photon)
        radiance.add(_with_total(out.radiance, axis=0) * per_photon)
        events += np.stack([out.events, out.energy, out.deposit])
        if progress is not None:
            progress(done * per_band * n, batches * per_band * n)

    irradiance, L = flux.estimate(), radiance.estimate()
    skylight = np.array([sky_light.radiance(view, t.c) for view in views]).reshape(-1, n)
    L.mean[:2] += skylight  # the total and the elastic part
    lights = [
        Light(*map(Estimate, irradiance.mean[:, i], irradiance.error[:, i]), L=Estimate(*radiances))
        for i, radiances in enumerate(zip(L.mean, L.error, strict=True))
    ]
    scale = 1.0 / (batches * per_band)
    return MonteCarloResult(
        wavelengths=column.bands.centres,
        depths=depths,
        views=views,
        total=lights[0],
        parts=dict(zip(("elastic", *(p.name for p in inelastic)), lights[1:], strict=True)),
        events=tuple(
            Event(name, np.rint(number).astype(np.int64), power * scale, deposit * scale)
            for name, number, power, deposit in zip(
                (*medium.names, *BOUNDARY_EVENTS), *events, strict=True
            )
        ),
        incident=t.packet.copy(),
        photons=batches * per_band * n,
        engine=engine,
        seed=seed,
    )


def numba_available() -> bool:
    """Return whether the numba engine can be used."""
    return importlib.util.find_spec("numba") is not None


class _Sky:
    """Skylight as it enters the water."""

    def __init__(self, column: WaterColumn, shape: str) -> None:
        if shape not in SKIES:
            raise unknown_name("sky", shape, SKIES)
        if column.sky != UNIFORM:
            raise InputError(
                f"Monte Carlo: the column's sky is {column.sky}; give it a uniform one, and the "
                f"shape as sky: {', '.join(SKIES)}"
            )
        self._column = column
        self._n = float(column.refractive_index) if column.reflects else 1.0
        if not (math.isfinite(self._n) and self._n >= 1):
            raise InputError(
                f"Monte Carlo: the refractive index must be at least 1, got {self._n:g}"
            )
        self._slope = 2.0 if shape == "cardioidal" else 0.0
        edges = np.linspace(0, 1, 8193)  # of the squared cosine in air: even steps of irradiance
        middle = np.sqrt((edges[1:] + edges[:-1]) / 2)
        fractions = self._relative(middle) * (1 - self._fresnel(middle)) * np.diff(edges)
        self.irradiance = math.pi * column.sky_radiance * fractions.sum()
        self.cdf = np.concatenate([[0.0], np.cumsum(fractions)]) / fractions.sum()
        self.cosine = np.sqrt(1 - (1 - edges) / self._n**2)

    def radiance(self, view: View, c: NDArray) -> NDArray[np.float64]:
        """Skylight that reaches a view without an event."""
        depth, w, *distance = view
        sine2 = self._n**2 * (1 - w[2] ** 2)
        if distance or w[2] <= 0 or sine2 >= 1:
            return np.zeros(len(c))
        cosine = math.sqrt(1 - sine2)
        entering = self._relative(cosine) * (1 - self._fresnel(cosine)) * self._n**2
        return self._column.sky_radiance * entering * np.exp(-c * depth / w[2])

    def _relative(self, cosine: ArrayLike) -> NDArray[np.float64]:
        """Radiance over that of the uniform sky of the same irradiance."""
        return (1 + self._slope * np.asarray(cosine)) / (1 + 2 * self._slope / 3)

    def _fresnel(self, cosine: ArrayLike) -> NDArray[np.float64]:
        return fresnel_reflectance(np.asarray(cosine), self._n)


def _tables(
    column: WaterColumn,
    medium: Interactions,
    depths: NDArray,
    views: Sequence[View],
    sky: _Sky,
    cone: float,
) -> PhaseTables:
    coefficients, n = medium.coefficients, len(column.bands)
    c = coefficients.sum(axis=0)
    roulette = np.cumsum(coefficients, axis=0) / np.where(c > 0, c, 1.0)
    # No event of probability 0 may be left for the last rounding error.
    last = len(roulette) - 1 - np.argmax(coefficients[::-1] > 0, axis=0)
    roulette[np.arange(len(roulette))[:, None] >= last] = 1.0
    phases = [*medium.phases.values(), *(process.phase for process in medium.inelastic)]
    s2 = s2_grid(phases)
    meters = _meters(column, views)
    floor_planar, floor_scalar = _from_floor(column, depths, c)
    index = float(column.refractive_index) if column.reflects else 1.0
    incoming = column.sun_irradiance + sky.irradiance
    centres = column.bands.centres
    tables = PhaseTables(
        c=c,
        roulette=roulette,
        absorptions=len(medium.absorption),
        inelastic_from=len(medium.absorption) + len(medium.scattering),
        s2=s2,
        cdf=np.array([cumulative(phase, s2) for phase in phases]).reshape(-1, len(s2)),
        density=np.array([on_even_grid(p) for p in phases]).reshape(-1, LOOKUP_CELLS + 1),
        seen=np.array([cone_average(p, cone) for p in phases if views]).reshape(
            -1, LOOKUP_CELLS + 1
        ),
        emission=np.array([np.cumsum(p.redistribution, axis=1) for p in medium.inelastic]).reshape(
            -1, n, n
        ),
        energy_ratio=centres[:, None] / centres[None, :],
        packet=incoming * column.bands.widths,
        sun_fraction=np.divide(
            column.sun_irradiance, incoming, out=np.ones(n), where=incoming > 0
        ),
        sun=_sun(column),
        sky_cdf=sky.cdf,
        sky_cosine=sky.cosine,
        refractive_index=index,
        floor=float(column.floor_depth),
        floor_reflectance=np.ascontiguousarray(column.floor_reflectance),
        floor_planar=floor_planar,
        floor_scalar=floor_scalar,
        depths=depths,
        **meters,
    )  # fmt: skip
    # One memory layout, so that numba compiles once.
    return PhaseTables._make(
        np.array(x, order="C") if isinstance(x, np.ndarray) else x for x in tables
    )


def _from_floor(
    column: WaterColumn, depths: NDArray, c: NDArray
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Eu and Eou at each depth of a Lambertian floor of unit irradiance: 2 E3(τ) and 2 E2(τ)."""
    if column.floor_depth == math.inf:
        nothing = np.zeros((len(depths), len(c)))
        return nothing, nothing
    # μ = t³ resolves the kink of exp(-τ/μ) at the level.
    nodes, weights = np.polynomial.legendre.leggauss(200)
    t = (nodes + 1) / 2
    mu, width = t**3, 3 * t**2 * weights / 2
    tau = (column.floor_depth - depths)[:, None, None] * c[:, None]
    seen = np.exp(-tau / mu)
    return 2 * (seen * mu * width).sum(axis=-1), 2 * (seen * width).sum(axis=-1)


def _meters(column: WaterColumn, views: Sequence[View]) -> dict[str, NDArray[np.float64]]:
    """Return the fields of :class:`.Tables` that describe the radiance meters."""
    depth = np.array([view[0] for view in views], dtype=np.float64)
    travel = -np.array([view[1] for view in views], dtype=np.float64).reshape(-1, 3)
    distance = np.array([view[2] if len(view) > 2 else math.inf for view in views])
    whole = np.array([len(view) == 2 for view in views], dtype=bool)
    down = travel[:, 2] < 0
    end = depth + travel[:, 2] * distance
    index = column.refractive_index if column.reflects else 1.0
    mirror = fresnel_reflectance(np.abs(travel[:, 2]), 1.0 / index) * (down & whole)
    return {
        "meter_depth": depth,
        "meter_travel": travel,
        "meter_low": np.where(down, np.maximum(end, 0.0), depth),
        "meter_high": np.where(down, depth, end),
        "meter_mirror": mirror,
        "meter_floor": np.where(down, mirror, whole * 1.0),
    }


def _in_order(run: Callable[[int], Tallies], batches: int, threads: int) -> Iterator[Tallies]:
    """Yield the batches in order; at most a few wait in memory."""
    if threads == 1:
        yield from map(run, range(batches))
        return
    with ThreadPoolExecutor(threads) as pool:
        waiting: collections.deque = collections.deque()
        for batch in range(batches):
            waiting.append(pool.submit(run, batch))
            if len(waiting) > 2 * threads:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


def _with_total(values: NDArray, axis: int) -> NDArray:
    return np.concatenate([values.sum(axis=axis, keepdims=True), values], axis=axis)


def _engine(name: str) -> tuple[Callable[..., None], str]:
    if name not in ENGINES:
        raise unknown_name("Monte Carlo engine", name, ENGINES)
    if name == "numpy" or (name == "auto" and not numba_available()):
        return numpy_engine.trace, "numpy"
    if not numba_available():
        raise InputError("Monte Carlo: numba is not installed; pip install numba, or use numpy")
    from . import photons_numba

    return photons_numba.trace, "numba"


def _whole(name: str, value: float, least: int = 1) -> int:
    if isinstance(value, bool) or not math.isfinite(value) or value != int(value) or value < least:
        raise InputError(f"Monte Carlo: {name} must be a whole number from {least}, got {value!r}")
    return int(value)


def _depths(column: WaterColumn, depths: ArrayLike) -> NDArray[np.float64]:
    depths = np.asarray(depths, dtype=np.float64)
    if depths.ndim != 1 or np.any(np.diff(depths) <= 0) or not np.all(np.isfinite(depths)):
        raise InputError("Monte Carlo: give the depths as an increasing list of finite numbers")
    for depth in depths:
        _check_depth(column, depth)
    return depths


def _check_depth(column: WaterColumn, depth: float) -> None:
    if not (math.isfinite(depth) and 0 <= depth <= column.floor_depth):
        raise InputError(
            f"Monte Carlo: depth {depth:g} m is not between the surface and the floor at "
            f"{column.floor_depth:g} m"
        )


def _view(column: WaterColumn, view: View) -> View:
    try:
        depth, w, *distance = view
        depth, w = float(depth), np.asarray(w, dtype=np.float64)
        distance = [float(x) for x in distance]
    except (TypeError, ValueError) as error:
        raise InputError(
            "Monte Carlo: a view is a depth, a direction of three numbers and perhaps a distance"
        ) from error
    _check_depth(column, depth)
    if w.shape != (3,) or not np.all(np.isfinite(w)) or abs(np.linalg.norm(w) - 1) > 1e-6:
        raise InputError(f"Monte Carlo: a view direction must be a unit vector, got {w.tolist()}")
    if abs(w[2]) < _LEVEL:
        raise InputError("Monte Carlo: a level view has no end in level water; tilt it a little")
    if len(distance) > 1 or not all(x > 0 for x in distance):
        raise InputError("Monte Carlo: the distance of a view must be one positive number")
    direction = tuple(w.tolist())
    return (depth, direction, distance[0]) if distance else (depth, direction)


def _sun(column: WaterColumn) -> NDArray[np.float64]:
    sun = np.asarray(column.sun_direction, dtype=np.float64)
    if (
        sun.shape != (3,)
        or not abs(np.linalg.norm(sun) - 1) < 1e-6
        or not abs(sun[2] + column.sun_cosine) < 1e-6
        or not sun[2] < 0
    ):
        raise InputError(
            f"Monte Carlo: the sun must travel down along a unit vector whose z is minus its "
            f"cosine {column.sun_cosine:g}, got {sun.tolist()}"
        )
    return sun


def _check_light(column: WaterColumn, medium: Interactions, sky: _Sky) -> None:
    if not np.any(column.sun_irradiance + sky.irradiance > 0):
        raise InputError("Monte Carlo: no light enters the water; give a sun or a sky")
    absorbing = sum(medium.absorption.values(), np.zeros(len(column.bands)))
    if column.floor_depth == math.inf and np.any(absorbing <= 0):
        raise InputError(
            "Monte Carlo: light in endless water without absorption never ends; "
            "give a floor depth or some absorption"
        )
