"""Water by the closed form, in one shader group that needs nothing else.

Drop it into a material, behind Shader to RGB, or into a world: every number is an input that can
be keyframed, and what follows from them is computed in the nodes, for each pixel. There is no
table, driver or handler. It knows one homogeneous water under a flat surface at z = 0 and a
uniform sky; no object shades it, and no lamp lights it.
"""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import ArrayLike

from ..node_groups.group_sockets import COLOUR, FLOAT, VECTOR, OpenGroup, Socket
from ..node_groups.node_mathematics import NODES, PART_SIZE, NodeValue
from ..node_groups.realtime_rays import (
    camera_depth,
    camera_depth_behind,
    depth_here,
    view_direction,
    view_distance,
)
from ..uw_spectral.mathematics import Operand, dot
from ..uw_spectral.transfer.path_integral import transmittance
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import BandPhase
from ..validation.closed_form import PlainLight, TwoStreamWater, UnoccludedWater, plain_water
from ..validation.closed_form.pixel import surface_light

NAME = "UW Closed Form"
LIT, COLOR, EMISSION = "Lit", "Color", "Emission"
COVERAGE, NORMAL = "Coverage", "Normal"
ABSORPTION, SCATTERING = "Absorption", "Scattering"
ASYMMETRY, SECOND_MOMENT = "Asymmetry", "Second Moment"
SUN_IRRADIANCE, SKY_RADIANCE, SUN_DIRECTION = "Sun Irradiance", "Sky Radiance", "Sun Direction"
FLOOR_DEPTH, FLOOR_REFLECTANCE = "Floor Depth", "Floor Reflectance"
INDEX = "Refractive Index"
SURFACE, OPEN_WATER = "Surface", "Open Water"
DISTANCE, DEPTH, DIRECTION = "Distance", "Camera Depth", "Direction"
TRANSMITTANCE, PATH_RADIANCE = "Transmittance", "Path Radiance"
DEEP = 1000.0
"""Floor depth in m from which on water counts as deep."""

_WHITE, _BLACK = (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 1.0)
_INPUTS = {
    LIT: Socket(
        COLOUR,
        "The surface under a white sun of strength 1, its emission included: Shader to RGB",
        _BLACK,
    ),
    COLOR: Socket(COLOUR, "Reflectance of the surface", (0.5, 0.5, 0.5, 1.0)),
    EMISSION: Socket(COLOUR, "Radiance that the surface emits", _BLACK),
    COVERAGE: Socket(
        FLOAT,
        "Fraction of the surface that is not transparent; the colours above hold it already",
        1.0, 0.0, 1.0,
    ),
    NORMAL: Socket(VECTOR, "Unit normal of the surface; 0, 0, 0 is the geometry's", (0.0,) * 3),
    ABSORPTION: Socket(
        VECTOR,
        "Absorption of the water in three bands that stand for red, green and blue, 1/m; Jerlov IB "
        "at 600, 540 and 450 nm by default",
        (0.2278, 0.05296, 0.0235), 0.0,
    ),
    SCATTERING: Socket(VECTOR, "Scattering of the water, 1/m", (0.0488, 0.05476, 0.068), 0.0),
    ASYMMETRY: Socket(
        VECTOR, "Mean cosine g of the Henyey-Greenstein phase function", (0.9,) * 3, 0.0, 0.98
    ),
    SECOND_MOMENT: Socket(
        VECTOR,
        "Second Legendre moment of the phase function, the forward peak of the scaling; g² of "
        "Henyey-Greenstein's",
        (0.81, 0.81, 0.81), 0.0, 0.98,
    ),
    SUN_IRRADIANCE: Socket(
        COLOUR, "Downwelling irradiance of the direct sun just below the surface", _WHITE
    ),
    SKY_RADIANCE: Socket(COLOUR, "Radiance of a uniform sky, in air", (0.05, 0.05, 0.05, 1.0)),
    SUN_DIRECTION: Socket(
        VECTOR,
        "Unit vector that sunlight travels to in the water, z up; turn the scene's sun lamp alike",
        (0.0, 0.373, -0.928),
    ),
    FLOOR_DEPTH: Socket(FLOAT, "Depth of a Lambertian floor, m; far down for deep water", DEEP,
                        0.01, DEEP),
    FLOOR_REFLECTANCE: Socket(COLOUR, "Reflectance of the floor", (0.3, 0.3, 0.3, 1.0)),
    INDEX: Socket(FLOAT, "Of the water against air; 1 is no surface", 1.34, 1.0, 2.0),
}  # fmt: skip
_OUTPUTS = {
    SURFACE: Socket(COLOUR, "The surface seen through the water; emit it"),
    OPEN_WATER: Socket(COLOUR, "The water with its surface or floor behind, for a world"),
}
_WAY = {
    DISTANCE: Socket(FLOAT, "Length of the way through the water, m", 1.0, 0.0),
    DEPTH: Socket(FLOAT, "Depth of the camera under the surface, m", 5.0, 0.0),
    DIRECTION: Socket(VECTOR, "Unit vector away from the camera, z up", (0.0, 1.0, 0.0)),
}
_FOUND = {
    TRANSMITTANCE: Socket(VECTOR, "Fraction of the light that arrives unscattered"),
    PATH_RADIANCE: Socket(
        VECTOR,
        "Light that the water scatters into the view, per steradian, relative to the sun's "
        "irradiance",
    ),
}
_TEXT = (
    "Water between the camera and a surface, and open water, by analytic multiple scattering; the "
    "mean water surface is z = 0. Every input can be keyframed"
)


def build(name: str = NAME) -> bpy.types.ShaderNodeTree:
    """Build the group."""
    group = OpenGroup(name, _INPUTS, _OUTPUTS, _TEXT, part_size=PART_SIZE, slim=True)
    graph, given = group.graph, group.given
    w = view_direction(graph)
    P, y = view_distance(graph), depth_here(graph)
    y_o = camera_depth_behind(y, w, P)
    sun = graph.components(given[SUN_DIRECTION])
    geometry = graph.term(graph.node("ShaderNodeNewGeometry").outputs["Normal"])
    normal = given[NORMAL]
    is_given = NODES.less(0.25, normal.dot(normal))
    n = graph.components(geometry + is_given * (normal - geometry))

    water = _water(given, sun, y_o)
    light = surface_light(water.patch_light(y, n), y, n[2], NODES)
    response = NODES.maximum(given[LIT] - given[EMISSION], 0.0)
    L = light.reflected(response, given[COLOR], -dot(n, sun), NODES) + given[EMISSION]
    eye = camera_depth(graph)
    return group.finished(
        {
            SURFACE: water.surface(y_o, y, w, P, L, NODES, coverage=given[COVERAGE]).total,
            OPEN_WATER: _water(given, sun, eye).open_water(eye, w, NODES).total,
        }
    )


def build_water(
    name: str, text: str, column: WaterColumn, phase: BandPhase
) -> bpy.types.ShaderNodeTree:
    """Build the group of what a way through the water of three bands does to light.

    The column is deep, of one layer, its last band stands for red; the phase function is
    Henyey-Greenstein's.
    """
    group = OpenGroup(name, _WAY, _FOUND, text)
    graph, given = group.graph, group.given

    def bands(values: ArrayLike) -> NodeValue:
        return graph.vector(*np.broadcast_to(np.asarray(values, np.float64), 3)[::-1].tolist())

    y_o, P = given[DEPTH], given[DISTANCE]
    coefficients = column.absorption, column.scattering, phase.chi1, phase.chi2
    light = bands(column.sun_irradiance), bands(column.sky_radiance), column.sun_direction.tolist()
    index = column.refractive_index if column.reflects else 1.0
    water = plain_water(
        TwoStreamWater(*map(bands, coefficients)), PlainLight(*light),
        y_o=y_o, y_f=DEEP, r=0.0, index=index, m=NODES,
    ).elastic  # fmt: skip
    return group.finished(
        {
            TRANSMITTANCE: transmittance(water.c, P, NODES),
            PATH_RADIANCE: water.path(y_o, graph.components(given[DIRECTION]), P, NODES),
        }
    )


def _water(
    given: dict[str, NodeValue], sun: tuple[NodeValue, ...], y_o: Operand
) -> UnoccludedWater:
    coefficients = ABSORPTION, SCATTERING, ASYMMETRY, SECOND_MOMENT
    return plain_water(
        TwoStreamWater(*(given[name] for name in coefficients)),
        PlainLight(given[SUN_IRRADIANCE], given[SKY_RADIANCE], sun),
        y_o=y_o, y_f=given[FLOOR_DEPTH], r=given[FLOOR_REFLECTANCE], index=given[INDEX], m=NODES,
    )  # fmt: skip
