"""What of a camera's view the objects of a scene fill."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector

from ...uw_spectral.occlusion.view_map import WIDEST, view_map
from ...uw_spectral.occlusion.visibility_buffer import (
    Surface,
    VisibilityBuffer,
    VisibilityCache,
    empty_buffer,
)
from .. import marks
from .cameras import turn_of
from .surface_samples import Triangles
from .threads import visible_threads

_BESIDE = math.radians(25.0)  # of the picture: what stands there blocks forward scattering, too
_MOST_TRIANGLES = 20_000  # of an object: of more every second, third, ... is taken


def filled_view(
    scene: bpy.types.Scene,
    camera: bpy.types.Object | None,
    surfaces: Sequence[Triangles] | None,
    floor_depth: float,
    cache: VisibilityCache | None = None,
) -> VisibilityBuffer:
    """Return what surfaces, and threads beside them, fill of the view of a camera in the water.

    Nothing without surfaces or a camera, or if its rays do not come from one place.
    """
    if camera is None or surfaces is None or camera.data.type == "ORTHO":
        return empty_buffer()
    reach = WIDEST
    if camera.data.type == "PERSP":
        corners = [Vector(c) for c in camera.data.view_frame(scene=scene)]
        reach = _BESIDE + max(c.angle(Vector((0.0, 0.0, -1.0))) for c in corners)
    eye = tuple(camera.matrix_world.translation)
    view = view_map(eye, np.array(turn_of(camera)), reach)
    threads = visible_threads(bpy.context.evaluated_depsgraph_get(), marks.objects(scene))
    ribbons = [thread.ribbons(eye) for thread in threads]
    drawn = {surface.key: functools.partial(_surface, surface) for surface in surfaces}
    return (cache or VisibilityCache()).buffer(view, drawn, ribbons, floor_depth)


def _surface(surface: Triangles) -> Surface:
    every = -(-len(surface.arrays.triangles) // _MOST_TRIANGLES)
    some = slice(None, None, every)
    opaque = surface.is_opaque(some)
    colours = surface.colours[surface.arrays.parts[some][opaque]]
    return Surface(surface.corners_of(some)[opaque], colours, float(every))
