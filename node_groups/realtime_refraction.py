"""Node groups of views from the air: rays bent at the surface, and where objects seem to lie.

EEVEE draws straight rays. So that an object under water shows where refraction puts it, its
vertices are moved straight up, to the line on which the bent ray reaches the camera. The pixel then
works out from that line where the ray went in the water: on such a line, distances beyond the
surface are those of the bent ray over the index.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.raised_waves import sunk_below_crests
from ..uw_spectral.surface.refraction import apparent_depth, apparent_height, seen_from_air
from ..uw_spectral.transfer.above_water import leaving_fraction
from ..uw_spectral.transfer.radiance_field import surface_normal
from .group_sockets import OpenGroup
from .node_mathematics import NODES, NodeValue
from .realtime_raised import crossing
from .realtime_rays import (
    DIRECTION,
    DISTANCE,
    ORIGIN,
    PLACE,
    drawn_place,
    eye_place,
    is_at_rest,
    straight_direction,
    straight_distance,
)
from .realtime_values import CAMERA, IN_AIR, INDEX, RAY_INDEX, THROUGH
from .realtime_waves import (
    FOAM,
    SLOPE,
    WAVES_HIGHEST,
    WaveImages,
    WaveTables,
    numbers_of,
)

NAME = "UW Rays"
DISPLACEMENT_NAME = "UW Apparent Place"
MIRRORED_SKY, REFLECTANCE, LEAVING, DRY = "Mirrored", "Reflectance", "Leaving", "Dry"
WATERLINE = 0.1
"""Distance in m of the glass at which the water may stand before a camera."""
LOWEST = 1e-3
"""Height in m, and downward fraction of a direction, that count as the least."""


def build(values: bpy.types.ShaderNodeTree, images: WaveImages | None) -> bpy.types.ShaderNodeTree:
    """Build the group of a pixel's ray.

    Outputs: direction, origin, distance and place of its part in the water, as of
    :mod:`.realtime_rays`; the direction in which it is mirrored, or goes on into the sky;
    reflectance of the surface, and what is left of radiance from below; whether the shaded
    point lies in the air; slopes of the surface, and the fraction of foam, which hides what the
    surface mirrors and lets through. Without a camera in the air the ray is straight.
    """
    group = OpenGroup(NAME)
    graph = group.graph
    number = numbers_of(graph, values)
    in_air, n = number(IN_AIR), number(RAY_INDEX)
    v, eye, drawn = straight_direction(graph), eye_place(graph), drawn_place(graph)
    straight = straight_distance(graph)
    height = NODES.maximum(eye[2], LOWEST)
    to_surface = height / NODES.maximum(-v[2], LOWEST)
    up, dry = NODES.less(0.0, v[2]), in_air * NODES.less(0.0, drawn[2])
    if images is not None and images.far is not None:
        # A ray that is near the water's glass begins there, whatever is before it.
        found, away = crossing(graph, values, images, eye, v, in_air=True, first=WATERLINE)
        level = NODES.maximum(to_surface, away)
        to_surface = NODES.select(found, away, level)
        up = up * (1.0 - found)
        dry = in_air * NODES.maximum(up, NODES.less(straight, to_surface))
    sx, sy = (e + along * to_surface for e, along in zip(eye[:2], v[:2], strict=True))
    level = (0.0, 0.0, 1.0)
    _, at_rest, _ = seen_from_air(v, level, n, NODES)
    slopes, foam, normal = None, None, level
    if images is not None:
        tables = WaveTables(graph, images, number)
        foam, slopes = tables.foam(sx, sy), tables.raised(sx, sy)
        normal = surface_normal(*graph.components(slopes)[:2], NODES)
    R, bent, mirrored = seen_from_air(v, normal, n, NODES)
    # A ray into the sky has none in the water; straight down is as good as any.
    bent = [NODES.select(up, a, b) for a, b in zip((0.0, 0.0, -1.0), bent, strict=True)]
    depth = -at_rest[2] * n * NODES.maximum(straight - to_surface, 0.0)

    def pick(air: Sequence[Operand], water: Sequence[Operand]) -> NodeValue:
        parts = (NODES.select(in_air, a, b) for a, b in zip(air, water, strict=True))
        return graph.vector(*parts)

    sky = (NODES.select(up, a, b) for a, b in zip(v, mirrored, strict=True))
    found = {
        DIRECTION: pick(bent, v),
        ORIGIN: pick((sx, sy, 0.0), eye),
        DISTANCE: NODES.select(in_air, depth / NODES.maximum(-bent[2], LOWEST), straight),
        PLACE: pick((*drawn[:2], -depth), drawn),
        MIRRORED_SKY: graph.vector(*sky),
        REFLECTANCE: in_air * NODES.select(up, 1.0, R),
        LEAVING: NODES.select(in_air, (1.0 - up) * leaving_fraction(R, n), 1.0),
        DRY: dry,
    }
    if slopes is not None:
        found[SLOPE] = slopes
    if foam is not None:
        found[FOAM] = in_air * (1.0 - up) * foam
        for name in (REFLECTANCE, LEAVING):
            found[name] = (1.0 - found[FOAM]) * found[name]
    return group.finished(found)


def build_refraction_displacement(
    values: bpy.types.ShaderNodeTree, images: WaveImages | None, *, from_air: bool = True
) -> bpy.types.ShaderNodeTree:
    """Build the group that moves a vertex to where it seems to lie; output: the way it goes.

    The surface counts as level, where it has heights at that above or below the vertex. Seen from
    the air, objects in the water move; else those in the air, while the picture of these is drawn,
    and what is under them follows them.
    """
    group = OpenGroup(DISPLACEMENT_NAME)
    graph = group.graph
    number = numbers_of(graph, values)
    x, y, z = drawn_place(graph)
    cx, cy, cz = (number(name) for name in CAMERA)
    if images is not None:
        level = WaveTables(graph, images, number).level(x, y)
        z, cz = z - level, cz - level
    dx, dy = x - cx, y - cy
    distance = NODES.sqrt(dx * dx + dy * dy)
    if from_air:
        depth, height = NODES.maximum(-z, LOWEST), NODES.maximum(cz, LOWEST)
        seeming = apparent_depth(distance, depth, height, number(RAY_INDEX), NODES)
        if images is not None and images.far is not None:
            highest = number(WAVES_HIGHEST)
            seeming = seeming + sunk_below_crests(depth, distance, highest, NODES)
        moved = number(IN_AIR) * NODES.less(z, -LOWEST) * (depth - seeming)
    else:
        height, depth = NODES.maximum(z, LOWEST), NODES.maximum(-cz, LOWEST)
        seeming = apparent_height(distance, height, depth, number(INDEX), NODES)
        moved = number(THROUGH) * (seeming - height)
    moved = is_at_rest(graph) * moved
    return group.finished({"Displacement": graph.vector(0.0, 0.0, moved)})
