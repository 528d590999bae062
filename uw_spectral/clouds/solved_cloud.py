"""The numbers of a cloud in a solved water, in channels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..lamps.lamp import Lamp
from ..lamps.multiple_scattering import LampWater
from ..mathematics import dot
from ..occlusion.point_spread import within_outline
from ..transfer.channels import Channels
from ..transfer.solved_field import SolvedField
from .cloud_light import Clouds, Several
from .cloud_numbers import CloudNumbers, with_escapes
from .density_grid import DensityGrid
from .gaussian_blob import GaussianBlob
from .matter import SuspendedMatter, blunt_phase

_SHALLOWEST, _STEP = 0.02, 0.25  # m
_TINY = 1e-30
_BESIDE_BEAM = 0.05  # of the intensity


@dataclass(frozen=True, eq=False)
class Cloud:
    """A cloud of some matter."""

    blob: GaussianBlob  #: Of one with a grid, the blob that is most like it.
    matter: SuspendedMatter
    grid: DensityGrid | None = None


def cloud_numbers(
    cloud: Cloud,
    field: SolvedField,
    channels: Channels,
    distance: float,
    by_lamps: ArrayLike | None = None,
    lamps: Sequence[Lamp] = (),
) -> CloudNumbers:
    """Return what a pixel needs of a cloud.

    ``distance`` is about how far it is from the camera, m; ``by_lamps`` (n,) the irradiance of
    lamps there (:func:`lamplight_on`), ``lamps`` those that shine on it, in the order of their
    numbers.
    """
    matter, blunt = cloud.matter, blunt_phase(cloud.matter.phase)
    y = float(np.clip(-float(cloud.blob.middle[2]), _SHALLOWEST, field.floor_depth))
    near = np.clip(np.array([y - _STEP, y, y + _STEP]), _SHALLOWEST / 2.0, field.floor_depth)
    sun, spread, ambient = _light(field, near)
    span = near[2] - near[0]
    decays = [np.log((x[0] + _TINY) / (x[2] + _TINY)) / span for x in (sun, spread + ambient)]
    scattered = field.scattering_at([y])[0]
    blocked = scattered * within_outline(field.phase_at(y), cloud.blob.size, distance)
    c = field.extinction_between(y, y, scaled=False) - blocked
    transmittance = np.exp(-c * distance)
    seen = (sun + spread + ambient)[1] * transmittance
    if by_lamps is not None:
        seen = seen + np.asarray(by_lamps) * transmittance
    wide = matter.scattering * (1.0 - blunt.peak)
    scaled = matter.absorption + wide

    def mean(values: NDArray[np.float64], light: NDArray[np.float64] = seen) -> NDArray[np.float64]:
        return channels.mean(values, light)

    transport = matter.absorption + matter.scattering * (1.0 - matter.phase.g)
    numbers = CloudNumbers(
        cloud.blob.middle,
        cloud.blob.rows,
        mean(matter.extinction),
        mean(scaled),
        np.minimum(mean(wide) / np.maximum(mean(scaled), _TINY), 1.0),
        channels.project(sun[1] * transmittance),
        channels.project(spread[1] * transmittance),
        channels.project(ambient[1] * transmittance),
        mean(decays[0], sun[1] * transmittance),
        mean(decays[1], (spread + ambient)[1] * transmittance),
        mean(c),
        mean(blocked - scattered * field.peak_at(y)),
        mean(transport),
        np.minimum(mean(transport - matter.absorption) / np.maximum(mean(transport), _TINY), 1.0),
        distance,
        blunt.asymmetry,
        blunt.ceiling,
        blunt.peak,
    )
    if cloud.grid is not None:
        # One length of matter serves the channels, whose coefficients are much alike.
        kept_mean = float(np.mean(numbers.transport))
        places = [tuple(float(x) for x in lamp.position) for lamp in lamps]
        return replace(numbers, grid=cloud.grid.lit(field.sun, kept_mean, places))
    return numbers if by_lamps is None else with_escapes(numbers)


def clouds_in(
    clouds: Sequence[Cloud], field: SolvedField, channels: Channels, place: Sequence[float]
) -> Clouds:
    """Return clouds as a camera at a place sees them by daylight, in arrays; m."""
    phases = list(dict.fromkeys(cloud.matter.phase for cloud in clouds))
    found = []
    for cloud in clouds:
        away = math.dist(cloud.blob.middle, place)
        numbers = cloud_numbers(cloud, field, channels, away)
        found.append(replace(numbers, kind=float(phases.index(cloud.matter.phase))))
    return Clouds(Several(found), phases, field.sun)


def lamplight_on(cloud: Cloud, lamps: Sequence[Lamp], water: LampWater) -> NDArray[np.float64]:
    """Irradiance of lamps on a cloud by which channels weigh its coefficients, shape (n,).

    But for what water scatters; where its middle is beside a beam, some light counts still.
    """
    total = np.zeros(np.shape(water.a))
    for lamp in lamps:
        r, u = lamp.towards(cloud.blob.middle)
        value = np.maximum(lamp.profile.value(dot(lamp.axis, u)), _BESIDE_BEAM)
        total = total + lamp.intensity * np.exp(-water.a * r) * (value / (r * r))
    return total


def _light(
    field: SolvedField, depths: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return scalar irradiances of sun, beam beside it and rest, see :class:`.CloudNumbers`."""
    mu_s = field.light.mu_s
    beam = (field.light.E[:, None] * field.beam(depths)).T
    E0 = field.scalar_irradiance(depths) - beam / mu_s
    net = field.Ed(depths) - field.Eu(depths) - beam
    spread = np.clip(net / mu_s, 0.0, np.maximum(E0, 0.0))
    return beam / mu_s, spread, np.maximum(E0 - spread, 0.0)
