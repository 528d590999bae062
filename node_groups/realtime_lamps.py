"""Lamps in the water as node groups read them: one image, looped over.

The first row of the image holds the places of the quadratures and the numbers of the water; then
come, with a margin of one texel, the tables of the spread of scattered light; and a block for each
lamp, and each that stands for objects that throw light back: its numbers, its profile, its tables
over the length of a path (:mod:`..uw_spectral.lamps.lamp_channels`), its blurred profiles and a map
of how far it shines into the water. All light is in three channels. Shadows on objects are EEVEE's
own: a lamp of one colour stands for each, so faint beside the sun that it is not seen on the
scene's own materials, and a white surface reads it.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.cloud_light import Clouds
from ..uw_spectral.clouds.lamp_lit_cloud import LampAndClouds, transmittance_to_surface
from ..uw_spectral.lamps.angular_spread import (
    ANGLES,
    LENGTHS,
    ON_PATCHES,
    PROFILE_ANGLES,
    PROFILE_LENGTHS,
    ValueGrid,
    WaterSpread,
)
from ..uw_spectral.lamps.lamp import Lamp, LitPart, ray_past_lamp
from ..uw_spectral.lamps.lamp_channels import (
    COLOURS,
    FLOATING,
    ChannelLamp,
    ChannelLight,
    LampChannels,
    SurfaceLight,
    matte_part,
    of_colour,
    place_of_length,
)
from ..uw_spectral.lamps.lamp_channels import LENGTHS as SAMPLES
from ..uw_spectral.lamps.lamp_path import NODES as PATH_NODES
from ..uw_spectral.lamps.lamp_path import Quadrature, fewer, gauss
from ..uw_spectral.lamps.lamp_shadow import DISTANCES, PART_SIDE, SIDE, SOFT_SIDE
from ..uw_spectral.lamps.lamp_surface import patch_past_lamp
from ..uw_spectral.lamps.multiple_scattering import MORE_NODES, LampField, LampWater
from ..uw_spectral.lamps.profile import NO_EDGE, LampProfile, sample_place
from ..uw_spectral.lamps.representative_bands import COUNT as BANDS
from ..uw_spectral.lamps.soft_shadow import SoftMap
from ..uw_spectral.lamps.virtual_point_lights import COUNT as PARTS
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.transfer.facets import Facets
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from . import lamp_sources
from .loops import followed, summed
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue, new_group
from .realtime_rays import camera_depth, camera_place, place_here, view_direction, view_distance
from .realtime_shadows import light_on_white
from .texture_atlas import closest, number_image, texel

NAME = "UW Lamps"
NORMAL, VISIBILITY, COLOR, MEASURED = "Normal", "Lamp Visibility", "Color", "Measured"
LIGHT = "Light"
MIRROR, EDGE, CLEAR, ROUGHNESS, CLEAR_INDEX = "Mirror", "Edge", "Clear", "Roughness", "Index"
COAT, COAT_ROUGHNESS, COAT_INDEX, COAT_NORMAL = (
    f"Coat{of}" for of in ("", " Roughness", " Index", " Normal")
)
_RGB, _FLOAT = "NodeSocketColor", "NodeSocketFloat"
FACETS: tuple[dict[str, str], ...] = (
    {MIRROR: _RGB, EDGE: _RGB, CLEAR: _RGB, ROUGHNESS: _FLOAT, CLEAR_INDEX: _FLOAT},
    {COAT: _FLOAT, COAT_ROUGHNESS: _FLOAT, COAT_INDEX: _FLOAT, COAT_NORMAL: "NodeSocketVector"},
)
"""Inputs of the facets of objects and of those of coats over them: see :class:`.Facets`."""
SEEN, UNSCATTERED, FORWARD, THERE, IRRADIANCE, EXCITING = "Seen", "D", "F", "J", "E", "Exciting"
"""Outputs of :func:`build_patch`."""
SUNLIT, CODE = "lamps beside the sun", "lamp code"
NUMBERS = (SUNLIT, CODE)
"""Names of the numbers that shadows are read with."""
CODES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Colours of the lamps that cast shadows; the first is the sun's where it shines."""
NO_SHADOW = (0.0, 0.0, 0.0)
"""In place of the colour of what stands for objects, and of lamps that cast no shadow."""
CloudsOf = Callable[[Graph], Clouds]
"""Makes the clouds of a scene in a node tree."""
# Custom properties of the image.
_PARTS, _MEASURED, _FROM_AIR = "uw_parts", "uw_measured", "uw_from_air"
_VIRTUAL, _EXCITING, _FLOATING = "uw_thrown", "uw_exciting", "uw_floating"
_QUADRATURES = (PATH_NODES, MORE_NODES, fewer(PATH_NODES), fewer(MORE_NODES))
_NUMBERS = sum(_QUADRATURES)  # first column after them
_EXTENT, _IN_WATER, _ON_SURFACES, _WIDE, _SCALES = range(_NUMBERS, _NUMBERS + 5)
_POSITION, _AXIS, _FORM, _COLOUR, _SEEN, _STANDS, _DRY, _FIRST_PART = range(8)
_PROFILE, _PROJECTED = 1, 2  # rows of a block; its numbers are in the first
_MARGIN = 1
_SPREAD, _SPREAD_ROWS = 1, LENGTHS + 2 * _MARGIN
_PATCHES = ANGLES + 2 * _MARGIN  # first column of the irradiance on patches
_PROFILE_COLUMNS = PROFILE_ANGLES + 2 * _MARGIN
_SHADOW = _PROFILE_COLUMNS  # first column of the map of shadows
_PART_COLUMNS = PART_SIDE + 2 * _MARGIN
_SOFT = _SHADOW + SIDE + 2 * _MARGIN  # that of the maps of scattered light, side by side
_SOFT_COLUMNS = SOFT_SIDE + 2 * _MARGIN
_FLOATING_ROWS = FLOATING + 2 * _MARGIN
_BESIDE = 3  # maps of parts of lit objects, in rows below those of scattered light
_TABLE_ROWS = max(PROFILE_LENGTHS, SIDE) + 2 * _MARGIN
_WIDTH = max(
    SAMPLES,
    _SCALES + 1,
    _SOFT + DISTANCES * _SOFT_COLUMNS,
    _PATCHES + ON_PATCHES + 2 * _MARGIN,
    _FLOATING_ROWS,
)
_UNHIDDEN = SoftMap(np.tile((1.0, 0.0), (DISTANCES, SOFT_SIDE, SOFT_SIDE, 1)))
_DARKEST = 1e-12
_LEAST_RADIUS = 1e-3  # m
_OF_SHADOWS = (
    "shadow_filter_radius", "shadow_maximum_resolution", "use_absolute_resolution",
    "use_shadow_jitter", "shadow_jitter_overblur",
)  # fmt: skip
# m; far beyond the reach of a lamp in water. From some 5 km on EEVEE draws no shadow.
_REACH_OF_SHADOWS = 200.0


@dataclass(frozen=True, eq=False)
class LampImages:
    """What lamps are looked up in.

    Attributes
    ----------
    numbers : Image
        Of :func:`new_image`.
    sources : Image
        Of :func:`.lamp_sources.new_image`.
    """

    numbers: bpy.types.Image
    sources: bpy.types.Image


@dataclass(frozen=True)
class _Rows:
    """Rows of a lamp's block.

    Of so many parts of the phase function, measured reflectances, bands that excite, and of the
    table of what floats.
    """

    parts: int
    measured: int
    exciting: int
    floating: int

    @property
    def unscattered(self) -> int:
        return _PROJECTED + self.parts

    @property
    def in_water(self) -> int:
        return self.unscattered + 1

    @property
    def coloured(self) -> int:
        return self.in_water + BANDS

    @property
    def excited(self) -> int:
        return self.coloured + BANDS * (COLOURS + self.measured)

    @property
    def floats(self) -> int:
        return self.excited + self.exciting

    @property
    def tables(self) -> int:
        return self.floats + self.floating

    @property
    def all(self) -> int:
        return self.tables + _TABLE_ROWS


def new_images(
    lamps: int,
    profiles: int,
    parts: int,
    measured: int = 0,
    virtual: int = 0,
    *,
    from_air: bool = False,
    exciting: bool = False,
    in_clouds: bool = False,
) -> LampImages:
    """Make the images of so many lamps, which are dark.

    Parameters
    ----------
    lamps : int
        Those that stand for objects included.
    profiles : int
        That these may have.
    parts : int
        Of the phase function.
    measured : int
        Measured reflectances of objects.
    virtual : int
        How many of the lamps stand for objects; they come last.
    from_air : bool
        Whether some may shine into the water from above.
    exciting : bool
        Whether their light excites fluorophores.
    in_clouds : bool
        Whether there are clouds that scatter it.
    """
    excited, floating = BANDS * exciting, _FLOATING_ROWS * in_clouds
    height = _SPREAD + _SPREAD_ROWS + _Rows(parts, measured, excited, floating).all * lamps
    image = number_image(NAME, _WIDTH, height)
    image.use_half_precision = False  # numbers keep their digits
    image[_PARTS], image[_MEASURED], image[_FROM_AIR] = parts, measured, from_air
    image[_VIRTUAL], image[_EXCITING], image[_FLOATING] = virtual, excited, floating
    return LampImages(image, lamp_sources.new_image(profiles))


def write_lamps(
    images: LampImages, projected: LampChannels, colours: Sequence[Sequence[float]]
) -> None:
    """Put lamps and their water into images of their size.

    Parameters
    ----------
    colours : sequence of 3
        Of the lamps that cast the shadows of each; :data:`NO_SHADOW` where nothing is in the way.
    """
    profiles = list(dict.fromkeys(lamp.profile for lamp in projected.lamps))
    lamp_sources.write(images.sources, *_fields(projected), profiles)
    image = images.numbers
    image.pixels.foreach_set(np.ravel(_pixels(image.size, projected, colours, profiles)))
    image.update()


def _pixels(
    size: Sequence[int],
    projected: LampChannels,
    colours: Sequence[Sequence[float]],
    profiles: Sequence[LampProfile],
) -> NDArray[np.float32]:
    width, height = size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    row = np.concatenate([np.transpose(gauss(count)) for count in _QUADRATURES])
    in_water, on_surfaces = projected.in_water, projected.on_surfaces
    out[0, : len(row), :2] = row
    out[0, _EXTENT, :2] = projected.stretch, in_water.reach
    out[0, _SCALES, :2] = [field.harmonics.scale for field in _fields(projected)]
    out[0, _IN_WATER, :3], out[0, _ON_SURFACES, :3] = in_water.b, on_surfaces.b
    out[0, _WIDE, :3] = in_water.wide
    in_spread, on_spread = in_water.spread, on_surfaces.spread
    assert isinstance(in_spread, WaterSpread)
    assert isinstance(on_spread, WaterSpread)
    _put(out[_SPREAD:], 0, in_spread.narrow.values)
    _put(out[_SPREAD:], _PATCHES, on_spread.on_patches.values)
    first = _SPREAD + _SPREAD_ROWS
    floating = _FLOATING_ROWS * projected.floats
    rows = _Rows(projected.parts, projected.measured, BANDS * projected.excites, floating)
    for index, (lamp, tables) in enumerate(zip(projected.lamps, projected.projected, strict=True)):
        block = out[first + rows.all * index :][: rows.all]
        _put_lamp(block, lamp, tables, colours[index], profiles.index(lamp.profile))
        _put(block[rows.tables :], 0, on_spread.profile(lamp.profile).values)
        if lamp.shadow is not None:
            assert isinstance(lamp.shadow, ValueGrid)
            _put(block[rows.tables :], _SHADOW, lamp.shadow.values)
        if projected.floats:
            _put(block[rows.floats :], 0, tables.floating)
        for place, part in enumerate(lamp.known_parts):
            if part.shadow is not None:
                assert isinstance(part.shadow, ValueGrid)
                down, across = divmod(place, _BESIDE)
                row, column = (_PART_COLUMNS * x for x in (down, across))
                row += rows.tables + _SOFT_COLUMNS
                _put(block[row:], _SOFT + column, part.shadow.values)
        soft = _UNHIDDEN if lamp.soft is None else lamp.soft
        assert isinstance(soft, SoftMap)
        for place, layer in enumerate(soft.values):
            _put(block[rows.tables :], _SOFT + place * _SOFT_COLUMNS, layer)
    return out


def _fields(projected: LampChannels) -> tuple[LampField, LampField]:
    in_water, on_surfaces = projected.in_water.field, projected.on_surfaces.field
    assert isinstance(in_water, LampField)
    assert isinstance(on_surfaces, LampField)
    return in_water, on_surfaces


def _put_lamp(
    block: NDArray[np.float32],
    lamp: Lamp,
    projected: ChannelLamp,
    colour: Sequence[float],
    source: int,
) -> None:
    edge = NO_EDGE if lamp.profile.edge is None else lamp.profile.edge
    numbers = block[0]
    numbers[_POSITION, :3], numbers[_AXIS, :3] = lamp.position, lamp.axis
    numbers[_FORM, :3] = lamp.radius, edge, source
    unblocked = max(lamp.virtual, lamp.unblocked)
    numbers[_COLOUR, :3], numbers[_SEEN, :3] = colour, (lamp.seen, lamp.virtual, unblocked)
    numbers[_STANDS, :3], numbers[_DRY, 0] = lamp.own_place, lamp.dry
    for index, part in enumerate(lamp.known_parts):
        place = _FIRST_PART + 3 * index
        numbers[place, :3], numbers[place + 2, :3] = part.position, part.fraction
        # One texel has both: a direction has no length.
        numbers[place + 1, :3] = np.array(part.axis) * max(float(part.radius), _LEAST_RADIUS)
    block[_PROFILE, :SAMPLES, 0] = lamp.profile.sampled(SAMPLES)
    coloured = projected.coloured.reshape(-1, SAMPLES, 3)
    tables = [
        projected.scattered, projected.unscattered[None], projected.in_water, coloured,
        projected.exciting,
    ]  # fmt: skip
    rows = np.concatenate(tables)
    block[_PROJECTED : _PROJECTED + len(rows), :SAMPLES, :3] = rows


def _put(out: NDArray[np.float32], column: int, values: NDArray[np.float64]) -> None:
    """Lay a table of one number or three into the image, with its margin."""
    padded = np.pad(values, ((_MARGIN, _MARGIN), (_MARGIN, _MARGIN), (0, 0)), mode="edge")
    rows, columns, count = padded.shape
    out[:rows, column : column + columns, :count] = padded


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
    """Interpolate between the samples of a row: two single texels are cheaper than a linear one."""
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
        h, v = self.column + _MARGIN + column, self.row + _MARGIN + row
        if isinstance(h, NodeValue):
            return texel(self.graph, self.image, h, v, *self.image.size)
        below = self.graph.operation("FLOOR", (v,))
        one, other = (closest(self.graph, self.image, h, place) for place in (below, below + 1.0))
        return one + (other - one) * (v - below)


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
        h = layer * float(_SOFT_COLUMNS) + column + float(_SOFT + _MARGIN)
        v = self.row + row + float(_MARGIN)
        near, far = (
            texel(self.graph, self.image, place, v, *self.image.size)
            for place in (h, h + float(_SOFT_COLUMNS))
        )
        return self.graph.components(near + (far - near) * (distance - layer))[:2]


@dataclass(frozen=True, eq=False)
class _ImageSpread:
    """The tables of three bands in the image."""

    graph: Graph
    image: bpy.types.Image

    @property
    def narrow(self) -> _ImageGrid:
        return _ImageGrid(self.graph, self.image, 0.0, float(_SPREAD))

    @property
    def on_patches(self) -> _ImageGrid:
        return _ImageGrid(self.graph, self.image, float(_PATCHES), float(_SPREAD))

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
        def of_part(number: NodeValue, _: NodeValue) -> tuple[NodeValue, Sequence[NodeValue]]:
            first, *others = terms(self.table.part(self.index, number))
            return first, others

        return followed(self.table.graph, PARTS, of_part, self.virtual)


@dataclass(frozen=True, eq=False)
class LampTable:
    """Look-ups in the images in a node tree; make it with :meth:`of`."""

    graph: Graph
    images: LampImages
    rows: _Rows

    @classmethod
    def of(cls, graph: Graph, images: LampImages) -> LampTable:
        """Make it of images of :func:`new_images`."""
        image = images.numbers
        counts = (image[name] for name in (_PARTS, _MEASURED, _EXCITING, _FLOATING))
        return cls(graph, images, _Rows(*counts))

    @property
    def image(self) -> bpy.types.Image:
        """That of the numbers."""
        return self.images.numbers

    @property
    def count(self) -> int:
        """Number of lamps."""
        return (self.image.size[1] - _SPREAD - _SPREAD_ROWS) // self.rows.all

    @property
    def virtual(self) -> int:
        """How many of them stand for objects; these come last."""
        return int(self.image[_VIRTUAL])

    def part(self, index: NodeValue, number: NodeValue) -> LitPart:
        """Return a part of what a lamp stands for."""
        row, place = self._row(index), number * 3.0 + float(_FIRST_PART)
        position, turned, fraction = (self._at(place + float(i), row) for i in range(3))
        radius = NODES.sqrt(turned.dot(turned))
        axis = self.graph.components(turned * (1.0 / radius))
        down = NODES.floor((number + 0.5) * (1.0 / _BESIDE))
        across = (number - down * float(_BESIDE)) * float(_PART_COLUMNS)
        tables = row + float(self.rows.tables + _SOFT_COLUMNS) + down * float(_PART_COLUMNS)
        shadow = _ImageShadow(self.graph, self.image, across + float(_SOFT), tables)
        return LitPart(self.graph.components(position), axis, fraction, radius, shadow)

    def with_parts(self, index: NodeValue, lamp: Lamp) -> Lamp:
        """Return a lamp with the parts of what it stands for, if any stands for something."""
        if not self.virtual:
            return lamp
        return dataclasses.replace(lamp, parts=_ImageParts(self, index, lamp.virtual))

    def colour(self, index: NodeValue) -> NodeValue:
        """Return the colour of the lamp that casts the shadows of one."""
        return self._at(_COLOUR, self._row(index))

    def lamp(self, index: NodeValue) -> Lamp:
        """Return a lamp, of intensity 1."""
        row = self._row(index)
        position, axis, form = (
            self.graph.components(self._at(column, row)) for column in (_POSITION, _AXIS, _FORM)
        )
        radius, edge, source = form
        tables = row + float(self.rows.tables)
        shadow = _ImageShadow(self.graph, self.image, float(_SHADOW), tables)
        profile = _ImageProfile(self.graph, self.image, row + float(_PROFILE), edge, source, tables)
        seen, virtual, unblocked = self.graph.components(self._at(_SEEN, row))
        soft = _ImageSoft(self.graph, self.image, tables)
        lamp = Lamp(
            position, axis, 1.0, profile, radius, seen, shadow, virtual, unblocked, soft=soft
        )
        if not self.image[_FROM_AIR]:
            return lamp
        dry, stands = (self.graph.components(self._at(at, row)) for at in (_DRY, _STANDS))
        return dataclasses.replace(lamp, dry=dry[0], stands=stands)

    def in_water(self, index: NodeValue, components: Sequence[PhaseFunction]) -> ChannelLight:
        """Return the light of a lamp in the water."""
        return ChannelLight(
            self._water(_IN_WATER),
            components,
            self._projected(index, _PROJECTED, self.rows.parts),
            self._projected(index, self.rows.unscattered, 1)[0],
            self._projected(index, self.rows.in_water, BANDS),
            self.graph.components,
            _ImageGrid(self.graph, self.image, 0.0, self._row(index) + float(self.rows.floats)),
        )

    def on_surfaces(self, index: NodeValue) -> SurfaceLight:
        """Return the light of a lamp on objects."""
        rows = self._projected(index, self.rows.coloured, BANDS * COLOURS)
        coloured = [rows[BANDS * colour :][:BANDS] for colour in range(COLOURS)]
        water = self._water(_ON_SURFACES)
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
        b, wide, nothing = self._at(column, 0.0), self._at(_WIDE, 0.0), Mixture((), ())
        reach = self._extent[1]
        scale = self.graph.components(self._at(_SCALES, 0.0))[column == _ON_SURFACES]
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
        return self.graph.components(self._at(_EXTENT, 0.0))

    def _at(self, column: NodeValue | float, row: NodeValue | float) -> NodeValue:
        return closest(self.graph, self.image, column, row)

    def _row(self, index: NodeValue) -> NodeValue:
        return index * float(self.rows.all) + float(_SPREAD + _SPREAD_ROWS)


def _first_of(nodes: int) -> float:
    """Column of the first place of a quadrature."""
    return float(sum(_QUADRATURES[: _QUADRATURES.index(nodes)]))


def build_path(
    images: LampImages,
    components: Sequence[PhaseFunction],
    *,
    ahead: bool,
    rays: bpy.types.ShaderNodeTree | None = None,
    clouds: CloudsOf | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the light of lamps in the water before an object, or up to the boundary.

    Parameters
    ----------
    components : sequence of PhaseFunction
        Parts of the phase function.
    ahead : bool
        Whether it goes to the boundary; the group has the input ``y_f`` then, else none.
    rays : ShaderNodeTree, optional
        Of :mod:`.realtime_refraction`.
    clouds : callable, optional
        Which they shine through; images have to be made for these.

    Returns
    -------
    ShaderNodeTree
        Output :data:`LIGHT`: three channels, the lamps themselves and what clouds scatter included.
    """
    inputs = {"y_f": "NodeSocketFloat"} if ahead else {}
    tree, graph, given = _group(f"{NAME} in the Water", inputs, rays, slim=clouds is not None)
    table, w = LampTable.of(graph, images), view_direction(graph)
    if ahead:
        origin = camera_place(graph)
        P = distance_in_water(camera_depth(graph), -w[2], given["y_f"], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    floating = None if clouds is None else clouds(graph)
    follow = functools.partial(followed, graph)

    def add_up(count: int, terms: Callable[[Operand], Sequence[Operand]]) -> Sequence[Operand]:
        return summed(graph, count, terms)

    passed = {}
    if floating is not None:
        passed = floating.rays(floating.group.grids, origin, w, P, add_up)

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index)
        ray = ray_past_lamp(lamp, origin, w, P, NODES, before_surface=not ahead)
        light = table.in_water(index, components)
        if floating is None:
            return (light.along(lamp, ray, NODES, table.nodes_for(lamp)),)
        through = LampAndClouds(floating, lamp, ray, origin, w, P, index, passed)
        return (through.seen(light, table.nodes_for(lamp), add_up, follow),)

    return _finished(tree, graph, {LIGHT: summed(graph, table.count, of_lamp)[0]})


def build_patch(
    images: LampImages,
    outputs: Collection[str] = (SEEN,),
    rays: bpy.types.ShaderNodeTree | None = None,
    facets: int = 0,
    clouds: CloudsOf | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the light of lamps on an object.

    Inputs: ``Normal``; ``Lamp Visibility``, of :func:`visibility`; ``Color``, the reflectance;
    those of :data:`FACETS`; and, if the image has measured reflectances, ``Measured``: 0, or the
    number of one from 1 on that replaces the colour.

    Parameters
    ----------
    outputs : collection of str
        Which of these, in three channels: :data:`SEEN`, the radiance that arrives at the camera,
        of which :data:`UNSCATTERED` and :data:`FORWARD` are the parts; :data:`THERE`, the radiance
        at the object; :data:`IRRADIANCE`, on it; :data:`EXCITING`, that as fluorophores weigh it.
    rays : ShaderNodeTree, optional
        Of :mod:`.realtime_refraction`.
    facets : int
        How many of :data:`FACETS` objects may have.
    clouds : callable, optional
        Which are between lamps and objects.
    """
    inputs = dict.fromkeys((NORMAL, VISIBILITY), "NodeSocketVector") | {COLOR: "NodeSocketColor"}
    for one in FACETS[:facets]:
        inputs |= one
    measured = bool(images.numbers[_MEASURED])
    inputs |= {MEASURED: "NodeSocketFloat"} if measured else {}
    tree, graph, given = _group(f"{NAME} on Objects", inputs, rays, slim=clouds is not None)
    table, here, P = LampTable.of(graph, images), place_here(graph), view_distance(graph)
    normal, colour = (graph.components(given[name]) for name in (NORMAL, COLOR))
    floating = None if clouds is None else clouds(graph)
    to_eye = [-part for part in view_direction(graph)]
    mirroring = [one.with_all_light(to_eye, NODES) for one in _facets(graph, given, facets)]
    matte = matte_part(colour, _facets(graph, given, facets), NODES) if facets else colour

    def of_lamp(index: NodeValue) -> tuple[NodeValue, ...]:
        lamp = table.with_parts(index, table.lamp(index))
        visible = given[VISIBILITY].dot(table.colour(index)) + lamp.unblocked
        found = found_of(index, lamp, visible)
        if floating is None:
            return found
        transmittance = transmittance_to_surface(floating, lamp, here, index)
        if table.virtual:
            # What objects throw back comes from near by.
            transmittance = NODES.select(lamp.virtual, 1.0, transmittance)
        return tuple(value * transmittance for value in found)

    def found_of(index: NodeValue, lamp: Lamp, visible: Operand) -> tuple[NodeValue, ...]:
        light = table.on_surfaces(index)
        patch = patch_past_lamp(lamp, here, normal, NODES)
        arriving = light.arriving_at(lamp, patch, visible, NODES)
        bands = light.on_patch(arriving, patch, NODES)
        to_lamp = [-part for part in lamp.towards(here, NODES)[1]]
        virtual = [
            light.on_facets(arriving, lamp, patch, one, to_eye, to_lamp, NODES) for one in mirroring
        ]

        def of_surface(tables: Sequence[Sequence[Operand]], length: NodeValue) -> list[Operand]:
            coloured = of_colour(tables, matte)
            if not measured:
                return coloured
            number = given[MEASURED]
            known, chosen = table.of_measured(index, number, length), NODES.less(0.5, number)
            pairs = zip(known, coloured, strict=True)
            return [NODES.select(chosen, one, other) for one, other in pairs]

        def reflected(length: NodeValue, fractions: Mapping[str, Operand]) -> dict[str, NodeValue]:
            tables = light.tables(length)
            parts = [(bands, of_surface(tables, length))]
            parts += [(one, of_colour(tables, colour)) for one, colour in virtual]
            return {
                name: functools.reduce(
                    operator.add,
                    (light.arriving(one * (1.0 / math.pi) * fraction, seen) for one, seen in parts),
                )
                for name, fraction in fractions.items()
                if name in outputs
            }

        found: dict[str, NodeValue] = {}
        if not {SEEN, UNSCATTERED, FORWARD}.isdisjoint(outputs):
            fractions = {UNSCATTERED: light.unscattered(P, NODES), FORWARD: light.forward(P, NODES)}
            fractions[SEEN] = fractions[UNSCATTERED] + fractions[FORWARD]
            found |= reflected(arriving.length + P, fractions)
        if not {THERE, IRRADIANCE}.isdisjoint(outputs):
            tables = light.tables(arriving.length)
            found |= reflected(arriving.length, {THERE: 1.0})
            if IRRADIANCE in outputs:
                found[IRRADIANCE] = light.arriving(bands, of_colour(tables, (1.0, 1.0, 1.0)))
        if EXCITING in outputs:
            found[EXCITING] = light.arriving(bands, table.exciting(index, arriving.length))
        return tuple(found[name] for name in outputs)

    totals = summed(graph, table.count, of_lamp)
    return _finished(tree, graph, dict(zip(outputs, totals, strict=True)))


def _facets(graph: Graph, given: Mapping[str, NodeValue], count: int) -> list[Facets]:
    """Return the facets that a group gets as inputs."""
    found = []
    if count:
        even, grazing, clear = (graph.components(given[name]) for name in (MIRROR, EDGE, CLEAR))
        normal = graph.components(given[NORMAL])
        own = Facets(normal, given[ROUGHNESS], even, grazing, clear, given[CLEAR_INDEX])
        found.append(own)
    if count > 1:
        normal, clear = graph.components(given[COAT_NORMAL]), [given[COAT]] * COLOURS
        coat = Facets(normal, given[COAT_ROUGHNESS], clear=clear, index=given[COAT_INDEX])
        found.append(coat)
    return found


def visibility(
    graph: Graph, numbers: bpy.types.NodeOutputs, images: LampImages, normal: NodeValue
) -> NodeValue:
    """Fraction of the lamps of each colour that the shaded point sees.

    A white surface shows the faint lamps; without objects in their way they would be as bright
    as their inverse squares of the distance.
    """
    sunlit, code = (graph.term(numbers[name]) for name in (SUNLIT, CODE))
    table, here, facing = LampTable.of(graph, images), place_here(graph), graph.components(normal)

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index)
        lamp = Lamp(lamp.own_place, lamp.axis, 1.0, lamp.profile, 0.0)
        patch = patch_past_lamp(lamp, here, facing, NODES)
        bright = NODES.maximum(patch.cosine, 0.0) / (patch.r * patch.r)
        return (table.colour(index) * bright,)

    (expected,) = summed(graph, table.count - table.virtual, of_lamp)
    seen = light_on_white(graph, normal)
    sun = graph.components(seen)[0] * sunlit
    found = (seen - sun) * (math.pi / code) / NODES.maximum(expected, _DARKEST)
    return NODES.clamp(found, 0.0, 1.0)


def shadow_lamps(like: Sequence[bpy.types.Light]) -> list[bpy.types.Light]:
    """Make the lamps that cast the shadows of the user's; see :func:`write_shadow_lamp`."""
    made = []
    for one in like:
        light = bpy.data.lights.new(NAME, "POINT")
        light.specular_factor = light.transmission_factor = light.volume_factor = 0.0
        light.use_custom_distance, light.cutoff_distance = True, _REACH_OF_SHADOWS
        for name in _OF_SHADOWS:
            setattr(light, name, getattr(one, name))
        made.append(light)
    return made


def write_shadow_lamp(
    light: bpy.types.PointLight, lamp: Lamp, colour: Sequence[float], code: float
) -> None:
    """Give a lamp that casts shadows its colour, its faint intensity and its size."""
    light.color, light.energy = colour, 4.0 * math.pi * code
    light.shadow_soft_size = float(lamp.radius)


def _group(
    name: str,
    inputs: dict[str, str],
    rays: bpy.types.ShaderNodeTree | None,
    *,
    slim: bool,
) -> tuple[bpy.types.ShaderNodeTree, Graph, dict[str, NodeValue]]:
    tree = new_group(name)
    for socket, kind in inputs.items():
        tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind)
    # Clouds besides would need more constants than a shader holds.
    graph = Graph(tree, PART_SIZE, slim=slim, rays=rays, slim_numbers=slim)
    outputs = graph.node("NodeGroupInput").outputs
    return tree, graph, {s.name: graph.term(s) for s in outputs if s.name}


def _finished(
    tree: bpy.types.ShaderNodeTree, graph: Graph, results: dict[str, NodeValue]
) -> bpy.types.ShaderNodeTree:
    for name in results:
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type="NodeSocketVector")
    end = graph.node("NodeGroupOutput").inputs
    for name, result in results.items():
        graph.assign(result, end[name])
    return tree
