"""One layer of the solved light field, and what bounds the layers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..water.phase import BandPhase, PhaseFunction
from .path_integral import attenuated_path
from .rough_surface import WaterSurface
from .sky import Sky

RESONANCE = 1e-5
"""Of a rate, within which another is taken for the same: wider errs, narrower leaves rounding."""
LEVEL = 1e-7  # |mu| of a ray that is level
_DEEP = 1e12  # optical depth that stands for infinity
THIN = 1e-6  # of a depth, and in m: a step across which extinction is averaged at least
Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Boundaries:
    """What comes in from above, through what surface, and what the floor sends back."""

    E: Array
    mu_s: float
    sun: Sequence[float]
    sky: Sky
    index: float | None
    floor_reflectance: Array
    waves: WaterSurface | None = None


@dataclass(frozen=True, eq=False)
class SolvedLayer:
    """Homogeneous water as a sum of k exponentials per azimuth mode m and band n."""

    #: Depths, m; the last bottom may be infinite.
    top: float
    bottom: float
    #: Extinction, and that after the forward peak is taken out, 1/m, (n,).
    c: Array
    scaled: Array
    b: Array  #: Scattering coefficient, 1/m, (n,).
    phase: BandPhase
    #: Per scaled optical depth: positive of an exponential that falls from 1 at the top, negative
    #: of one that rises to 1 at the bottom, (m, n, k).
    rate: Array
    #: Radiance along the streams where the exponential is 1, (m, n, N, k).
    down: Array
    up: Array
    source: Array  #: The source function there, by degree of the Legendre functions, (m, n, l, k).

    @property
    def depth(self) -> Array:
        """Scaled optical thickness, shape (n,), at most :data:`_DEEP`."""
        return np.minimum(self.scaled * (self.bottom - self.top), _DEEP)

    def inside(self, y: Array) -> Array:
        """Depths y as seen from the top of the layer, held inside it, m."""
        return np.clip(y - self.top, 0.0, self.bottom - self.top)

    def scaled_below(self, y: Array) -> Array:
        """Scaled optical depths of depths y below the top, shape (n, d)."""
        return self.scaled[:, None] * self.inside(np.ravel(y))

    def exponentials(self, t: Array, modes: int | None = None) -> Array:
        """Those of modes, by default all, at scaled optical depths t (n, d), (m, n, k, d)."""
        left = np.maximum(self.depth[:, None] - t, 0.0)
        rate = self.rate[:modes, ..., None]
        return np.exp(-np.abs(rate) * np.where(rate > 0, t[:, None], left[:, None]))


def across_layer(
    layer: SolvedLayer,
    entering: Array,
    y: Array,
    mu: Array,
    legendre: Array,
    at_y: Array | None = None,
) -> Array:
    """Modes of light at depths y, or where it leaves the layer, that came into it with others.

    All of mu has one sign; shapes as of :meth:`SolvedField._scattered_modes`. ``at_y`` are the
    exponentials there, if they are known.
    """
    strength = np.swapaxes(legendre, 1, 2)[:, None] @ layer.source
    detuning = 1.0 - layer.rate[..., None, :] * mu[:, None]
    close = np.abs(detuning) < RESONANCE
    ratio = strength / np.where(close, np.inf, detuning)
    t = layer.scaled_below(y)
    start = np.zeros_like(layer.depth) if mu[0] > 0 else layer.depth
    path = np.abs(t - start[:, None]).reshape(len(t), *y.shape) / np.abs(mu)
    fades = np.exp(-path)
    at_start = np.einsum("mnqk,mnk->mnq", ratio, layer.exponentials(start[:, None])[..., 0])
    if at_y is None:
        at_y = layer.exponentials(t)
    if y.ndim > 1:
        found = np.swapaxes(ratio @ at_y, 2, 3)
        at_start = at_start[:, :, None]
    else:
        found = np.einsum("mnqk,mnkq->mnq", ratio, at_y)
    found += fades * (entering - at_start)
    # Where rate and cosine agree: (e^{-rt} - e^{-t/μ}) / (1 - rμ) by its series.
    m, n, q, k = np.nonzero(close)
    if len(m):
        length, shape = path[n, ..., q], (-1, *[1] * (y.ndim - 1))
        series = np.exp(-length) * length
        series *= 1.0 + 0.5 * length * detuning[m, n, q, k].reshape(shape)
        place: Any = (m, n, ..., q)
        np.add.at(found, place, strength[m, n, q, k].reshape(shape) * series)
    return found


def weight_of(phase: BandPhase, part: PhaseFunction) -> Array:
    """Weight per band of a part of a phase function; 0 where it has no such part."""
    return sum(
        (w for own, w in zip(phase.components, phase.weights, strict=True) if own == part),
        np.zeros(len(phase)),
    )


def path_of(near: Array, rate: Array, P: Array) -> Array:
    """Integral of e^{near - rate v} dv over the length P."""
    return attenuated_path(near, near - rate * P, rate * P, P)
