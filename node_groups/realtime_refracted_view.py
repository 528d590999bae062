"""The picture of the air through a flat surface, as node groups read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import override

import bpy

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.surface_views import ReflectedView, RefractedView
from ..uw_spectral.transfer.pixel_parts import RefractedRadiance, SurfaceAbove
from .node_mathematics import NODES
from .pixel_term import Pixel, TermPixel
from .realtime_air import DrySide
from .realtime_reflected_view import looks, new_image
from .realtime_values import CAMERA, MIRRORED_FRACTION, MIRRORED_SUN, OF_AIR, THROUGH
from .realtime_waves import WaveShape
from .shape import Shape, TermShape
from .value_fields import ValueFields

NAME, PART = "UW Window", "uw_window"
FIELDS = ValueFields(ReflectedView, "window", dict.fromkeys(("eye", "right", "up", "ahead"), 3))
"""Numbers of the picture; all are 0 where there is none."""


class WindowShape(TermShape):
    """A picture shows the objects in the air that are seen through the surface."""

    channels = OF_AIR
    singles = (THROUGH, *CAMERA, MIRRORED_FRACTION, MIRRORED_SUN, *FIELDS.names)

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image(NAME)}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _WindowPixel(pixel)


class _WindowPixel(DrySide):
    """Looks up what a ray that leaves the water meets in the air."""

    def __init__(self, pixel: Pixel) -> None:
        super().__init__(pixel)
        self.dry = pixel.water.values[THROUGH]

    @override
    def above(self, surface: SurfaceAbove) -> SurfaceAbove:
        return surface if surface.index is None else replace(surface, window=self._seen)

    def _seen(self, up: Sequence[Operand]) -> RefractedRadiance:
        """Return what there is in a unit direction in the air."""
        pixel, index = self.pixel, self.pixel.water.index
        view = FIELDS.read(pixel.graph, pixel.water.values.outputs)
        look, beside = looks(pixel.graph, view, pixel.sources.parts[PART])
        if WaveShape in pixel.shape:
            h, v, inside = RefractedView(view, index).found(
                pixel.point, up, lambda h, v: pixel.graph.components(beside(h, v))[0], NODES
            )
        else:
            h, v, inside = view.place(pixel.w, NODES)
        covered = pixel.graph.components(beside(h, v))[1]
        return RefractedRadiance(look(h, v) * inside, covered * inside)
