"""The sea with its heights at one moment: two periodic tiles, and where rays meet it.

Short waves repeat after the tile of the caustics; those that are longer than it, and a swell,
after one that is :data:`FAR` times as wide. Both are choppy (:meth:`.WaveComponents.choppy`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from .wave_components import WaveComponents, periodic_at
from .waves import WaveSpectrum, angular_frequency, in_loop
from .whitecaps import Foam

FAR = 24
"""Side of the tile of the long waves, in tiles of the short ones."""
FAR_RESOLUTION = 256
"""Samples along it."""
FARTHEST = 60.0
"""Distance in m up to which rays look for heights; beyond, the surface is level."""
STEEPEST_SWELL = 0.1
"""Height over length at which a swell breaks."""

_STEPS, _REFINED = 10, 2
_FLATTEST = 1e-4
_MARGIN = 0.02  # m per m of distance that vertices may be off the waves between them


def sunk_below_crests(
    depth: Operand, distance: Operand, highest: Operand, m: Mathematics = NUMPY
) -> Operand:
    """How much deeper than it seems a vertex under water is drawn, m, so that no trough bares it.

    Seen at a grazing angle from the air, all that is under water seems to lie right below the
    surface, while faces between vertices far away are longer than waves. What is itself near the
    surface stays where it is.

    ``highest`` is the height that hardly any crest exceeds; the distance is horizontal, from the
    camera.
    """
    return m.minimum(_MARGIN * distance, highest) * m.minimum(depth, 1.0)


@dataclass(frozen=True)
class Swell:
    """A long wave that comes from afar.

    Raises
    ------
    InputError
        If it would break, or has no length.
    """

    height: float = 0.0  #: From trough to crest, m; 0 for none.
    length: float = 25.0  #: From crest to crest, m.
    direction: float = 0.0  #: It runs *to* it, degrees from +x towards +y.

    def __post_init__(self) -> None:
        if not (self.length > 0 and self.height >= 0):
            raise InputError(
                f"swell: height must be 0 or more and length positive, got {self.height:g} m "
                f"and {self.length:g} m"
            )
        if self.height > STEEPEST_SWELL * self.length:
            raise InputError(
                f"swell: {self.height:g} m would break at a length of {self.length:g} m; make it "
                f"lower than {STEEPEST_SWELL * self.length:g} m, or longer"
            )

    def on(self, waves: WaveComponents, depth: float = math.inf) -> WaveComponents:
        """Add the swell to waves, by the wave of their tile that is nearest to it."""
        if self.height == 0:
            return waves
        periods, turn = waves.tile / self.length, math.radians(self.direction)
        index = np.rint([periods * math.cos(turn), periods * math.sin(turn)]).astype(np.int64)
        k = 2 * math.pi / waves.tile * math.hypot(*index.tolist())
        if k == 0:
            raise InputError(
                f"swell: {self.length:g} m is longer than the {waves.tile:g} m after which long "
                "waves repeat; make the tile of the waves wider"
            )
        return replace(
            waves,
            index=np.vstack([waves.index, index]),
            amplitude=np.append(waves.amplitude, self.height / 2),
            frequency=np.append(waves.frequency, angular_frequency(k, depth)),
            phase=np.append(waves.phase, 0.0),
        )


NO_SWELL = Swell()


def image_of(*channels: NDArray[np.float64]) -> NDArray[np.float32]:
    """Three channels with an alpha of 1, shape (N, N, 4)."""
    image = np.stack([*channels, np.ones_like(channels[0])], axis=-1)
    return np.ascontiguousarray(image, dtype=np.float32)


@dataclass(frozen=True, eq=False)
class HeightTile:
    """A periodic part of the surface over the mean level."""

    tile: float
    elevation: NDArray[np.float64]  #: m; row i, column j is y = i tile/N, x = j tile/N, (N, N).
    slope_x: NDArray[np.float64]
    slope_y: NDArray[np.float64]
    #: Of the waves that break, if there is foam, (N, N).
    crowding: NDArray[np.float64] | None = None

    def image(self) -> NDArray[np.float32]:
        """Slopes and elevation, shape (N, N, 4)."""
        return image_of(self.slope_x, self.slope_y, self.elevation)

    def crowding_image(self) -> NDArray[np.float32]:
        """Crowding, shape (N, N, 4); 0 without foam."""
        crowding = 0.0 * self.elevation if self.crowding is None else self.crowding
        return image_of(crowding, crowding, crowding)

    def at(self, x: ArrayLike, y: ArrayLike, *fields: NDArray) -> list[NDArray[np.float64]]:
        """Interpolate fields of the tile at places, m."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        per_metre = len(self.elevation) / self.tile
        return periodic_at(fields, y * per_metre, x * per_metre)


@dataclass(frozen=True, eq=False)
class RaisedWaves:
    """The surface with its heights."""

    #: Short waves, and those that are longer than their tile.
    near: HeightTile
    far: HeightTile
    foam: Foam | None = None

    @property
    def highest(self) -> float:
        """Height that nothing of the surface exceeds, up or down, m."""
        return sum(float(np.abs(part.elevation).max()) for part in (self.near, self.far))

    def elevation(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Height of the surface over the mean level at places, m."""
        near, far = self.near, self.far
        return near.at(x, y, near.elevation)[0] + far.at(x, y, far.elevation)[0]

    def foam_fraction(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Fraction of the surface that is fresh foam at places; 0 without foam."""
        near, far = self.near, self.far
        if self.foam is None or near.crowding is None or far.crowding is None:
            return np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        return self.foam.fraction(near.at(x, y, near.crowding)[0] + far.at(x, y, far.crowding)[0])


def height_tile(
    waves: WaveComponents, resolution: int, t: float, breaking: WaveComponents | None = None
) -> HeightTile:
    """Compute a part of the choppy surface at a moment t, s.

    Waves that are ``breaking`` leave foam.
    """
    surface = waves.choppy(2 * resolution, t)
    fields = [surface.elevation, surface.slope_x, surface.slope_y]
    if breaking is not None:
        fields.append(breaking.crowding(2 * resolution, t))
    return HeightTile(waves.tile, *surface.over_mean(resolution, *fields))


def far_waves(
    spectrum: WaveSpectrum, tile: float, seed: int, swell: Swell, loop_seconds: float | None
) -> WaveComponents:
    """Realise the waves that are longer than a tile of so many metres, and the swell."""
    longest = 2 * math.pi / tile / math.sqrt(math.pi)  # of the short ones, as these count it
    waves = spectrum.realise(
        FAR * tile, FAR_RESOLUTION, seed, k_max=longest, loop_seconds=loop_seconds
    )
    waves = swell.on(waves, spectrum.depth)
    return replace(waves, frequency=in_loop(waves.frequency, loop_seconds))


Step = Callable[..., tuple[Operand, ...]]
Iterate = Callable[[int, Sequence[Operand], Step], tuple[Operand, ...]]


def repeated(count: int, state: Sequence[Operand], step: Step) -> tuple[Operand, ...]:
    """Take a state through steps, each of which gets its number and the state before it.

    Examples
    --------
    >>> repeated(3, (0, 1), lambda number, total, product: (total + number, 2 * product))
    (3, 8)
    """
    found = tuple(state)
    for number in range(count):
        found = step(number, *found)
    return found


def surface_ahead(
    start: Sequence[Operand],
    w: Sequence[Operand],
    elevation: Callable[[Operand, Operand], Operand],
    highest: Operand,
    side: float,
    first: float = 0.0,
    m: Mathematics = NUMPY,
    iterate: Iterate = repeated,
) -> tuple[Operand, Operand]:
    """Where a ray first meets a surface with heights.

    The surface is sampled along the ray, closer near the start, and the crossing refined by
    the rule of false position. What lies between two samples on the same side is missed.

    ``elevation`` tells the height of the surface at x and y, ``highest`` is what nothing of it
    exceeds, up or down, m. ``side`` is 1 for a ray that begins in the air, -1 for one in the water;
    it begins to look at the distance ``first`` from the start, m. Steps are repeated as
    :func:`repeated` does it.

    Returned are 1 where the ray meets the surface within :data:`FARTHEST`, else 0, and the distance
    from the start, m; where nothing is found, the end of the search.
    """
    x, y, z = start

    def over(t: Operand) -> Operand:
        return side * (z + t * w[2] - elevation(x + t * w[0], y + t * w[1]))

    steep = m.select(m.less(w[2], 0.0), -1.0, 1.0) * m.maximum(m.absolute(w[2]), _FLATTEST)
    down, up = (-1.0 * highest - z) / steep, (highest - z) / steep
    begin = m.clamp(m.minimum(down, up), first, FARTHEST)
    end = m.clamp(m.maximum(down, up), first, FARTHEST)
    at_first = over(begin)

    def march(step: Operand, *state: Operand) -> tuple[Operand, ...]:
        t_before, f_before, low, above, high, below, found = state
        fraction = (step + 1.0) * (1.0 / _STEPS)
        t = begin + (end - begin) * (fraction * fraction)
        f = over(t)
        here = (1.0 - found) * m.less(f, 0.0) * (1.0 - m.less(f_before, 0.0))
        low, above = m.select(here, t_before, low), m.select(here, f_before, above)
        high, below = m.select(here, t, high), m.select(here, f, below)
        return t, f, low, above, high, below, m.maximum(found, here)

    def refine(_: Operand, *state: Operand) -> tuple[Operand, ...]:
        low, above, high, below = state
        t = _crossed(state, m)
        f = over(t)
        under = m.less(f, 0.0)
        low, above = m.select(under, low, t), m.select(under, above, f)
        return low, above, m.select(under, t, high), m.select(under, f, below)

    # What begins behind the surface has met it there.
    behind = m.less(at_first, 0.0)
    high = m.select(behind, begin, end)
    start_state = begin, at_first, begin, at_first, high, at_first, behind
    *_, low, above, high, below, found = iterate(_STEPS, start_state, march)
    bracket = iterate(_REFINED, (low, above, high, below), refine)
    return found, m.select(found, _crossed(bracket, m), end)


def _crossed(bracket: Sequence[Operand], m: Mathematics) -> Operand:
    """Distance at which what is above 0 at one and below at another is 0."""
    low, above, high, below = bracket
    fraction = above / m.maximum(above - below, 1e-9)
    return low + (high - low) * m.clamp(fraction, 0.0, 1.0)
