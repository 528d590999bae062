"""Pictures that the surface mirrors and lets through, given to the water of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import override

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
from ...node_groups.shape import TermShape
from ...uw_spectral.surface.surface_views import ReflectedView
from .. import marks
from ..readers.filled_view import filled_view
from ..readers.surroundings import Surroundings
from ..water import refraction_displacement, scene_water
from ..water.frame_water import RealtimeWater
from ..water.term import Term
from .occlusion import OcclusionTerm
from .view_from_air import in_air


class ReflectionTerm(Term):
    """The surface may mirror a picture of objects."""

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (realtime_reflected_view.ReflectionShape(),)


@dataclass(frozen=True)
class WindowTerm(Term):
    """The surface may show a picture of objects in the air to a camera that is in the water."""

    camera: Sequence[float]  #: Where it is, m.

    @override
    def shapes(self, water: RealtimeWater) -> Sequence[TermShape]:
        return (realtime_refracted_view.WindowShape(),)

    @override
    def prepare(self, scene: bpy.types.Scene) -> list[str]:
        refraction_displacement.subdivide(scene, self.camera, from_air=False)
        return []

    @override
    def numbers(self, water: RealtimeWater) -> Numbers:
        return in_air(water) | Numbers({}, {realtime_values.THROUGH: 0.0})


def look_from_mirror(
    scene: bpy.types.Scene,
    water: RealtimeWater,
    camera: bpy.types.Object,
    around: Surroundings | None,
) -> None:
    """Give the water what differs for an eye at the camera's mirror image, until its next values.

    Shafts are not drawn for it: what they would draw counts as unshadowed.
    """
    single, occlusion = {realtime_values.SHAFT_END: 0.0}, water.term(OcclusionTerm)
    if occlusion is not None and occlusion.buffer is not None:
        surfaces = None if around is None else around.surfaces
        buffer = filled_view(scene, camera, surfaces, water.field.floor_depth)
        single |= realtime_adjacency.FIELDS.numbers(buffer.view)
        occlusion.write_adjacency(scene, water, buffer)
    _write(scene, single)


def look_into_air(scene: bpy.types.Scene, water: RealtimeWater, view: ReflectedView) -> None:
    """Let the scene show what is above the water, to an eye in it, until its next values.

    The sun is that of the air; shadows fall as if objects were where they seem to be.
    """
    camera = zip(realtime_values.CAMERA, view.eye, strict=True)
    _write(scene, {realtime_values.THROUGH: 1.0, **dict(camera)})
    for item in marks.suns(scene):
        scene_water.turn(item, water.column.skylight.sun)


def show(
    scene: bpy.types.Scene,
    view: ReflectedView,
    picture: NDArray[np.float32],
    nearness: NDArray[np.float32] | None,
    *,
    in_air: bool,
) -> None:
    """Show a picture: of objects in the air through the surface, or mirrored by it.

    See :func:`.realtime_reflected_view.write_picture`.
    """
    seen = realtime_refracted_view if in_air else realtime_reflected_view
    realtime_reflected_view.write_picture(marks.part(scene, seen.PART), picture, nearness)
    _write(scene, seen.FIELDS.numbers(view))


def hide(scene: bpy.types.Scene, *, in_air: bool) -> None:
    """Let the sky alone be seen through the surface, or it mirror open water alone."""
    seen = realtime_refracted_view if in_air else realtime_reflected_view
    _write(scene, seen.FIELDS.numbers(realtime_reflected_view.NO_VIEW))


def _write(scene: bpy.types.Scene, numbers: dict[str, float]) -> None:
    realtime_values.write(marks.part(scene, marks.VALUES), Numbers({}, numbers))
