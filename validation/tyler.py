"""The radiance distributions that Tyler measured in Lake Pend Oreille, and those of our solvers.

J. E. Tyler, SIO Reference 58-25 (1958) and Bull. Scripps Inst. Oceanogr. 7, 363 (1960): radiance
from 19 tilts and 10 azimuths at seven depths, 28 April 1957, clear sky, sun 56.6° high, 430 to
546 nm; the tables are those of the package jerlov. Nothing of the model is fitted but one factor,
since the unit of the radiances is relative:

- c = 0.396 1/m, Tyler's transmissometer;
- a from his own radiances by Gershun's law, from the second table down (the first lacks light of
  the sun's glitter);
- the fraction of the sky by SPECTRL2, its distribution the clear one of the CIE.
"""

from __future__ import annotations

import functools
import math
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.surface.refraction import (
    in_water_cosine,
    sun_travel_direction,
)
from ..uw_spectral.transfer.discrete_ordinates import OpticalLayer, solve_discrete_ordinates
from ..uw_spectral.transfer.rough_surface import WaterSurface
from ..uw_spectral.transfer.sky import Sky
from ..uw_spectral.water.phase_functions import parse_phase
from ..uw_spectral.water.pure_water import molecular_scattering
from .closed_form.closed_form import solve_closed_form
from .closed_form.internal_reflectance import diffuse_internal_reflectance
from .closed_form.light_field import TwoStreamWater, solve_light_field
from .closed_form.unoccluded_water import UnoccludedWater
from .sunlight import entering, sky_fraction

PHASES = ("fournier-forand:1.10,0.0183", "petzold", "mixture", "hg:0.924", "hg:0.8")
INDEX = 1.334
"""Of fresh water."""
FROM_SUN = 12.0
"""Degrees from the refracted sun from which radiances are compared, beyond its glitter."""
BAND = Bands.uniform(1, 430.0, 546.0)
_RING = 6  # directions around each that stand for the acceptance


@dataclass(frozen=True)
class Lake:
    """What Tyler measured."""

    depths: NDArray[np.float64]  #: m, shape (7,).
    #: Shape (7, 19, 10): Relative, by depth, tilt from straight up and azimuth from the sun's.
    radiance: NDArray[np.float64]
    w: NDArray[np.float64]  #: Shape (3, 19, 10): View directions, z up.
    #: Shape (19, 10): Directions away from the sun; straight up and down once.
    compared: NDArray[np.bool_]
    #: Beam attenuation, 1/m; zenith angle of the sun in air and full acceptance, degrees.
    c: float
    zenith: float
    acceptance: float

    @property
    def sun(self) -> NDArray[np.float64]:
        """Direction that sunlight travels to in the water."""
        return sun_travel_direction(self.zenith, 0.0, INDEX)

    def absorption(self) -> NDArray[np.float64]:
        """Absorption between depths by Gershun's law, shape (6,), 1/m."""
        tilt, azimuth = np.radians(_tables()[0].tilt_deg), np.radians(_tables()[0].azimuth_deg)
        around = 2.0 * np.trapezoid(self.radiance, azimuth, axis=-1) * np.sin(tilt)
        scalar = np.trapezoid(around, tilt, axis=-1)
        net = np.trapezoid(around * np.cos(tilt), tilt, axis=-1)
        cosine = net / scalar
        return -np.diff(np.log(net)) / np.diff(self.depths) * (cosine[1:] + cosine[:-1]) / 2.0

    def mean_absorption(self) -> float:
        """Mean from the second table down, 1/m."""
        steps = np.diff(self.depths)[1:]
        return float(self.absorption()[1:] @ steps / steps.sum())

    def sky_fraction(self) -> float:
        """Fraction of the sky in the irradiance above the water, by SPECTRL2."""
        return float(sky_fraction(self.zenith, BAND)[0])


@functools.cache
def _tables() -> tuple:
    import jerlov
    from jerlov.radiance import TYLER1958_DEPTHS

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jerlov.ProvenanceWarning)
        return tuple(jerlov.tyler1958_radiance(depth) for depth in TYLER1958_DEPTHS)


@functools.cache
def lake() -> Lake:
    """Read the tables."""
    tables = _tables()
    first = tables[0]
    angles = (np.radians(each) for each in (first.tilt_deg, first.azimuth_deg))
    tilt, azimuth = np.meshgrid(*angles, indexing="ij")
    # To look towards the sun's azimuth is to look against the way its light travels.
    w = np.array([-np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    zenith = 90.0 - first.sun_altitude_deg
    to_sun = -sun_travel_direction(zenith, 0.0, INDEX)
    compared = np.tensordot(to_sun, w, 1) < math.cos(math.radians(FROM_SUN))
    compared[[0, -1], 1:] = False
    return Lake(
        np.array([table.depth_m for table in tables]),
        np.array([table.radiance for table in tables]),
        w, compared, first.beam_attenuation, zenith, first.acceptance_deg,
    )  # fmt: skip


def modelled(
    phase_name: str, fraction: float, sky_kind: str = "clear", streams: int = 32
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radiance by discrete ordinates and by the closed form, shape (7, 19, 10) each."""
    at = lake()
    a = at.mean_absorption()
    b = np.array([at.c - a])
    phase = parse_phase(phase_name).for_bands(b, molecular_scattering([488.0]))
    E = np.array([(1.0 - fraction) * entering(at.zenith, INDEX)])
    sky = Sky.standard(sky_kind, [fraction], sun_travel_direction(at.zenith, 0.0, 1.0).tolist())
    field = solve_discrete_ordinates(
        [OpticalLayer(math.inf, np.array([a]), b, phase)], E, at.sun.tolist(),
        sky=sky, surface=WaterSurface(INDEX), streams=streams,
    )  # fmt: skip
    tube = _tube(at.w, at.acceptance)
    depths = at.depths[:, None, None, None]
    solved = field.radiance(depths, tuple(tube))[..., 0].mean(axis=-1)
    light = solve_light_field(
        TwoStreamWater(a, b, phase.chi1, phase.chi2), E, float(in_water_cosine(at.zenith, INDEX)),
        E_sky=np.array([fraction * sky.transmittance(WaterSurface(INDEX))]),
        R=diffuse_internal_reflectance(INDEX),
    )  # fmt: skip
    rays = tuple(part[..., None] for part in tube)
    closed = np.array([
        UnoccludedWater(solve_closed_form(light, phase, y, at.sun.tolist()), sky, INDEX)
        .radiance(y, rays)[..., 0].mean(axis=-1)
        for y in at.depths.tolist()
    ])  # fmt: skip
    return solved, closed


def _tube(w: NDArray[np.float64], acceptance: float) -> NDArray[np.float64]:
    """Each direction and a ring around it that halves the accepted solid angle, (3, ..., k)."""
    radius = math.radians(acceptance / 2.0) / math.sqrt(2.0)
    centre = np.moveaxis(w, 0, -1)
    aside = np.where(np.abs(centre[..., 2:]) > 0.9, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    across = np.cross(centre, aside)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    along = np.cross(centre, across)
    ways = [centre]
    for turn in 2.0 * math.pi * np.arange(_RING) / _RING:
        turned = math.cos(turn) * across + math.sin(turn) * along
        ways.append(math.cos(radius) * centre + math.sin(radius) * turned)
    return np.moveaxis(np.stack(ways, axis=-1), -2, 0)


@dataclass(frozen=True)
class Misfit:
    """Relative errors of modelled radiances; medians and 90th percentiles.

    ``median``, ``tail`` and ``worst`` have one factor for all depths and directions; ``shape`` and
    ``shape_tail`` one at each depth: what is wrong with the directions alone. ``by_depth``, shape
    (7,), is the median of modelled over measured, one factor for all depths.
    """

    median: float
    tail: float
    worst: float
    shape: float
    shape_tail: float
    by_depth: NDArray[np.float64]


def misfit(radiance: NDArray[np.float64]) -> Misfit:
    """Compare modelled radiances (7, 19, 10) with the measured ones."""
    at = lake()
    ratio = (np.log(radiance) - np.log(at.radiance))[:, at.compared]
    ratio -= np.median(ratio)
    depth = np.median(ratio, axis=1)
    whole, shape = (np.abs(np.expm1(x)) for x in (ratio, ratio - depth[:, None]))
    return Misfit(
        float(np.median(whole)), float(np.quantile(whole, 0.9)), float(whole.max()),
        float(np.median(shape)), float(np.quantile(shape, 0.9)), np.exp(depth),
    )  # fmt: skip
