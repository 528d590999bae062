"""The contract of what a term of light does to a pixel of nodes."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Self

from ..uw_spectral.mathematics import Operand
from ..uw_spectral.transfer.channel_pixel import ChannelWater
from ..uw_spectral.transfer.pixel_parts import (
    Around,
    ChannelPixel,
    OcclusionFactor,
    OcclusionOnPath,
    SurfaceAbove,
)
from ..uw_spectral.transfer.radiance_field import distance_in_water
from .node_mathematics import NODES, Graph, NodeValue
from .realtime_rays import (
    camera_depth_behind,
    camera_place,
    depth_here,
    place_here,
    view_direction,
    view_distance,
)
from .realtime_values import FLOOR_DEPTH, FRAME
from .realtime_water import PixelWater
from .shape import Shape, Sources

type Triple = tuple[NodeValue, NodeValue, NodeValue]


@dataclass(frozen=True, eq=False)
class Pixel:
    """A pixel under construction: its water, and the view ray in it."""

    water: PixelWater
    w: Triple  #: Direction of the ray.
    P: NodeValue  #: Its length.
    y_o: NodeValue  #: Depth where it begins.
    y: NodeValue  #: Depth where it ends.
    begin: Triple | None = None  #: Where it begins, if its end is not known instead.
    end: Triple | None = None
    #: Inputs of the surface that is seen, of :mod:`.surface_inputs`; none of open water.
    given: Mapping[str, NodeValue] | None = None

    @classmethod
    def of_surface(cls, water: PixelWater, given: Mapping[str, NodeValue]) -> Self:
        """Return that of a surface with inputs."""
        graph = water.graph
        w, P, y = view_direction(graph), view_distance(graph), depth_here(graph)
        y_o = camera_depth_behind(y, w, P)
        return cls(water, w, P, y_o, y, end=place_here(graph), given=given)

    @classmethod
    def of_open_water(cls, water: PixelWater) -> Self:
        """Return that of open water, up to its floor or surface."""
        graph = water.graph
        w, eye = view_direction(graph), camera_place(graph, water.values.of(*FRAME))
        y_o = mean_depth = NODES.maximum(-eye[2], 0.0)
        for term in water.shape.terms:
            y_o = term.depth_of_eye(water, eye, w, y_o)
        if y_o is not mean_depth:
            eye = (*eye[:2], -y_o)
        P = distance_in_water(y_o, -w[2], water.values[FLOOR_DEPTH], NODES)
        return cls(water, w, P, y_o, NODES.maximum(y_o - w[2] * P, 0.0), begin=eye)

    @property
    def graph(self) -> Graph:
        """The tree."""
        return self.water.graph

    @property
    def shape(self) -> Shape:
        """What decides its nodes."""
        return self.water.shape

    @property
    def sources(self) -> Sources:
        """What its nodes read."""
        return self.water.sources

    @functools.cached_property
    def ray(self) -> ChannelWater:
        """The water along the ray."""
        return self.water.along(self.w)

    @functools.cached_property
    def eye(self) -> Sequence[NodeValue]:
        """Where the ray begins."""
        if self.begin is not None:
            return self.begin
        assert self.end is not None, "a ray has an end"
        return [x - along * self.P for x, along in zip(self.end, self.w, strict=True)]

    @functools.cached_property
    def point(self) -> Sequence[NodeValue]:
        """Where it ends."""
        if self.end is not None:
            return self.end
        return [e + along * self.P for e, along in zip(self.eye, self.w, strict=True)]

    @functools.cached_property
    def rates(self) -> tuple[Operand, Operand]:
        """Those of :meth:`.ChannelWater.falling_off`."""
        return self.ray.falling_off(self.y, self.w)

    def shaft(self, reach: Operand) -> Operand:
        """Single scattering from its beginning to a distance, as the volume draws it."""
        y_e = NODES.maximum(self.y_o - self.w[2] * reach, 0.0)
        return self.ray.single_scattering(self.y_o, y_e, self.w, reach)


class TermPixel:
    """What a term does to a pixel; every part is optional, and by itself does nothing."""

    sunlight: Operand = 1.0  #: Fraction of the sun's light that it leaves on an object.
    unscattered: Operand = 1.0  #: Fraction of unscattered light that it leaves on the way.
    leaving: Operand = 1.0  #: Fraction of light from the water that reaches what looks.
    pattern: Operand | None = None  #: Of caustics on an object.
    around: Around | None = None  #: What objects about one do to light scattered forward.
    dry: NodeValue | None = None  #: Whether an object lies in the air, 0 or 1, if any does.
    added: Operand = 0.0  #: Radiance of an object by its light, as it arrives at the camera.
    irradiance: Operand = 0.0  #: Of its light on an object.
    exciting: Operand = 0.0  #: The same as fluorophores weigh it.

    @property
    def caustics(self) -> Operand:
        """What caustics make of the sun's light on an object."""
        return 1.0

    def turned(self, sun: Sequence[NodeValue]) -> Operand:
        """Return a factor on the light of the sun as it is drawn, where another one lights."""
        del sun
        return 1.0

    def occluded(self, factor: OcclusionFactor, *, behind: bool = False) -> OcclusionFactor:
        """Return what is left of light from all sides on an object, or on its other side."""
        del behind
        return factor

    def on_path(self, occlusion: OcclusionOnPath) -> OcclusionOnPath:
        """Return what is left of the light that the path gathers."""
        return occlusion

    def above(self, surface: SurfaceAbove) -> SurfaceAbove:
        """Return the surface of open water as the ray meets it."""
        return surface

    def excitation(
        self, irradiance: Callable[[ChannelWater, Sequence[int]], Operand]
    ) -> Sequence[Operand]:
        """How much fluorophores of an object are excited, over π, by what is given a light."""
        del irradiance
        return ()

    def lit(self, pixel: ChannelPixel) -> ChannelPixel:
        """Return a pixel with its light."""
        return pixel

    def veiled(self, pixel: ChannelPixel, added: Operand) -> ChannelPixel:
        """Return it behind what floats before it; terms have ``added`` light to the object's."""
        del added
        return pixel

    def seen(self, pixel: Operand, coverage: Operand) -> Operand:
        """Return what is seen of the light of a pixel in the water."""
        del coverage
        return pixel

    def sun_in_air(self) -> list[Operand]:
        """What channels see of the sun on each colour where an object is dry."""
        return []

    def in_air(self, lit: Sequence[Operand], glow: Sequence[Operand]) -> Operand:
        """Radiance of an object there: lit by the sun as each colour, and glowing."""
        del lit, glow
        return 0.0


@dataclass(frozen=True, eq=False)
class PixelTerms:
    """What the terms of a water do to a pixel, in their order."""

    terms: Sequence[TermPixel]

    def combined[Found](self, apply: Callable[[Found, TermPixel], Found], start: Found) -> Found:
        """Let each make something of what those before it have made."""
        return functools.reduce(apply, self.terms, start)

    def first[Found](self, part: Callable[[TermPixel], Found | None]) -> Found | None:
        """Return a part of the first that has it."""
        return next((found for term in self.terms if (found := part(term)) is not None), None)

    def on_path(self, occlusion: OcclusionOnPath) -> OcclusionOnPath:
        """Return what they leave of the light that the path gathers."""
        return self.combined(lambda found, term: term.on_path(found), occlusion)

    def seen(self, pixel: Operand, coverage: Operand = 1.0) -> Operand:
        """Return what is seen of the light of a pixel in the water."""
        return self.combined(lambda found, term: term.seen(found, coverage), pixel)


def terms_of(pixel: Pixel) -> PixelTerms:
    """Return what the terms of a pixel's water do to it."""
    found = (shape.in_pixel(pixel) for shape in pixel.shape.terms)
    return PixelTerms([term for term in found if term is not None])
