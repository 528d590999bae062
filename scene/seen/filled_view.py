"""What of a camera's view the things of a scene fill."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector

from ...uw_spectral.shade.view_cover import WIDEST, ViewCover, no_cover, view_cover, view_map
from .cameras import turn_of
from .surroundings import Surroundings

_BESIDE = math.radians(25.0)  # of the picture: what stands there blocks forward scattering, too


def filled_view(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    around: Surroundings | None,
    floor_depth: float,
) -> ViewCover:
    """Return what things fill of the view of a camera in the water.

    Parameters
    ----------
    scene : Scene
    camera : Object or None
        Without one, or if its rays do not come from one place, it is nothing.
    around : Surroundings or None
        What there is.
    floor_depth : float
        Of the floor of the water, m.
    """
    if camera is None or around is None or camera.data.type == "ORTHO":
        return no_cover()
    reach = WIDEST
    if camera.data.type == "PERSP":
        corners = [Vector(c) for c in camera.data.view_frame(scene=scene)]
        reach = _BESIDE + max(c.angle(Vector((0.0, 0.0, -1.0))) for c in corners)
    axes = np.array(turn_of(camera))
    view = view_map(tuple(camera.matrix_world.translation), axes, reach)
    return view_cover(view, (thing.corners for thing in around.things), floor_depth)
