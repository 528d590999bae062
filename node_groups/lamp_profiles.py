"""The water of lamps in their images, and their profiles that it is looked up with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ..uw_spectral.lamps.angular_spread import NARROW, ON_PATCHES, PROFILE
from ..uw_spectral.lamps.lamp import LitPart
from ..uw_spectral.lamps.lamp_channels import LENGTHS as SAMPLES
from ..uw_spectral.lamps.multiple_scattering import LampWater
from ..uw_spectral.lamps.profile import LampProfile, sample_place
from ..uw_spectral.lamps.virtual_point_lights import COUNT as PARTS
from ..uw_spectral.mathematics import NUMPY, Mathematics, Operand
from ..uw_spectral.water.phase import Mixture
from . import lamp_images as layout
from . import lamp_sources
from .image_table import ImageTable
from .lamp_images import LampImages
from .loops import summed
from .node_mathematics import Graph, NodeValue
from .texture_atlas import closest


@dataclass(frozen=True, eq=False)
class ImageProfile(LampProfile):
    """The profile of a lamp in the image."""

    samples: ImageTable
    edge_cosine: NodeValue
    source: NodeValue
    tables: NodeValue

    @property
    def edge(self) -> NodeValue:
        """Where its edge is."""
        return self.edge_cosine

    def value(self, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
        """Look up the intensity at a cosine to the axis."""
        return self.samples.at(place=sample_place(cosine, SAMPLES, m, self.edge_cosine))


@dataclass(frozen=True, eq=False)
class _ImageSpread:
    """The tables of three bands in the image."""

    graph: Graph
    image: bpy.types.Image

    @property
    def narrow(self) -> ImageTable:
        return ImageTable(self.graph, self.image, NARROW, 0.0, float(layout.SPREAD))

    @property
    def on_patches(self) -> ImageTable:
        corner = float(layout.PATCHES), float(layout.SPREAD)
        return ImageTable(self.graph, self.image, ON_PATCHES, *corner)

    def profile(self, profile: LampProfile) -> ImageTable:
        assert isinstance(profile, ImageProfile)
        return ImageTable(self.graph, self.image, PROFILE, 0.0, profile.tables)


@dataclass(frozen=True, eq=False)
class _ImageField:
    """The scattered light of lamps in its image."""

    graph: Graph
    image: bpy.types.Image
    scale: NodeValue

    def source(self, profile: LampProfile) -> ImageTable:
        assert isinstance(profile, ImageProfile)
        return lamp_sources.source(self.graph, self.image, profile.source, self.scale)

    def arriving(self, profile: LampProfile) -> ImageTable:
        assert isinstance(profile, ImageProfile)
        return lamp_sources.arriving(self.graph, self.image, profile.source, self.scale)


@dataclass(frozen=True, eq=False)
class ImageParts:
    """The parts of what a lamp stands for, by their number: :class:`.Parts`."""

    graph: Graph
    part: Callable[[NodeValue], LitPart]
    virtual: NodeValue

    def total(self, terms: Callable[[LitPart], tuple[Operand, ...]]) -> tuple[Operand, ...]:
        """Add up terms of each."""
        count = self.virtual * float(PARTS)
        return summed(self.graph, count, lambda number: terms(self.part(number)))


def water_of_lamps(graph: Graph, images: LampImages, column: int, reach: NodeValue) -> LampWater:
    """Return the water that light of lamps meets in the water, or on objects, by its column."""

    def at(place: int) -> NodeValue:
        return closest(graph, images.numbers, place, 0.0)

    b, wide, nothing = at(column), at(layout.WIDE), Mixture((), ())
    scale = graph.components(at(layout.SCALES))[column == layout.ON_SURFACES]
    field = _ImageField(graph, images.sources, scale)
    spread = _ImageSpread(graph, images.numbers)
    return LampWater(0.0, b, b, nothing, spread, field, wide, reach)
