"""Look-ups in the images of lamps in a node tree: :class:`.Lamp` and its light, of node values."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy

from ..uw_spectral.lamps.angular_spread import NARROW
from ..uw_spectral.lamps.lamp import Lamp, LitPart
from ..uw_spectral.lamps.lamp_channels import (
    COLOURS,
    ON_FLOATING,
    ChannelLight,
    SurfaceLight,
    along_path,
)
from ..uw_spectral.lamps.lamp_channels import LENGTHS as SAMPLES
from ..uw_spectral.lamps.lamp_path import Quadrature, fewer
from ..uw_spectral.lamps.lamp_shadow import SOFT, shadow_axes
from ..uw_spectral.lamps.multiple_scattering import InelasticLight
from ..uw_spectral.lamps.representative_bands import COUNT as BANDS
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Axis
from ..uw_spectral.water.phase import PhaseFunction
from . import lamp_images as layout
from . import lamp_sources
from .image_table import ImageTable
from .lamp_images import LampImages, LampRows
from .lamp_profiles import ImageParts, ImageProfile, water_of_lamps
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import closest


@dataclass(frozen=True, eq=False)
class LampTable:
    """Look-ups in the images in a node tree; make it with :meth:`of`."""

    graph: Graph
    images: LampImages
    rows: LampRows

    @classmethod
    def of(cls, graph: Graph, images: LampImages) -> LampTable:
        """Make it of images of :func:`new_images`."""
        return cls(graph, images, LampRows.of(images.numbers))

    @property
    def image(self) -> bpy.types.Image:
        """That of the numbers."""
        return self.images.numbers

    @property
    def count(self) -> int:
        """Number of lamps."""
        return (self.image.size[1] - layout.SPREAD - layout.SPREAD_ROWS) // self.rows.first["all"]

    @property
    def count_on_surfaces(self) -> int:
        """How many of them light objects; those of light of changed wavelength come last."""
        return self.count - self.rows.inelastic

    @property
    def virtual(self) -> int:
        """How many of these stand for objects; they come last."""
        return int(self.image[layout.VIRTUAL_KEY])

    def part(self, index: NodeValue, number: NodeValue) -> LitPart:
        """Return a part of what a lamp stands for."""
        row, place = self._row(index), number * 3.0 + float(layout.FIRST_PART)
        position, turned, fraction = (self._at(place + float(i), row) for i in range(3))
        radius = NODES.sqrt(turned.dot(turned))
        axis = self.graph.components(turned * (1.0 / radius))
        across, down = layout.PART_TILES.corner(number, NODES)
        first = row + float(self.rows.first["maps"] + layout.PARTS_ROW)
        corner = across + float(layout.SOFT), first + down
        shadow = self._table(shadow_axes(layout.PART_SIDE), *corner, numbers=1)
        return LitPart(self.graph.components(position), axis, fraction, radius, shadow)

    def with_parts(self, index: NodeValue, lamp: Lamp) -> Lamp:
        """Return a lamp with the parts of what it stands for, if any stands for something."""
        if not self.virtual:
            return lamp
        return dataclasses.replace(
            lamp, parts=ImageParts(self.graph, functools.partial(self.part, index), lamp.virtual)
        )

    def colour(self, index: NodeValue) -> NodeValue:
        """Return the colour of the lamp that casts the shadows of one."""
        return self._at(layout.COLOUR, self._row(index))

    def lamp(self, index: NodeValue) -> Lamp:
        """Return a lamp, of intensity 1."""
        row = self._row(index)
        columns = layout.POSITION, layout.AXIS, layout.FORM
        position, axis, form = (self.graph.components(self._at(x, row)) for x in columns)
        radius, edge, source = form
        tables = row + float(self.rows.first["maps"])
        shadow = self._table(shadow_axes(), float(layout.SHADOW), tables, numbers=1)
        own = row + float(layout.PROFILE_ROW)
        samples = self._table((Axis("place", SAMPLES),), 0.0, own, margin=0, numbers=1)
        profile = ImageProfile(samples, edge, source, tables)
        seen, virtual, unblocked = self.graph.components(self._at(layout.SEEN, row))
        tiles = (layout.SOFT_TILES,)
        soft = self._table(SOFT, float(layout.SOFT), tables, tiles=tiles, numbers=2)
        lamp = Lamp(
            position, axis, 1.0, profile, radius, seen, shadow, virtual, unblocked, soft=soft
        )
        if not self.image[layout.FROM_AIR_KEY]:
            return lamp
        columns = layout.DRY, layout.STANDS
        dry, stands = (self.graph.components(self._at(x, row)) for x in columns)
        return dataclasses.replace(lamp, dry=dry[0], stands=stands)

    def in_water(self, index: NodeValue, components: Sequence[PhaseFunction]) -> ChannelLight:
        """Return the light of a lamp in the water."""
        return ChannelLight(
            water_of_lamps(self.graph, self.images, layout.IN_WATER, self._extent[1]),
            components,
            self._projected(index, "scattered", self.rows.parts),
            self._projected(index, "unscattered", 1)[0],
            self._projected(index, "in water", BANDS),
            self.graph.components,
            self._table(ON_FLOATING, 0.0, self._row(index) + float(self.rows.first["floating"])),
            self._inelastic(index),
        )

    def _inelastic(self, index: NodeValue) -> InelasticLight | None:
        """Return what tells the light of a lamp from others, if the wavelength of any changes."""
        if not self.rows.inelastic:
            return None
        row = self._row(index)
        changed, first, _ = self.graph.components(self._at(layout.ONWARD, row))
        place = self.graph.components(self._at(layout.FORM, row))[2]
        scale = self.graph.components(self._at(layout.SCALES, 0.0))[0]
        source = lamp_sources.source(self.graph, self.images.sources, place, scale)
        onward = self._table(NARROW, 0.0, first)
        return InelasticLight(onward, source, self._at(layout.DECAY, row), changed)

    def on_surfaces(self, index: NodeValue) -> SurfaceLight:
        """Return the light of a lamp on objects."""
        rows = self._projected(index, "coloured", BANDS * COLOURS)
        coloured = [rows[BANDS * colour :][:BANDS] for colour in range(COLOURS)]
        column = layout.ON_SURFACES
        water = water_of_lamps(self.graph, self.images, column, self._extent[1])
        return SurfaceLight(water, coloured, self.graph.components)

    def of_measured(
        self, index: NodeValue, number: NodeValue, length: NodeValue
    ) -> list[NodeValue]:
        """Look up the tables of a measured reflectance; the first has the number 1."""
        # Number 0 finds those of a colour, which nothing uses.
        first = self._row(index) + float(self.rows.first["coloured"] + BANDS * (COLOURS - 1))
        rows = self._rows(first + number * float(BANDS), BANDS)
        return [row.at(length=length) for row in rows]

    def exciting(self, index: NodeValue, length: NodeValue) -> list[NodeValue]:
        """Look up the tables of what excites fluorophores."""
        return [row.at(length=length) for row in self._projected(index, "exciting", BANDS)]

    def nodes_for(self, lamp: Lamp) -> Quadrature:
        """Return what adds up terms along rays past a lamp, as :func:`.nodes_for` does.

        Places and weights are those of the image.
        """

        def integrate(
            count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
        ) -> tuple[NodeValue, ...]:
            first, number = _first_of(count), count
            if self.virtual:
                few = fewer(count)
                first = NODES.select(lamp.virtual, _first_of(few), first)
                number = NODES.select(lamp.virtual, float(few), float(count))

            def of_place(index: NodeValue) -> tuple[NodeValue, ...]:
                place, fraction, _ = self.graph.components(self._at(index + first, 0.0))
                return term(place, fraction)

            return summed(self.graph, number, of_place)

        return integrate

    def _projected(self, index: NodeValue, name: str, count: int) -> list[ImageTable]:
        return self._rows(self._row(index) + float(self.rows.first[name]), count)

    def _rows(self, first: NodeValue, count: int) -> list[ImageTable]:
        axes = along_path(self._extent[0])
        return [self._table(axes, 0.0, first + float(i), margin=0) for i in range(count)]

    @property
    def _table(self) -> Callable[..., ImageTable]:
        return functools.partial(ImageTable, self.graph, self.image)

    @property
    def _extent(self) -> tuple[NodeValue, ...]:
        return self.graph.components(self._at(layout.EXTENT, 0.0))

    def _at(self, column: NodeValue | float, row: NodeValue | float) -> NodeValue:
        return closest(self.graph, self.image, column, row)

    def _row(self, index: NodeValue) -> NodeValue:
        return index * float(self.rows.first["all"]) + float(layout.SPREAD + layout.SPREAD_ROWS)


def _first_of(nodes: int) -> float:
    """Column of the first place of a quadrature."""
    return float(sum(layout.QUADRATURES[: layout.QUADRATURES.index(nodes)]))
