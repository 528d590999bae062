"""Lamps in the water as node groups read them: one image, looped over.

A row of the image holds the places of the quadratures; then come two rows for each lamp, and each
that stands for things that throw light back: its numbers and its profile; then, with a margin of
one texel, tables of each triple of bands: the
spread of scattered light, and for each lamp its blurred profile; and a map of how far it shines
into the water. Light in the water, and on things, is computed for three bands at a time. Shadows
on things are EEVEE's own: a lamp of one colour stands for each, so faint beside the sun that it is
not seen on the scene's own materials, and a white surface reads it.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.lamps.angular_spread import (
    ANGLES,
    LENGTHS,
    PROFILE_LENGTHS,
    TILTS,
    Grid,
    WaterSpread,
)
from ..uw_spectral.lamps.lamp import Lamp, lamp_disc, ray_past_lamp
from ..uw_spectral.lamps.lamp_path import NODES as PATH_NODES
from ..uw_spectral.lamps.lamp_path import gauss
from ..uw_spectral.lamps.lamp_shadow import SIDE
from ..uw_spectral.lamps.lamp_surface import carried_forward, patch_past_lamp, surface_irradiance
from ..uw_spectral.lamps.multiple_scattering import (
    BEYOND_NODES,
    MORE_NODES,
    LampWater,
    lamp_light,
)
from ..uw_spectral.lamps.profile import NO_EDGE, Profile, sample_place
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.water.phase import Mixture, PhaseFunction
from .loops import summed
from .node_mathematics import MARK, NODES, Graph, NodeValue, new_group
from .realtime_rays import camera_depth, camera_place, place_here, view_direction, view_distance
from .realtime_shadows import light_on_white
from .texels import closest, texel

NAME = "UW Lamps"
TRIPLE = "Triple"
NORMAL, VISIBILITY = "Normal", "Lamp Visibility"
_BANDS = ("a", "b")
REACH, SUNLIT, CODE = "lamp reach", "lamps beside the sun", "lamp code"
NUMBERS = (REACH, SUNLIT, CODE)
"""Names of the numbers that are the same in every band."""
SAMPLES = 256
CODES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Colours of the lamps that cast shadows; the first is the sun's where it shines."""
NO_SHADOW = (0.0, 0.0, 0.0)
"""In place of the colour of what stands for things."""
_POSITION, _AXIS, _FORM, _COLOUR, _SEEN, _INTENSITY = range(6)
_OF_LAMP = 2  # rows
_QUADRATURES = (PATH_NODES, MORE_NODES, BEYOND_NODES)
_MARGIN = 1
_PATCHES = ANGLES + 2 * _MARGIN  # first column of the irradiance on patches in a tile
_TILE = _PATCHES + 2 + TILTS + 2 * _MARGIN
_SPREAD_ROWS, _PROFILE_ROWS = LENGTHS + 2 * _MARGIN, PROFILE_LENGTHS + 2 * _MARGIN
_SHADOW_ROWS = SIDE + 2 * _MARGIN
_BELOW = _PROFILE_ROWS + _SHADOW_ROWS  # rows of a lamp that come after the spread
_DARKEST = 1e-12
# m; far beyond the reach of a lamp in water. From some 5 km on EEVEE draws no shadow.
_REACH_OF_SHADOWS = 200.0


def band_names(components: Sequence[PhaseFunction]) -> list[str]:
    """Names of the quantities per band."""
    parts = range(len(components)) if len(components) > 1 else ()
    return [f"lamp {name}" for name in _BANDS] + [f"lamp phase {i}" for i in parts]


def of_water(water: LampWater) -> dict[str, NDArray[np.float64]]:
    """Return the quantities per band of a water."""
    values = [getattr(water, name) for name in _BANDS]
    if len(water.phase.components) > 1:
        values += list(water.phase.weights)
    return dict(zip(band_names(water.phase.components), values, strict=True))


def new_image(lamps: int, triples: int) -> bpy.types.Image:
    """Make the image of so many lamps and triples of bands, which are dark."""
    height = 1 + _SPREAD_ROWS + (_OF_LAMP + _BELOW) * lamps
    size = max(SAMPLES, _INTENSITY + triples, _TILE * triples), height
    image = bpy.data.images.new(NAME, *size, alpha=True, float_buffer=True, is_data=True)
    image.alpha_mode = "CHANNEL_PACKED"
    image.use_half_precision = False  # numbers keep their digits
    image[MARK] = True
    return image


def write_lamps(
    image: bpy.types.Image,
    lamps: Sequence[Lamp],
    colours: Sequence[Sequence[float]],
    water: LampWater,
) -> None:
    """Put lamps, the colours of those that cast their shadows, and the water into an image."""
    image.pixels.foreach_set(np.ravel(_pixels(image.size, lamps, colours, water)))
    image.update()
    # A file that is saved now opens with these pixels, without the extension.
    image.pack()


def _pixels(
    size: Sequence[int],
    lamps: Sequence[Lamp],
    colours: Sequence[Sequence[float]],
    water: LampWater,
) -> NDArray[np.float32]:
    width, height = size
    out = np.zeros((height, width, 4), np.float32)
    out[..., 3] = 1.0
    row = np.concatenate([np.transpose(gauss(count)) for count in _QUADRATURES])
    out[0, : len(row), :2] = row
    for index, (lamp, colour) in enumerate(zip(lamps, colours, strict=True)):
        numbers, profile = out[1 + _OF_LAMP * index :][:_OF_LAMP]
        edge = NO_EDGE if lamp.profile.edge is None else lamp.profile.edge
        numbers[_POSITION, :3], numbers[_AXIS, :3] = lamp.position, lamp.axis
        numbers[_FORM, :3] = lamp.radius, edge, lamp.profile.beam
        numbers[_COLOUR, :3], numbers[_SEEN, :3] = colour, (lamp.seen, lamp.thrown, 0.0)
        triples = np.pad(lamp.intensity, (0, -len(lamp.intensity) % 3), mode="edge").reshape(-1, 3)
        numbers[_INTENSITY : _INTENSITY + len(triples), :3] = triples
        profile[:SAMPLES, 0] = lamp.profile.sampled(SAMPLES)
    spread, first = water.spread, 1 + _OF_LAMP * len(lamps)
    assert isinstance(spread, WaterSpread)
    _put(out[first:], 0, spread.deflection.values)
    _put(out[first:], _PATCHES, spread.on_patches.values)
    for index, lamp in enumerate(lamps):
        row = first + _SPREAD_ROWS + _BELOW * index
        _put(out[row:], 0, spread.profile(lamp.profile).values)
        if lamp.shadow is not None:
            assert isinstance(lamp.shadow, Grid)
            _put(out[row + _PROFILE_ROWS :], 0, lamp.shadow.values)
    return out


def _put(out: NDArray[np.float32], column: int, values: NDArray[np.float64]) -> None:
    """Lay a table of n bands, with its margin, into the tiles of their triples."""
    rows, columns, n = values.shape
    sides = (_MARGIN, _MARGIN)
    padded = np.pad(values, (sides, sides, (0, -n % 3)), mode="edge")
    for triple in range(padded.shape[2] // 3):
        start = triple * _TILE + column
        width = columns + 2 * _MARGIN
        tile = out[: rows + 2 * _MARGIN, start : start + width, :3]
        tile[:] = padded[..., 3 * triple : 3 * triple + 3]


@dataclass(frozen=True, eq=False)
class _ImageProfile(Profile):
    """The profile of a lamp in the image."""

    graph: Graph
    image: bpy.types.Image
    row: NodeValue
    edge_cosine: NodeValue
    beam_cosine: NodeValue
    blurred: NodeValue

    @property
    def edge(self) -> NodeValue:
        return self.edge_cosine

    @property
    def beam(self) -> NodeValue:
        return self.beam_cosine

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        place = m.minimum(sample_place(cosine, SAMPLES, m), SAMPLES - 1.001)
        below = self.graph.operation("FLOOR", (place,))
        one, other = (
            self.graph.components(closest(self.graph, self.image, column, self.row))[0]
            for column in (below, below + 1.0)
        )
        return one + (place - below) * (other - one)


@dataclass(frozen=True, eq=False)
class _ImageGrid:
    """A table of three bands in the image; its corner, margin included."""

    graph: Graph
    image: bpy.types.Image
    column: NodeValue | float
    row: NodeValue | float

    def at(self, column: Operand, row: Operand) -> NodeValue:
        h, v = self.column + _MARGIN + column, self.row + _MARGIN + row
        return texel(self.graph, self.image, h, v, *self.image.size)


class _ImageShadow(_ImageGrid):
    """The map of a lamp's shadows in the image: one number, the same in every band."""

    def at(self, column: Operand, row: Operand) -> NodeValue:
        return self.graph.components(super().at(column, row))[0]


@dataclass(frozen=True, eq=False)
class _ImageSpread:
    """The tables of a triple in the image, the spread of scattered light from a row on."""

    graph: Graph
    image: bpy.types.Image
    triple: NodeValue
    row: float

    @property
    def deflection(self) -> _ImageGrid:
        return self._grid(0.0, self.row)

    @property
    def on_patches(self) -> _ImageGrid:
        return self._grid(float(_PATCHES), self.row)

    def profile(self, profile: Profile) -> _ImageGrid:
        assert isinstance(profile, _ImageProfile)
        return self._grid(0.0, profile.blurred)

    def _grid(self, column: float, row: NodeValue | float) -> _ImageGrid:
        return _ImageGrid(self.graph, self.image, self.triple * float(_TILE) + column, row)


@dataclass(frozen=True, eq=False)
class LampTable:
    """Look-ups in the image in a node tree."""

    graph: Graph
    image: bpy.types.Image

    @property
    def count(self) -> int:
        """Number of lamps."""
        return (self.image.size[1] - 1 - _SPREAD_ROWS) // (_OF_LAMP + _BELOW)

    def spread(self, triple: NodeValue) -> _ImageSpread:
        """Return the spread of scattered light in three bands."""
        return _ImageSpread(self.graph, self.image, triple, 1.0 + _OF_LAMP * self.count)

    def colour(self, index: NodeValue) -> NodeValue:
        """Return the colour of the lamp that casts the shadows of one."""
        return self._at(_COLOUR, self._row(index))

    def lamp(self, index: NodeValue, triple: NodeValue | None = None) -> Lamp:
        """Return a lamp, in three bands or of intensity 1."""
        row = self._row(index)
        position, axis, form = (
            self.graph.components(self._at(column, row)) for column in (_POSITION, _AXIS, _FORM)
        )
        radius, edge, beam = form
        first = 1.0 + _OF_LAMP * self.count + _SPREAD_ROWS
        blurred = index * float(_BELOW) + first
        shadow = _ImageShadow(self.graph, self.image, 0.0, blurred + float(_PROFILE_ROWS))
        profile = _ImageProfile(self.graph, self.image, row + 1.0, edge, beam, blurred)
        intensity = 1.0 if triple is None else self._at(triple + float(_INTENSITY), row)
        seen, thrown, _ = self.graph.components(self._at(_SEEN, row))
        return Lamp(position, axis, intensity, profile, radius, seen, shadow, thrown)

    def integrate(
        self, count: int, term: Callable[[Operand, Operand], tuple[Operand, ...]]
    ) -> tuple[NodeValue, ...]:
        """Add up terms of the places of a quadrature, as :func:`.gauss_sum` does."""
        first = float(sum(_QUADRATURES[: _QUADRATURES.index(count)]))

        def of_place(index: NodeValue) -> tuple[NodeValue, ...]:
            place, share, _ = self.graph.components(self._at(index + first, 0.0))
            return term(place, share)

        return summed(self.graph, count, of_place)

    def _at(self, column: NodeValue | float, row: NodeValue | float) -> NodeValue:
        return closest(self.graph, self.image, column, row)

    def _row(self, index: NodeValue) -> NodeValue:
        return index * float(_OF_LAMP) + 1.0


def build_path(
    components: Sequence[PhaseFunction],
    image: bpy.types.Image,
    *,
    ahead: bool,
    rays: bpy.types.ShaderNodeTree | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the light of lamps in the water before a thing, or up to the boundary.

    Output: radiance of three bands, the lamps themselves included.
    """
    more = {"y_f": "NodeSocketFloat"} if ahead else {}
    tree, graph, given = _group(f"{NAME} in the Water", components, more, rays)
    table = LampTable(graph, image)
    water = _water(given, components, table)
    w = view_direction(graph)
    if ahead:
        origin = camera_place(graph)
        P = distance_in_water(camera_depth(graph), -w[2], given["y_f"], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index, given[TRIPLE])
        ray = ray_past_lamp(lamp, origin, w, P, NODES, before_thing=not ahead)
        once, more = lamp_light(lamp, ray, water, NODES, table.integrate)
        return (once + more + lamp_disc(lamp, ray, water.c, NODES),)

    return _finished(tree, graph, summed(graph, table.count, of_lamp)[0])


def build_patch(
    components: Sequence[PhaseFunction],
    image: bpy.types.Image,
    rays: bpy.types.ShaderNodeTree | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the irradiance of lamps on a thing, in three bands."""
    kinds: dict[str, str] = dict.fromkeys((NORMAL, VISIBILITY), "NodeSocketVector")
    tree, graph, given = _group(f"{NAME} on Things", components, kinds, rays)
    table = LampTable(graph, image)
    water = _water(given, components, table)
    here, normal = place_here(graph), graph.components(given[NORMAL])

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = table.lamp(index, given[TRIPLE])
        patch = patch_past_lamp(lamp, here, normal, NODES)
        direct, forward, diffuse = surface_irradiance(lamp, patch, water, NODES)
        seen = given[VISIBILITY].dot(table.colour(index)) + lamp.thrown
        return ((direct + forward) * seen + diffuse,)

    return _finished(tree, graph, summed(graph, table.count, of_lamp)[0])


def build_carried(
    components: Sequence[PhaseFunction],
    image: bpy.types.Image,
    rays: bpy.types.ShaderNodeTree | None = None,
) -> bpy.types.ShaderNodeTree:
    """Build the group of the share of a thing's light that arrives scattered, in three bands."""
    tree, graph, given = _group(f"{NAME} from Things", components, {}, rays)
    water = _water(given, components, LampTable(graph, image))
    return _finished(tree, graph, carried_forward(view_distance(graph), water, NODES))


def visibility(
    graph: Graph, numbers: bpy.types.NodeOutputs, image: bpy.types.Image, normal: NodeValue
) -> NodeValue:
    """Share of the lamps of each colour that the shaded point sees.

    A white surface shows the faint lamps; without things in their way they would be as bright
    as their inverse squares of the distance.
    """
    sunlit, code = (graph.term(numbers[name]) for name in (SUNLIT, CODE))
    table, here, facing = LampTable(graph, image), place_here(graph), graph.components(normal)

    def of_lamp(index: NodeValue) -> tuple[NodeValue]:
        lamp = dataclasses.replace(table.lamp(index), radius=0.0)
        patch = patch_past_lamp(lamp, here, facing, NODES)
        bright = NODES.maximum(patch.cosine, 0.0) / (patch.r * patch.r)
        return (table.colour(index) * bright,)

    (expected,) = summed(graph, table.count, of_lamp)
    seen = light_on_white(graph, normal)
    sun = graph.components(seen)[0] * sunlit
    found = (seen - sun) * (math.pi / code) / NODES.maximum(expected, _DARKEST)
    return NODES.clamp(found, 0.0, 1.0)


def shadow_lamps(count: int) -> list[bpy.types.Light]:
    """Make the lamps that cast the shadows; see :func:`write_shadow_lamp`."""
    made = []
    for _ in range(count):
        light = bpy.data.lights.new(NAME, "POINT")
        light.specular_factor = light.transmission_factor = light.volume_factor = 0.0
        light.use_custom_distance, light.cutoff_distance = True, _REACH_OF_SHADOWS
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
    components: Sequence[PhaseFunction],
    more: dict[str, str],
    rays: bpy.types.ShaderNodeTree | None,
) -> tuple[bpy.types.ShaderNodeTree, Graph, dict[str, NodeValue]]:
    tree = new_group(name)
    kinds = dict.fromkeys((TRIPLE, REACH), "NodeSocketFloat")
    kinds |= dict.fromkeys(band_names(components), "NodeSocketVector") | more
    for socket, kind in kinds.items():
        tree.interface.new_socket(socket, in_out="INPUT", socket_type=kind)
    graph = Graph(tree, rays=rays)
    outputs = graph.node("NodeGroupInput").outputs
    return tree, graph, {s.name: graph.term(s) for s in outputs if s.name}


def _finished(
    tree: bpy.types.ShaderNodeTree, graph: Graph, result: NodeValue
) -> bpy.types.ShaderNodeTree:
    tree.interface.new_socket("Light", in_out="OUTPUT", socket_type="NodeSocketVector")
    graph.assign(result, graph.node("NodeGroupOutput").inputs[0])
    return tree


def _water(
    given: dict[str, NodeValue], components: Sequence[PhaseFunction], table: LampTable
) -> LampWater:
    a, b = (given[f"lamp {name}"] for name in _BANDS)
    weights: tuple[Operand, ...] = (1.0,)
    if len(components) > 1:
        weights = tuple(given[f"lamp phase {i}"] for i in range(len(components)))
    spread = table.spread(given[TRIPLE])
    return LampWater(a, b, a + b, Mixture(tuple(components), weights), spread, given[REACH])
