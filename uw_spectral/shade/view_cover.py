"""How far things fill a view: what they keep from a pixel of the light that is scattered forward.

Light that is scattered forward by a few degrees comes from behind a thing, which blocks it, and
what the thing sends is scattered forward in the same way. At distance t before a thing the phase
function's cone of half-angle θ is covered where the thing is wider than t tan θ. Taken over all of
a path of length P the share of scattering that stays within the thing is, at a pixel, the mean of
what is covered around it, weighed by

    K(φ) = dF̄ / dΩ,   F̄(tan φ) = ∫₀¹ F(arctan(tan φ / u)) du,

of the angle φ between view directions, where F(θ) is the share of the phase function within θ.
Neither the path nor the thing's size is in K, so that one convolution of a picture of what is
covered serves for everything in view: light is lost with c - b (K * cover) instead of c.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..water.phase import PhaseFunction
from .triangles import quartered

SIZE = 160
"""Texels along a side of the picture of what is covered."""
WIDEST = math.radians(170.0)
_MIDDLE = (SIZE - 1) / 2.0
_MOST_TRIANGLES = 20_000  # of a thing: of more every second, third, ... is taken
_MOST_SPLITS = 6
_LARGE, _SMALL = 4.0, 1.2
"""Texels that triangles reach from their middle: larger ones are filled, smaller ones added."""
_LEAST = 1e-12
_BEHIND = 1e-3  # 1 + cosine of what lies straight behind
_FADE = 0.25  # m over a floor of the water: lower things are like it
_ANGLES, _STEPS = 1500, 200
_FINE = 5  # parts along a texel in which the kernel is added up
_NEAR = 6  # texels from its middle that it is done in

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ViewMap:
    """Places of a picture of all directions about an axis, of equal area (Lambert's azimuthal).

    Attributes
    ----------
    centre : sequence of 3
        Of the view, m.
    right, up, ahead : sequences of 3
        Unit vectors; ``ahead`` is the middle of the picture.
    per_unit : float
        Texels per unit of 2 sin(θ/2), for the angle θ from the middle.
    """

    centre: Sequence[Operand]
    right: Sequence[Operand]
    up: Sequence[Operand]
    ahead: Sequence[Operand]
    per_unit: Operand

    @property
    def texel(self) -> float:
        """Solid angle of a texel, sr."""
        return 1.0 / float(self.per_unit) ** 2

    def place(self, point: Sequence[Operand], m: Mathematics = NUMPY) -> tuple[Operand, Operand]:
        """Column and row of a point, held to the picture's sides.

        Examples
        --------
        >>> view = view_map((0, 0, 0), np.eye(3), math.radians(60.0))
        >>> [round(float(x), 3) for x in view.place((0.0, 0.0, -2.0))]
        [79.5, 79.5]
        """
        d = [x - c for x, c in zip(point, self.centre, strict=True)]
        near = 1.0 / m.sqrt(m.maximum(dot(d, d), _LEAST))
        cosine = dot(d, self.ahead) * near
        scale = near * self.per_unit * m.sqrt(2.0 / m.maximum(1.0 + cosine, _BEHIND))
        h, v = dot(d, self.right) * scale, dot(d, self.up) * scale
        last = SIZE - 1.0
        return m.clamp(h + _MIDDLE, 0.0, last), m.clamp(v + _MIDDLE, 0.0, last)

    def ways(self) -> Array:
        """Unit vectors to the texels, (SIZE SIZE, 3); beyond the sphere they turn back."""
        x, y = np.meshgrid(np.arange(SIZE) - _MIDDLE, np.arange(SIZE) - _MIDDLE)
        x, y = x.ravel() / float(self.per_unit), y.ravel() / float(self.per_unit)
        squared = np.minimum(x * x + y * y, 4.0)
        side, cosine = np.sqrt(1.0 - squared / 4.0), 1.0 - squared / 2.0
        axes = np.array([self.right, self.up, self.ahead], np.float64)
        return np.stack([x * side, y * side, cosine], axis=1) @ axes


def view_map(centre: Sequence[float], axes: Array, reach: float) -> ViewMap:
    """Return the map of a view.

    Parameters
    ----------
    centre : sequence of 3
        m.
    axes : array, shape (3, 3)
        Columns: to the right, up, and back, as a camera has them.
    reach : float
        Angle from the middle to the picture's sides, rad; at most :data:`WIDEST`.
    """
    unit = 2.0 * math.sin(min(reach, WIDEST) / 2.0)
    right, up, back = (tuple(float(x) for x in column) for column in np.asarray(axes).T)
    ahead = tuple(-x for x in back)
    return ViewMap(tuple(map(float, centre)), right, up, ahead, _MIDDLE / unit)


@dataclass(frozen=True, eq=False)
class ViewCover:
    """What of a view things cover.

    Attributes
    ----------
    view : ViewMap
    covered : array, shape (SIZE, SIZE)
        Share of each texel, rows upwards.
    """

    view: ViewMap
    covered: Array

    def blocked(self, phase: PhaseFunction) -> Array:
        """Share of a phase function that stays within what is covered, (SIZE, SIZE)."""
        if not self.covered.any():
            return np.zeros_like(self.covered)
        kernel = _kernel(phase, float(self.view.per_unit))
        size = (2 * SIZE, 2 * SIZE)
        found = np.fft.irfft2(np.fft.rfft2(self.covered, size) * kernel, size)
        return np.clip(found[:SIZE, :SIZE], 0.0, 1.0)


def no_cover() -> ViewCover:
    """Return the cover of a view with nothing in it, or of one that has no centre."""
    return ViewCover(view_map((0.0, 0.0, 0.0), np.eye(3), 1.0), np.zeros((SIZE, SIZE)))


def view_cover(
    view: ViewMap, things: Iterable[NDArray[np.floating]], floor_depth: float = math.inf
) -> ViewCover:
    """Look at what things cover.

    Parameters
    ----------
    view : ViewMap
    things : iterable of arrays, shape (t, 3, 3)
        Corners of the triangles of each, m.
    floor_depth : float
        Of the floor of the water, m: what lies on it is part of it.
    """
    picture = _Picture(view, floor_depth)
    for corners in things:
        picture.add(corners)
    return ViewCover(view, picture.covered())


class _Picture:
    """What is covered, while things are drawn."""

    def __init__(self, view: ViewMap, floor_depth: float) -> None:
        self._view, self._floor = view, floor_depth
        self._ways = view.ways()
        # Faces to and from the view apart: of closed things both cover the same.
        self._sides = np.zeros((2, SIZE * SIZE))

    def covered(self) -> Array:
        """Return the picture."""
        return np.minimum(self._sides.max(axis=0), 1.0).reshape(SIZE, SIZE)

    def add(self, corners: NDArray[np.floating]) -> None:
        """Draw triangles."""
        every = -(-len(corners) // _MOST_TRIANGLES)
        now = np.asarray(corners[::every], np.float64) - np.asarray(self._view.centre)
        weight = np.full(len(now), float(every))
        for split in range(_MOST_SPLITS):
            now, weight, wide = self._within(now, weight)
            if not split:
                for triangle in now[wide > _LARGE]:
                    self._fill(triangle)
                now, weight, wide = (x[wide <= _LARGE] for x in (now, weight, wide))
            small = (wide * np.sqrt(weight) < _SMALL) | (split == _MOST_SPLITS - 1)
            self._put(now[small], weight[small])
            now, weight = quartered(now[~small]), np.tile(weight[~small], 4)
            if not len(now):
                return

    def _within(self, corners: Array, weight: Array) -> tuple[Array, Array, Array]:
        """Keep what may be in the picture; how far each reaches from its middle, texels."""
        per_unit = float(self._view.per_unit)
        middle = corners.mean(axis=1)
        distance = np.maximum(np.linalg.norm(middle, axis=1), _LEAST)
        around = np.sqrt(((corners - middle[:, None]) ** 2).sum(axis=2).max(axis=1))
        cosine = np.clip(middle @ np.asarray(self._view.ahead) / distance, -1.0, 1.0)
        wide = np.arcsin(np.minimum(around / distance, 1.0))
        corner = 2.0 * math.asin(min(_MIDDLE / per_unit / math.sqrt(2.0), 1.0))
        seen = (np.arccos(cosine) - wide < corner) | (around >= distance)
        return corners[seen], weight[seen], (around / distance * per_unit)[seen]

    def _fill(self, triangle: Array) -> None:
        """Draw a large triangle, with soft edges of a texel."""
        out = float(np.linalg.det(triangle))
        share = np.ones(SIZE * SIZE) if out else np.zeros(SIZE * SIZE)
        for k in range(3):
            side = np.cross(triangle[k], triangle[(k + 1) % 3])
            side *= math.copysign(1.0, out) / max(float(np.linalg.norm(side)), _LEAST)
            off = self._ways @ side * float(self._view.per_unit)
            share *= np.clip(0.5 + off, 0.0, 1.0)
        here = np.flatnonzero(share)
        if not len(here):
            return
        normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        along = self._ways[here] @ normal
        distance = out / np.where(np.abs(along) > _LEAST, along, math.inf)
        z = self._view.centre[2] + distance * self._ways[here, 2]
        self._sides[int(out < 0.0), here] += share[here] * self._over_floor(z)

    def _over_floor(self, z: Array) -> Array:
        return np.clip((self._floor + z) / _FADE, 0.0, 1.0)

    def _put(self, corners: Array, weight: Array) -> None:
        """Add the solid angles of small triangles to texels."""
        view = self._view
        one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        middle = corners.mean(axis=1)
        squared = np.maximum((middle**2).sum(axis=1), _LEAST)
        turned = (np.cross(one, other) * middle).sum(axis=1)
        share = weight * turned / (2.0 * squared**1.5 * view.texel)
        point = middle + np.asarray(view.centre)
        share *= self._over_floor(point[:, 2])
        h, v = view.place(tuple(point.T))
        # What is held to the sides lies outside.
        inside = (h > 0) & (h < SIZE - 1) & (v > 0) & (v < SIZE - 1)
        h, v, share = h[inside], v[inside], share[inside]
        left, low = np.floor(h), np.floor(v)
        for dh in (0, 1):
            for dv in (0, 1):
                part = share * np.abs(1 - dh - (h - left)) * np.abs(1 - dv - (v - low))
                place = ((low + dv) * SIZE + left + dh).astype(np.intp)
                for side, sign in zip(self._sides, (1.0, -1.0), strict=True):
                    side += np.bincount(place, np.maximum(sign * part, 0.0), SIZE * SIZE)


def share_within(phase: PhaseFunction, angle: Array) -> Array:
    """Share F of a phase function within angles of the way ahead, rad.

    Examples
    --------
    >>> from uw_spectral.water.phase import Isotropic
    >>> share_within(Isotropic(), np.array([math.pi / 2, math.pi])).round(4).tolist()
    [0.5, 1.0]
    """
    angles, within = _shares(phase)
    return np.interp(angle, angles, within)


@functools.lru_cache(maxsize=16)
def _shares(phase: PhaseFunction) -> tuple[Array, Array]:
    angles = np.geomspace(1e-7, math.pi, 6000)
    middle = np.sqrt(angles[1:] * angles[:-1])
    parts = phase.per_steradian(np.sin(middle / 2) ** 2)
    within = np.cumsum(2.0 * math.pi * parts * np.sin(middle) * np.diff(angles))
    first = math.pi * float(phase.per_steradian(np.sin(angles[0] / 2) ** 2)) * angles[0] ** 2
    within = np.concatenate([[first], first + within])
    return angles, within / within[-1]


def share_on_path(phase: PhaseFunction, tangent: Array) -> Array:
    """Mean F̄ of that share over a path, of a disc of a size over its distance (angle's tangent)."""
    u = (np.arange(_STEPS) + 0.5) / _STEPS
    return share_within(phase, np.arctan2(tangent[:, None], u)).mean(axis=1)


@functools.lru_cache(maxsize=16)
def _kernel(phase: PhaseFunction, per_unit: float) -> NDArray[np.complex128]:
    """Fourier transform of K times the texel's solid angle, for texels about the middle."""
    angle = np.concatenate([[0.0], np.geomspace(1e-4, math.pi / 2 - 1e-4, _ANGLES)])
    total = share_on_path(phase, np.tan(angle))

    def within(texels: Array) -> Array:
        """Share within a circle of a radius."""
        unit = np.minimum(texels / per_unit, 2.0)
        return np.interp(2.0 * np.arcsin(unit / 2.0), angle, total)

    def per_texel(radius: Array) -> Array:
        step = 0.25
        low = np.maximum(radius - step, 0.0)
        area = math.pi * ((radius + step) ** 2 - low**2)
        return (within(radius + step) - within(low)) / area

    offset = np.fft.fftfreq(2 * SIZE, 1.0 / (2 * SIZE))
    radius = np.hypot(offset[:, None], offset)
    kernel = per_texel(radius)
    near = np.arange(-_NEAR, _NEAR + 1)
    parts = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    for row in near:
        for column in near:
            fine = np.hypot(row + parts[:, None], column + parts)
            kernel[row, column] = per_texel(fine).mean()
    # The middle is steep: it has what the others leave of a circle that holds them.
    circle = radius <= _NEAR
    kernel[0, 0] = 0.0
    kernel[0, 0] = max(
        float(within(np.array([math.sqrt(circle.sum() / math.pi)]))[0]) - kernel[circle].sum(), 0.0
    )
    return np.fft.rfft2(kernel)
