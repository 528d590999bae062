"""The image of lamps in the water: where what stands in it, and how it is written.

The first row holds the places of the quadratures and the numbers of the water; then
come, with a margin of one texel, the tables of the spread of scattered light; and a block for each
lamp, and each that stands for objects that throw light back: its numbers, its profile, its tables
over the length of a path (:mod:`..uw_spectral.lamps.lamp_channels`), its blurred profiles and a map
of how far it shines into the water. All light is in three channels.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.angular_spread import (
    ANGLES,
    LENGTHS,
    PROFILE_ANGLES,
    PROFILE_LENGTHS,
    WaterSpread,
)
from ..uw_spectral.lamps.lamp import Lamp
from ..uw_spectral.lamps.lamp_channels import COLOURS, FLOATING, ChannelLamp, LampChannels
from ..uw_spectral.lamps.lamp_channels import LENGTHS as SAMPLES
from ..uw_spectral.lamps.lamp_path import NODES as PATH_NODES
from ..uw_spectral.lamps.lamp_path import fewer, gauss
from ..uw_spectral.lamps.lamp_shadow import DISTANCES, PART_SIDE, SIDE, SOFT_SIDE
from ..uw_spectral.lamps.multiple_scattering import MORE_NODES, LampField
from ..uw_spectral.lamps.profile import NO_EDGE, LampProfile
from ..uw_spectral.lamps.representative_bands import COUNT as BANDS
from ..uw_spectral.lamps.virtual_point_lights import COUNT as PARTS
from ..uw_spectral.table import Table
from . import lamp_sources
from .image_table import MARGIN, Tiles, write_tiles
from .texture_atlas import number_image

NAME = "UW Lamps"
_NUMBERS_PART, _SOURCES_PART = "uw_lamps", "uw_lamp_sources"
# Custom properties of the image.
_PARTS, MEASURED_KEY, FROM_AIR_KEY = "uw_parts", "uw_measured", "uw_from_air"
VIRTUAL_KEY, _EXCITING, _FLOATING = "uw_thrown", "uw_exciting", "uw_floating"
INELASTIC_KEY, _PLACES = "uw_inelastic", "uw_places"
_ROWS = _PARTS, MEASURED_KEY, _EXCITING, _FLOATING, INELASTIC_KEY
QUADRATURES = (PATH_NODES, MORE_NODES, fewer(PATH_NODES), fewer(MORE_NODES))
_NUMBERS = sum(QUADRATURES)  # first column after them
EXTENT, IN_WATER, ON_SURFACES, WIDE, SCALES = range(_NUMBERS, _NUMBERS + 5)
POSITION, AXIS, FORM, COLOUR, SEEN, STANDS, DRY, FIRST_PART = range(8)
DECAY, ONWARD = (FIRST_PART + 3 * PARTS + i for i in range(2))
PROFILE_ROW, PROJECTED_ROW = 1, 2  # rows of a block; its numbers are in the first
SPREAD, SPREAD_ROWS = 1, LENGTHS + 2 * MARGIN
PATCHES = ANGLES + 2 * MARGIN  # first column of the irradiance on patches
_PROFILE_COLUMNS = PROFILE_ANGLES + 2 * MARGIN
SHADOW = _PROFILE_COLUMNS  # first column of the map of shadows
PART_COLUMNS = PART_SIDE + 2 * MARGIN
SOFT = SHADOW + SIDE + 2 * MARGIN  # that of the maps of scattered light, side by side
SOFT_COLUMNS = SOFT_SIDE + 2 * MARGIN
_FLOATING_ROWS = FLOATING + 2 * MARGIN
SOFT_TILES = Tiles(columns=SOFT_COLUMNS)
PARTS_ROW = SOFT_COLUMNS  # of maps of parts of lit objects, below those of scattered light
PART_TILES = Tiles(PART_COLUMNS, PART_COLUMNS, across=3)
_TABLE_ROWS = max(PROFILE_LENGTHS, SIDE) + 2 * MARGIN
_WIDTH = max(
    SAMPLES, SCALES + 1, SOFT + DISTANCES * SOFT_COLUMNS, PATCHES + 3 + 2 * MARGIN, _FLOATING_ROWS
)
_UNHIDDEN = np.tile((1.0, 0.0), (DISTANCES, SOFT_SIDE, SOFT_SIDE, 1))
_LEAST_RADIUS = 1e-3  # m


@dataclass(frozen=True, eq=False)
class LampImages:
    """What lamps are looked up in."""

    numbers: bpy.types.Image  #: Of :func:`new_images`.
    sources: bpy.types.Image  #: Of :func:`.lamp_sources.new_image`.

    @property
    def parts(self) -> dict[str, bpy.types.ID]:
        """Both, by the names of :func:`images_in`."""
        return {_NUMBERS_PART: self.numbers, _SOURCES_PART: self.sources}


def images_in(parts: Mapping[str, bpy.types.ID]) -> LampImages | None:
    """Return the images of a water, if lamps shine in it."""
    numbers, sources = parts.get(_NUMBERS_PART), parts.get(_SOURCES_PART)
    return LampImages(numbers, sources) if numbers is not None else None


@dataclass(frozen=True)
class LampRows:
    """Rows of a lamp's block.

    Of so many parts of the phase function, measured reflectances, bands that excite, of the table
    of what floats, and of what is emitted at a place if any lamps stand for light of changed
    wavelength.
    """

    parts: int
    measured: int
    exciting: int
    floating: int
    inelastic: int

    @classmethod
    def of(cls, image: bpy.types.Image) -> LampRows:
        """Return those of an image of numbers."""
        return cls(*(image[name] for name in _ROWS))

    @classmethod
    def of_parts(
        cls,
        parts: int,
        measured: int = 0,
        *,
        exciting: bool = False,
        in_clouds: bool = False,
        inelastic: int = 0,
    ) -> LampRows:
        """Return those of light that may excite fluorophores, and be scattered in clouds.

        ``inelastic`` are how many lamps stand for light of changed wavelength, after all others.
        """
        return cls(parts, measured, BANDS * exciting, _FLOATING_ROWS * in_clouds, inelastic)

    @functools.cached_property
    def first(self) -> dict[str, int]:
        """First row of each of its tables in a block, and how many rows that has."""
        rows = {
            "scattered": self.parts,
            "unscattered": 1,
            "in water": BANDS,
            "coloured": BANDS * (COLOURS + self.measured),
            "exciting": self.exciting,
            "floating": self.floating,
            "maps": _TABLE_ROWS,
            "onward": SPREAD_ROWS * bool(self.inelastic),
            "all": 0,
        }
        first = itertools.accumulate(rows.values(), initial=PROJECTED_ROW)
        return dict(zip(rows, first, strict=False))


def new_images(
    lamps: int, profiles: int, rows: LampRows, virtual: int = 0, *, from_air: bool = False
) -> LampImages:
    """Make the images of so many lamps, which are dark; the ``virtual`` ones of them come last.

    They have so many profiles; some may shine in ``from_air``.
    """
    height = SPREAD + SPREAD_ROWS + rows.first["all"] * (lamps + rows.inelastic)
    image = number_image(NAME, _WIDTH, height, half=False)
    for name, count in zip(_ROWS, dataclasses.astuple(rows), strict=True):
        image[name] = count
    image[FROM_AIR_KEY], image[VIRTUAL_KEY], image[_PLACES] = from_air, virtual, profiles
    return LampImages(image, lamp_sources.new_image(profiles + rows.inelastic))


def write_lamps(
    images: LampImages, projected: LampChannels, colours: Sequence[Sequence[float]]
) -> None:
    """Put lamps and their water into images of their size.

    The colours are those of the lamps that cast the shadows of each; :data:`.NO_SHADOW` where
    nothing is in the way.
    """
    image = images.numbers
    profiles = list(dict.fromkeys(lamp.profile for lamp in projected.lamps))
    # What stands for light of changed wavelength has a place of its own after these.
    first = int(image[_PLACES]) - len(projected.lamps) + int(image[INELASTIC_KEY])
    made = [(index, one.inelastic) for index, one in enumerate(projected.projected)]
    changed = {index: one.source for index, one in made if one is not None}
    own = {index: first + index for index in changed}
    sources = {own[index]: source for index, source in changed.items()}
    lamp_sources.write(images.sources, *_fields(projected), profiles, sources)
    image.pixels.foreach_set(np.ravel(_pixels(image, projected, colours, profiles, own)))
    image.update()


def _pixels(
    image: bpy.types.Image,
    projected: LampChannels,
    colours: Sequence[Sequence[float]],
    profiles: Sequence[LampProfile],
    own: Mapping[int, int],
) -> NDArray[np.float32]:
    """Texels; ``own`` are places of lamps' sources that are not those of their profiles."""
    width, height = image.size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    row = np.concatenate([np.transpose(gauss(count)) for count in QUADRATURES])
    in_water, on_surfaces = projected.in_water, projected.on_surfaces
    out[0, : len(row), :2] = row
    out[0, EXTENT, :2] = projected.stretch, in_water.reach
    out[0, SCALES, :2] = [field.harmonics.scale for field in _fields(projected)]
    out[0, IN_WATER, :3], out[0, ON_SURFACES, :3] = in_water.b, on_surfaces.b
    out[0, WIDE, :3] = in_water.wide
    in_spread, on_spread = in_water.spread, on_surfaces.spread
    assert isinstance(in_spread, WaterSpread)
    assert isinstance(on_spread, WaterSpread)
    write_tiles(out[SPREAD:], in_spread.narrow.values)
    write_tiles(out[SPREAD:, PATCHES:], on_spread.on_patches.values)
    first, rows = SPREAD + SPREAD_ROWS, LampRows.of(image)
    for index, (lamp, tables) in enumerate(zip(projected.lamps, projected.projected, strict=True)):
        row = first + rows.first["all"] * index
        block = out[row:][: rows.first["all"]]
        place = own.get(index, profiles.index(lamp.profile))
        _put_lamp(block, lamp, tables, colours[index], place)
        if (made := tables.inelastic) is not None:
            assert isinstance(made.onward, Table)
            block[0, DECAY, :3] = made.decay
            block[0, ONWARD, :2] = 1.0, row + rows.first["onward"]
            write_tiles(block[rows.first["onward"] :], made.onward.values)
        elif rows.inelastic:
            block[0, ONWARD, :2] = 0.0, SPREAD
        maps = block[rows.first["maps"] :]
        write_tiles(maps, on_spread.profile(lamp.profile).values)
        if lamp.shadow is not None:
            assert isinstance(lamp.shadow, Table)
            write_tiles(maps[:, SHADOW:], lamp.shadow.values)
        if projected.floats:
            write_tiles(block[rows.first["floating"] :], tables.floating)
        for place, part in enumerate(lamp.known_parts):
            if part.shadow is not None:
                assert isinstance(part.shadow, Table)
                column, row = (int(x) for x in PART_TILES.corner(place))
                write_tiles(maps[PARTS_ROW + row :, SOFT + column :], part.shadow.values)
        assert lamp.soft is None or isinstance(lamp.soft, Table)
        soft = _UNHIDDEN if lamp.soft is None else lamp.soft.values[..., 0]
        write_tiles(maps[:, SOFT:], soft, (SOFT_TILES,))
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
    numbers[POSITION, :3], numbers[AXIS, :3] = lamp.position, lamp.axis
    numbers[FORM, :3] = lamp.radius, edge, source
    unblocked = max(lamp.virtual, lamp.unblocked)
    numbers[COLOUR, :3], numbers[SEEN, :3] = colour, (lamp.seen, lamp.virtual, unblocked)
    numbers[STANDS, :3], numbers[DRY, 0] = lamp.own_place, lamp.dry
    for index, part in enumerate(lamp.known_parts):
        place = FIRST_PART + 3 * index
        numbers[place, :3], numbers[place + 2, :3] = part.position, part.fraction
        # One texel has both: a direction has no length.
        numbers[place + 1, :3] = np.array(part.axis) * max(float(part.radius), _LEAST_RADIUS)
    block[PROFILE_ROW, :SAMPLES, 0] = lamp.profile.sampled(SAMPLES)
    coloured = projected.coloured.reshape(-1, SAMPLES, 3)
    tables = [
        projected.scattered, projected.unscattered[None], projected.in_water, coloured,
        projected.exciting,
    ]  # fmt: skip
    rows = np.concatenate(tables)
    block[PROJECTED_ROW : PROJECTED_ROW + len(rows), :SAMPLES, :3] = rows
