"""What things in view block of the light behind them, and what they send in its place.

Of a pixel's path the share b (K * cover) of scattering stays within things, see
:mod:`.forward_share`: the light behind them is lost with less than the extinction c, and that of
the things comes instead. The share that is the pixel's own thing's, or one like it, has the
pixel's light; what stands beside may be brighter or darker. Where the floor is seen, it counts as a
thing: what is scattered forward before it comes from around there, which may lie in a shadow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..transfer.channel_pixel import COLOURS, LightLeft, Thing, along_rays
from ..transfer.folded_light import FoldedLight
from .forward_share import spread
from .grid import Array
from .shade_table import ShadeTable
from .view_cover import ViewCover

_LEAST = 1e-6
_COLOUR_COUNT = len(COLOURS)


@dataclass(frozen=True, eq=False)
class CarriedLight:
    """What things in view do to light that is scattered forward, in channels.

    Attributes
    ----------
    blocked : array, shape (3, SIZE, SIZE)
        Share of scattering that stays within things.
    beside : array, shape (3, SIZE, SIZE)
        Mean radiance of the things there, less that of the one that is seen.
    """

    blocked: Array
    beside: Array


def carried_light(
    cover: ViewCover,
    light: FoldedLight,
    sun: Sequence[float],
    shade: ShadeTable,
    floor: int | Sequence[float] = (0.0, 0.0, 0.0),
) -> CarriedLight:
    """Return what is blocked, and what comes instead.

    Parameters
    ----------
    cover : ViewCover
    light : FoldedLight
    sun : sequence of 3
        Unit direction that sunlight travels to in the water.
    shade : ShadeTable
        On the bands of ``light``.
    floor : int or sequence of 3
        Column of the measured reflectance of the water's floor, or its colour.
    """
    nothing = np.zeros((_COLOUR_COUNT, *cover.covered.shape))
    if not cover.covered.any():
        return CarriedLight(nothing, nothing)
    L = _radiance(cover, light, sun, shade, floor)
    blocked, mean = _spread(cover.covered, L, cover, light)
    if cover.floor.any():
        on_floor = _spread(cover.with_floor, L, cover, light)
        blocked, mean = (
            np.where(cover.floor, x, y) for x, y in zip(on_floor, (blocked, mean), strict=True)
        )
    beside = np.where(cover.known & (blocked > _LEAST), mean - L, 0.0)
    return CarriedLight(np.clip(blocked, 0.0, 1.0), _extended(beside, cover.known))


def _spread(covered: Array, L: Array, cover: ViewCover, light: FoldedLight) -> tuple[Array, Array]:
    """Share of scattering that stays within what is covered, and its mean radiance."""
    pictures = np.concatenate([covered[None], covered * L])
    blocked, carried = np.zeros_like(L), np.zeros_like(L)
    for part, phase in zip(light.parts, light.components, strict=True):
        of_cover, *of_light = spread(pictures, phase, cover.view)
        blocked += part[:, None, None] * of_cover
        carried += part[:, None, None] * np.stack(of_light)
    return blocked, carried / np.maximum(blocked, _LEAST)


def _radiance(
    cover: ViewCover,
    light: FoldedLight,
    sun: Sequence[float],
    shade: ShadeTable,
    floor: int | Sequence[float],
) -> Array:
    """Radiance of what is seen, by its mean colour, (3, SIZE, SIZE)."""
    here = cover.known
    found = np.zeros((_COLOUR_COUNT, *here.shape))
    ways = cover.view.ways().reshape(*here.shape, 3)[here]
    points = np.asarray(cover.view.centre) + ways * cover.distance[here][:, None]
    normal = cover.normal[here]
    mean, share, sunlit = shade.on_patches(points, normal).T
    facing = np.maximum(normal @ -np.asarray(sun), 0.0) * sunlit / np.pi
    y = np.maximum(-points[:, 2:], 0.0)
    along, normals = along_rays(light, sun, [np.zeros((1, 1))] * 3), list(normal.T[..., None])

    def leaving(columns: Sequence[int], base: Sequence[Array]) -> Array:
        lit = [colour * facing[:, None] for colour in base]
        left = LightLeft(mean[:, None], share[:, None])
        return np.asarray(along.leaving(Thing(columns, lit, base, shade=left), y, normals, 0.0 * y))

    plane, colours = cover.plane[here][:, None], cover.colour[here].T
    if isinstance(floor, int):
        of_floor = leaving((floor,), [np.ones((len(points), 1))])
        L = np.where(plane, of_floor, leaving(COLOURS, list(colours[..., None])))
    else:
        parts = [
            np.where(plane, x, colour[:, None]) for x, colour in zip(floor, colours, strict=True)
        ]
        L = leaving(COLOURS, parts)
    found[:, here] = L.T
    return found


def _extended(values: Array, known: NDArray[np.bool_]) -> Array:
    """Give texels that are not known what those next to them have."""
    total, count = np.zeros_like(values), np.zeros(known.shape)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            near = np.roll(known, (dy, dx), axis=(0, 1))
            total += np.roll(values, (dy, dx), axis=(1, 2)) * near
            count += near
    return np.where(known, values, total / np.maximum(count, 1.0))
