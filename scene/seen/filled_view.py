"""What of a camera's view the things of a scene fill."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector

from ...uw_spectral.shade.view_cover import KeptPicture, Surface, ViewCover, no_cover
from ...uw_spectral.shade.view_map import WIDEST, view_map
from .. import marks
from .cameras import turn_of
from .surface_samples import Triangles
from .threads import visible_threads

_BESIDE = math.radians(25.0)  # of the picture: what stands there blocks forward scattering, too
_MOST_TRIANGLES = 20_000  # of a thing: of more every second, third, ... is taken


def filled_view(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    things: Sequence[Triangles] | None,
    floor_depth: float,
    kept: KeptPicture | None = None,
) -> ViewCover:
    """Return what things fill of the view of a camera in the water.

    Parameters
    ----------
    camera : Object or None
        Without one, or if its rays do not come from one place, it is nothing.
    things : sequence of Triangles, optional
        What there is besides threads; without, nothing.
    floor_depth : float
        Of the floor of the water, m.
    kept : KeptPicture, optional
        What may be used again.
    """
    if camera is None or things is None or camera.data.type == "ORTHO":
        return no_cover()
    reach = WIDEST
    if camera.data.type == "PERSP":
        corners = [Vector(c) for c in camera.data.view_frame(scene=scene)]
        reach = _BESIDE + max(c.angle(Vector((0.0, 0.0, -1.0))) for c in corners)
    eye = tuple(camera.matrix_world.translation)
    view = view_map(eye, np.array(turn_of(camera)), reach)
    threads = visible_threads(bpy.context.evaluated_depsgraph_get(), marks.objects(scene))
    ribbons = [thread.ribbons(eye) for thread in threads]
    drawn = {thing.key: functools.partial(_surface, thing) for thing in things}
    return (kept or KeptPicture()).cover(view, drawn, ribbons, floor_depth)


def _surface(thing: Triangles) -> Surface:
    every = -(-len(thing.arrays.triangles) // _MOST_TRIANGLES)
    corners = thing.corners_of(slice(None, None, every))
    return Surface(corners, thing.colours[thing.arrays.parts[::every]], float(every))
