"""What is known of each band before it is projected onto channels."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .channel_tables import NOTHING, Array, LengthScale
from .channels import Channels
from .radiance_table import RadianceTable
from .solved_field import SolvedField

_SEEN = 1e-3  # fraction of a channel from which on a band counts for its slowest decay


@dataclass(frozen=True, eq=False)
class OcclusionSpectra:
    """What objects do to the spectrum of light."""

    #: Those that light is multiplied with besides a number for all bands: on patches, and from
    #: :data:`.ON_PATH` on along paths, (SPECTRA, n).
    spectra: Array
    typical: Array  #: What is left of light at some usual places, of any scale, (k, n).
    #: Of the same water in fewer streams: what counts as unscattered there does here, so that the
    #: light that shade works on changes with direction no faster than occlusion is known.
    low_stream_field: SolvedField


@dataclass(frozen=True, eq=False)
class BandSpectra:
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
        return transmittance_tables(self.c, self.lengths)


def counting_bands(fractions: Array) -> NDArray[np.bool_]:
    """Bands (3, n) that have a fraction in a channel worth counting."""
    total = fractions.sum(axis=1, keepdims=True)
    return fractions > _SEEN * np.maximum(total, NOTHING)


def slowest_decay(counts: NDArray[np.bool_], rates: Array) -> Array:
    """Least rate (d, n) of the bands that count in each channel, (d, 3)."""
    least = np.where(counts, rates[:, None], math.inf).min(axis=-1)
    return np.where(np.isfinite(least), least, rates.min(axis=1, keepdims=True))


def beams_of(spectra: BandSpectra) -> tuple[Array, Array]:
    """Normal irradiance of the sun at all depths, unscattered and with the peak, (n, d)."""
    field, y = spectra.field, spectra.depths
    mu_s = field.light.mu_s
    c = field.extinction_between(0.0, y, scaled=False).T
    E = field.light.E[:, None] / mu_s
    return E * np.exp(-c * y / mu_s), E * field.beam(y)


def forward_peak(spectra: BandSpectra) -> Array:
    """Normal irradiance of the forward peak of the sun at all depths, (n, d)."""
    sharp, peaked = beams_of(spectra)
    return np.maximum(peaked - sharp, 0.0)


def transmittance_tables(c: Array, lengths: LengthScale) -> Array:
    """Fraction that is left at extinctions (d, n) after all distances, (d, l, n)."""
    return np.exp(-c[:, None] * lengths.lengths()[:, None])
