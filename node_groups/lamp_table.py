"""Look-ups in the images of lamps in a node tree: :class:`.Lamp` and its light, of node values."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy

from ..uw_spectral.lamps.lamp import Lamp, LitPart
from ..uw_spectral.lamps.lamp_channels import COLOURS, ChannelLight, SurfaceLight, place_of_length
from ..uw_spectral.lamps.lamp_channels import LENGTHS as SAMPLES
from ..uw_spectral.lamps.lamp_path import Quadrature, fewer
from ..uw_spectral.lamps.lamp_shadow import DISTANCES
from ..uw_spectral.lamps.multiple_scattering import LampWater
from ..uw_spectral.lamps.profile import LampProfile, sample_place
from ..uw_spectral.lamps.representative_bands import COUNT as BANDS
from ..uw_spectral.lamps.virtual_point_lights import COUNT as PARTS
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from . import lamp_images as layout
from . import lamp_sources
from .lamp_images import LampImages, LampRows
from .loops import summed
from .node_mathematics import NODES, Graph, NodeValue
from .texture_atlas import closest, texel


def _first_of(nodes: int) -> float:
    """Column of the first place of a quadrature."""
    return float(sum(layout.QUADRATURES[: layout.QUADRATURES.index(nodes)]))


@dataclass(frozen=True, eq=False)
class _ImageProfile(LampProfile):
    """The profile of a lamp in the image."""

    graph: Graph
    image: bpy.types.Image
    row: NodeValue
    edge_cosine: NodeValue
    source: NodeValue
    tables: NodeValue

    @property
    def edge(self) -> NodeValue:
        return self.edge_cosine

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        place = sample_place(cosine, SAMPLES, m, self.edge_cosine)
        return self.graph.components(_between(self.graph, self.image, place, self.row))[0]


@dataclass(frozen=True, eq=False)
class _ImageRow:
    """A table over the length of a path in a row of the image."""

    graph: Graph
    image: bpy.types.Image
    row: NodeValue
    stretch: NodeValue

    def at(self, length: Operand) -> NodeValue:
        place = place_of_length(length, self.stretch)
        return _between(self.graph, self.image, place, self.row)


def _between(graph: Graph, image: bpy.types.Image, place: NodeValue, row: NodeValue) -> NodeValue:
    """Interpolate between the samples of a row, of which only nodes know that it is a whole one."""
    held = NODES.minimum(place, SAMPLES - 1.001)
    below = graph.operation("FLOOR", (held,))
    one, other = (closest(graph, image, column, row) for column in (below, below + 1.0))
    return one + (other - one) * (held - below)


@dataclass(frozen=True, eq=False)
class _ImageGrid:
    """A table of three bands in the image; its corner, margin included."""

    graph: Graph
    image: bpy.types.Image
    column: NodeValue | float
    row: NodeValue | float

    def at(self, column: Operand, row: Operand) -> NodeValue:
        h, v = self.column + layout.MARGIN + column, self.row + layout.MARGIN + row
        return texel(self.graph, self.image, h, v, *self.image.size)


class _ImageShadow(_ImageGrid):
    """The map of a lamp's shadows in the image: one number, the same in every channel."""

    def at(self, column: Operand, row: Operand) -> NodeValue:
        return self.graph.components(super().at(column, row))[0]


@dataclass(frozen=True, eq=False)
class _ImageSoft:
    """The maps of a lamp's scattered light in the image, a layer for each distance."""

    graph: Graph
    image: bpy.types.Image
    row: NodeValue

    def at(self, distance: NodeValue, column: NodeValue, row: NodeValue) -> tuple[NodeValue, ...]:
        layer = self.graph.operation("FLOOR", (NODES.minimum(distance, DISTANCES - 1.001),))
        h = layer * float(layout.SOFT_COLUMNS) + column + float(layout.SOFT + layout.MARGIN)
        v = self.row + row + float(layout.MARGIN)
        near, far = (
            texel(self.graph, self.image, place, v, *self.image.size)
            for place in (h, h + float(layout.SOFT_COLUMNS))
        )
        return self.graph.components(near + (far - near) * (distance - layer))[:2]


@dataclass(frozen=True, eq=False)
class _ImageSpread:
    """The tables of three bands in the image."""

    graph: Graph
    image: bpy.types.Image

    @property
    def narrow(self) -> _ImageGrid:
        return _ImageGrid(self.graph, self.image, 0.0, float(layout.SPREAD))

    @property
    def on_patches(self) -> _ImageGrid:
        return _ImageGrid(self.graph, self.image, float(layout.PATCHES), float(layout.SPREAD))

    def profile(self, profile: LampProfile) -> _ImageGrid:
        assert isinstance(profile, _ImageProfile)
        return _ImageGrid(self.graph, self.image, 0.0, profile.tables)


@dataclass(frozen=True, eq=False)
class _ImageField:
    """The scattered light of lamps in its image."""

    graph: Graph
    image: bpy.types.Image
    scale: NodeValue

    def source(self, profile: LampProfile) -> lamp_sources.ImageSource:
        assert isinstance(profile, _ImageProfile)
        return lamp_sources.ImageSource(self.graph, self.image, profile.source, self.scale)

    def arriving(self, profile: LampProfile) -> lamp_sources.ImageArriving:
        assert isinstance(profile, _ImageProfile)
        return lamp_sources.ImageArriving(self.graph, self.image, profile.source, self.scale)


@dataclass(frozen=True, eq=False)
class _ImageParts:
    """The parts of what a lamp stands for, in the image: :class:`.Parts`."""

    table: LampTable
    index: NodeValue
    virtual: NodeValue

    def total(self, terms: Callable[[LitPart], tuple[Operand, ...]]) -> tuple[Operand, ...]:
        def of_part(number: NodeValue) -> tuple[NodeValue, ...]:
            return terms(self.table.part(self.index, number))

        return summed(self.table.graph, self.virtual * float(PARTS), of_part)


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
        return (self.image.size[1] - layout.SPREAD - layout.SPREAD_ROWS) // self.rows.all

    @property
    def virtual(self) -> int:
        """How many of them stand for objects; these come last."""
        return int(self.image[layout.VIRTUAL_KEY])

    def part(self, index: NodeValue, number: NodeValue) -> LitPart:
        """Return a part of what a lamp stands for."""
        row, place = self._row(index), number * 3.0 + float(layout.FIRST_PART)
        position, turned, fraction = (self._at(place + float(i), row) for i in range(3))
        radius = NODES.sqrt(turned.dot(turned))
        axis = self.graph.components(turned * (1.0 / radius))
        down = NODES.floor((number + 0.5) * (1.0 / layout.BESIDE))
        across = (number - down * float(layout.BESIDE)) * float(layout.PART_COLUMNS)
        tables = row + float(self.rows.tables + layout.SOFT_COLUMNS)
        tables = tables + down * float(layout.PART_COLUMNS)
        shadow = _ImageShadow(self.graph, self.image, across + float(layout.SOFT), tables)
        return LitPart(self.graph.components(position), axis, fraction, radius, shadow)

    def with_parts(self, index: NodeValue, lamp: Lamp) -> Lamp:
        """Return a lamp with the parts of what it stands for, if any stands for something."""
        if not self.virtual:
            return lamp
        return dataclasses.replace(lamp, parts=_ImageParts(self, index, lamp.virtual))

    def colour(self, index: NodeValue) -> NodeValue:
        """Return the colour of the lamp that casts the shadows of one."""
        return self._at(layout.COLOUR, self._row(index))

    def lamp(self, index: NodeValue) -> Lamp:
        """Return a lamp, of intensity 1."""
        row = self._row(index)
        columns = layout.POSITION, layout.AXIS, layout.FORM
        position, axis, form = (self.graph.components(self._at(x, row)) for x in columns)
        radius, edge, source = form
        tables = row + float(self.rows.tables)
        shadow = _ImageShadow(self.graph, self.image, float(layout.SHADOW), tables)
        profile = _ImageProfile(
            self.graph, self.image, row + float(layout.PROFILE_ROW), edge, source, tables
        )
        seen, virtual, unblocked = self.graph.components(self._at(layout.SEEN, row))
        soft = _ImageSoft(self.graph, self.image, tables)
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
            self._water(layout.IN_WATER),
            components,
            self._projected(index, layout.PROJECTED_ROW, self.rows.parts),
            self._projected(index, self.rows.unscattered, 1)[0],
            self._projected(index, self.rows.in_water, BANDS),
            self.graph.components,
            _ImageGrid(self.graph, self.image, 0.0, self._row(index) + float(self.rows.floats)),
        )

    def on_surfaces(self, index: NodeValue) -> SurfaceLight:
        """Return the light of a lamp on objects."""
        rows = self._projected(index, self.rows.coloured, BANDS * COLOURS)
        coloured = [rows[BANDS * colour :][:BANDS] for colour in range(COLOURS)]
        water = self._water(layout.ON_SURFACES)
        return SurfaceLight(water, coloured, self.graph.components)

    def of_measured(self, index: NodeValue, number: NodeValue, length: NodeValue) -> list[Operand]:
        """Look up the tables of a measured reflectance; the first has the number 1."""
        # Number 0 finds those of a colour, which nothing uses.
        first = self._row(index) + float(self.rows.coloured + BANDS * (COLOURS - 1))
        rows = self._rows(first + number * float(BANDS), BANDS)
        return [row.at(length) for row in rows]

    def exciting(self, index: NodeValue, length: NodeValue) -> list[Operand]:
        """Look up the tables of what excites fluorophores."""
        return [row.at(length) for row in self._projected(index, self.rows.excited, BANDS)]

    def integrate(
        self, count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
    ) -> tuple[NodeValue, ...]:
        """Add up terms of the places of a quadrature, as :func:`.gauss_sum` does."""
        return self._integrated(_first_of(count), count, term)

    def nodes_for(self, lamp: Lamp) -> Quadrature:
        """Return what adds up terms along rays past a lamp, as :func:`.nodes_for` does."""
        if not self.virtual:
            return self.integrate

        def integrate(
            count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
        ) -> tuple[NodeValue, ...]:
            few, many = (float(n) for n in (fewer(count), count))
            first = NODES.select(lamp.virtual, _first_of(fewer(count)), _first_of(count))
            return self._integrated(first, NODES.select(lamp.virtual, few, many), term)

        return integrate

    def _integrated(
        self,
        first: NodeValue | float,
        count: NodeValue | int,
        term: Callable[[Operand, Operand], tuple[Operand, ...]],
    ) -> tuple[NodeValue, ...]:
        def of_place(index: NodeValue) -> tuple[NodeValue, ...]:
            place, fraction, _ = self.graph.components(self._at(index + first, 0.0))
            return term(place, fraction)

        return summed(self.graph, count, of_place)

    def _water(self, column: int) -> LampWater:
        b, wide, nothing = self._at(column, 0.0), self._at(layout.WIDE, 0.0), Mixture((), ())
        reach = self._extent[1]
        scale = self.graph.components(self._at(layout.SCALES, 0.0))[column == layout.ON_SURFACES]
        field = _ImageField(self.graph, self.images.sources, scale)
        spread = _ImageSpread(self.graph, self.image)
        return LampWater(0.0, b, b, nothing, spread, field, wide, reach)

    def _projected(self, index: NodeValue, row: int, count: int) -> list[_ImageRow]:
        return self._rows(self._row(index) + float(row), count)

    def _rows(self, first: NodeValue, count: int) -> list[_ImageRow]:
        stretch = self._extent[0]
        return [_ImageRow(self.graph, self.image, first + float(i), stretch) for i in range(count)]

    @property
    def _extent(self) -> tuple[NodeValue, ...]:
        return self.graph.components(self._at(layout.EXTENT, 0.0))

    def _at(self, column: NodeValue | float, row: NodeValue | float) -> NodeValue:
        return closest(self.graph, self.image, column, row)

    def _row(self, index: NodeValue) -> NodeValue:
        return index * float(self.rows.all) + float(layout.SPREAD + layout.SPREAD_ROWS)
