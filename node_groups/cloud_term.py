"""Clouds in the water as a term of a pixel."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import override

import bpy

from ..uw_spectral.clouds.cloud_light import Clouds, Several
from ..uw_spectral.clouds.veiled_pixel import surroundings, veiled
from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.pixel_parts import ChannelPixel, OcclusionFactor, OcclusionOnPath
from ..uw_spectral.water.phase import PhaseFunction
from . import cloud_grids, cloud_table, realtime_clouds
from .cloud_table import GRID_LAMPS, GRIDS, PART, CloudTable
from .lamp_term import LampShape
from .node_mathematics import NODES, Graph, NodeValue
from .pixel_term import Pixel, TermPixel
from .realtime_values import SUN, Values
from .shape import Shape, Sources, TermShape
from .surface_inputs import COVERAGE


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
        clouds_of = functools.partial(clouds_in, sources=pixel.sources, shape=pixel.shape)
        self._found = realtime_clouds.clouds_before(pixel, clouds_of)
        self.unscattered = self._found[realtime_clouds.UNSCATTERED]
        self.sunlight = self._found.get(realtime_clouds.SUNLIGHT, 1.0)

    @override
    def occluded(self, factor: OcclusionFactor, *, behind: bool = False) -> OcclusionFactor:
        return _scaled(factor, self._found[realtime_clouds.SKYLIGHT])

    @override
    def on_path(self, occlusion: OcclusionOnPath) -> OcclusionOnPath:
        scattered = _scaled(occlusion.scattered, self._found[realtime_clouds.DAYLIT])
        single = occlusion.single * self._found[realtime_clouds.SUNLIT]
        return replace(occlusion, scattered=scattered, single=single)

    @override
    def veiled(self, pixel: ChannelPixel, added: Operand) -> ChannelPixel:
        at, veil = self._pixel, realtime_clouds.veil_of(self._found)
        if at.given is None:
            return veiled(pixel, veil, at.ray, at.y_o, at.w)
        coverage = at.given[COVERAGE]
        around = surroundings(at.ray, at.y_o, at.y, at.w, at.P) * coverage + added
        return veiled(pixel, veil, at.ray, at.y_o, at.w, around=around, coverage=coverage)


def _scaled(factor: OcclusionFactor, by: NodeValue) -> OcclusionFactor:
    return OcclusionFactor(factor.mean * by, [part * by for part in factor.fractions])
