"""The light of solved water projected into channels: tables that know no number of bands.

What a pixel gets is linear in the spectrum of the light, so the sums over the bands are taken here,
once, and a renderer looks up three channels. Where light is dimmed over a distance after it is
looked up, its three channels stand for its spectrum: at every depth the spectra of light from all
directions are regressed on their channels, and the regression, dimmed, is what is tabulated. So
light with the spectrum of the water passes exactly, and so does everything if channels are bands.

Tables over distance are divided by e^{-κP}, so that they vary slowly; positions are formulas over
a :class:`.Mathematics`, as of :mod:`.radiance_table`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..water.phase import PhaseFunction
from .aureole import WIDEST
from .channels import Channels
from .depth_scale import DepthScale
from .radiance_table import (
    AZIMUTHS,
    ELEVATIONS,
    TURNS,
    RadianceTable,
    angles,
    azimuths,
    decay_rate,
    elevations,
    interpolate,
    tabulate,
    tilts,
)
from .solved_field import SolvedField
from .sun_beam import half_angle2

RATES = ("extinction", "peak", "scattering", "mean_extinction", "sun_decay")
"""Numbers that layered water has of every depth."""
ALONG = {
    "rates": len(RATES), "occlusion_matrix": 6, "image_transmittance": 2, "sky": 1,
    "glitter": 1, "floor": 1, "mirrored": 3,
}  # fmt: skip
"""Tables over depth or distance alone, and the sets of three channels that each has."""
ALONG_SUNLIGHT = ("single", "drawn", "drawn_at")
"""More of water of one layer, a set for each part of the phase function."""
ON_PATCH, ON_PATH = 0, 1
"""Light that the spectrum of the occlusion works on."""
LENGTHS = 96
"""Distances that tables over distance have."""
_FARTHEST = 5e3  # m
_GONE = 16.0  # optical depths after which no light counts
_FIRST = 0.3  # optical depths of the scale of the first distances
_SEEN = 1e-3  # fraction of a channel from which on a band counts for its slowest decay
_RIDGE = 1e-6  # of the regression, relative to the mean squares of what it stands on
_EVERY = 4, 6  # of the elevations and azimuths whose spectra are regressed
_PATHS = 24, 48, 72  # of the distances whose light counts for what the occlusion makes of it
_NOTHING = 1e-30
_LARGEST_EXPONENT = 40.0

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LengthScale:
    """Where distances lie among so many: evenly at first, by their logarithm later.

    Examples
    --------
    >>> scale = LengthScale.up_to(100.0, 0.5)
    >>> scale.place(np.array([0.0, 100.0])).round(6), scale.lengths()[1].round(4)
    (array([ 0., 95.]), np.float64(0.0287))
    """

    first: Operand
    per_log: Operand

    @classmethod
    def up_to(cls, farthest: float, first: float) -> LengthScale:
        """Return the scale that ends at a distance, even up to about the ``first`` one, m."""
        return cls(first, (LENGTHS - 1) / math.log1p(farthest / first))

    def place(self, P: Operand, m: Mathematics = NUMPY) -> Operand:
        """Position of a distance among :data:`LENGTHS`; what is farther is the last."""
        return m.minimum(self.per_log * m.log(1.0 + P / self.first), LENGTHS - 1.0)

    def held(self, P: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return a distance, or the last one where it is farther, m."""
        return m.minimum(P, self.first * (m.exp((LENGTHS - 1.0) / self.per_log) - 1.0))

    def step(self, P: Operand) -> Operand:
        """Difference in m between two places at a distance."""
        return (P + self.first) / self.per_log

    def lengths(self) -> Array:
        """All of them, m."""
        return self.first * np.expm1(np.arange(LENGTHS) / self.per_log)


@dataclass(frozen=True, eq=False)
class ChannelNumbers:
    """What formulas need besides tables; channels are arrays of three, or vectors of a shader.

    Attributes
    ----------
    scale, decay : channels
        Light in the tables of depth and direction is divided by ``scale e^{-decay y}``.
    extinction : channels
        κ: tables over distance are divided by e^{-κP}, 1/m. In layered water, where each depth
        has its own, it is :attr:`ChannelTables.rates`, as are the next four.
    peak : channels
        Part of the extinction that scatters forward and counts as unscattered, 1/m.
    scattering : channels
        Scattering coefficient b, 1/m.
    mean_extinction : channels
        Without that part, and of all that a channel sees at the camera, 1/m.
    sun_decay : channels
        Sunlight in its table is divided by e^{-κs y} besides, 1/m.
    single_decay : channels
        Sunlight scattered once is divided by e^{-x}, for the optical path x times this.
    mu_s, y_f : float
        Cosine of the in-water zenith angle; depth of the floor, m.
    """

    scale: Operand
    decay: Operand
    extinction: Operand
    peak: Operand
    scattering: Operand
    mean_extinction: Operand
    sun_decay: Operand
    single_decay: Operand
    lengths: LengthScale
    mu_s: Operand
    y_f: Operand


@dataclass(frozen=True, eq=False)
class ChannelTables:
    """Tables of three channels; make them with :func:`project`. The first axis is the channel.

    Attributes
    ----------
    components : tuple of PhaseFunction
        The k parts of the phase function.
    scattered : array, shape (3, slices, ELEVATIONS, AZIMUTHS)
        M(y, w).
    beyond : array, of that shape
        Sunlight that is scattered once ahead.
    irradiance : array, shape (3, slices, TILTS, TURNS)
        On patches, without the direct sun; with the sun's forward peak unless objects occlude.
    aureole : array, shape (3, slices, ANGLES)
        Factor on sunlight scattered once.
    dimmed : array, shape (3, 3, slices, LENGTHS)
        [j]: what is left over a distance of light at a depth, per unit of its channel j.
    peaked : array, of that shape
        The same where light that the forward peak scatters counts as unscattered, over that.
    matte : array, shape (3, 3 + i, 3, slices, LENGTHS)
        [j, k]: the same of what colour k reflects of it; after red, green and blue measured ones.
    sunlit : array, shape (3 + i, 3, slices, LENGTHS)
        [k]: what is left over a distance of direct sunlight on colour k, normal irradiance.
    caustics : array, shape (3 + i, 3, slices, LENGTHS), or (0, ...) without waves
        [k]: what is added to that per unit of the waves' pattern above 1.
    glowing : array, shape (3 + e, 3, slices, LENGTHS)
        [k]: of the light of a lamp of colour k; after red, green and blue other emissions.
    occlusion_matrix : array, shape (2, 3, 3, slices)
        [i, j]: of light times the spectrum of the occlusion, per unit of its channel j: on patches
        (:data:`ON_PATCH`) or along paths (:data:`ON_PATH`).
    rates : array, shape (5, 3, slices)
        Those of :data:`RATES` of :class:`ChannelNumbers`, by depth.
    parts : array, shape (k, 3)
        Fraction of each part of the phase function in the scattering about the camera.
    image : array, shape (3, ELEVATIONS, AZIMUTHS)
        Radiance of the surface from just below, and of the floor.
    image_transmittance : array, shape (2, 3, LENGTHS)
        Fraction of that which is left over a distance: of the surface, of the floor.
    sky, glitter, floor : array, shape (3, LENGTHS)
        Of the sky per its relative radiance, of the sun's irradiance, of the floor.
    mirrored : array, shape (3, 3, LENGTHS)
        [j]: of light that the surface mirrors down.
    single : array, shape (k, 3, LENGTHS), or (k, 3, ELEVATIONS, LENGTHS)
        Sunlight scattered once: what is left of it after an optical path, or, in layered
        water, between the camera and a distance along an elevation, per distance.
    drawn, drawn_at : array, shape (k, 3, LENGTHS)
        The same with the whole extinction, and its density; of water of one layer.
    layered : bool
        Whether the water differs with depth: then all holds for one depth of the camera.
    fastest : float
        Largest extinction of the bands, 1/m.
    """

    numbers: ChannelNumbers
    depth_scale: DepthScale
    components: tuple[PhaseFunction, ...]
    scattered: Array
    beyond: Array
    irradiance: Array
    aureole: Array
    dimmed: Array
    peaked: Array
    matte: Array
    sunlit: Array
    caustics: Array
    glowing: Array
    occlusion_matrix: Array
    rates: Array
    parts: Array
    image: Array
    image_transmittance: Array
    sky: Array
    glitter: Array
    floor: Array
    mirrored: Array
    single: Array
    drawn: Array
    drawn_at: Array
    layered: bool
    fastest: float


@dataclass(frozen=True, eq=False)
class OcclusionSpectrum:
    """What objects do to the spectrum of light.

    Attributes
    ----------
    spectrum : array, shape (n,)
        The one that light is multiplied with besides a number for all bands.
    typical : array, shape (k, n)
        What is left of light at some usual places, of any scale.
    low_stream_field : SolvedField
        Of the same water in fewer streams: what counts as unscattered there does here, so that the
        light that shade works on changes with direction no faster than occlusion is known.
    """

    spectrum: Array
    typical: Array
    low_stream_field: SolvedField


@dataclass(frozen=True, eq=False)
class _Spectra:
    """The light of n bands that is projected.

    ``low_stream_field`` tells what of it is unscattered, and scattered once. ``c`` and ``cp`` are
    mean extinctions (d, n) from the camera to the depths, ``c_up`` and ``cp_up`` (n,) to the
    surface, ``cp_down`` to the floor.
    """

    field: SolvedField
    low_stream_field: SolvedField
    table: RadianceTable
    channels: Channels
    depths: Array
    c: Array
    cp: Array
    c_up: Array
    cp_up: Array
    cp_down: Array
    lengths: LengthScale

    @property
    def unit(self) -> Array:
        """What the tables of the bands are divided by, (n, d)."""
        return self.table.scale[:, None] * np.exp(-self.table.decay[:, None] * self.depths)

    @functools.cached_property
    def transmittance(self) -> Array:
        """Fraction that is left of light at the depths after all distances, (d, l, n)."""
        return _transmittance(self.c, self.lengths)


def project(
    field: SolvedField,
    channels: Channels,
    eye: float,
    sky: Array,
    measured: Sequence[Array] = (),
    occlusion: OcclusionSpectrum | None = None,
    contrast: Callable[[Array], Array] | None = None,
    emissions: Sequence[Array] = (),
) -> ChannelTables:
    """Project a solved field.

    Parameters
    ----------
    field : SolvedField
        Of n bands.
    channels : Channels
        Of the same bands.
    eye : float
        Depth of the camera, m; it matters where water differs with depth.
    sky : array, shape (n,)
        Level of the sky's radiance in air.
    measured : sequence of array, shape (n,)
        Measured reflectances.
    occlusion : Shades, optional
        If objects occlude: the sun's forward peak is then part of the direct sun.
    contrast : callable, optional
        Of caustics, at depths (d,), of shape (d, n), under waves.
    emissions : sequence of array, shape (n,)
        Radiance of objects that emit what is no colour.
    """
    table = tabulate(field)
    depths = table.depth_scale.depths()
    occluded = occlusion is not None
    low_stream_field = field if occlusion is None else occlusion.low_stream_field
    eye = min(max(eye, 0.0), field.floor_depth)

    def mean(z: float | Array, *, scaled: bool) -> Array:
        return low_stream_field.extinction_between(eye, z, scaled=scaled)

    bottom = min(field.floor_depth, float(table.depth_scale.deepest))
    c, cp = mean(depths, scaled=False), mean(depths, scaled=True)
    E = field.light.E
    light = np.maximum(E, field.scalar_irradiance(eye))
    counts = _counting(np.abs(channels.weights) * light)
    slowest = _slowest(counts, c)  # (d, 3)
    fastest = float(c.max())
    lengths = LengthScale.up_to(
        min(_GONE / max(float(slowest.min()), 1e-4), _FARTHEST), _FIRST / max(fastest, 1e-3)
    )
    spectra = _Spectra(
        field, low_stream_field, table, channels, depths, c, cp, mean(0.0, scaled=False),
        mean(0.0, scaled=True), mean(bottom, scaled=True), lengths,
    )  # fmt: skip
    # Weighed as what is left after a distance over which forward scattering counts.
    arriving = light * np.exp(-c[:, None] / slowest[..., None])  # (d, 3, n)
    peak = np.diagonal(channels.mean((c - cp)[:, None], arriving), axis1=1, axis2=2)
    peak = np.minimum(peak, 0.98 * slowest)
    b = field.scattering_between(eye, depths)
    b = np.diagonal(channels.mean(b[:, None], arriving), axis1=1, axis2=2)
    scattering = np.clip(b, peak, 0.98 * slowest)
    here = field.scattering_at([eye])[0] * field.scalar_irradiance(eye)
    parts = [channels.mean(field.weight_at(eye, part), here) for part in field.components]
    mean_extinction = channels.mean(cp, field.scalar_irradiance(eye))
    beyond = _directed(spectra, _beyond(low_stream_field, table.depth_scale).at)
    scattered = _directed(spectra, _scattered(spectra))
    irradiance = _directed(spectra, _irradiance(spectra, occluded=occluded))
    decay, scale = _unit(spectra, np.maximum(scattered.most, irradiance.most))
    over = (scale[:, None] * np.exp(-decay[:, None] * depths))[..., None, None]
    way = np.exp(-slowest.T[..., None] * lengths.lengths())  # (3, d, l)
    forward = np.exp(-(slowest - peak).T[..., None] * lengths.lengths())
    bases = np.column_stack([channels.reflectance, *measured])
    sun_decay, sunlit, caustics = _sunlit(spectra, bases, counts, contrast, occluded=occluded)
    single_decay, single, drawn, drawn_at = _single(spectra, eye, counts)
    numbers = ChannelNumbers(
        scale, decay, slowest[0], peak[0], scattering[0], mean_extinction[0], sun_decay[0],
        single_decay, lengths, field.light.mu_s, field.floor_depth,
    )  # fmt: skip
    image, image_transmittance = _image(spectra)
    dimmed, peaked = _dimmed(spectra, [scattered.some, beyond.some])
    emitted = np.column_stack([channels.emission, *emissions])
    glow = channels.project_colours(spectra.transmittance, emitted)
    up = np.exp(-spectra.cp_up * lengths.lengths()[:, None])
    sun_up = np.exp(-spectra.c_up * lengths.lengths()[:, None])
    down = np.exp(-spectra.cp_down * lengths.lengths()[:, None])
    return ChannelTables(
        numbers,
        table.depth_scale,
        field.components,
        scattered.projected / over,
        beyond.projected / over,
        irradiance.projected / over,
        _aureole(spectra),
        dimmed / way,
        peaked / forward,
        _matte(spectra, bases, irradiance.some, occlusion) / way,
        sunlit / way,
        caustics / way,
        np.moveaxis(glow, (0, 1, 2, 3), (2, 3, 1, 0)) / way,
        _occlusion_matrix(spectra, scattered.some, beyond.some, irradiance.some, occlusion),
        np.array([slowest.T, peak.T, scattering.T, mean_extinction.T, sun_decay.T]),
        np.array(parts),
        image,
        image_transmittance / np.swapaxes(forward[:, [0, -1]], 0, 1),
        channels.project(sky * up).T / forward[:, 0],
        channels.project(E * sun_up).T / way[:, 0],
        channels.project(field.floor_radiance * down).T / forward[:, -1],
        _mirrored(spectra, scattered.some, beyond.some) / forward[:, 0],
        single,
        drawn,
        drawn_at,
        field.layered,
        fastest,
    )


def _counting(fractions: Array) -> NDArray[np.bool_]:
    """Bands (3, n) that have a fraction in a channel worth counting."""
    total = fractions.sum(axis=1, keepdims=True)
    return fractions > _SEEN * np.maximum(total, _NOTHING)


def _slowest(counts: NDArray[np.bool_], rates: Array) -> Array:
    """Least rate (d, n) of the bands that count in each channel, (d, 3)."""
    least = np.where(counts, rates[:, None], math.inf).min(axis=-1)
    return np.where(np.isfinite(least), least, rates.min(axis=1, keepdims=True))


@dataclass(frozen=True, eq=False)
class _Directed:
    """Light at all depths from all directions: its channels, and what else tables need of it.

    Attributes
    ----------
    projected : array, shape (3, d, v, h)
    most : array, shape (n, d)
        Largest from any direction.
    some : array, shape (n, d, i, j)
        From some of the directions.
    """

    projected: Array
    most: Array
    some: Array


def _directed(spectra: _Spectra, at: Callable[[int], Array]) -> _Directed:
    """Fold light whose bands (n, v, h) are made depth by depth, for all would be too many."""
    rows, columns = _EVERY
    projected, most, some = [], [], []
    for place in range(len(spectra.depths)):
        light = at(place)
        flat = spectra.channels.weights @ light.reshape(len(light), -1)
        projected.append(flat.reshape(-1, *light.shape[1:]))
        most.append(light.max(axis=(1, 2)))
        some.append(light[:, rows // 2 :: rows, ::columns])
    return _Directed(*(np.stack(parts, axis=1) for parts in (projected, most, some)))


def _scattered(spectra: _Spectra) -> Callable[[int], Array]:
    """Return M (n, v, h) by depth: all light but what is ahead unscattered or scattered once."""
    field, low_stream_field, depths = spectra.field, spectra.low_stream_field, spectra.depths
    table, unit = spectra.table, spectra.unit[..., None, None]
    if low_stream_field is field:
        return lambda place: table.radiance[:, place] * unit[:, place]
    mu = elevations()
    ends = np.where(mu > 0, 0.0, min(field.floor_depth, _FARTHEST))
    P = np.abs(depths[:, None] - ends) / np.abs(mu)

    def transmittance(water: SolvedField) -> Array:
        c = water.extinction_between(depths[:, None], ends, scaled=True)
        return np.moveaxis(np.exp(-c * P[..., None]), -1, 0)

    image = table.image * table.scale[:, None, None]
    gone = (transmittance(field) - transmittance(low_stream_field))[..., None]
    of_field, of_straight = (_beyond(x, table.depth_scale) for x in (field, low_stream_field))

    def at(place: int) -> Array:
        M = table.radiance[:, place] * unit[:, place]
        M += of_field.at(place) - of_straight.at(place) + gone[:, place] * image
        return np.maximum(M, 0.0, out=M)

    return at


@dataclass(frozen=True, eq=False)
class _Once:
    """Sunlight scattered once from all depths on.

    Attributes
    ----------
    parts : array, shape (k, v, h)
        Of the phase function.
    light : array, shape (k, n, d, v)
        Per value of these.
    near : array of bool, shape (v, h)
        Directions of the sun's aureole.
    aureole : array, shape (n, d, t)
        Its factor there.
    """

    parts: Array
    light: Array
    near: NDArray[np.bool_]
    aureole: Array

    def at(self, place: int) -> Array:
        """Return that from a depth on, (n, v, h)."""
        pairs = zip(self.parts, self.light[:, :, place], strict=True)
        light = sum((single[..., None] * part for part, single in pairs), np.zeros(()))
        light[:, self.near] *= self.aureole[:, place]
        return light


@functools.lru_cache(maxsize=2)
def _beyond(field: SolvedField, scale: DepthScale) -> _Once:
    """Sunlight scattered once ahead; frames differ in their channels, not in this."""
    depths = scale.depths()
    mu, turns = elevations(), azimuths(AZIMUTHS)
    across = np.sqrt(1.0 - mu * mu)[:, None]
    around = turns + math.atan2(field.sun[1], field.sun[0])
    w = -across * np.cos(around), -across * np.sin(around), mu[:, None] + 0.0 * around
    s2 = half_angle2(w, field.sun)
    parts = np.stack([part.per_steradian(s2) for part in field.components])
    near = s2 < WIDEST
    return _Once(
        parts, field.single_scattering_on_grid(depths, mu), near, field.aureole(depths, s2[near])
    )


@functools.lru_cache(maxsize=2)
def _aureole_factor(field: SolvedField, scale: DepthScale) -> Array:
    """Factor on sunlight scattered once at all depths, (n, d, t), likewise."""
    factor = field.aureole(scale.depths(), angles())
    factor.flags.writeable = False
    return factor


def _image(spectra: _Spectra) -> tuple[Array, Array]:
    """Radiance of the boundary that is ahead, (3, v, h), and what is left of it (2, 3, l).

    What is left is up, of the surface's mean, and down, of the floor.
    """
    table, channels, lengths = spectra.table, spectra.channels, spectra.lengths.lengths()
    image = table.image * table.scale[:, None, None]
    half = ELEVATIONS // 2
    transmittance = []
    for part, cp in ((image[:, half:], spectra.cp_up), (image[:, :half], spectra.cp_down)):
        T = np.exp(-cp * lengths[:, None])
        transmittance.append(channels.mean(T, part.mean(axis=(1, 2))).T)
    return np.einsum("cn,nvh->cvh", channels.weights, image), np.array(transmittance)


def _unit(spectra: _Spectra, most: Array) -> tuple[Array, Array]:
    """Decay and scale of the channels' tables of light (n, d) at most; of a band its own."""
    field, depths = spectra.field, spectra.depths
    weights = np.abs(spectra.channels.weights)
    decay = decay_rate(depths, field.scalar_irradiance(depths) @ weights.T)
    grown = np.exp(np.minimum(decay[:, None] * depths, _LARGEST_EXPONENT))
    scale = (weights @ most * grown).max(axis=1)
    return decay, np.maximum(scale, float(np.finfo(np.float32).tiny))


def _irradiance(spectra: _Spectra, *, occluded: bool) -> Callable[[int], Array]:
    """Return that on patches (n, i, t) by depth."""
    table, unit = spectra.table, spectra.unit[..., None, None]
    if occluded:
        return lambda place: table.irradiance[:, place] * unit[:, place]
    field = spectra.field
    n_z, turns = tilts(), azimuths(TURNS)
    across = np.sqrt(np.maximum(1.0 - n_z * n_z, 0.0))[:, None]
    around = turns + math.atan2(field.sun[1], field.sun[0])
    normal = -across * np.cos(around), -across * np.sin(around), n_z[:, None] + 0.0 * around
    facing = np.maximum(-sum(a * b for a, b in zip(normal, field.sun, strict=True)), 0.0)
    peak = _forward_peak(spectra)[..., None, None]
    return lambda place: table.irradiance[:, place] * unit[:, place] + peak[:, place] * facing


def _beams(spectra: _Spectra) -> tuple[Array, Array]:
    """Normal irradiance of the sun at all depths, unscattered and with the peak, (n, d)."""
    field, y = spectra.field, spectra.depths
    mu_s = field.light.mu_s
    c = field.extinction_between(0.0, y, scaled=False).T
    E = field.light.E[:, None] / mu_s
    return E * np.exp(-c * y / mu_s), E * field.beam(y)


def _forward_peak(spectra: _Spectra) -> Array:
    sharp, peaked = _beams(spectra)
    return np.maximum(peaked - sharp, 0.0)


def _sunlit(
    spectra: _Spectra,
    bases: Array,
    counts: NDArray[np.bool_],
    contrast: Callable[[Array], Array] | None,
    *,
    occluded: bool,
) -> tuple[Array, Array, Array]:
    """Decay with depth, and sunlight and caustics on colours over distance, (k, 3, d, l)."""
    beam = _beams(spectra)[1 if occluded else 0]
    field, y = spectra.field, spectra.depths
    rate = field.extinction_between(0.0, y, scaled=occluded) / field.light.mu_s  # (d, n)
    slowest = _slowest(counts, rate)
    T = spectra.transmittance
    weights = _on_colours(spectra, bases)
    grown = np.exp(np.minimum(slowest.T * y, 80.0))[..., None]

    def projected(light: Array) -> Array:
        arriving = np.swapaxes(light.T[:, None] * T, 1, 2)
        return np.moveaxis(weights @ arriving, 0, 1).reshape(-1, 3, *T.shape[:2]) * grown

    steady = projected(beam)
    return slowest, steady, steady[:0] if contrast is None else projected(beam * contrast(y).T)


def _on_colours(spectra: _Spectra, bases: Array) -> Array:
    """What the channels see of light on colours (n, k), (k c, n)."""
    return (bases.T[:, None] * spectra.channels.weights).reshape(-1, len(bases))


def _transmittance(c: Array, lengths: LengthScale) -> Array:
    """Fraction that is left at extinctions (d, n) after all distances, (d, l, n)."""
    return np.exp(-c[:, None] * lengths.lengths()[:, None])


def _aureole(spectra: _Spectra) -> Array:
    """Factor on what the channels see of sunlight scattered once, (3, d, t)."""
    field, s2 = spectra.field, angles()
    factor = spectra.table.aureole  # (n, d, t)
    if spectra.low_stream_field is not field:
        factor = _aureole_factor(spectra.low_stream_field, spectra.table.depth_scale)
    light = np.empty_like(factor)
    phases = [field.phase_at(float(y)) for y in spectra.depths]
    known = {phase: phase.per_steradian(s2[:, None]).T for phase in set(phases)}  # (n, t)
    for place, phase in enumerate(phases):
        light[:, place] = known[phase]
    light *= (_beams(spectra)[1] * field.scattering_at(spectra.depths).T)[..., None]
    moved = spectra.channels.mean(np.moveaxis(factor, 0, -1), np.moveaxis(light, 0, -1))
    return np.moveaxis(moved, -1, 0)


def _lights(parts: Sequence[Array]) -> Array:
    """Spectra of light (n, d, i, j) from some directions, (d, q, n)."""
    flat = [part.reshape(*part.shape[:2], -1) for part in parts]
    return np.moveaxis(np.concatenate(flat, axis=2), 0, -1)


def _dimmed(spectra: _Spectra, parts: Sequence[Array]) -> list[Array]:
    """What is left of light over distances, without the forward peak and with it, (j, 3, d, l)."""
    weights = spectra.channels.weights
    both = [spectra.transmittance, _transmittance(spectra.cp, spectra.lengths)]
    return np.split(
        _channel_transmittance(_lights(parts), weights, weights, np.concatenate(both, axis=1)),
        2,
        -1,
    )


def _occlusion_matrix(
    spectra: _Spectra,
    scattered: Array,
    beyond: Array,
    irradiance: Array,
    occlusion: OcclusionSpectrum | None,
) -> Array:
    """What the spectrum of the occlusion makes of light, (i, j, 3, d)."""
    if occlusion is None:
        return np.zeros((2, 3, 3, len(spectra.depths)))
    factor = np.broadcast_to(occlusion.spectrum, (len(spectra.depths), 1, len(occlusion.spectrum)))
    weights = spectra.channels.weights
    M = _lights([scattered])
    gained = [M * (1.0 - spectra.transmittance[:, at, None]) for at in _PATHS]
    along = np.concatenate([_lights([scattered, beyond]), *gained], axis=1)
    both = (
        _channel_transmittance(light, weights, weights, factor)
        for light in (_lights([irradiance]), along)
    )
    return np.stack([found[..., 0] for found in both])


def _channel_transmittance(light: Array, channels: Array, weights: Array, T: Array) -> Array:
    """Regress what is left of lights on their channels.

    Parameters
    ----------
    light : array, shape (d, q, n)
        q lights at each depth.
    channels : array, shape (3, n)
    weights : array, shape (c, n)
        What light is asked for; for errors, and where nothing tells otherwise, the quantity c
        belongs to the channel c modulo 3.
    T : array, shape (d, l, n)
        Fraction of each band that is left.

    Returns
    -------
    array, shape (j, c, d, l)
    """
    seen = light @ channels.T  # (d, q, 3)
    q, c = light.shape[1], len(weights)
    own = np.arange(c) % 3
    size = np.maximum(light @ np.abs(weights).T, _NOTHING)
    onward = np.swapaxes(T, 1, 2)
    whole = (light @ np.abs(channels).T).mean(axis=1)[:, own, None]
    mean = (np.abs(weights) * light.mean(axis=1)[:, None]) @ onward
    fraction = mean / np.maximum(whole, _NOTHING)  # (d, c, l)
    features = seen[:, :, None, :] / size[..., None]  # (d, q, c, j)
    gram = np.einsum("dqci,dqcj->dcij", features, features) / q
    ridge = _RIDGE * np.einsum("dcjj->dcj", gram) + _NOTHING
    # What is regressed is linear in T: first the sums over lights, then those over bands.
    relative = np.einsum("dqcj,dqc->dcjq", features, 1.0 / size)
    d = len(light)
    asked = (relative.reshape(d, c * 3, q) @ light).reshape(d, c, 3, -1) * weights[:, None]
    right = (asked.reshape(d, c * 3, -1) @ onward).reshape(d, c, 3, -1)
    known = np.einsum("dcjq,dqc->dcj", relative, seen[..., own])
    right = (right - known[..., None] * fraction[:, :, None]) / q
    found = np.linalg.solve(gram + ridge[..., None] * np.eye(3), right)  # (d, c, j, l)
    found[:, np.arange(c), own] += fraction
    return np.moveaxis(found, (0, 1, 2, 3), (2, 1, 0, 3))


def _matte(
    spectra: _Spectra, bases: Array, irradiance: Array, occlusion: OcclusionSpectrum | None
) -> Array:
    """What is left over distances of what colours reflect of light, (j, k, 3, d, l)."""
    peak = np.moveaxis(_forward_peak(spectra), 0, -1)
    light = np.concatenate([_lights([irradiance]), peak[:, None]], axis=1)
    if occlusion is not None:
        # Under occlusion light has spectra that it has nowhere else.
        light = np.concatenate(
            [light, *(light * transmittance for transmittance in occlusion.typical)], axis=1
        )
    weights = _on_colours(spectra, bases)
    found = _channel_transmittance(light, spectra.channels.weights, weights, spectra.transmittance)
    return found.reshape(3, -1, 3, *found.shape[2:])


def _mirrored(spectra: _Spectra, scattered: Array, beyond: Array) -> Array:
    """What is left over distances of light that rises to the surface, (j, 3, l)."""
    half = scattered.shape[2] // 2
    single, often = beyond[:, :1, :half], scattered[:, :1, :half]
    rising = [often + single, often]
    T = _transmittance(spectra.cp_up[None], spectra.lengths)
    weights = spectra.channels.weights
    return _channel_transmittance(_lights(rising), weights, weights, T)[:, :, 0]


def _single(
    spectra: _Spectra, eye: float, counts: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Decay, and tables of sunlight scattered once; see :class:`ChannelTables`."""
    field, channels, lengths = spectra.low_stream_field, spectra.channels, spectra.lengths
    x = lengths.lengths()
    if field.layered:
        none = np.zeros((0, 3, LENGTHS))
        return np.zeros(3), _single_on_paths(spectra, eye), none, none
    E = field.light.E / field.light.mu_s
    slowest = _slowest(counts, spectra.cp[:1])[0]
    over = np.exp(-slowest[:, None] * x)
    b = field.scattering_at(np.zeros(1))[0]
    found: list[list[Array]] = [[], [], []]
    for part in field.components:
        source = b * E * field.weight_at(0.0, part)
        for rows, c, integrated in (
            (found[0], spectra.cp[0], True),
            (found[1], spectra.c[0], True),
            (found[2], spectra.c[0], False),
        ):
            density = source * np.exp(-c * x[:, None])
            rows.append(channels.project(density / c if integrated else density).T / over)
    single, drawn, drawn_at = (np.array(rows) for rows in found)
    return slowest, single, drawn, drawn_at


def _single_on_paths(spectra: _Spectra, eye: float) -> Array:
    """Sunlight that layered water scatters once on paths from the eye, (k, 3, v, l)."""
    field, lengths = spectra.low_stream_field, spectra.lengths.lengths()
    mu = elevations()
    y = np.clip(eye - mu[:, None] * lengths, 0.0, field.floor_depth)
    P = np.where(mu[:, None] > 0, np.minimum(lengths, eye / np.maximum(mu[:, None], 1e-9)), lengths)
    if math.isfinite(field.floor_depth):
        down = (field.floor_depth - eye) / np.maximum(-mu[:, None], 1e-9)
        P = np.where(mu[:, None] > 0, P, np.minimum(P, down))
    near = field.single_scattering_on_grid([eye], mu)[:, :, 0]  # (k, n, v)
    far = field.single_scattering_on_rays(np.ravel(y), np.repeat(mu, len(lengths)))
    far = far.reshape(len(far), *y.shape, -1)  # (k, v, l, n)
    cp = field.extinction_between(eye, y, scaled=True)
    path = np.swapaxes(near, 1, 2)[:, :, None] - np.exp(-cp * P[..., None]) * far
    path = np.maximum(path, 0.0)
    kept = spectra.channels.project(path)  # (k, v, l, 3)
    return np.moveaxis(kept, -1, 1) / path_unit(lengths, float(spectra.c.max()))


def path_unit(P: Operand, c: Operand) -> Operand:
    """What sunlight scattered once on paths of layered water is divided by."""
    return P / (1.0 + c * P) + 1e-6


@dataclass(frozen=True, eq=False)
class NumpyTables:
    """Look-ups of the channel tables for arrays of rays; depths and distances of shape (..., 1)."""

    light: ChannelTables
    sun: Sequence[float]

    @staticmethod
    def split(channels: Array) -> list[Array]:
        """Return the three channels, shape (..., 1) each."""
        return [channels[..., i : i + 1] for i in range(3)]

    def _on(self, table: Array, *places: Array) -> Array:
        flat = [place[..., 0] for place in np.broadcast_arrays(*places)]
        return interpolate(table, flat)

    def _each(self, tables: Array, *places: Array) -> list[Array]:
        """Look several sets of channels up, (j, 3, ...), at the same places."""
        found = self._on(tables.reshape(-1, *tables.shape[2:]), *places)
        return np.split(found, len(tables), axis=-1)

    def _slice(self, y: Operand) -> Array:
        return np.asarray(self.light.depth_scale.slice(np.asarray(y, np.float64)))

    def _length(self, P: Operand) -> Array:
        return np.asarray(self.light.numbers.lengths.place(np.asarray(P, np.float64)))

    def scattered(self, y: Operand, h: Operand, v: Operand) -> Array:
        """Return M over its unit at a depth, at places among azimuths and elevations."""
        return self._on(self.light.scattered, self._slice(y), v, h)

    def beyond(self, y: Operand, h: Operand, v: Operand) -> Array:
        """Return the rest of what is ahead over the same unit."""
        return self._on(self.light.beyond, self._slice(y), v, h)

    def irradiance(self, y: Operand, h: Operand, v: Operand) -> Array:
        """Return the irradiance on a patch over the same unit."""
        return self._on(self.light.irradiance, self._slice(y), v, h)

    def image_at(self, h: Operand, v: Operand) -> Array:
        """Return the radiance of the boundary that is ahead."""
        return self._on(self.light.image, v, h)

    def image_transmittance(self, up: Operand, P: Operand) -> Array:
        """Return the fraction of that which is left, looking up (1) or down (0)."""
        above, below = self._each(self.light.image_transmittance, self._length(P))
        return np.where(np.asarray(up) > 0.5, above, below)

    def aureole(self, y: Operand, t: Operand) -> Array:
        """Return the factor of the sun's aureole."""
        return self._on(self.light.aureole, self._slice(y), t)

    def dimmed(self, y: Operand, P: Operand) -> list[Array]:
        """Return what is left of light per channel j."""
        return self._each(self.light.dimmed, self._slice(y), self._length(P))

    def peaked(self, y: Operand, P: Operand) -> list[Array]:
        """Look up the same with the forward peak."""
        return self._each(self.light.peaked, self._slice(y), self._length(P))

    def matte(self, y: Operand, P: Operand, k: int) -> list[Array]:
        """Return what is left of what colour k reflects, per channel j of the light."""
        return self._each(self.light.matte[:, k], self._slice(y), self._length(P))

    def sunlit(self, y: Operand, P: Operand, k: int) -> Array:
        """Return what is left of sunlight on colour k."""
        return self._on(self.light.sunlit[k], self._slice(y), self._length(P))

    def caustics(self, y: Operand, P: Operand, k: int) -> Array:
        """Return what waves add to that, per unit of their pattern above 1."""
        return self._on(self.light.caustics[k], self._slice(y), self._length(P))

    def glowing(self, y: Operand, P: Operand, k: int) -> Array:
        """Return what is left of light of colour k."""
        return self._on(self.light.glowing[k], self._slice(y), self._length(P))

    def occlusion_matrix(self, kind: int, y: Operand) -> list[Array]:
        """Return what the spectrum of the occlusion makes of light, per channel j."""
        return self._each(self.light.occlusion_matrix[kind], self._slice(y))

    def rate(self, name: str, y: Operand) -> Array:
        """Return one of :data:`RATES` at a depth."""
        return self._on(self.light.rates[RATES.index(name)], self._slice(y))

    def along(self, name: str, index: int | None, P: Operand) -> Array:
        """Look a table over distance up, by the name of its attribute."""
        table = getattr(self.light, name)
        return self._on(table if index is None else table[index], self._length(P))

    def single_on_path(self, part: int, v: Operand, P: Operand) -> Array:
        """Return layered water's sunlight scattered once, over :func:`path_unit`."""
        return self._on(self.light.single[part], v, self._length(P))
