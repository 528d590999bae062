"""Node group of what clouds before a pixel do to it; formulas of uw_spectral/clouds."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, override

import bpy
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.clouds.cloud_light import Clouds, Together
from ..uw_spectral.clouds.cloud_numbers import ESCAPES, ESCAPING, CloudNumbers, Veil
from ..uw_spectral.clouds.cloud_shadow import daylit_fractions
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.table import Table
from ..uw_spectral.transfer.pixel_parts import OcclusionFactor, OcclusionOnPath
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.water.phase import PhaseFunction
from . import cloud_grids
from .chance import chance
from .data_blocks import write_pixels
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .image_table import ImageTable
from .loops import followed, summed
from .node_mathematics import NODES, PART_SIZE, Graph, NodeValue
from .realtime_lamps import CloudsOf, LampShape
from .realtime_rays import camera_place, place_here, view_direction, view_distance
from .realtime_values import FLOOR_DEPTH, FRAME, SUN, Values
from .shape import Shape, Sources, TermShape
from .texture_atlas import closest, number_image

NAME, PART = "UW Clouds", "uw_clouds"
GRIDS, GRID_LAMPS = "uw_cloud_grids", "uw_cloud_lamps"
"""Parts of clouds with grids, and of what is between these and lamps."""
UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD = (
    "Unscattered", "Passed", "Light", "Middle", "Forward",
)  # fmt: skip
SUNLIT, DAYLIT, RATE = "Sunlit", "Daylit", "Rate"
SUNLIGHT, SKYLIGHT = "Sunlight", "Skylight"
_OUTPUTS = (UNSCATTERED, PASSED, LIGHT, MIDDLE, FORWARD, SUNLIT, DAYLIT)
# Texels of a cloud: single numbers, three to each, and how many the other fields take.
_SINGLE = ("reference", "asymmetry", "ceiling", "peak", "kind")
_OF_PLACE = {"middle": 1, "rows": 3}
_TRIPLES = {
    field.name: _OF_PLACE.get(field.name, 1)
    for field in fields(CloudNumbers)
    if field.name not in (*_SINGLE, "escapes", "grid")
}
_FIRST = -(-len(_SINGLE) // 3)  # texels of single numbers
_ESCAPES = _FIRST + sum(_TRIPLES.values())
_WIDTH = _ESCAPES + ESCAPES.count


@dataclass(frozen=True)
class CloudShape(TermShape):
    """Clouds float in the water: the phase functions of those of blobs, and of those of grids."""

    blobs: tuple[PhaseFunction, ...] = ()
    grids: tuple[PhaseFunction, ...] = ()

    @property
    def all(self) -> tuple[PhaseFunction, ...]:
        """Of all clouds."""
        return self.blobs + self.grids

    @override
    def parts(self, shape: Shape) -> dict[str, bpy.types.ID]:
        found: dict[str, bpy.types.ID] = {}
        if self.blobs:
            found[PART] = new_image(len(self.blobs))
        if self.grids:
            found[GRIDS] = cloud_grids.new_image(len(self.grids))
            if LampShape in shape:
                lamps = shape.of(LampShape)
                count = lamps.count - lamps.virtual
                found[GRID_LAMPS] = cloud_grids.new_lamp_image(len(self.grids), count)
        return found


def build(shape: Shape, sources: Sources, *, ahead: bool) -> bpy.types.ShaderNodeTree:
    """Build the group of clouds before an object, or ``ahead``, up to the boundary.

    Its input :data:`RATE` is that of :func:`.daylit_fractions`. Before an object it has the outputs
    :data:`SUNLIGHT` and :data:`SKYLIGHT`: fractions of the sun's and of other light that clouds
    leave on the object.
    """
    names = _OUTPUTS if ahead else (*_OUTPUTS, SUNLIGHT, SKYLIGHT)
    outputs: dict[str, str] = dict.fromkeys(names, VECTOR)
    outputs[MIDDLE] = FLOAT
    group = OpenGroup(NAME, {RATE: FLOAT}, outputs, **options(shape, sources))
    graph = group.graph
    found = Values(graph, sources.values, shape)
    clouds, w = clouds_in(graph, sources, shape), view_direction(graph)
    if ahead:
        origin = camera_place(graph, found.of(*FRAME))
        y_o = NODES.maximum(-origin[2], 0.0)
        P = distance_in_water(y_o, -w[2], found[FLOOR_DEPTH], NODES)
    else:
        P = view_distance(graph)
        origin = [x - along * P for x, along in zip(place_here(graph), w, strict=True)]

    def add_up(count: int, terms: object) -> tuple[NodeValue, ...]:
        return summed(graph, count, terms)  # pyright: ignore[reportArgumentType]

    follow = functools.partial(followed, graph)
    rate, drawn = group.given[RATE], chance(graph, w)[0]
    daylit = daylit_fractions(clouds, origin, w, P, rate, drawn, add_up)
    veil = clouds.veil(origin, w, P, half_angle2(w, found.of(*SUN), NODES), add_up, follow)
    results: dict[str, Operand] = {
        UNSCATTERED: veil.unscattered,
        PASSED: veil.passed,
        LIGHT: veil.light,
        MIDDLE: veil.middle,
        FORWARD: veil.forward,
        SUNLIT: daylit[0],
        DAYLIT: daylit[1],
    }
    if not ahead:
        results[SUNLIGHT] = clouds.sunlight_transmittance(place_here(graph))
        results[SKYLIGHT] = clouds.skylight_transmittance(place_here(graph))
    return group.finished(results)


def veil_of(found: dict[str, NodeValue]) -> Veil:
    """Return the veil from the outputs of the group."""
    return Veil(*(found[name] for name in _OUTPUTS))


def shadowed(occlusion: OcclusionOnPath, found: dict[str, NodeValue]) -> OcclusionOnPath:
    """Return what is left of a path's light in the shadows of clouds, if there are any."""
    if not found:
        return occlusion
    factor, here = occlusion.scattered, found[DAYLIT]
    scattered = OcclusionFactor(
        factor.mean * here, None if factor.fraction is None else factor.fraction * here
    )
    return OcclusionOnPath(scattered, occlusion.single * found[SUNLIT])


def new_image(count: int) -> bpy.types.Image:
    """Make the image of the numbers of so many clouds."""
    image = number_image(NAME, _WIDTH, count)
    image.use_half_precision = False  # numbers keep their digits
    return image


def write_clouds(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put the numbers of clouds into an image of their size."""
    out = np.zeros((len(clouds), _WIDTH, 4), np.float32)
    out[..., 3] = 1.0
    for row, cloud in zip(out, clouds, strict=True):
        row[:_ESCAPES, :3] = _texels(cloud)
        if cloud.escapes is not None:
            assert isinstance(cloud.escapes, Table)
            row[_ESCAPES:, :3] = cloud.escapes.values
    write_pixels(image, out)


def write_grids(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put the numbers of clouds with grids, and these, into an image of their number."""
    cloud_grids.write(image, [(_texels(cloud), cloud.grid) for cloud in clouds])


def write_lamps(image: bpy.types.Image, clouds: Sequence[CloudNumbers]) -> None:
    """Put what is between grids and lamps into an image of their numbers."""
    cloud_grids.write_lamps(image, [cloud.grid for cloud in clouds])


def _texels(cloud: CloudNumbers) -> NDArray[np.float64]:
    """Return what all clouds have, three numbers each."""
    single = [getattr(cloud, name) for name in _SINGLE] + [0.0] * (3 * _FIRST - len(_SINGLE))
    values = [np.ravel(getattr(cloud, name)) for name in _TRIPLES]
    return np.reshape(np.concatenate([single, *values]), (-1, 3))


def _read(graph: Graph, image: bpy.types.Image, row: NodeValue | float) -> CloudNumbers:
    """Look up what all clouds have in a row of an image."""
    texels = [closest(graph, image, float(i), row) for i in range(_ESCAPES)]
    first = _FIRST
    single = [x for place in texels[:first] for x in graph.components(place)]
    parts: dict[str, Operand] = dict(zip(_SINGLE, single, strict=False))
    for name, size in _TRIPLES.items():
        found = texels[first : first + size]
        first += size
        parts[name] = found[0]
        if name in _OF_PLACE:
            parts[name] = [x for place in found for x in graph.components(place)]
    return CloudNumbers(**parts)


@dataclass(frozen=True, eq=False)
class CloudTable:
    """Clouds in an image of :func:`new_image`, in a node tree; a :class:`.Group`.

    One is read where it is needed; several are looped over, so that what is compiled does not grow
    with their number.
    """

    graph: Graph
    image: bpy.types.Image

    @property
    def count(self) -> int:
        """Number of clouds."""
        return int(self.image.size[1])

    def total(self, terms: Callable[[CloudNumbers], Sequence[Operand]]) -> Sequence[Operand]:
        """Add up terms of each."""
        if self.count == 1:
            return terms(self._cloud(0.0))
        return summed(self.graph, self.count, lambda index: terms(self._cloud(index)))

    def product(self, factor: Callable[[CloudNumbers], Operand]) -> Operand:
        """Multiply channels of each, which are positive."""
        if self.count == 1:
            return factor(self._cloud(0.0))

        def logarithms(index: NodeValue) -> Sequence[NodeValue]:
            return [NODES.log(x) for x in self.graph.components(factor(self._cloud(index)))]

        return NODES.exp(self.graph.vector(*summed(self.graph, self.count, logarithms)))

    @property
    def alone(self) -> bool:
        """Whether there is one only."""
        return self.count == 1

    @property
    def grids(self) -> Sequence[CloudNumbers]:
        """None of them."""
        return ()

    def _cloud(self, index: NodeValue | float) -> CloudNumbers:
        found = _read(self.graph, self.image, index)
        escapes = ImageTable(self.graph, self.image, ESCAPING, float(_ESCAPES), index, margin=0)
        return replace(found, escapes=escapes)


def clouds_in(graph: Graph, sources: Sources, shape: Shape) -> Clouds:
    """Return the clouds in a node tree."""
    sun = Values(graph, sources.values, shape).of(*SUN)
    blobs, grids = (sources.parts.get(name) for name in (PART, GRIDS))
    group = None if blobs is None else CloudTable(graph, blobs)
    if grids is not None:
        lamps = shape.of(LampShape)
        count = lamps.count - lamps.virtual
        group = Together(group, grids_in(graph, grids, sources.parts.get(GRID_LAMPS), count))
    assert group is not None, "there are clouds"
    return Clouds(group, kinds(shape.of(CloudShape).all), sun, NODES)


def grids_in(
    graph: Graph, image: bpy.types.Image, of_lamps: bpy.types.Image | None = None, lamps: int = 0
) -> list[CloudNumbers]:
    """Return the clouds with grids in an image, in a node tree; arguments of :func:`.grid`."""
    found = []
    for index in range(cloud_grids.count(image)):
        numbers = _read(graph, image, cloud_grids.row(index))
        box = cloud_grids.grid(graph, image, index, of_lamps, lamps)
        found.append(replace(numbers, grid=box))
    return found


def for_lamps(sources: Sources, shape: Shape) -> CloudsOf | None:
    """Return what makes the clouds that lamps shine on; None where there are none."""
    if CloudShape not in shape:
        return None
    return functools.partial(clouds_in, sources=sources, shape=shape)


def options(shape: Shape, sources: Sources) -> dict[str, Any]:
    """Return how the graph of a large group is made.

    Clouds and lamps together need most of the constants that a shader holds: they have to be few.
    """
    slim = CloudShape in shape and LampShape in shape
    return {"part_size": PART_SIZE, "slim": slim, "slim_numbers": slim, "rays": sources.rays}


def kinds(phases: Sequence[PhaseFunction]) -> list[PhaseFunction]:
    """Return the phase functions of clouds, each once; its place is the kind of a cloud."""
    found: list[PhaseFunction] = []
    for phase in phases:
        found += [] if phase in found else [phase]
    return found
