"""The ship as shapes in her own space: x forward, y to port, z up from the keel, metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..parts.detail import Detail
from ..parts.noise import fractal_noise, generator, gradient_noise
from ..parts.sand import smooth_step
from ..parts.shapes import Shape, box, grid_triangles, joined, torus, tube
from ..parts.solids import clipped, thickened

Array = NDArray[np.float64]

LENGTH = 26.0
BEAM = 6.8
DEPTH = 4.1
"""From keel to deck amidships, m."""
BULWARK = 0.75
HOLD = (-2.6, 8.3)
"""The hold's bulkheads, x."""
CEILING = 0.5
"""Height of the hold's wooden floor above the keel, m."""
BREACH = (4.3, 2.15)
"""Middle of the hole in her port side, (x, z)."""
HATCHES = ((4.4, 2.0, 1.35), (-0.9, 1.1, 1.15))
"""Middle x, half length and half width of the hatches."""
_PLATE = 0.05


def sheer(s: ArrayLike) -> Array:
    """Height of the deck's edge at s, from -1 at the stern to 1 at the bow."""
    s = np.asarray(s, float)
    return DEPTH + 1.35 * np.clip(s, 0, 1) ** 2.5 + 0.5 * np.clip(-s, 0, 1) ** 2.5


def _keel(s: Array) -> Array:
    return 0.7 * smooth_step(0.8, 1.02, s) + 1.5 * smooth_step(-0.72, -1.02, s)


def _half_beam(s: Array) -> Array:
    bow = np.clip((s - 0.28) / 0.72, 0, 1)
    stern = np.clip((-0.5 - s) / 0.5, 0, 1)
    return BEAM / 2 * np.maximum((1 - bow**2.3) * (1 - stern**2.6) ** 0.6, 0.012)


def _fullness(s: Array) -> Array:
    """Exponent of the section: small where she is a box, 1 and more where she is a wedge."""
    return 0.40 + 0.75 * smooth_step(0.25, 1.0, s) + 0.55 * smooth_step(-0.45, -1.0, s)


def skin(s: ArrayLike, t: ArrayLike) -> Array:
    """Points of her side; t runs from 0 at the keel to 1 at the deck, above 1 up the bulwark."""
    s, t = np.broadcast_arrays(np.asarray(s, float), np.asarray(t, float))
    angle, power = np.clip(np.abs(t), 0, 1) * np.pi / 2, _fullness(s)
    low, high = _keel(s), sheer(s)
    above = np.clip(np.abs(t) - 1, 0, None)
    y = _half_beam(s) * (np.sin(angle) ** power + 0.15 * above * smooth_step(0.3, 0.9, s))
    up = 1 - np.cos(angle) ** power
    z = low + (high - low) * up + 4 * above * BULWARK
    rake = 1.5 * (1 - np.clip(up, 0, 1)) * smooth_step(0.45, 1.0, s)
    counter = 0.9 * (1 - np.clip(up, 0, 1)) * smooth_step(-0.6, -1.0, s)
    return np.stack([s * LENGTH / 2 - rake + counter, np.sign(t) * y, z], axis=-1)


def half_width(x: ArrayLike, z: ArrayLike) -> Array:
    """Half her width inside at x and z, for x away from her ends."""
    s = np.asarray(x, float) / (LENGTH / 2)
    up = np.clip((np.asarray(z, float) - _keel(s)) / (sheer(s) - _keel(s)), 0, 1)
    power = _fullness(s)
    angle = np.arccos((1 - up) ** (1 / power))
    return _half_beam(s) * np.sin(angle) ** power


def breach(points: Array, seed: int) -> Array:
    """Field that is negative where her plates are torn away."""
    rng = generator(seed, "breach")
    x, y, z = points.T
    torn = 0.30 * gradient_noise(points / 0.9, rng) + 0.13 * gradient_noise(points / 0.3, rng)
    side = np.hypot((x - BREACH[0]) / 2.5, (z - BREACH[1]) / 1.35) - 1 + torn
    port = np.where(y > 0.2, side, 1.0)
    small = np.hypot((x + 7.0) / 0.7, (z - 2.0) / 0.5) - 1 + 1.5 * torn
    holes = np.where(y < -0.2, small, 1.0)
    rot = 0.62 - np.abs(fractal_noise(points / 1.3, rng, 3)) + 0.25 * (z < 1.0)
    return np.minimum(np.minimum(port, holes), rot)


def plating(seed: int, detail: Detail) -> Shape:
    """Her plates: dented between the frames, rusted through, torn open to port."""
    step = 0.075 if detail.coarser == 0 else 0.3
    s = np.linspace(-1, 1, int(LENGTH / step))
    rows = int(1.25 * 6.0 / step)
    t = np.linspace(-1.25, 1.25, 2 * rows + 1)
    gs, gt = np.meshgrid(s, t)
    points = skin(gs, gt).reshape(-1, 3)
    sheet = Shape(points, grid_triangles(len(t), len(s))[:, ::-1])
    rng = generator(seed, "plating")
    keep = breach(points, seed)
    # Freeing ports in the bulwark.
    high = np.abs(gt.ravel())
    along = np.abs((points[:, 0] + 0.8) % 2.4 - 1.2) - 0.35
    port = np.maximum(np.maximum(along, (1.04 - high) * 4), (high - 1.11) * 4)
    keep = np.where(np.abs(points[:, 0]) < 9.5, np.minimum(keep, port), keep)
    dent = -0.022 * np.sin(np.pi * points[:, 0] / FRAME) ** 2
    dent -= 0.16 * np.clip(gradient_noise(points / 2.6, rng), 0, 1)
    # Torn edges are bent inwards.
    dent -= 0.35 * np.clip(0.35 - np.abs(keep), 0, 1) ** 1.5 * (high < 1)
    dent += 0.014 * fractal_noise(points / 0.22, rng, 3)
    bent = Shape(points + sheet.normals() * dent[:, None], sheet.triangles)
    return thickened(clipped(bent, keep), _PLATE)


FRAME = 0.62
"""Spacing of the frames, m."""


def frames(seed: int, detail: Detail) -> Shape:
    """Frames and deck beams, some broken where her side is torn, with stem and sternpost."""
    rng = generator(seed, "frames")
    parts = []
    t = np.linspace(0.03, 0.995, 22 if detail.coarser == 0 else 9)
    for x in np.arange(-11.2, 11.3, FRAME):
        for side in (-1, 1):
            line = skin(x / (LENGTH / 2), side * t)
            line[:, 1] -= side * np.minimum(0.11, 0.6 * np.abs(line[:, 1]))
            line[:, 2] += 0.05
            torn = breach(line, seed) < 0.02
            pieces = [line]
            if side > 0 and torn.any() and rng.uniform() < 0.6:
                first = np.argmax(torn) + int(rng.integers(0, 2))
                last = len(line) - np.argmax(torn[::-1]) - int(rng.integers(0, 3))
                stub = line[: max(first, 2)].copy()
                stub[-1, 1] += rng.uniform(-0.1, 0.35)
                pieces = [stub, line[min(last, len(line) - 2) :]]
            parts += [tube(piece, 0.05, 4, 0.0) for piece in pieces]
        deck = float(sheer(x / (LENGTH / 2))) - 0.13
        reach = float(half_width(x, deck)) - 0.05
        open_to = max([w for m, h, w in HATCHES if abs(x - m) < h], default=0.0)
        if open_to:
            for side in (-1, 1):
                ends = [(x, side * reach, deck), (x, side * open_to, deck + 0.06)]
                parts.append(tube(ends, 0.06, 4, 0.0))
        else:
            ends = [(x, -reach, deck), (x, 0, deck + 0.08), (x, reach, deck)]
            parts.append(tube(ends, 0.06, 4, 0.0))
    for end in (-1.0, 1.0):
        post = skin(end, np.linspace(0, 1.25, 24))
        post[:, 1] = 0
        parts.append(tube(post, 0.11, 8))
    return joined(parts)


def rail_cap(detail: Detail) -> Shape:
    """Rail on top of her bulwark."""
    s = np.linspace(-1, 1, 120 if detail.coarser == 0 else 40)
    return joined([tube(skin(s, side * 1.25), 0.06, 5) for side in (-1, 1)])


def _sheet(u: Array, v: Array, at: Array) -> Shape:
    """Sheet over a grid of points of shape (len(v), len(u), 3), "uv" in metres."""
    gu, gv = np.meshgrid(u, v)
    uv = np.stack([gu.ravel(), gv.ravel()], axis=1)
    return Shape(at.reshape(-1, 3), grid_triangles(len(v), len(u)), {"uv": uv})


def deck(seed: int, detail: Detail) -> Shape:
    """Her planked deck, with its hatches and where it has rotted away."""
    step = 0.07 if detail.coarser == 0 else 0.22
    x = np.arange(-12.7, 12.45, step)
    u = np.linspace(-1, 1, int(BEAM / step))
    gx, gu = np.meshgrid(x, u)
    s = gx / (LENGTH / 2)
    y = gu * skin(s, np.ones_like(s))[..., 1]
    z = sheer(s) + 0.14 * (1 - gu**2)
    points = np.stack([gx, y, z], axis=-1)
    sheet = _sheet(x, u, points)
    flat = points.reshape(-1, 3)
    keep = np.full(len(flat), 1.0)
    for middle, length, width in HATCHES:
        rectangle = np.maximum(np.abs(flat[:, 0] - middle) - length, np.abs(flat[:, 1]) - width)
        keep = np.minimum(keep, rectangle)
    rng = generator(seed, "deck rot")
    # Planks go one by one: the noise is long along them.
    rot = 0.50 - gradient_noise(flat * (0.45, 2.4, 1.0), rng)
    keep = np.minimum(keep, rot + 0.3 * smooth_step(4.5, 7.5, np.abs(flat[:, 0])))
    warp = 0.02 * gradient_noise(flat * (0.7, 4.0, 1.0), rng)
    uv = np.stack([flat[:, 0], flat[:, 1]], axis=1)
    sheet = Shape(flat + np.array([0, 0, 1.0]) * warp[:, None], sheet.triangles, {"uv": uv})
    return thickened(clipped(sheet, keep), 0.07)


def floor_of_hold(seed: int, detail: Detail) -> Shape:
    """Planks on which the cargo stood."""
    step = 0.12 if detail.coarser == 0 else 0.4
    x = np.arange(HOLD[0], HOLD[1] + step, step)
    u = np.linspace(-1, 1, int(BEAM / step))
    gx, gu = np.meshgrid(x, u)
    y = gu * half_width(gx, CEILING)
    z = np.full_like(gx, CEILING)
    sheet = _sheet(x, u, np.stack([gx, y, z], axis=-1))
    uv = sheet.vertices[:, :2].copy()
    rng = generator(seed, "ceiling")
    keep = 0.42 - gradient_noise(sheet.vertices * (0.4, 2.2, 1.0), rng)
    return thickened(clipped(Shape(sheet.vertices, sheet.triangles, {"uv": uv}), keep), 0.05)


def bulkheads(detail: Detail) -> Shape:
    """Walls before and behind the hold; the one aft has a doorway."""
    step = 0.15 if detail.coarser == 0 else 0.3
    parts = []
    for x, facing in ((HOLD[0], 1), (HOLD[1], -1)):
        top = float(sheer(x / (LENGTH / 2))) + 0.02
        z = np.linspace(0.05, top, int(DEPTH / step))
        u = np.linspace(-1, 1, int(BEAM / step))
        gu, gz = np.meshgrid(u, z)
        at = np.full_like(gz, x)
        sheet = _sheet(u, z, np.stack([at, gu * half_width(at, gz), gz], axis=-1))
        triangles = sheet.triangles if facing > 0 else sheet.triangles[:, ::-1]
        keep = np.ones(len(sheet.vertices))
        if facing > 0:
            door = (
                np.abs(sheet.vertices[:, 1] - 1.4) - 0.4,
                np.abs(sheet.vertices[:, 2] - 1.6) - 1,
            )
            keep = np.maximum(*door)
        parts.append(thickened(clipped(Shape(sheet.vertices, triangles), keep), _PLATE))
    return joined(parts)


def coamings() -> Shape:
    """Steel walls around the hatches."""
    parts = []
    for middle, length, width in HATCHES:
        z = float(sheer(middle / (LENGTH / 2))) + 0.28
        for sign in (-1, 1):
            parts.append(box((2 * length + 0.12, 0.06, 0.85), (middle, sign * width, z)))
            parts.append(box((0.06, 2 * width + 0.12, 0.85), (middle + sign * length, 0, z)))
    return joined(parts)


def hatch_boards(seed: int) -> Shape:
    """What is left of the covers of the after hatch, and two boards across the main one."""
    rng = generator(seed, "hatch boards")
    parts = []
    (main, _, wide), (middle, length, width) = HATCHES
    for x in np.arange(middle - length + 0.15, middle + length, 0.29):
        if rng.uniform() < 0.55:
            z = float(sheer(x / (LENGTH / 2))) + 0.72
            turn = np.array([[np.cos(a := rng.normal() * 0.05), -np.sin(a), 0],
                             [np.sin(a), np.cos(a), 0], [0, 0, 1]])  # fmt: skip
            parts.append(box((0.26, 2 * width + 0.2, 0.06)).moved((x, rng.normal() * 0.1, z), turn))
    z = float(sheer(main / (LENGTH / 2))) + 0.72
    for x in (main - 1.75, main - 1.4):
        parts.append(box((0.26, 2 * wide + 0.3, 0.06)).moved((x, 0.1, z)))
    boards = joined(parts)
    return boards.with_attributes(uv=boards.vertices[:, [1, 0]].copy())


def _wall(
    start: ArrayLike, end: ArrayLike, low: float, high: float, openings: list[tuple], step: float
) -> Shape:
    """Steel wall between two (x, y), seen from its right side; openings are (along, up, w, h)."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start))
    u = np.linspace(0, length, max(2, int(length / step)))
    v = np.linspace(low, high, max(2, int((high - low) / step)))
    gu, gv = np.meshgrid(u, v)
    flat = start + (end - start) * (gu / length)[..., None]
    sheet = _sheet(u, v, np.concatenate([flat, gv[..., None]], axis=-1))
    keep = np.ones(len(sheet.vertices))
    for along, up, wide, tall in openings:
        rectangle = np.maximum(
            np.abs(gu - along).ravel() - wide / 2, np.abs(gv - low - up).ravel() - tall / 2
        )
        keep = np.minimum(keep, rectangle)
    return thickened(clipped(Shape(sheet.vertices, sheet.triangles), keep), _PLATE)


def _house(
    x: tuple[float, float],
    y: float,
    z: tuple[float, float],
    sides: list[tuple],
    front: list[tuple],
    back: list[tuple],
    step: float,
) -> list[Shape]:
    """Four walls with openings, and a roof that stands out a little."""
    corners = [(x[0], -y), (x[1], -y), (x[1], y), (x[0], y)]
    walls = [
        _wall(corners[i], corners[(i + 1) % 4], *z, holes, step)
        for i, holes in enumerate((sides, front, sides, back))
    ]
    roof = box((x[1] - x[0] + 0.3, 2 * y + 0.3, 0.06), ((x[0] + x[1]) / 2, 0, z[1] + 0.03))
    return [*walls, roof]


def superstructure(detail: Detail) -> Shape:
    """Deckhouse, wheelhouse on it, and the funnel."""
    step = 0.11 if detail.coarser == 0 else 0.2
    deck_z = float(sheer(-0.6))
    low, mid, top = deck_z - 0.15, deck_z + 2.15, deck_z + 4.1
    ports = [(a, 1.35, 0.5, 0.5) for a in (1.0, 2.3, 4.4)] + [(3.4, 1.05, 0.75, 1.8)]
    parts = _house((-10.2, -4.9), 2.15, (low, mid), ports, [(1.1, 1.3, 0.6, 0.6),
        (3.2, 1.3, 0.6, 0.6)], [(2.1, 1.05, 0.75, 1.8)], step)  # fmt: skip
    windows = [(a, 1.25, 0.62, 0.7) for a in (0.55, 1.45, 2.35)]
    parts += _house((-8.1, -5.2), 1.6, (mid + 0.06, top), windows, [(a, 1.25, 0.7, 0.7)
        for a in (0.6, 1.6, 2.6)], [(1.6, 1.0, 0.7, 1.7)], step)  # fmt: skip
    sides = 4 * detail.sides
    rings = [(0.55, mid), (0.55, mid + 2.3), (0.5, mid + 2.35), (0.49, mid + 0.1)]
    angle = np.arange(sides) * 2 * np.pi / sides
    circle = np.stack([1.25 * np.cos(angle), np.sin(angle)], axis=1)
    points = [np.column_stack([r * circle - (9.3 + 0.12 * (z - mid), 0), 0 * angle + z])
              for r, z in rings]  # fmt: skip
    parts.append(Shape(np.concatenate(points), grid_triangles(4, sides, True)))
    return joined(parts)


def rigging(seed: int, detail: Detail) -> Shape:
    """Mast with its crosstree, the boom that fell over the hatch, railings, stays."""
    rng = generator(seed, "rigging")
    sides = 2 * detail.sides
    foot = np.array([9.1, 0.0, float(sheer(0.7))])
    head = np.add(foot, (0.5, 0.0, 8.2))
    line = foot + np.linspace(0, 1, 8)[:, None] * (head - foot)
    parts = [tube(line, np.linspace(0.17, 0.09, 8), sides)]
    cross = foot + 0.72 * (head - foot)
    parts.append(tube([np.add(cross, (0, y, 0)) for y in (-1.2, 0.0, 1.2)], 0.06, sides))
    boom = [np.add(foot, (-0.3, 0.2, 0.9)), (4.5, -1.2, 5.25), (0.6, -2.5, 5.2)]
    parts.append(tube(boom, [0.11, 0.10, 0.07], sides))
    parts.append(torus(0.3, 0.05, 4 * detail.sides, detail.sides).moved(np.add(cross, (0, 0, 0.2))))
    t = np.linspace(0, 1, 14)[:, None]
    for side in (-1, 1):
        for x, stop in ((8.0, 1.0), (10.2, 1.0 if side > 0 else 0.62)):
            low = skin(x / (LENGTH / 2), np.array(side * 1.25))
            stay = head + (low - head) * t * stop
            stay[:, 2] -= 0.25 * np.sin(np.pi * t[:, 0])
            parts.append(tube(stay, 0.022, 4))
    forestay = head + (skin(0.97, np.array(1.0)) * (1, 0, 1) - head) * t
    parts.append(tube(forestay, 0.025, 4))
    # Railings along the poop and the forecastle; some stanchions lean.
    for start, end in ((-0.97, -0.36), (0.74, 0.97)):
        for side in (-1, 1):
            s = np.arange(start, end, 0.085)
            low = skin(s, side * 1.25 * np.ones_like(s))
            high = low + (0, 0, 0.75) + rng.normal(size=low.shape) * (0.05, 0.07, 0.02)
            parts += [tube(pair, 0.022, 4) for pair in zip(low, high, strict=True)]
            parts += [tube(low + (high - low) * up, 0.02, 4) for up in (0.55, 1.0)]
    return joined(parts)
