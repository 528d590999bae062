"""Fish as shapes: body, fins, eyes, and a colour per vertex. They swim along +x."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .detail import Detail
from .shapes import Shape, icosphere, joined, revolved

Array = NDArray[np.float64]
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Species:
    """Proportions, in body lengths, and linear Rec.709 colours of a fish.

    ``bands`` are dark bars: positions along the body from nose (0) to tail (1).
    """

    name: str
    depth: float
    width: float
    fork: float
    fin: float
    back: Rgb
    flank: Rgb
    belly: Rgb
    tail: Rgb
    back_from: float = 0.35
    bands: tuple[float, ...] = ()


FUSILIER = Species(
    "Fusilier", 0.27, 0.15, 0.55, 0.05,
    back=(0.85, 0.62, 0.06), flank=(0.16, 0.42, 0.74), belly=(0.78, 0.82, 0.85),
    tail=(0.88, 0.62, 0.05), back_from=0.25,
)  # fmt: skip
ANTHIAS = Species(
    "Anthias", 0.34, 0.15, 0.6, 0.11,
    back=(0.80, 0.22, 0.03), flank=(0.78, 0.27, 0.06), belly=(0.72, 0.25, 0.30),
    tail=(0.62, 0.14, 0.22),
)  # fmt: skip
BUTTERFLYFISH = Species(
    "Butterflyfish", 0.66, 0.14, 0.08, 0.16,
    back=(0.78, 0.50, 0.02), flank=(0.80, 0.62, 0.10), belly=(0.75, 0.72, 0.62),
    tail=(0.78, 0.52, 0.03), back_from=0.1, bands=(0.14, 0.90),
)  # fmt: skip
SWEEPER = Species(
    "Sweeper", 0.36, 0.13, 0.3, 0.09,
    back=(0.30, 0.15, 0.05), flank=(0.46, 0.26, 0.12), belly=(0.55, 0.38, 0.24),
    tail=(0.32, 0.18, 0.08),
)  # fmt: skip

_STATION = np.array([0.0, 0.02, 0.07, 0.15, 0.27, 0.40, 0.55, 0.70, 0.82, 0.92, 1.0])
_HEIGHT = np.array([0.05, 0.20, 0.46, 0.75, 0.96, 1.00, 0.90, 0.66, 0.42, 0.26, 0.26])


def _sheet(outline: ArrayLike, color: Rgb) -> Shape:
    """Fin: a fan of triangles over an outline in the xz plane, from its first point."""
    flat = np.asarray(outline, float)
    vertices = np.stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]], axis=1)
    i = np.arange(1, len(flat) - 1)
    triangles = np.stack([0 * i, i, i + 1], axis=1)
    return Shape(vertices, triangles, {"scale_color": np.tile(color, (len(flat), 1))})


def fish(species: Species, bend: float, detail: Detail) -> Shape:
    """Return a fish of length 1 with its nose at x = 0.5; slot 0 is body and fins, slot 1 eyes.

    ``bend`` is the phase of the tail beat, radians; the attribute "scale_color" is its colours.
    """
    s = species
    fine = detail.sides > 4
    t = np.linspace(0, 1, 21) ** 1.15 if fine else _STATION[[0, 2, 4, 7, 10]]
    half = np.interp(t, _STATION, _HEIGHT)
    if fine:
        half[1:-1] = (half[:-2] + 2 * half[1:-1] + half[2:]) / 4
    peduncle = np.clip((t - 0.7) / 0.3, 0, 1)
    # Deep-bodied fish still have a slender tail stalk.
    half = half * (1 - peduncle * (1 - min(1.0, 0.30 / s.depth) ** 0.6))
    length = 0.78
    sides = 14 if fine else 4
    body = revolved(np.stack([half, t], axis=1), sides)
    ring, along = body.vertices[:, :2], body.vertices[:, 2]
    wide = s.width / 2 * (1 - 0.75 * along**2)
    up = ring[:, 1]
    z = up * s.depth / 2 + 0.02 * np.sin(np.pi * along)
    vertices = np.stack([0.5 - length * along, ring[:, 0] * wide, z], axis=1)

    tone = np.clip((up - s.back_from * np.maximum(half.max(), 0.5)) / 0.12 + 0.5, 0, 1)[:, None]
    pale = np.clip((-0.35 - up) / 0.2 + 0.5, 0, 1)[:, None]
    color = np.array(s.flank) * (1 - tone) + np.array(s.back) * tone
    color = color * (1 - pale) + np.array(s.belly) * pale
    stalk = np.clip((along - 0.86) / 0.1, 0, 1)[:, None]
    color = color * (1 - stalk) + np.array(s.tail) * stalk
    for band in s.bands:
        dark = np.exp(-(((along - band) / 0.035) ** 4))[:, None]
        color = color * (1 - dark) + 0.015 * dark
    parts = [Shape(vertices, body.triangles[:, ::-1], {"scale_color": color})]

    root = 0.5 - length + 0.02
    tall = max(s.depth * 0.62, 0.17)
    notch = 0.20 - 0.20 * s.fork
    lobe = [(root, 0.03), (root - 0.10, tall * 0.62), (root - 0.21, tall), (root - 0.23, tall)]
    lobe += [(root - 0.15, tall * 0.42), (root - notch, 0.0)]
    upper = np.array([(root + 0.02, 0.0), *lobe])
    parts += [_sheet(upper, s.tail), _sheet(upper * (1, -1), s.tail)]

    def edge(station: float, sign: int) -> tuple[float, float]:
        x = 0.5 - length * station
        top = np.interp(station, t, half) * s.depth / 2 * sign
        return x, top + 0.02 * np.sin(np.pi * station)

    def fin_along(start: float, end: float, sign: int, tone: Rgb) -> Shape:
        stations = np.linspace(start, end, 7)
        low = np.array([edge(p, sign) for p in stations])
        grow = np.sin(np.pi * np.linspace(0.12, 0.93, 7)) ** 0.6 * s.fin
        high = low + np.stack([-0.35 * grow, sign * grow], axis=1)
        low[:, 1] -= sign * 0.015
        flat = np.stack([low, high], axis=1).reshape(-1, 2)
        i = np.arange(0, 12, 2)
        triangles = np.concatenate([np.stack([i, i + 1, i + 3], 1), np.stack([i, i + 3, i + 2], 1)])
        points = np.stack([flat[:, 0], 0 * flat[:, 0], flat[:, 1]], axis=1)
        return Shape(points, triangles, {"scale_color": np.tile(tone, (len(points), 1))})

    parts += [fin_along(0.28, 0.86, 1, s.back), fin_along(0.60, 0.88, -1, s.belly)]
    for side in (-1, 1):
        fin = _sheet([(0.20, -0.02), (0.15, 0.005), (0.04, -0.03), (0.07, -0.07)], s.belly)
        v = fin.vertices.copy()
        v[:, 1] = side * (s.width * 0.45 + 0.6 * (0.20 - v[:, 0]))
        parts.append(Shape(v, fin.triangles, fin.attributes))
        eye = icosphere(2 if fine else 0).moved(
            (0.5 - 0.105 * length, side * s.width * 0.27, 0.055 * s.depth + 0.015),
            scale=(0.024, 0.012, 0.024),
        )
        parts.append(eye.with_material(1))
    whole = joined(parts)
    # The tail beat: a wave that grows from the head to the tail.
    back = np.clip(0.4 - whole.vertices[:, 0], 0, 1)
    sway = 0.16 * back**1.5 * np.sin(bend + 3.5 * back)
    return Shape(
        whole.vertices + np.stack([0 * sway, sway, 0 * sway], axis=1),
        whole.triangles,
        whole.attributes,
        whole.material,
    )
