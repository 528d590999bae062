"""Clouds in the water as a term of a pixel, and the group of what they do to it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import override

import bpy

from ..uw_spectral.clouds.cloud_light import Clouds, Several
from ..uw_spectral.clouds.cloud_numbers import Veil
from ..uw_spectral.clouds.cloud_shadow import daylit_fractions
from ..uw_spectral.clouds.veiled_pixel import surroundings, veiled
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.pixel_parts import ChannelPixel, OcclusionFactor, OcclusionOnPath
from ..uw_spectral.transfer.radiance_field import distance_in_water
from ..uw_spectral.transfer.sun_beam import half_angle2
from ..uw_spectral.water.phase import PhaseFunction
from . import cloud_grids, cloud_table
from .chance import chance
from .cloud_table import GRID_LAMPS, GRIDS, NAME, PART, CloudTable
from .group_sockets import FLOAT, VECTOR, OpenGroup
from .lamp_term import LampShape
from .loops import followed, summed
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_rays import camera_place, place_here, view_direction, view_distance
from .realtime_values import FLOOR_DEPTH, FRAME, SUN, Values
from .realtime_water import in_group, options
from .shape import Shape, Sources, TermShape
from .surface_inputs import COVERAGE

_RATE, _SUNLIGHT, _SKYLIGHT = "Rate", "Sunlight", "Skylight"
_OF_VEIL = tuple(field.name.title() for field in fields(Veil))


@dataclass(frozen=True)
class CloudShape(TermShape):
    """Clouds float in the water: the phase functions of those of blobs, and of those of grids."""

    large = True

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
            found[PART] = cloud_table.new_image(len(self.blobs))
        if self.grids:
            found[GRIDS] = cloud_grids.new_image(len(self.grids))
            if LampShape in shape:
                lamps = shape.of(LampShape)
                count = lamps.count - lamps.virtual
                found[GRID_LAMPS] = cloud_grids.new_lamp_image(len(self.grids), count)
        return found

    @override
    def matter(self, shape: Shape, sources: Sources) -> Callable[[Graph], Clouds]:
        return functools.partial(clouds_in, sources=sources, shape=shape)

    @override
    def in_pixel(self, pixel: Pixel) -> TermPixel:
        return _CloudPixel(pixel)


def clouds_in(graph: Graph, sources: Sources, shape: Shape) -> Clouds:
    """Return the clouds in a node tree."""
    sun = Values(graph, sources.values, shape).of(*SUN)
    blobs, grids = (sources.parts.get(name) for name in (PART, GRIDS))
    group = None if blobs is None else CloudTable(graph, blobs)
    if grids is not None:
        lamps = shape.of(LampShape)
        count = lamps.count - lamps.virtual
        of_lamps = sources.parts.get(GRID_LAMPS)
        group = Several(cloud_table.grids_in(graph, grids, of_lamps, count), group)
    assert group is not None, "there are clouds"
    return Clouds(group, cloud_table.kinds(shape.of(CloudShape).all), sun, NODES)


class _CloudPixel(TermPixel):
    """What clouds leave of light on an object and on the path, and their veil before both."""

    def __init__(self, pixel: Pixel) -> None:
        self._pixel = pixel
        found = _clouds_before(pixel)
        self._veil = Veil(*(found[name] for name in _OF_VEIL))
        self.unscattered = self._veil.unscattered
        self.sunlight, self._skylight = (found.get(x, 1.0) for x in (_SUNLIGHT, _SKYLIGHT))

    @override
    def occluded(self, factor: OcclusionFactor, *, behind: bool = False) -> OcclusionFactor:
        return _scaled(factor, self._skylight)

    @override
    def on_path(self, occlusion: OcclusionOnPath) -> OcclusionOnPath:
        scattered = _scaled(occlusion.scattered, self._veil.daylit)
        single = occlusion.single * self._veil.sunlit
        return replace(occlusion, scattered=scattered, single=single)

    @override
    def veiled(self, pixel: ChannelPixel, added: Operand) -> ChannelPixel:
        at, veil = self._pixel, self._veil
        if at.given is None:
            return veiled(pixel, veil, at.ray, at.y_o, at.w)
        coverage = at.given[COVERAGE]
        around = surroundings(at.ray, at.y_o, at.y, at.w, at.P) * coverage + added
        return veiled(pixel, veil, at.ray, at.y_o, at.w, around=around, coverage=coverage)


def _scaled(factor: OcclusionFactor, by: Operand) -> OcclusionFactor:
    return OcclusionFactor(factor.mean * by, [part * by for part in factor.fractions])


def _clouds_before(pixel: Pixel) -> dict[str, NodeValue]:
    """Put the group of clouds before an object, or up to the boundary, into a pixel's tree.

    Before an object there are fractions of the sun's and of other light that clouds leave on it.
    """
    ahead, shape, sources = pixel.given is None, pixel.shape, pixel.sources
    names = _OF_VEIL if ahead else (*_OF_VEIL, _SUNLIGHT, _SKYLIGHT)
    outputs: dict[str, str] = dict.fromkeys(names, VECTOR) | {"Middle": FLOAT}
    group = OpenGroup(NAME, {_RATE: FLOAT}, outputs, **options(shape, sources))
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

    add_up, follow = functools.partial(summed, graph), functools.partial(followed, graph)
    rate, drawn = group.given[_RATE], chance(graph, w)[0]
    sunlit, daylit = daylit_fractions(clouds, origin, w, P, rate, drawn, add_up)
    veil = clouds.veil(origin, w, P, half_angle2(w, found.of(*SUN), NODES), add_up, follow)
    veil = replace(veil, sunlit=sunlit, daylit=daylit)
    results: dict[str, Operand] = dict(zip(_OF_VEIL, vars(veil).values(), strict=True))
    if not ahead:
        results[_SUNLIGHT] = clouds.sunlight_transmittance(place_here(graph))
        results[_SKYLIGHT] = clouds.skylight_transmittance(place_here(graph))
    return in_group(pixel.graph, group.finished(results), {_RATE: pixel.rates[1]})
