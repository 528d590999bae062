"""What decides the nodes of the real-time water, and what these read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import bpy

from ..uw_spectral.transfer.sky import UNIFORM
from ..uw_spectral.water.phase import PhaseFunction

if TYPE_CHECKING:
    from ..uw_spectral.clouds.cloud_light import Clouds
    from ..uw_spectral.transfer.sky import Sky
    from .node_mathematics import Graph, NodeValue
    from .pixel_term import Pixel, TermPixel, Triple
    from .realtime_water import PixelWater


@dataclass(frozen=True)
class Sources:
    """What the groups of a water read."""

    values: bpy.types.ShaderNodeTree  #: Of :func:`.realtime_values.build`.
    #: Images by the names that their modules give them.
    parts: Mapping[str, bpy.types.ID] = field(default_factory=dict)
    #: Group of a pixel's ray, where that is not straight from the camera.
    rays: bpy.types.ShaderNodeTree | None = None


@dataclass(frozen=True)
class TermShape:
    """What decides the nodes of a term; without arguments, that of a water that lacks the term."""

    #: Names of the term's numbers of which each channel has its own.
    channels: ClassVar[tuple[str, ...]] = ()
    singles: ClassVar[tuple[str, ...]] = ()  #: Of those that are the same in every channel.

    #: The tables of light hold the contrast of its caustics.
    caustics: ClassVar[bool] = False
    skies: ClassVar[int] = 1  #: Spectra that the sky is a sum of.
    #: Its nodes need about half of the constants that a shader holds.
    large: ClassVar[bool] = False
    surfaces: ClassVar[str] = ""  #: Name of the group of surfaces that it alone concerns.

    @property
    def emissions(self) -> int:
        """Lights beside those of colours that the tables of light hold for it."""
        return 0

    def parts(self, shape: Shape) -> Mapping[str, bpy.types.ID]:
        """Make the data-blocks that the nodes read, which are written by frame."""
        del shape
        return {}

    def rays(self, sources: Sources) -> bpy.types.ShaderNodeTree | None:
        """Build the group of a pixel's ray, if the term bends or shortens it."""
        del sources
        return None

    @property
    def inputs(self) -> Mapping[str, str]:
        """More inputs of the groups of surfaces, with their types."""
        return {}

    @property
    def own_inputs(self) -> Mapping[str, str]:
        """Those of the group of surfaces that the term alone concerns, which is named by it."""
        return {}

    def depth_of_eye(self, water: PixelWater, eye: Triple, w: Triple, y_o: NodeValue) -> NodeValue:
        """Return the depth of an eye of open water below the surface along a ray w.

        ``y_o`` is that below the mean surface.
        """
        del water, eye, w
        return y_o

    def sky(self, water: PixelWater) -> Sky | None:
        """Return the sky of a pixel, if the term has one: relative, in each of its spectra."""
        del water
        return None

    def matter(self, shape: Shape, sources: Sources) -> Callable[[Graph], Clouds] | None:
        """Return what makes in a tree what floats in the water, which lamps light."""
        del shape, sources
        return None

    def in_pixel(self, pixel: Pixel) -> TermPixel | None:
        """Return what the term does to a pixel, if anything."""
        del pixel
        return None


@dataclass(frozen=True)
class Shape:
    """What decides the nodes of the groups; everything else is a number in them.

    The fields are of the water and of materials; each term of light has a shape of its own.
    """

    components: tuple[PhaseFunction, ...]  #: Parts of the phase function.
    flat: bool  #: The water has a surface that reflects.
    zones: int = 1  #: Of the scale of depths.
    slices: int = 0
    shafts: bool = False  #: Single scattering comes from the volume.
    sky: str = UNIFORM  #: Distribution of the sky's radiance.
    layered: bool = False  #: The water differs with depth.
    layers: tuple[str, ...] = ()  #: Written beside the picture, of :mod:`.realtime_layers`.
    mirrors: bool = False  #: Objects mirror the water.
    translucent: bool = False  #: Light from behind objects shines through them.
    highlights: tuple[str, ...] = ()  #: Groups of :mod:`.realtime_highlights` that there are.
    filters: bool = False  #: Objects let through more of one colour than of another.
    glows: bool = False  #: Objects emit light.
    measured: int = 0  #: Measured reflectances.
    terms: tuple[TermShape, ...] = ()

    def __contains__(self, kind: type[TermShape]) -> bool:
        return any(isinstance(term, kind) for term in self.terms)

    def of[T: TermShape](self, kind: type[T]) -> T:
        """Return the shape of a term, or that of its absence."""
        return next((term for term in self.terms if isinstance(term, kind)), kind())
