"""The picture of what the surface mirrors, as node groups read it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import override

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.surface.surface_views import ReflectedView
from ..uw_spectral.transfer.pixel_parts import ReflectedRadiance, SurfaceAbove
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_rays import build_mirrored
from .realtime_waves import WaveShape
from .shape import Shape, Sources, TermShape
from .texture_atlas import number_image, texel
from .value_fields import ValueFields

NAME, PART = "UW Mirrored", "uw_mirrored"
FIELDS = ValueFields(ReflectedView, "mirror", dict.fromkeys(("eye", "right", "up", "ahead"), 3))
"""Numbers of the picture; all are 0 where there is none."""
_NOWHERE = 0.0, 0.0, 0.0
NO_VIEW = ReflectedView(_NOWHERE, _NOWHERE, _NOWHERE, _NOWHERE, 0.0, 0.0)
_SMALLEST = 4  # texels along a side
_TILES = 2  # the picture, and how near what it shows is to the surface


class ReflectionShape(TermShape):
    """A picture shows the objects that the surface mirrors."""

    singles = FIELDS.names

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image()}

    @override
    def rays(self, sources: Sources) -> bpy.types.ShaderNodeTree:
        return build_mirrored()

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _ReflectionPixel(pixel)


def new_image(name: str = NAME) -> bpy.types.Image:
    """Make an image in which nothing is."""
    return number_image(name, _SMALLEST, _TILES * _SMALLEST)


def write_picture(
    image: bpy.types.Image,
    picture: NDArray[np.float32],
    nearness: NDArray[np.float32] | None,
) -> None:
    """Put a picture, shape (h, w, 3), from the top, into the image.

    Beside it lie the nearness, 1/m, shape (h, w), and the fraction of a pixel that objects cover:
    of a picture of shape (h, w, 4).
    """
    h, w = picture.shape[:2]
    out = np.ones((_TILES, h, w, 4), np.float32)
    out[0, ..., :3] = picture[::-1, :, :3]
    out[1, ..., :3] = 0.0 if nearness is None else nearness[::-1, :, None]
    if picture.shape[2] > 3:
        out[1, ..., 1] = picture[::-1, :, 3]
    if tuple(image.size) != (w, _TILES * h):
        image.scale(w, _TILES * h)
    image.pixels.foreach_set(np.ravel(out))
    image.update()


def looks(
    graph: Graph, view: ReflectedView, image: bpy.types.Image
) -> tuple[Callable[[Operand, Operand], NodeValue], Callable[[Operand, Operand], NodeValue]]:
    """Return what looks up, at a column and row, a picture, and what was written beside it."""
    columns, rows = NODES.maximum(view.columns, 1.0), NODES.maximum(view.rows, 1.0)

    def look(h: Operand, v: Operand) -> NodeValue:
        return texel(graph, image, h, v, columns, float(_TILES) * rows)

    return look, lambda h, v: look(h, v + rows)


class _ReflectionPixel(TermPixel):
    def __init__(self, pixel: Pixel) -> None:
        self._pixel = pixel

    @override
    def above(self, surface: SurfaceAbove) -> SurfaceAbove:
        return replace(surface, picture=self._seen)

    def _seen(self, down: Sequence[Operand]) -> ReflectedRadiance:
        """Look up what a ray brings that the surface mirrors, of unit direction from there on."""
        pixel = self._pixel
        view = FIELDS.read(pixel.graph, pixel.water.values.outputs)
        look, near = looks(pixel.graph, view, pixel.sources.parts[PART])
        if WaveShape in pixel.shape:
            h, v, inside = view.found(
                pixel.point, down, lambda h, v: pixel.graph.components(near(h, v))[0], NODES
            )
        else:
            h, v, inside = view.place(down, NODES)
        return ReflectedRadiance(look(h, v), inside)
