"""Pictures that the surface mirrors and lets through, given to the water of a scene."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import (
    realtime_adjacency,
    realtime_reflected_view,
    realtime_refracted_view,
    realtime_values,
)
from ...node_groups.realtime_values import Numbers
from ...node_groups.value_fields import ValueFields
from ...uw_spectral.occlusion.visibility_buffer import VisibilityBuffer
from ...uw_spectral.surface.reflected_view import ReflectedView
from .. import marks
from . import scene_water
from .frame_water import RealtimeWater
from .realtime import ADJACENCY, MIRRORED, VALUES, WINDOW


def look_from_mirror(
    scene: bpy.types.Scene, water: RealtimeWater, buffer: VisibilityBuffer | None
) -> None:
    """Give the water what differs for an eye at the camera's mirror image, until its next values.

    Shafts are not drawn for it: what they would draw counts as unshadowed.
    """
    values = marks.part(scene, VALUES)
    single = {realtime_values.SHAFT_END: 0.0}
    if buffer is not None:
        single |= realtime_adjacency.FIELDS.numbers(buffer.view)
        realtime_adjacency.write_adjacency(marks.part(scene, ADJACENCY), water.adjacency_of(buffer))
    realtime_values.write(values, Numbers({}, single))


def show_mirrored(
    scene: bpy.types.Scene,
    view: ReflectedView,
    picture: NDArray[np.float32],
    nearness: NDArray[np.float32] | None,
) -> None:
    """Let the surface mirror a picture, see :func:`.realtime_reflected_view.write_picture`."""
    realtime_reflected_view.write_picture(marks.part(scene, MIRRORED), picture, nearness)
    _place(scene, realtime_reflected_view.FIELDS, view)


def look_into_air(scene: bpy.types.Scene, water: RealtimeWater, view: ReflectedView) -> None:
    """Let the scene show what is above the water, to an eye in it, until its next values.

    The sun is that of the air; shadows fall as if objects were where they seem to be.
    """
    numbers = {
        realtime_values.THROUGH: 1.0,
        **dict(zip(realtime_values.CAMERA, view.eye, strict=True)),
    }
    realtime_values.write(marks.part(scene, VALUES), Numbers({}, numbers))
    for item in marks.objects(scene):
        if item.get(marks.IS_SUN):
            scene_water.turn(item, water.column.skylight.sun)


def show_window(
    scene: bpy.types.Scene,
    view: ReflectedView,
    picture: NDArray[np.float32],
    nearness: NDArray[np.float32] | None,
) -> None:
    """Let objects in the air be seen through the surface, from a picture of shape (h, w, 4)."""
    image = marks.part(scene, WINDOW)
    realtime_reflected_view.write_picture(image, picture[..., :3], nearness, picture[..., 3])
    _place(scene, realtime_refracted_view.FIELDS, view)


def hide_window(scene: bpy.types.Scene) -> None:
    """Let the sky alone be seen through the surface."""
    _place(scene, realtime_refracted_view.FIELDS, realtime_reflected_view.NO_VIEW)


def hide_mirrored(scene: bpy.types.Scene) -> None:
    """Let the surface mirror open water alone."""
    _place(scene, realtime_reflected_view.FIELDS, realtime_reflected_view.NO_VIEW)


def _place(scene: bpy.types.Scene, fields: ValueFields, view: ReflectedView) -> None:
    realtime_values.write(marks.part(scene, VALUES), Numbers({}, fields.numbers(view)))
