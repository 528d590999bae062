"""The water that explains how a picture changes with distance, whatever it shows.

A surface of reflectance ρ is seen at the distance P along the direction w, from the depth y, as

    I = g (T' ρ E_d(y')/π + (T - T') ρ̄ E_d(y')/π + L(y, w) - T L(y', w)),
    T = e^{-(c - φ κ b) P},   T' = e^{-(c - ω φ κ b) P},

y' being its depth, L the radiance of the water as it is without it, g the exposure. Of the light
that the water scatters forward a fraction κ stays within surfaces, which hide what comes from
behind them; ω of that is of the one that is seen, the rest comes from those around it, of the
reflectance ρ̄. φ is 1, or 0 in pictures that lack it. What is darkest about each distance shows the
backscatter (D. Akkaynak & T. Treibitz, CVPR 2019), but it is not black. Assumed is that what it
reflects has, at all distances, one least value for each channel, times 1 + E; E, the same in all
channels, is distributed as e^{-E/θ}, for some of them with a larger θ, and each channel scatters
besides. All these are fitted with the water, with wide priors. Pixels of open water tell L, and
the mean of what is seen at each distance tells more, above all if its reflectance is known.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..spectra.spectrum import Spectrum
from ..water.bio_optics import Constituents
from .description import BandsDescription, Description
from .picture_cells import Bins, SeenPicture, bins_of
from .water_fit import (
    STARTS,
    FittedWater,
    constituents_of,
    inside,
    intervals,
    logarithms,
    viewpoint_in,
)

Array = NDArray[np.float64]

_BANDS = BandsDescription(20)
_TRIED = 2  # starts that are followed
_WATER, _SURFACES = 0.03, (1e-4, 1e-5)  # step for slopes; what deviances are settled to
_BEST, _FOLLOWED = 0.05, 1.0  # what those of waters are settled to
_COLOUR = 0.01  # error of the exposure of a channel
_HUE = 0.5  # of logarithms of reflectances in the channels
_PRIOR = np.array([*np.log([3.0] * 6), 5.0, math.log(5.0), 1.0])
#: Logarithms of the exposures; of the least reflectances; of θ; of the scatter, over the
#: reflectance; of that of the mean of a bin; of φ/(1 - φ); of ρ̄ over the least; of ω/(1 - ω).
_TYPICAL = np.log([1.0, 1.0, 1.0, 0.01, 0.01, 0.01, 3.0, 0.3, 0.3, 1.0, 20.0, 1.0])
_95 = 1.96
#: Bins that count as one: neighbours show the same surfaces, and objects shade the water. To hold
#: 95 % of amounts in nine scenes that EEVEE rendered took 3.2, in 24 made-up pictures 1.7.
_SHARED = 3.5
_BRIGHTER = (0.8, 1.0), (0.2, 10.0)  # parts of the darkest, and their θ
#: What all channels alike are off by: of the light before the darkest, 1 to 4 % by occlusion in
#: eight scenes of EEVEE; of what is scattered forward from around.
_OCCLUDED, _BESIDE = 0.04, 0.3
_DARK_ENOUGH = 0.7  # light of the darkest over that of the mean
_FAR_ENOUGH = 0.3  # attenuation lengths
_SCATTER = 3.0  # of channels, over the reflectance
_STRAIGHT, _LARGEST = 1e-2, 30.0
_ROUNDS, _SHORTER = 40, 8

_ERFC = (0.17087277, -0.82215223, 1.48851587, -1.13520398, 0.27886807,
         -0.18628806, 0.09678418, 0.37409196, 1.00002368, -1.26551223)  # fmt: skip


def fit_picture(
    seen: SeenPicture,
    description: Description,
    depth: float,
    mean_reflectance: Spectrum | None = None,
) -> FittedWater:
    """Fit chlorophyll, CDOM and minerals to a picture that was taken at a depth in m.

    Of the description all counts but the water, the bands and how pictures are developed. The mean
    reflectance, if it is known, is that of what is seen, shading included, at all distances.

    Raises
    ------
    InputError
        If the picture does not tell the water: its distances are too short or too much alike, or
        nothing in it is dark; or if no water explains it.
    """
    bins = bins_of(seen, viewpoint_in(Constituents(), description, depth, _BANDS).phase.components)
    fit = _PictureFit(bins, description, depth, mean_reflectance)
    starts = sorted((logarithms(start) for start in STARTS), key=fit.deviance)[:_TRIED]
    x = min((fit.least(start)[0] for start in starts), key=fit.deviance)
    # What is brighter scatters more; how bright it is, is known once the water is.
    fit = dataclasses.replace(fit, brightness=fit.brightness_at(x), kept={})
    x, curvature = fit.least(x)
    fit.require_distances(x)
    bends, ways = np.linalg.eigh(curvature / 2.0)
    # Near nothing the deviance is flat, though no amounts are there that count.
    normal = ways * np.maximum(bends, 0.0) @ ways.T + np.eye(len(x))
    low, high = intervals(fit.deviance, fit.followed, x, normal, _95 * math.sqrt(_SHARED))
    return FittedWater(constituents_of(x), low, high, fit.misfit(x))


@dataclass(frozen=True, eq=False)
class _Light:
    """Light of bins in a water."""

    open: Array  #: Of open water, (k, 3).
    here: Array  #: Of open water in place of surfaces, of the darkest and the mean, (m, 3).
    #: Logarithms, for φ of 0, ½ and 1, of the part of it that comes from behind, of white surfaces,
    #: and, if it is known, those of the mean reflectance, (3, parts, m, 3).
    left: Array

    def at(self, u: Array) -> tuple[Array, Array, Array]:
        """Light on the way, of white surfaces and of the mean, for surfaces u (k, p), (k, m, 3)."""
        gain = np.exp(u[:, None, :3])
        behind, white, *mean = gain * self._part(_logistic(u[:, 9]))
        if not mean:
            mean = [white * np.exp(u[:, None, 3:6] + u[:, None, 10:11])]
        return gain * self.here - behind, white, mean[0]

    def own(self, u: Array) -> Array:
        """Light of white surfaces that is their own, (k, m, 3)."""
        return np.exp(u[:, None, :3]) * self._part(_logistic(u[:, 9]) * _logistic(u[:, 11]))[1]

    def _part(self, phi: Array) -> Array:
        weights = [(1 - phi) * (1 - 2 * phi), 4 * phi * (1 - phi), phi * (2 * phi - 1)]
        return np.exp(np.einsum("ak,apmc->pkmc", weights, self.left))


@dataclass(frozen=True, eq=False)
class _PictureFit:
    """Likelihood of waters (parameters x) and of the surfaces that are seen (parameters u)."""

    bins: Bins
    description: Description
    depth: float
    mean: Spectrum | None
    brightness: Array | float = 1.0  #: Of the darkest of bins, (n, 1), over the least.
    kept: dict[bytes, tuple[float, Array]] = dataclasses.field(default_factory=dict)

    def deviance(self, x: Array) -> float:
        """Twice the negative logarithm of the likelihood, with the likeliest surfaces."""
        return self._settled(x)[0]

    def least(self, x: Array, held: int | None = None) -> tuple[Array, Array]:
        """Return the parameters of the least deviance near some, and its curvature there."""
        free = np.array([i for i in range(len(x)) if i != held])

        def placed(y: Array) -> Array:
            p = x.copy()
            p[free] = y
            return inside(p)

        def deviances(points: Array) -> Array:
            return np.array([self.deviance(placed(y)) for y in points])

        settled = _BEST if held is None else _FOLLOWED
        y, curvature = _newton(deviances, x[free], _WATER, settled)
        return placed(y), curvature

    def followed(self, x: Array, i: int) -> Array:
        """Return the parameters of the least deviance when number i is held."""
        return self.least(x, i)[0]

    def brightness_at(self, x: Array) -> Array:
        """Return the most likely 1 + E of bins, (n, 1)."""
        _, q, a = self._dark(self._light(x), self._settled(x)[1][None])
        return 1.0 + _along(q, a)[0, :, None]

    def misfit(self, x: Array) -> float:
        """Root mean square of what neither water nor brightness of surfaces explains."""
        light, u = self._light(x), self._settled(x)[1][None]
        _, q, a = self._dark(light, u)
        opened = self._open(light, u)
        squares = np.square(q - a * _along(q, a)[..., None]).sum() + np.square(opened).sum()
        return math.sqrt(squares / (2 * q.shape[1] + opened.size))

    def require_distances(self, x: Array) -> None:
        """Refuse where distances are too short, or the darkest is not dark."""
        water = constituents_of(x).water()
        c = float(water.a([550.0])[0] + water.b([550.0])[0])
        lengths = c * float(self.bins.dark.P.max())
        if lengths < _FAR_ENOUGH:
            raise InputError(
                f"fit: the farthest surface is {lengths:.2g} attenuation lengths away, where water "
                f"does not show; give a picture that reaches {_FAR_ENOUGH / lengths:.1f} times as "
                "far"
            )
        u = self._settled(x)[1]
        _, white, mean = self._light(x).at(u[None])
        ratio = float(np.exp(u[3:6]).mean() * (1.0 + math.exp(u[6])) / (mean / white).mean())
        if math.exp(u[7]) > _SCATTER:
            raise InputError(
                "fit: no water explains how the darkest surfaces change with distance; objects "
                "that shade the water before them, lamps, or wrong distances make it so"
            )
        if ratio > _DARK_ENOUGH:
            raise InputError(
                f"fit: the darkest surfaces are {ratio:.0%} as bright as the mean of all; a "
                "picture tells the water by shadows or dark surfaces at all distances"
            )

    def _settled(self, x: Array) -> tuple[float, Array]:
        """Deviance of a water, and its likeliest surfaces."""
        key = x.tobytes()
        if key not in self.kept:
            light, start = self._light(x), _TYPICAL.copy()
            path, *_ = light.at(start[None])
            darkest = self.bins.dark.value / path[0, : len(self.bins.dark.P)]
            start[:3] = math.log(0.9 * float(darkest.min()))
            apart = {y: np.square(np.frombuffer(y) - x).sum() for y in self.kept}
            near = min(apart, key=apart.__getitem__, default=None)
            known = start if near is None else self.kept[near][1]
            starts = [start, known] if len(self.kept) < len(STARTS) else [known]
            deviances = functools.partial(self._deviances, light)
            ends = (_newton(deviances, u, *_SURFACES)[0] for u in starts)
            found = ((float(deviances(u[None])[0]), u) for u in ends)
            self.kept[key] = min(found, key=lambda end: end[0])
        return self.kept[key]

    def _light(self, x: Array) -> _Light:
        view = viewpoint_in(constituents_of(x), self.description, self.depth, _BANDS)
        response, field = view.reduction.response.T, view.field
        P, w, cover = (
            np.concatenate([getattr(kind, name) for kind in (self.bins.dark, self.bins.mean)])
            for name in ("P", "w", "cover")
        )
        y = np.clip(self.depth - w[:, 2] * P, 0.0, view.column.floor_depth)
        here, there = field.radiance(np.stack([np.full_like(y, self.depth), y]), tuple(w.T))
        white = field.Ed(y) / math.pi
        parts = [there, white]
        if self.mean is not None:
            parts.append(self.mean.at(view.column.bands.centres) * white)
        forward = cover @ view.phase.weights * view.layer.scattering
        left = [
            [np.exp(-(view.attenuation - phi * forward) * P[:, None]) * part for part in parts]
            for phi in (0.0, 0.5, 1.0)
        ]
        opened = np.zeros((0, len(white[0])))
        if len(self.bins.open.P):
            opened = field.radiance(self.depth, tuple(self.bins.open.w.T))
        logs = np.log(np.maximum(np.array(left) @ response, 1e-300))
        return _Light(opened @ response, here @ response, logs)

    def _deviances(self, light: _Light, u: Array) -> Array:
        """Twice the negative logarithms of likelihoods of surfaces u (k, p), (k,)."""
        u = np.clip(u, -_LARGEST, _LARGEST)
        logs, q, a = self._dark(light, u)
        A = np.maximum((a * a).sum(axis=2), 1e-200)

        def brighter(part: float, times: float) -> Array:
            # The integral of e^{-E/θ}/θ times the normal densities at q - a E, over E > 0.
            theta = times * np.exp(u[:, 6:7])
            m = ((a * q).sum(axis=2) - 1.0 / theta) / np.sqrt(A)
            return math.log(part) + _log_tail(m) - np.log(theta * theta * A) / 2.0

        some, few = (brighter(*each) for each in _BRIGHTER)
        off = ((q * q).sum(axis=2) - 2.0 * np.logaddexp(some, few) + 2.0 * logs).sum(axis=1)
        off += np.square(self._open(light, u)).sum(axis=(1, 2))
        off += np.square((u[:, 3:] - _TYPICAL[3:]) / _PRIOR).sum(axis=1)
        for of, spread in ((u[:, :3], _COLOUR), (u[:, 3:6], _HUE)):
            off += np.square((of - of.mean(axis=1, keepdims=True)) / spread).sum(axis=1)
        mean = self.bins.mean
        path, _, surfaces = (part[:, -len(mean.P) :] for part in light.at(u))
        variance = np.square(mean.sd) + np.square(np.exp(u[:, None, 8:9]) * surfaces)
        z2 = np.square(mean.value - path - surfaces) / variance
        # What brightens one channel brightens all: three count as one.
        return off + ((z2 + np.log(variance)) / 3.0).sum(axis=(1, 2))

    def _dark(self, light: _Light, u: Array) -> tuple[Array, Array, Array]:
        """Logarithms of the deviations of the darkest, (k, n); what is left in them, and E = 1."""
        dark, count = self.bins.dark, len(self.bins.dark.P)
        path, white, mean = (part[:, :count] for part in light.at(u))
        own = light.own(u)[:, :count]
        least, beside = own * np.exp(u[:, None, 3:6]), (1.0 - own / white) * mean
        scatter = np.exp(u[:, 7])[:, None, None] * self.brightness * least
        sd = np.sqrt(np.square(dark.sd) + np.square(scatter))
        grey = np.hypot(_OCCLUDED * (path + beside), _BESIDE * beside) / sd
        size = np.sqrt(1.0 + np.square(grey).sum(axis=2, keepdims=True))
        q, a = (
            x - grey * (grey * x).sum(axis=2, keepdims=True) / (size * (size + 1.0))
            for x in ((dark.value - path - beside - least) / sd, least / sd)
        )
        return np.log(sd).sum(axis=2) + np.log(size[..., 0]), q, a

    def _open(self, light: _Light, u: Array) -> Array:
        opened = self.bins.open
        return (opened.value - light.open * np.exp(u[:, None, :3])) / opened.sd


def _logistic(x: Array) -> Array:
    return 1.0 / (1.0 + np.exp(-x))


def _along(q: Array, a: Array) -> Array:
    """Return how far along ``a``, not backwards, one comes nearest to ``q``."""
    return np.maximum((q * a).sum(axis=-1) / np.maximum((a * a).sum(axis=-1), 1e-200), 0.0)


def _newton(
    f: Callable[[Array], Array], x: Array, step: float, tolerance: float
) -> tuple[Array, Array]:
    """Return where a function is least near x, and its curvature there, by Newton's method.

    ``f`` takes points (k, p) to (k,); derivatives are differences over a step. It ends when it
    expects to fall by less than the tolerance.
    """
    n = len(x)
    e, pairs = np.eye(n) * step, [(p, r) for p in range(n) for r in range(p)]
    offsets = np.array([0.0 * x, *e, *-e, *(e[p] + e[r] for p, r in pairs)])
    H = np.empty((n, n))
    for _ in range(_ROUNDS):
        now, *values = f(x + offsets)
        up, down = np.array(values[:n]), np.array(values[n : 2 * n])
        H[np.diag_indices(n)] = (up + down - 2.0 * now) / step**2
        for (p, r), both in zip(pairs, values[2 * n :], strict=True):
            H[p, r] = H[r, p] = (both - up[p] - up[r] + now) / step**2
        bends, ways = np.linalg.eigh(H)
        slope = ways.T @ (up - down) / (2.0 * step)
        # Down, whichever way it bends.
        along = -slope / np.maximum(np.abs(bends), _STRAIGHT)
        by = ways @ along
        by *= min(1.0, 1.0 / max(float(np.abs(by).max()), 1e-30))
        for _ in range(_SHORTER):
            if float(f((x + by)[None])[0]) < now:
                x = x + by
                break
            by /= 4.0
        else:
            return x, H
        if -float(along @ slope) < 2.0 * tolerance:
            break
    return x, H


def _log_tail(m: Array) -> Array:
    """Logarithm of e^{m²/2} Φ(m), Φ being the normal distribution, within 1.2e-7.

    W. H. Press et al., Numerical Recipes, 2nd ed. (1992), 6.2: erfcc.
    """
    z = np.abs(m) / math.sqrt(2.0)
    t = 1.0 / (1.0 + 0.5 * z)
    tail = np.log(t / 2.0) + np.polyval(_ERFC, t)
    return np.where(m < 0.0, tail, z * z + np.log1p(-np.exp(np.minimum(tail - z * z, 0.0))))
