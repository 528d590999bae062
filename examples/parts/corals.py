"""Corals, sea fans and sponges as shapes that stand on the origin, in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .detail import Detail
from .noise import fractal_noise, generator, gradient_noise, meander
from .shapes import Shape, icosphere, joined, normalised, revolved, tube

Array = NDArray[np.float64]


def _branch(points: Array, radii: Array, sides: int, pale: float) -> Shape:
    """Tube whose attribute "tip" rises to 1 over its last `pale` metres."""
    shape = tube(points, radii, sides)
    to_end = np.linalg.norm(points[-1] - points, axis=1)
    tip = np.clip(1 - to_end / pale, 0, 1)
    return shape.with_attributes(tip=np.append(np.repeat(tip, sides), 1.0))


def staghorn(seed: int, part: str, detail: Detail, stems: int) -> Shape:
    """Thicket of staghorn coral (Acropora), about 0.6 m wide: branches fork and turn up."""
    rng = generator(seed, part)
    sides = max(3, detail.sides - 2)
    step = 0.035 if detail.sides > 4 else 0.07
    branches = []

    def grow(start: Array, heading: Array, length: float, radius: float, order: int) -> None:
        count = max(3, int(length / step) + 1)
        points, headings = [start], [heading]
        for _ in range(count - 1):
            jitter = rng.normal(size=3) * 0.13
            headings.append(normalised(headings[-1] + jitter + (0, 0, 0.13)))
            points.append(points[-1] + headings[-1] * length / (count - 1))
        taper = np.linspace(1, 0.5, count)
        branches.append(_branch(np.array(points), radius * taper, sides, 0.06))
        if order == 3:
            return
        for at in np.arange(0.25, 0.95, 0.17 if order else 0.14):
            if rng.uniform() > (0.9 if detail.sides > 4 else 0.3):
                continue
            i = min(int(at * count), count - 2)
            aside = normalised(np.cross(headings[i], rng.normal(size=3)))
            lean = normalised(headings[i] * 0.75 + aside * rng.uniform(0.6, 1.0) + (0, 0, 0.25))
            grow(points[i], lean, length * rng.uniform(0.32, 0.55), radius * 0.78, order + 1)

    for stem in range(stems):
        angle = 2.4 * stem + rng.normal() * 0.3
        out = 0.35 + 0.75 * np.sqrt(stem / stems)
        heading = normalised(np.array([np.cos(angle) * out, np.sin(angle) * out, 0.75]))
        start = np.array([np.cos(angle), np.sin(angle), 0]) * 0.05 * out - (0, 0, 0.06)
        grow(start, heading, rng.uniform(0.26, 0.38), 0.0175, 2 if detail.sides <= 4 else 1)
    return joined(branches)


def table(seed: int, part: str, detail: Detail, twigs_at_full: int) -> Shape:
    """Table coral (Acropora hyacinthus), 1 m wide: a lobed plate full of short twigs."""
    rng = generator(seed, part)
    sides = 6 * detail.sides
    profile = [(0.10, -0.42), (0.085, -0.30), (0.10, -0.20), (0.20, -0.11), (0.36, -0.055)]
    profile += [(0.48, -0.012), (0.50, 0.004), (0.48, 0.016), (0.40, 0.006)]
    profile += [(0.28, -0.008), (0.15, -0.02), (0.001, -0.03)]
    plate = revolved(profile, sides)

    def spread(points: Array) -> Array:
        """Lobes and waves of the plate, for points of the round plate."""
        x, y, z = points.T
        radius = np.hypot(x, y)
        circle = np.stack([x, y, 0 * x], axis=1) / np.maximum(radius, 1e-6)[:, None]
        waves = generator(seed, f"{part} plate")
        lobes = 0.30 * fractal_noise(circle * 1.4 + 5, waves, 3) + 0.02
        outward = np.clip((radius - 0.12) / 0.38, 0, 1)
        grown = points * np.stack([1 + lobes * outward, 1 + lobes * outward, 1 + 0 * z], axis=1)
        flat = np.stack([x, y, 0 * x], axis=1)
        grown[:, 2] += 0.10 * outward * gradient_noise(flat * 3.0 + 9, waves)
        return grown

    plate = Shape(spread(plate.vertices), plate.triangles)
    radial = np.repeat([r for r, _ in profile], sides)
    plate = plate.with_attributes(tip=np.clip((radial - 0.42) / 0.08, 0, 1) * 0.7)

    twigs = []
    count = int(twigs_at_full * detail.density)
    index = np.arange(count)
    radius = 0.485 * np.sqrt((index + 0.5) / count)
    angle = index * 2.399963 + rng.normal(size=count) * 0.15
    thick = np.sqrt(700 / twigs_at_full)
    rows = np.array(profile)[6:][::-1]
    for r, a in zip(radius, angle, strict=True):
        foot = np.array([r * np.cos(a), r * np.sin(a), np.interp(r, rows[:, 0], rows[:, 1])])
        lean = np.array([np.cos(a), np.sin(a), 0]) * (0.15 + 1.1 * (r / 0.5) ** 4)
        heading = normalised(lean + rng.normal(size=3) * 0.16 + (0, 0, 1.0))
        length = rng.uniform(0.022, 0.045)
        line = foot + heading * np.array([-0.01, 0.55 * length, length])[:, None]
        twigs.append(_branch(line, np.array([0.0105, 0.0095, 0.0055]) * thick, 3, 0.02))
    crown = joined(twigs)
    crown = Shape(
        spread(crown.vertices),
        crown.triangles,
        {"tip": 0.85 * crown.attributes["tip"]},
    )
    return joined([plate, crown])


def brain(seed: int, part: str, level: int) -> Shape:
    """Brain coral, 1 m wide: a dome whose ridges meander; attribute "groove"."""
    rng = generator(seed, part)
    sphere = icosphere(level)
    points = sphere.vertices * (0.5, 0.5, 0.38)
    points = points * (1 + 0.16 * fractal_noise(points / 0.7, rng, 2)[:, None])
    ridge = 0.5 + 0.5 * np.tanh(2.2 * meander(points, 0.062, rng))
    points = points + sphere.vertices * (0.020 * ridge[:, None] - 0.01)
    return Shape(points, sphere.triangles, {"groove": 1 - ridge})


def boulder(seed: int, part: str, level: int) -> Shape:
    """Massive coral (Porites), about 1 m wide: one skin over many knobs."""
    rng = generator(seed, part)
    sphere = icosphere(level)
    knobs = normalised(rng.normal(size=(34, 3)) + np.array([0, 0, 0.5])) * (0.33, 0.33, 0.30)
    size = rng.uniform(0.11, 0.2, len(knobs))
    # Where each ray from the middle leaves each knob; the farthest is the skin.
    along = sphere.vertices @ knobs.T
    inside = size**2 - (knobs**2).sum(axis=1) + along**2
    leaves = np.where(inside > 0, along + np.sqrt(np.maximum(inside, 0)), 0.24)
    sharpness = 40.0
    skin = np.log(np.exp(sharpness * leaves).sum(axis=1)) / sharpness - 0.06
    points = sphere.vertices * skin[:, None]
    points += sphere.vertices * 0.008 * gradient_noise(points / 0.05, rng)[:, None]
    return Shape(points, sphere.triangles)


def _colonised(attractors: Array, step: float, reach: float) -> tuple[Array, list[int]]:
    """Grow a tree from the origin towards attractors (space colonisation, Runions 2007)."""
    nodes, parents = [np.zeros(2)], [-1]
    # The stalk, up to where the first attractor is in reach.
    while np.linalg.norm(attractors - nodes[-1], axis=1).min() > reach:
        parents.append(len(nodes) - 1)
        nodes.append(nodes[-1] + (0, step))
    alive = attractors
    for _ in range(200):
        positions = np.array(nodes)
        distance = np.linalg.norm(alive[:, None] - positions, axis=2)
        nearest = distance.argmin(axis=1)
        pulled = distance.min(axis=1) < reach
        if not pulled.any():
            break
        for node in np.unique(nearest[pulled]):
            pull = alive[pulled & (nearest == node)] - positions[node]
            heading = normalised(pull).sum(axis=0)
            if np.linalg.norm(heading) < 0.3:
                continue
            parents.append(int(node))
            nodes.append(positions[node] + step * heading / np.linalg.norm(heading))
        newest = np.array(nodes[len(positions) :])
        if not len(newest):
            break
        alive = alive[np.linalg.norm(alive[:, None] - newest, axis=2).min(axis=1) > 1.05 * step]
        if not len(alive):
            break
    return np.array(nodes), parents


def sea_fan(seed: int, part: str, detail: Detail) -> Shape:
    """Sea fan (gorgonian), 0.8 m high in the xz plane, grown by space colonisation."""
    rng = generator(seed, part)
    full = detail.sides > 4
    spots = rng.uniform(-1, 1, (2000 if full else 200, 2))
    spots = spots[(np.abs(spots) ** 2).sum(axis=1) < 1] * (0.40, 0.36) + (0, 0.44)
    outline = 1 + 0.25 * np.sin(5 * np.arctan2(spots[:, 0], spots[:, 1] - 0.3) + rng.uniform(0, 6))
    spots = (spots - (0, 0.1)) * outline[:, None] * 0.85 + (0, 0.13)
    step = 0.019 if full else 0.055
    nodes, parents = _colonised(spots[spots[:, 1] > 0.1], step, 5.5 * step)
    load = np.ones(len(nodes))
    children: list[list[int]] = [[] for _ in nodes]
    for node in range(len(nodes) - 1, 0, -1):
        load[parents[node]] += load[node]
        children[parents[node]].append(node)
    radius = np.maximum(0.0034, 0.0017 * load**0.37)
    points = np.stack([nodes[:, 0], 0 * nodes[:, 0], nodes[:, 1] - 0.04], axis=1)
    points[:, 1] = 0.10 * gradient_noise(points * 2.2, rng) + 0.15 * points[:, 0] ** 2
    points[:, 1] -= points[0, 1]

    branches, starts = [], [(0, child) for child in children[0]]
    while starts:
        first, node = starts.pop()
        line = [first, node]
        while children[line[-1]]:
            heavy, *rest = sorted(children[line[-1]], key=lambda c: -load[c])
            starts += [(line[-1], child) for child in rest]
            line.append(heavy)
        thickness = np.minimum(radius[line], radius[node])
        branches.append(tube(points[line], thickness, 3))
    return joined(branches)


def tube_sponge(seed: int, part: str, detail: Detail) -> Shape:
    """Cluster of tube sponges, about 0.45 m high, hollow at the top."""
    rng = generator(seed, part)
    tubes = []
    sides = 3 * detail.sides - 3
    for number in range(7 if detail.sides > 4 else 3):
        high = rng.uniform(0.22, 0.46)
        wide = rng.uniform(0.03, 0.042)
        z = np.array([-0.1, 0.1, 0.35, 0.65, 0.9, 0.985, 1.0, 0.985, 0.9, 0.6]) * high
        r = np.array([0.75, 0.85, 0.9, 1.05, 1.1, 1.08, 0.98, 0.85, 0.75, 0.6]) * wide
        shape = revolved(np.stack([r, z], axis=1), sides)
        v = shape.vertices
        v = v * (1 + 0.22 * fractal_noise(v / 0.07 + number, rng, 2)[:, None] * (1, 1, 0))
        angle = 2.4 * number
        lean = rng.uniform(0.15, 0.45) * (number > 0)
        bend = np.array([np.cos(angle), np.sin(angle)]) * lean
        v[:, :2] += bend * (v[:, 2:] * 0.6 + 0.9 * v[:, 2:] ** 2)
        v[:, :2] += np.array([np.cos(angle), np.sin(angle)]) * 0.05 * (number > 0)
        inside = np.repeat(np.array([0, 0, 0, 0, 0, 0, 0.2, 0.8, 1, 1.0]), sides)
        tubes.append(Shape(v, shape.triangles, {"inside": inside}))
    return joined(tubes)
