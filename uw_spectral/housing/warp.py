"""A picture through port and lens, made of one by a pinhole in the water and its depth.

A point at inverse depth ρ along the ray of a pixel lies in the pinhole picture at a + ρ b: a line,
along which the pixel's point is where the picture's own inverse depth is ρ. As the pinhole stands
where the rays nearly meet, b is small and looking up the depth again and again converges; where it
jumps to and fro at the edge of an object, the line is searched from the camera outwards.
Inverse depth is linear in the picture of a plane, and is interpolated as such.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from .housing import Housing
from .view import PinholeView

Array = NDArray[np.float64]
Sampling = Literal["nearest", "linear", "cubic"]

_LOOKS = 12
_SETTLED = 1e-6  # pixels
# Neighbours are different things if their parallax differs by more pixels, or their inverse depth
# by a larger factor.
_EDGE, _STEP = 0.1, 1.25
_STARTS, _SEARCHED, _HALVINGS = 5, 64, 30
_FARTHEST = 1e9  # m: stands for infinity where a point is needed


@dataclass(frozen=True, eq=False)
class SeenPlaces:
    """What each pixel of a picture through a port sees, at one wavelength."""

    #: Image coordinates in the pinhole picture; NaN where the port shows nothing,
    #: (height, width, 2).
    places: Array
    #: In the camera's axes from its pupil, m; infinite in open water, (height, width, 3).
    points: Array
    distances: Array  #: Way in the water, from the outer face of the port, m, (height, width).
    #: Where an object hid from the pinhole what the port shows: what is beside it stands in,
    #: (height, width).
    hidden: NDArray[np.bool_]
    #: Water in the way of the pinhole less that in the way of the port, m, (height, width).
    extra: Array

    def sampled(self, picture: ArrayLike, sampling: Sampling = "cubic") -> Array:
        """Return what a picture, shape (rows, columns, ...), shows at the places.

        Labels, normals and other things that have no mean take ``"nearest"``.
        """
        return sample(picture, self.places, sampling)


def seen_places(
    housing: Housing, view: PinholeView, depth: ArrayLike, wavelength: float
) -> SeenPlaces:
    """Find what each pixel through the port sees.

    ``depth`` is the planar depth of the picture of :func:`field_needed`, m; infinite in open water.

    Raises
    ------
    InputError
        If the depth is not of that picture, or a pixel sees beyond it.
    """
    inverse = _inverse(depth, view)
    origins, w = housing.ray_in_water(housing.camera.pixel_centres(), wavelength)
    line = _Line.of(view, origins, w)
    known = np.isfinite(w).all(axis=-1)
    at, rho = np.full((*known.shape, 2), np.nan), np.full(known.shape, np.nan)
    hidden = np.zeros(known.shape, dtype=bool)
    rho[known], at[known], hidden[known] = line.chosen(known).seen(inverse)
    if (_outside(at, inverse) & known).any():
        raise InputError(
            "warp: the pinhole picture is too small for this port, lens and depth; make it as "
            "field_needed says, with the distance of the nearest object"
        )
    points = line.point(rho)
    far, position = np.isinf(points).any(axis=-1), np.array(view.position)
    there = np.where(far[..., None], origins, points)
    water = np.linalg.norm(there - origins, axis=-1)
    # At infinity the ways differ by what lies along the ray.
    end = np.einsum("...i,...i->...", origins - position, w)
    extra = np.where(far, end, np.linalg.norm(there - position, axis=-1) - water)
    distances = np.where(far, np.inf, water)
    return SeenPlaces(at, points, distances, hidden, extra)


def warped(
    picture: ArrayLike,
    depth: ArrayLike,
    housing: Housing,
    view: PinholeView,
    wavelengths: ArrayLike,
    sampling: Sampling = "cubic",
) -> Array:
    """Return a picture of n bands or channels as it is seen through the port, (height, width, n).

    Depth as of :func:`seen_places`; a channel has its :func:`effective_wavelength`. NaN where the
    port shows nothing.

    Raises
    ------
    InputError
        If the numbers of bands differ, or the picture is too small.
    """
    values = np.asarray(picture, dtype=np.float64)
    nm = np.asarray(wavelengths, dtype=np.float64)
    if values.ndim != 3 or nm.shape != values.shape[2:]:
        raise InputError(
            f"warp: give a wavelength for each band; the picture is {values.shape}, the "
            f"wavelengths are {nm.shape}"
        )
    bands = [
        seen_places(housing, view, depth, float(one)).sampled(values[..., band], sampling)
        for band, one in enumerate(nm)
    ]
    return np.stack(bands, axis=-1)


def warped_flow(
    places: SeenPlaces,
    flow: ArrayLike,
    next_depth: ArrayLike,
    housing: Housing,
    view: PinholeView,
    wavelength: float,
) -> Array:
    """Return the optical flow through the port, of that of the pinhole's pictures, in pixels.

    ``places`` and ``flow`` are of the first picture; ``next_depth`` is the planar depth, m, of what
    each pixel of the *first* picture shows when the second is taken. NaN for what leaves the field.
    """
    there = places.places + places.sampled(flow, "linear")
    inverse = places.sampled(_inverse(next_depth, view), "linear")
    rays = view.camera.directions(there)
    depth = 1.0 / np.maximum(inverse, 1.0 / _FARTHEST)
    points = np.array(view.position) + rays / rays[..., 2:] * depth[..., None]
    return housing.project(points, wavelength) - housing.camera.pixel_centres()


def effective_wavelength(centres: ArrayLike, weights: ArrayLike) -> Array:
    """Mean wavelength of channels, nm, by what each band adds to them, (n, channels).

    That is response times light; negative ones count as none.
    """
    fraction = np.maximum(np.asarray(weights, dtype=np.float64), 0.0)
    return np.asarray(centres, dtype=np.float64) @ fraction / fraction.sum(axis=0)


def sample(picture: ArrayLike, places: Array, sampling: Sampling = "cubic") -> Array:
    """Return values of a picture at image coordinates; NaN where these are.

    Beyond the outermost pixels' centres these are repeated. ``"cubic"`` is Catmull and Rom's, kept
    between the least and the most of the 16 pixels that it is made of: beside something bright
    nothing becomes negative.
    """
    values = np.asarray(picture)
    known = np.isfinite(places).all(axis=-1)
    at = np.where(known[..., None], places, 0.5) - 0.5
    if sampling == "nearest":
        x, y = np.floor(at[..., 0] + 0.5), np.floor(at[..., 1] + 0.5)
        found = _pixels(values, x.astype(np.int64), y.astype(np.int64))
        whole = not np.issubdtype(found.dtype, np.floating)
        return found if whole and known.all() else _masked(found.astype(np.float64), known)
    first = np.floor(at).astype(np.int64)
    weights = _cubic if sampling == "cubic" else _linear
    shift = -1 if sampling == "cubic" else 0
    across, down = (weights(at[..., axis] - first[..., axis]) for axis in (0, 1))
    found = np.zeros(places.shape[:-1] + values.shape[2:])
    least, most = np.full(found.shape, np.inf), np.full(found.shape, -np.inf)
    extra = (1,) * (values.ndim - 2)
    for row, fraction_down in enumerate(down, shift):
        for column, fraction_across in enumerate(across, shift):
            fraction = (fraction_down * fraction_across).reshape(known.shape + extra)
            here = _pixels(values, first[..., 0] + column, first[..., 1] + row)
            found += fraction * here
            np.minimum(least, here, out=least)
            np.maximum(most, here, out=most)
    return _masked(found.clip(least, most), known)


def _masked(found: Array, known: NDArray[np.bool_]) -> Array:
    return np.where(known.reshape(known.shape + (1,) * (found.ndim - known.ndim)), found, np.nan)


def _pixels(values: NDArray, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray:
    rows, columns = values.shape[:2]
    return values[y.clip(0, rows - 1), x.clip(0, columns - 1)]


def _linear(t: Array) -> tuple[Array, ...]:
    return 1.0 - t, t


def _cubic(t: Array) -> tuple[Array, ...]:
    return (
        t * (-0.5 + t * (1.0 - 0.5 * t)),
        1.0 + t * t * (-2.5 + 1.5 * t),
        t * (0.5 + t * (2.0 - 1.5 * t)),
        t * t * (-0.5 + 0.5 * t),
    )


def _inverse(depth: ArrayLike, view: PinholeView) -> Array:
    """Inverse planar depth, 1/m."""
    given = np.asarray(depth, dtype=np.float64)
    size = (view.camera.height, view.camera.width)
    if given.shape != size:
        raise InputError(f"warp: the depth is {given.shape}, the pinhole's picture {size}")
    if not (given > 0).all():
        raise InputError("warp: depths must be above 0 m; what is open water is infinite")
    return 1.0 / given


def _outside(at: Array, picture: Array) -> NDArray[np.bool_]:
    rows, columns = picture.shape
    x, y = at[..., 0], at[..., 1]
    return ~((x >= 0) & (x <= columns) & (y >= 0) & (y <= rows))


@dataclass(frozen=True, eq=False)
class _Line:
    """Rays as lines in the pinhole's picture, start + ρ · along, in pixels and 1/m."""

    start: Array
    along: Array
    slopes: Array
    foot: Array
    position: Array

    @classmethod
    def of(cls, view: PinholeView, origins: Array, w: Array) -> _Line:
        camera, position = view.camera, np.array(view.position)
        slopes = w / w[..., 2:]
        # Where a ray, drawn backwards, meets the plane of the pinhole.
        foot = origins - position
        foot = foot - foot[..., 2:] * slopes
        focal = np.array([camera.fx, camera.fy])
        start = slopes[..., :2] * focal + (camera.cx, camera.cy)
        return cls(start, foot[..., :2] * focal, slopes, foot, position)

    @property
    def parallax(self) -> Array:
        """Pixels for a change of ρ by 1/m."""
        return np.hypot(self.along[..., 0], self.along[..., 1])

    def chosen(self, which: NDArray) -> _Line:
        """Lines of an index or a mask."""
        return _Line(
            self.start[which], self.along[which], self.slopes[which], self.foot[which],
            self.position,
        )  # fmt: skip

    def at(self, rho: Array) -> Array:
        return self.start + rho[..., None] * self.along

    def point(self, rho: Array) -> Array:
        """Points in the camera's axes; infinite where ρ is 0."""
        away = np.where(rho > 0, rho, 1.0)[..., None]
        near = self.position + self.foot + self.slopes / away
        far = np.where(self.slopes == 0, 0.0, np.copysign(np.inf, self.slopes))
        return np.where((rho == 0)[..., None], far, near)

    def looked_up(self, inverse: Array, rho: Array) -> Array:
        """Inverse depth of the picture at ρ; that of the nearest pixel at the edge of an object."""
        rows, columns = inverse.shape
        x, y = (self.at(rho) - 0.5).T
        left, top = np.floor(x), np.floor(y)
        right, down = x - left, y - top
        i = [np.clip(left + n, 0, columns - 1).astype(np.intp) for n in (0, 1)]
        j = [np.clip(top + n, 0, rows - 1).astype(np.intp) * columns for n in (0, 1)]
        a, b, c, d = (inverse.ravel().take(row + column) for row in j for column in i)
        least = np.minimum(np.minimum(a, b), np.minimum(c, d))
        most = np.maximum(np.maximum(a, b), np.maximum(c, d))
        edge = ((most - least) * self.parallax > _EDGE) | (most > _STEP * least)
        smooth = (a + right * (b - a)) * (1.0 - down) + (c + right * (d - c)) * down
        nearest = np.where(down < 0.5, np.where(right < 0.5, a, b), np.where(right < 0.5, c, d))
        return np.where(edge, nearest, smooth)

    def seen(self, inverse: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Inverse depth that is seen, its place in the picture, and whether it is hidden there."""
        lowest, highest = float(inverse.min()), float(inverse.max())
        rho = self.looked_up(inverse, np.full(len(self.parallax), 0.5 * (lowest + highest)))
        # What is nearest anywhere on a line is tried first: it may hide the rest.
        long = np.flatnonzero((highest - lowest) * self.parallax > 0.5)
        part = self.chosen(long)
        for start in np.linspace(lowest, highest, _STARTS):
            there = part.looked_up(inverse, np.full(len(long), start))
            rho[long] = np.maximum(rho[long], there)
        moving, change = np.arange(len(rho)), np.zeros(len(rho))
        for _ in range(_LOOKS):
            part = self.chosen(moving)
            found = part.looked_up(inverse, rho[moving])
            change[moving] = np.abs(found - rho[moving]) * part.parallax
            rho[moving] = found
            moving = np.flatnonzero(change > _SETTLED)
            if not len(moving):
                break
        at, hidden = self.at(rho), np.zeros(len(rho), dtype=bool)
        restless = np.flatnonzero(change > _EDGE)
        if len(restless):
            part = self.chosen(restless)
            rho[restless], at[restless], hidden[restless] = part.searched(inverse, lowest, highest)
        return rho, at, hidden

    def searched(
        self, inverse: Array, lowest: float, highest: float
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Go outwards to the first ρ at which the picture is no farther; say what stands there.

        Returns the inverse depth that is seen, its place in the picture, and where what would be
        seen is hidden behind an edge: there the farther side of it is taken.
        """
        count = self.start.shape[0]
        near, far = np.full(count, highest), np.full(count, lowest)
        reached = np.zeros(count, dtype=bool)
        for rho in np.linspace(highest, lowest, _SEARCHED):
            here = np.full(count, rho)
            hit = self.looked_up(inverse, here) >= rho
            far = np.where(hit & ~reached, rho, far)
            reached |= hit
            near = np.where(reached, near, rho)
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            hit = self.looked_up(inverse, middle) >= middle
            near, far = np.where(hit, near, middle), np.where(hit, middle, far)
        met = self.looked_up(inverse, far)
        hidden = np.abs(met - far) * self.parallax > _EDGE
        rho = np.where(hidden, self.looked_up(inverse, near), far)
        return rho, self.at(np.where(hidden, near, far)), hidden
