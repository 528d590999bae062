"""Occlusion in the water as node groups read it: one image, and where in it.

A tile of the image is a level of the grid; levels lie one above the other, the ways that light is
mixed from side by side, patches below views. The image has the size of the grid, so another grid
needs no other nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import override

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.occlusion.occlusion_table import (
    IRRADIANCE,
    OFF_SURFACE,
    SCATTERED,
    STEPS,
    OcclusionBox,
    OcclusionTable,
    arriving,
    mean_along,
    step,
)
from ..uw_spectral.occlusion.view_directions import COUNT
from ..uw_spectral.transfer.pixel_parts import OcclusionFactor, OcclusionOnPath
from .data_blocks import write_pixels
from .image_table import ImageTable, Tiles, write_tiles
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .shape import Shape, TermShape
from .surface_inputs import CLOSED, NORMAL
from .texture_atlas import number_image
from .value_fields import ValueFields

NAME, PART = "UW Occlusion", "uw_shade"
_SMALLEST = 3
FIELDS = ValueFields(OcclusionBox, "occlusion", {"lower": 3, "last": 3})
"""Numbers of a box."""


class OcclusionShape(TermShape):
    """Objects keep all kinds of light away, and throw some back."""

    singles = FIELDS.names

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        return {PART: new_image()}

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _OcclusionPixel(pixel)


def new_image() -> bpy.types.Image:
    """Make an image without occlusion."""
    return number_image(NAME, COUNT * _SMALLEST, 2 * _SMALLEST * _SMALLEST)


def write_table(image: bpy.types.Image, table: OcclusionTable) -> None:
    """Put a table into the image; one of another size takes its place wherever it is used."""
    write_pixels(image, pixels(table))


def pixels(table: OcclusionTable) -> NDArray[np.float32]:
    """Return the texels, shape (rows, columns, 4); the first row is the lowest."""
    _, _, nz, ny, nx, _ = table.atlas.shape
    out = np.ones((2 * nz * ny, COUNT * nx, 4), np.float32)
    write_tiles(out, table.atlas, _tiles(nz, ny, nx), margin=0)
    return out


def _tiles(nz: Operand, ny: Operand, nx: Operand) -> tuple[Tiles, ...]:
    return Tiles(rows=nz * ny), Tiles(columns=nx), Tiles(rows=ny)


class Occlusion:
    """Look-ups of occlusion in a node tree, in an image of :func:`new_image`.

    ``values`` are the outputs of the group of all numbers.
    """

    def __init__(self, graph: Graph, values: bpy.types.NodeOutputs, image: bpy.types.Image) -> None:
        self._graph, self._image = graph, image
        self._box = FIELDS.read(graph, values)

    def on_patch(self, point: Sequence[NodeValue], normal: Sequence[NodeValue]) -> NodeValue:
        """Look up the light on a patch at a point, over the unoccluded."""
        off = OFF_SURFACE / self._box.per_metre
        beside = [x + n * off for x, n in zip(point, normal, strict=True)]
        return self._mixed(IRRADIANCE, beside, normal)

    def on_path(
        self,
        camera: Sequence[NodeValue],
        w: Sequence[NodeValue],
        P: NodeValue,
        rates: tuple[Operand, Operand],
    ) -> list[NodeValue]:
        """Look up the light along a ray of length P, over the unoccluded, in channels.

        Three numbers of that scattered often, and the sun's scattered once; ``rates``, 1/m, are
        those at which they fall off.
        """

        def of_step(now: NodeValue) -> list[NodeValue]:
            s = step(now, P, self._box.reach, NODES)
            point = [x + along * s for x, along in zip(camera, w, strict=True)]
            light = self._mixed(SCATTERED, point, w)
            often, once = (arriving(now, s, rate, NODES) for rate in rates)
            parts = [part * often for part in self._graph.components(light.colour)]
            return [*parts, light.alpha * once, often, once]

        *scattered, single, often, once = summed(self._graph, STEPS, of_step)
        return [
            *(mean_along(part, often, NODES) for part in scattered),
            mean_along(single, once, NODES),
        ]

    def turned(self, y: NodeValue) -> NodeValue:
        """Fraction of sunlight scattered once at depth y that is occluded as the rest is."""
        return self._box.turned(y, NODES)

    def _mixed(self, kind: int, point: Sequence[NodeValue], w: Sequence[NodeValue]) -> Operand:
        place = dict(zip("xyz", self._box.place(point, NODES), strict=True))
        levels, rows, columns = (axis.count for axis in self._box.axes[2:])
        table = ImageTable(
            self._graph, self._image, self._box.axes, tiles=_tiles(levels, rows, columns),
            margin=0, size=(columns * COUNT, rows * levels * 2.0), alpha=kind == SCATTERED,
        )  # fmt: skip

        def at(tile: Operand) -> Operand:
            return table.at(kind=float(kind), tile=tile, **place)

        return self._box.mixed(kind, w, at, NODES)


class _OcclusionPixel(TermPixel):
    """Light on an object, in front and behind, and at steps of the path."""

    def __init__(self, pixel: Pixel) -> None:
        self._pixel, self._graph, given = pixel, pixel.graph, pixel.given
        values, image = pixel.water.values.outputs, pixel.sources.parts[PART]
        occlusion = Occlusion(self._graph, values, image)
        self._sides: list[NodeValue] = []
        if given is not None:
            normal = self._graph.components(given[NORMAL])
            self._sides.append(occlusion.on_patch(pixel.point, normal))
            if pixel.shape.translucent:
                back = [-part for part in normal]
                self._sides.append(occlusion.on_patch(pixel.point, back))
        self._path = occlusion.on_path(pixel.eye, pixel.w, pixel.P, pixel.rates)
        self._turned = occlusion.turned(pixel.y_o)

    @override
    def occluded(self, factor: OcclusionFactor, *, behind: bool = False) -> OcclusionFactor:
        found = self._sides[0]
        if behind and self._pixel.given is not None:
            # Inside a body there is no probe.
            found = NODES.select(self._pixel.given[CLOSED], *self._sides)
        mean, *fractions = self._graph.components(found)
        return OcclusionFactor(factor.mean * mean, [factor.mean * part for part in fractions])

    @override
    def on_path(self, occlusion: OcclusionOnPath) -> OcclusionOnPath:
        mean, *fractions, single = self._path
        return OcclusionOnPath(
            OcclusionFactor(mean, fractions), occlusion.single * single, self._turned
        )
