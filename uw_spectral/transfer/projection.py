"""Channel tables made of a solved field."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .aureole import WIDEST
from .band_spectra import (
    BandSpectra,
    OcclusionSpectra,
    beams_of,
    counting_bands,
    forward_peak,
    slowest_decay,
)
from .channel_tables import FARTHEST, FIRST, GONE, Array, ChannelNumbers, ChannelTables, LengthScale
from .channels import Channels
from .depth_scale import DepthScale
from .projection_over_distance import (
    LARGEST_EXPONENT,
    dimmed_tables,
    matte_tables,
    mirrored_tables,
    occlusion_matrices,
    single_scattering_tables,
    sunlit_tables,
)
from .radiance_table import (
    AZIMUTH,
    ELEVATIONS,
    SUN_ANGLE,
    TILT,
    TURN,
    UP,
    decay_rate,
    tabulate,
)
from .solved_field import SolvedField
from .sun_beam import half_angle2

_EVERY = 4, 6  # of the elevations and azimuths whose spectra are regressed


def project(
    field: SolvedField,
    channels: Channels,
    eye: float,
    sky: Array,
    measured: Sequence[Array] = (),
    occlusion: OcclusionSpectra | None = None,
    contrast: Callable[[Array], Array] | None = None,
    emissions: Sequence[Array] = (),
) -> ChannelTables:
    """Project a solved field.

    ``eye`` is the camera's depth, m, which matters where water differs with depth; ``sky`` (n,) the
    level of the sky's radiance in air, or (n, k) those of the spectra that it is made of;
    ``measured`` reflectances and ``emissions`` that are no colour have shape (n,). If objects
    occlude, the sun's forward peak is part of the direct sun. ``contrast`` is that of caustics at
    depths (d,), of shape (d, n), under waves.
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
    counts = counting_bands(np.abs(channels.weights) * light)
    slowest = slowest_decay(counts, c)  # (d, 3)
    fastest = float(c.max())
    lengths = LengthScale.up_to(
        min(GONE / max(float(slowest.min()), 1e-4), FARTHEST), FIRST / max(fastest, 1e-3)
    )
    spectra = BandSpectra(
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
    sun_decay, sunlit, caustics = sunlit_tables(spectra, bases, counts, contrast, occluded=occluded)
    single_decay, single, drawn, drawn_at = single_scattering_tables(spectra, eye, counts)
    numbers = ChannelNumbers(
        scale, decay, slowest[0], peak[0], scattering[0], mean_extinction[0], sun_decay[0],
        single_decay, lengths, field.light.mu_s, field.floor_depth,
    )  # fmt: skip
    image, image_transmittance = _image(spectra)
    dimmed, peaked = dimmed_tables(spectra, [scattered.some, beyond.some])
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
        matte_tables(spectra, bases, irradiance.some, occlusion) / way,
        sunlit / way,
        caustics / way,
        np.moveaxis(glow, (0, 1, 2, 3), (2, 3, 1, 0)) / way,
        occlusion_matrices(spectra, scattered.some, beyond.some, irradiance.some, occlusion),
        np.array([slowest.T, peak.T, scattering.T, mean_extinction.T, sun_decay.T]),
        np.array(parts),
        image,
        image_transmittance / np.swapaxes(forward[:, [0, -1]], 0, 1),
        np.stack([channels.project(each * up).T for each in np.atleast_2d(sky.T)]) / forward[:, 0],
        channels.project(E * sun_up).T / way[:, 0],
        channels.project(field.floor_radiance * down).T / forward[:, -1],
        mirrored_tables(spectra, scattered.some, beyond.some) / forward[:, 0],
        single,
        drawn,
        drawn_at,
        field.layered,
        fastest,
    )


@dataclass(frozen=True, eq=False)
class _Directed:
    """Light at all depths from all directions: its channels, and what else tables need of it."""

    projected: Array  #: Shape (3, d, v, h).
    most: Array  #: Largest from any direction, (n, d).
    some: Array  #: From some of the directions, (n, d, i, j).


def _directed(spectra: BandSpectra, at: Callable[[int], Array]) -> _Directed:
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


def _scattered(spectra: BandSpectra) -> Callable[[int], Array]:
    """Return M (n, v, h) by depth: all light but what is ahead unscattered or scattered once."""
    field, low_stream_field, depths = spectra.field, spectra.low_stream_field, spectra.depths
    table, unit = spectra.table, spectra.unit[..., None, None]
    if low_stream_field is field:
        return lambda place: table.radiance[:, place] * unit[:, place]
    mu = UP.values()
    ends = np.where(mu > 0, 0.0, min(field.floor_depth, FARTHEST))
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
    """Sunlight scattered once from all depths on."""

    parts: Array  #: Of the phase function, (k, v, h).
    light: Array  #: Per value of these, (k, n, d, v).
    near: NDArray[np.bool_]  #: Directions of the sun's aureole, (v, h).
    aureole: Array  #: Its factor there, (n, d, t).

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
    mu, turns = UP.values(), AZIMUTH.values()
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
    factor = field.aureole(scale.depths(), SUN_ANGLE.values())
    factor.flags.writeable = False
    return factor


def _image(spectra: BandSpectra) -> tuple[Array, Array]:
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


def _unit(spectra: BandSpectra, most: Array) -> tuple[Array, Array]:
    """Decay and scale of the channels' tables of light (n, d) at most; of a band its own."""
    field, depths = spectra.field, spectra.depths
    weights = np.abs(spectra.channels.weights)
    decay = decay_rate(depths, field.scalar_irradiance(depths) @ weights.T)
    grown = np.exp(np.minimum(decay[:, None] * depths, LARGEST_EXPONENT))
    scale = (weights @ most * grown).max(axis=1)
    return decay, np.maximum(scale, float(np.finfo(np.float32).tiny))


def _irradiance(spectra: BandSpectra, *, occluded: bool) -> Callable[[int], Array]:
    """Return that on patches (n, i, t) by depth."""
    table, unit = spectra.table, spectra.unit[..., None, None]
    if occluded:
        return lambda place: table.irradiance[:, place] * unit[:, place]
    field = spectra.field
    n_z, turns = TILT.values(), TURN.values()
    across = np.sqrt(np.maximum(1.0 - n_z * n_z, 0.0))[:, None]
    around = turns + math.atan2(field.sun[1], field.sun[0])
    normal = -across * np.cos(around), -across * np.sin(around), n_z[:, None] + 0.0 * around
    facing = np.maximum(-sum(a * b for a, b in zip(normal, field.sun, strict=True)), 0.0)
    peak = forward_peak(spectra)[..., None, None]
    return lambda place: table.irradiance[:, place] * unit[:, place] + peak[:, place] * facing


def _aureole(spectra: BandSpectra) -> Array:
    """Factor on what the channels see of sunlight scattered once, (3, d, t)."""
    field, s2 = spectra.field, SUN_ANGLE.values()
    factor = spectra.table.aureole  # (n, d, t)
    if spectra.low_stream_field is not field:
        factor = _aureole_factor(spectra.low_stream_field, spectra.table.depth_scale)
    light = np.empty_like(factor)
    phases = [field.phase_at(float(y)) for y in spectra.depths]
    known = {phase: phase.per_steradian(s2[:, None]).T for phase in set(phases)}  # (n, t)
    for place, phase in enumerate(phases):
        light[:, place] = known[phase]
    light *= (beams_of(spectra)[1] * field.scattering_at(spectra.depths).T)[..., None]
    moved = spectra.channels.mean(np.moveaxis(factor, 0, -1), np.moveaxis(light, 0, -1))
    return np.moveaxis(moved, -1, 0)
