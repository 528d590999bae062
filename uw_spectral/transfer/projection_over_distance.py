"""Channels of light after distances: what is left of each spectrum."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .band_spectra import (
    BandSpectra,
    OcclusionSpectra,
    beams_of,
    forward_peak,
    slowest_decay,
    transmittance_tables,
)
from .channel_tables import LENGTHS, NOTHING, ON_PATH, SPECTRA, Array, path_unit
from .radiance_table import UP

_RIDGE = 1e-6  # of the regression, relative to the mean squares of what it stands on
_PATHS = 24, 48, 72  # of the distances whose light counts for what the occlusion makes of it
LARGEST_EXPONENT = 40.0


def sunlit_tables(
    spectra: BandSpectra,
    bases: Array,
    counts: NDArray[np.bool_],
    contrast: Callable[[Array], Array] | None,
    *,
    occluded: bool,
) -> tuple[Array, Array, Array]:
    """Decay with depth, and sunlight and caustics on colours over distance, (k, 3, d, l)."""
    beam = beams_of(spectra)[1 if occluded else 0]
    field, y = spectra.field, spectra.depths
    rate = field.extinction_between(0.0, y, scaled=occluded) / field.light.mu_s  # (d, n)
    slowest = slowest_decay(counts, rate)
    T = spectra.transmittance
    weights = _on_colours(spectra, bases)
    grown = np.exp(np.minimum(slowest.T * y, 80.0))[..., None]

    def projected(light: Array) -> Array:
        arriving = np.swapaxes(light.T[:, None] * T, 1, 2)
        return np.moveaxis(weights @ arriving, 0, 1).reshape(-1, 3, *T.shape[:2]) * grown

    steady = projected(beam)
    return slowest, steady, steady[:0] if contrast is None else projected(beam * contrast(y).T)


def _on_colours(spectra: BandSpectra, bases: Array) -> Array:
    """What the channels see of light on colours (n, k), (k c, n)."""
    return (bases.T[:, None] * spectra.channels.weights).reshape(-1, len(bases))


def _lights(parts: Sequence[Array]) -> Array:
    """Spectra of light (n, d, i, j) from some directions, (d, q, n)."""
    flat = [part.reshape(*part.shape[:2], -1) for part in parts]
    return np.moveaxis(np.concatenate(flat, axis=2), 0, -1)


def dimmed_tables(spectra: BandSpectra, parts: Sequence[Array]) -> list[Array]:
    """What is left of light over distances, without the forward peak and with it, (j, 3, d, l)."""
    weights = spectra.channels.weights
    both = [spectra.transmittance, transmittance_tables(spectra.cp, spectra.lengths)]
    return np.split(
        _channel_transmittance(_lights(parts), weights, weights, np.concatenate(both, axis=1)),
        2,
        -1,
    )


def occlusion_matrices(
    spectra: BandSpectra,
    scattered: Array,
    beyond: Array,
    irradiance: Array,
    occlusion: OcclusionSpectra | None,
) -> Array:
    """What the spectra of the occlusion make of light, (i, j, 3, d)."""
    if occlusion is None:
        return np.zeros((SPECTRA, 3, 3, len(spectra.depths)))
    factor = np.broadcast_to(occlusion.spectra, (len(spectra.depths), *occlusion.spectra.shape))
    weights = spectra.channels.weights
    M = _lights([scattered])
    gained = [M * (1.0 - spectra.transmittance[:, at, None]) for at in _PATHS]
    along = np.concatenate([_lights([scattered, beyond]), *gained], axis=1)
    both = (
        _channel_transmittance(light, weights, weights, factor[:, some])
        for light, some in (
            (_lights([irradiance]), slice(ON_PATH)),
            (along, slice(ON_PATH, SPECTRA)),
        )
    )
    return np.moveaxis(np.concatenate(list(both), axis=-1), -1, 0)


def _channel_transmittance(light: Array, channels: Array, weights: Array, T: Array) -> Array:
    """Regress what is left of q lights (d, q, n) on their channels, weights (3, n): (j, c, d, l).

    ``weights`` (c, n) are what light is asked for; for errors, and where nothing tells otherwise,
    the quantity c belongs to the channel c modulo 3. ``T`` (d, l, n) is the fraction of each band
    that is left.
    """
    seen = light @ channels.T  # (d, q, 3)
    q, c = light.shape[1], len(weights)
    own = np.arange(c) % 3
    size = np.maximum(light @ np.abs(weights).T, NOTHING)
    onward = np.swapaxes(T, 1, 2)
    whole = (light @ np.abs(channels).T).mean(axis=1)[:, own, None]
    mean = (np.abs(weights) * light.mean(axis=1)[:, None]) @ onward
    fraction = mean / np.maximum(whole, NOTHING)  # (d, c, l)
    features = seen[:, :, None, :] / size[..., None]  # (d, q, c, j)
    gram = np.einsum("dqci,dqcj->dcij", features, features) / q
    ridge = _RIDGE * np.einsum("dcjj->dcj", gram) + NOTHING
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


def matte_tables(
    spectra: BandSpectra, bases: Array, irradiance: Array, occlusion: OcclusionSpectra | None
) -> Array:
    """What is left over distances of what colours reflect of light, (k, j, 3, d, l)."""
    peak = np.moveaxis(forward_peak(spectra), 0, -1)
    light = np.concatenate([_lights([irradiance]), peak[:, None]], axis=1)
    if occlusion is not None:
        # Under occlusion light has spectra that it has nowhere else.
        light = np.concatenate(
            [light, *(light * transmittance for transmittance in occlusion.typical)], axis=1
        )
    weights = _on_colours(spectra, bases)
    found = _channel_transmittance(light, spectra.channels.weights, weights, spectra.transmittance)
    return np.swapaxes(found.reshape(3, -1, 3, *found.shape[2:]), 0, 1)


def mirrored_tables(spectra: BandSpectra, scattered: Array, beyond: Array) -> Array:
    """What is left over distances of light that rises to the surface, (j, 3, l)."""
    half = scattered.shape[2] // 2
    single, often = beyond[:, :1, :half], scattered[:, :1, :half]
    rising = [often + single, often]
    T = transmittance_tables(spectra.cp_up[None], spectra.lengths)
    weights = spectra.channels.weights
    return _channel_transmittance(_lights(rising), weights, weights, T)[:, :, 0]


def single_scattering_tables(
    spectra: BandSpectra, eye: float, counts: NDArray[np.bool_]
) -> tuple[Array, Array, Array, Array]:
    """Decay, and tables of sunlight scattered once; see :class:`ChannelTables`."""
    field, channels, lengths = spectra.low_stream_field, spectra.channels, spectra.lengths
    x = lengths.lengths()
    if field.layered:
        none = np.zeros((0, 3, LENGTHS))
        return np.zeros(3), _single_on_paths(spectra, eye), none, none
    E = field.light.E / field.light.mu_s
    slowest = slowest_decay(counts, spectra.cp[:1])[0]
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


def _single_on_paths(spectra: BandSpectra, eye: float) -> Array:
    """Sunlight that layered water scatters once on paths from the eye, (k, 3, v, l)."""
    field, lengths = spectra.low_stream_field, spectra.lengths.lengths()
    mu = UP.values()
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
