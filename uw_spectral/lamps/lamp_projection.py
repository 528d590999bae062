"""The tables of lamps, projected onto the channels."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..content import constant
from ..occlusion.point_spread import within_outline
from ..transfer.channels import Channels
from .inelastic_source import LampExcitation, inelastic_light
from .lamp import Lamp
from .lamp_channels import (
    FARTHEST,
    FLOATING,
    FLOATING_LENGTHS,
    LENGTHS,
    Array,
    ChannelLamp,
    LampChannels,
    SurfaceLight,
    bands_of,
)
from .lamp_surface import PatchPastLamp, arriving_light
from .multiple_scattering import LampField, LampWater
from .profile import LampProfile, SpotProfile
from .representative_bands import RepresentativeBands, representative_bands
from .scattered_source import source_seen, source_table
from .soft_shadow import soft_map

_STRETCH = 2.5  # decay lengths, in which half the entries lie
_LOST = 0.1  # of scattered light, about
_LONGEST_STRETCH = 100.0  # m
# Places that the three bands have to do for: m, cosines, rad.
_DISTANCES = (0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 14.0)
_OFF_AXIS = (1.0, 0.8, 0.5, -0.2)  # in the beam and beside it
_TILTS = (1.0, 0.3)
_HALF_DEFLECTIONS = (0.01, 0.05, 0.1, 0.3, 0.6, 0.9, 1.2)
_NEAR = _DISTANCES[:-1]  # from where light that is turned is seen
_FEW_DEGREES = 10
_LARGEST = 60.0  # exponent in single precision
_CANDIDATES = 721  # cosines from the axis
_TYPICAL = Lamp((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0, SpotProfile(math.radians(60.0), 0.5))


def project_lamps(
    lamps: Sequence[Lamp],
    water: LampWater,
    channels: Channels,
    measured: ArrayLike = (),
    own: Sequence[LampWater] = (),
    exciting: ArrayLike = (),
    *,
    clouds: float = 0.0,
    excited: Sequence[LampExcitation] = (),
) -> LampChannels:
    """Project the light of lamps into channels.

    Parameters
    ----------
    measured : array_like, shape (m, n)
        Reflectances of surfaces that are known better than by a colour.
    own : sequence of LampWater, optional
        Water of the first lamps where it differs from that of all: absorption, and light that is
        scattered once.
    exciting : array_like, shape (3, n), optional
        Weights of bands by which fluorophores are excited.
    clouds : float
        About how large clouds in the water are, as their standard deviation, m; 0 without.
    excited : sequence of LampExcitation
        What each of the first lamps excites in the water.
    """
    spectra = np.asarray(measured, dtype=np.float64).reshape(-1, len(water.a))
    intensities = [np.broadcast_to(lamp.intensity, water.a.shape) for lamp in lamps]
    excitation = np.asarray(exciting, dtype=np.float64).reshape(-1, len(water.a))
    shining = _mean_spectrum(intensities, len(water.a))
    seen = np.abs(channels.weights) * shining
    in_water, on_surfaces = (
        _bands_in_water(water, seen),
        _bands_on_surfaces(water, np.concatenate([seen, excitation * shining])),
    )
    lost = water.a + _LOST * water.b
    middle = math.sqrt(float(lost.min() * lost.max()))
    stretch = min(_STRETCH / max(middle, _STRETCH / _LONGEST_STRETCH), _LONGEST_STRETCH)
    fraction = np.arange(LENGTHS) / (LENGTHS - 1.0)
    lengths = stretch * fraction / np.maximum(1.0 - fraction, stretch / FARTHEST)
    reflectances = np.concatenate([channels.reflectance.T, spectra])

    def projected(lamp: Lamp, intensity: Array, water: LampWater) -> ChannelLamp:
        passed = np.exp(-lengths[:, None] * water.a)
        unscattered = np.exp(-lengths[:, None] * water.c)
        single = water.b * np.asarray(water.phase.weights)[:, None, :] * unscattered
        coloured = (reflectances[:, None] * on_surfaces.fractions)[:, :, None, :] * passed
        return ChannelLamp(
            channels.project(intensity * single),
            channels.project(intensity * unscattered),
            channels.project(intensity * in_water.fractions[:, None, :] * passed),
            channels.project(intensity * coloured),
            exciting_on_surfaces(intensity * passed),
            on_floating(lamp, intensity, water),
        )

    def exciting_on_surfaces(light: Array) -> Array:
        if not len(excitation):
            return np.zeros((0, LENGTHS, 3))
        return (light * on_surfaces.fractions[:, None, :]) @ excitation.T

    three_on_surfaces = _of_three(water, on_surfaces)

    def on_floating(lamp: Lamp, intensity: Array, water: LampWater) -> Array:
        if not clouds:
            return np.zeros((0, FLOATING, 3))
        bands = _on_floating(lamp, three_on_surfaces, clouds)
        lengths = FLOATING_LENGTHS.values()
        length = lengths[:, None] + lengths
        passed = intensity * np.exp(-length[..., None] * water.a)
        return channels.project((bands @ on_surfaces.fractions) * passed)

    waters = [*own, *[water] * (len(lamps) - len(own))]
    three = _of_three(water, in_water)
    shadowed = [with_soft_shadow(lamp, three).of_bands(on_surfaces.indices) for lamp in lamps]
    found = list(itertools.starmap(projected, zip(lamps, intensities, waters, strict=True)))
    for i, one in enumerate(excited):
        shadowed.append(replace(shadowed[i], seen=0.0))
        seen = _inelastic(one, lamps[i].profile, water, three, channels, lengths)
        tables = "scattered", "unscattered", "in_water", "coloured", "exciting", "floating"
        dark = {name: np.zeros_like(getattr(found[i], name)) for name in tables}
        found.append(replace(found[i], **dark | seen))
    return LampChannels(
        tuple(shadowed),
        tuple(found),
        three,
        three_on_surfaces,
        water.phase.components,
        len(spectra),
        stretch,
    )


def _inelastic(
    excited: LampExcitation,
    profile: LampProfile,
    water: LampWater,
    three: LampWater,
    channels: Channels,
    lengths: Array,
) -> dict[str, Any]:
    """Project the light of changed wavelength that a lamp makes: fields of its tables, if any.

    It is looked up with the rows of the bands ``three`` of the water, and what these scatter on the
    way to the camera.
    """
    power = float(excited.matrices.sum())
    if power <= 0.0:
        return {}
    # Of a lamp that only changes its brightness all is known already.
    even = replace(excited, matrices=constant(np.round(excited.matrices / power, 9)))
    assert isinstance(water.field, LampField)
    assert isinstance(three.field, LampField)
    seen, scale = water.field.harmonics, three.field.harmonics.scale
    half, r, t, cosine = _places(_HALF_DEFLECTIONS, _NEAR, _NEAR, _OFF_AXIS)
    bent = np.cos(2.0 * half)
    # Few harmonics tell how bands differ.
    few = replace(even, water=replace(even.water, degrees=_FEW_DEGREES))
    made = inelastic_light(few, _TYPICAL.profile, replace(seen, degrees=_FEW_DEGREES), scale)
    values = source_seen(made.source, r, cosine, bent, cosine * bent) / r
    onward = np.exp(made.onward.at(length=r, half=half)) / (r * r)
    values = values + onward * _TYPICAL.profile.value(cosine)
    values = values * np.exp(-made.decay * r)
    light = np.abs(channels.weights).sum(axis=0) * np.exp(-t * (water.a + water.wide))
    bands = representative_bands(values, light)
    three_even = even.of_bands(bands.indices)
    made = inelastic_light(three_even, profile, seen.of_bands(bands.indices), scale)
    # Looked up where the three bands of the water are scattered on the way.
    left = three.wide[:, None, None] - (water.a + water.wide)
    passed = np.exp(np.minimum(lengths[:, None] * left, _LARGEST))
    arriving = channels.project(power * bands.fractions[:, None, :] * passed)
    return {"in_water": arriving, "inelastic": made}


def _on_floating(lamp: Lamp, water: LampWater, size: float) -> Array:
    """What scattering leaves of a lamp's light on its brightest axis, over that without water.

    By the distance from the lamp (rows) and on to the camera, in the three bands. Of the light of
    clouds that arrives which is not scattered out of their outline.
    """
    lengths = FLOATING_LENGTHS.values()
    cosine, r = _brightest(lamp), lengths[:, None]
    value = lamp.profile.value(np.array([cosine]))
    patch = PatchPastLamp(r, value / (r * r), 1.0, cosine, cosine, r)
    # What stands for objects has parts, which tell the irradiance on surfaces alone.
    light = arriving_light(replace(lamp, parts=None), patch, water)
    reaching = (light.straight + light.about) * (r * r / value)
    within = [within_outline(water.phase, size, float(s)) for s in lengths]
    return reaching[:, None] * np.exp(-water.b * (1.0 - np.array(within)) * r)


def _brightest(lamp: Lamp) -> float:
    """Cosine from its axis at which a lamp is brightest."""
    cosines = np.linspace(1.0, -1.0, _CANDIDATES)
    return float(cosines[np.argmax(lamp.profile.value(cosines))])


def with_soft_shadow(lamp: Lamp, water: LampWater) -> Lamp:
    """Return a lamp that knows what objects leave of its scattered light."""
    return lamp if lamp.shadow is None else replace(lamp, soft=soft_map(lamp, water))


def _mean_spectrum(intensities: Sequence[Array], count: int) -> Array:
    """Mean of the lamps' spectra, each of one sum; even where none shines."""
    shining = [one / one.sum() for one in intensities if one.sum() > 0]
    return np.mean(shining, axis=0) if shining else np.full(count, 1.0 / count)


def _of_three(water: LampWater, bands: RepresentativeBands) -> LampWater:
    return replace(water.of_bands(bands.indices), reach=water.reach)


def _bands_in_water(water: LampWater, seen: Array) -> RepresentativeBands:
    """Bands that stand for all in what is scattered more than once."""
    half, r, t, cosine = _places(_HALF_DEFLECTIONS, _NEAR, _NEAR, _OFF_AXIS)
    bent = np.cos(2.0 * half)
    assert isinstance(water.field, LampField)
    source = source_table(water.field.harmonics.for_patches(), _TYPICAL.profile)
    values = source_seen(source, r, cosine, bent, cosine * bent) * np.exp(-water.wide * t)
    return representative_bands(values, _light_in(seen, water, r + t))


def _bands_on_surfaces(water: LampWater, seen: Array) -> RepresentativeBands:
    """Bands that stand for all in what objects get, and in what of it arrives."""
    r, P, cosine, tilt = _places(_DISTANCES, _DISTANCES, _OFF_AXIS, _TILTS)
    lit = _TYPICAL.profile.value(cosine) / (r * r)
    patch = PatchPastLamp(r, lit, tilt, cosine, tilt * cosine, r)
    light = SurfaceLight(water, (), bands_of)
    arriving = light.unscattered(P) + light.forward(P)
    values = light.on_patch(light.arriving_at(_TYPICAL, patch), patch) * arriving
    return representative_bands(values, _light_in(seen, water, r + P))


def _light_in(seen: Array, water: LampWater, lengths: Array) -> Array:
    """How much each band counts at lengths (k, 1), shape (k, n); all channels alike."""
    transmittance = seen * np.exp(-water.a * lengths)[:, None, :]
    whole = transmittance.sum(axis=-1, keepdims=True)
    return np.divide(transmittance, whole, out=np.zeros_like(transmittance), where=whole > 0.0).sum(
        axis=1
    )


def _places(*axes: Sequence[float]) -> list[Array]:
    """Return all combinations of values, shape (k, 1) each."""
    return [column.reshape(-1, 1) for column in np.meshgrid(*axes)]
