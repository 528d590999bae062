"""What a pixel in channels is made of, and what it asks of surfaces and of the tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..mathematics import Operand
from .foam_light import FoamAhead
from .radiance_field import Ripples
from .sky import Sky

COLOURS = (0, 1, 2)
"""Columns of red, green and blue; those of measured reflectances follow."""


class Tables(Protocol):
    """The tables of :class:`.ChannelTables`, of arrays or in a node tree."""

    def split(self, channels: Operand) -> Sequence[Operand]:
        """Return the three channels."""
        ...

    def at(self, name: str, **coordinates: Operand) -> Operand:
        """Look up one of the tables, as :meth:`.Lookup.at` does."""
        ...


@dataclass(frozen=True, eq=False)
class ChannelPixel:
    """The light of a pixel in components that add up, in channels."""

    path: Operand  #: Light scattered by the water on the way.
    direct: Operand  #: Unscattered light of what is seen.
    forward_scattered: Operand  #: Light of the surroundings, blurred over what is seen.
    L_end: Operand = 0.0  #: Radiance of what is seen, where it is.
    single_scattering: Operand = 0.0  #: Part of the path that was scattered once.
    lamps: Operand = 0.0  #: Light of lamps that the water on the way scatters.

    @property
    def water(self) -> Operand:
        """All but the direct light."""
        return self.path + self.forward_scattered + self.lamps

    @property
    def total(self) -> Operand:
        """Sum of the components."""
        return self.direct + self.water


@dataclass(frozen=True, eq=False)
class OcclusionFactor:
    """Fraction of light that objects leave or bring, as :class:`.OcclusionTable` has it."""

    mean: Operand = 1.0  #: Of all bands.
    fractions: Sequence[Operand] = ()  #: Of each spectrum of the occlusion.


NO_OCCLUSION = OcclusionFactor()


@dataclass(frozen=True, eq=False)
class OcclusionOnPath:
    """What objects leave of the light that a path gathers."""

    scattered: OcclusionFactor = NO_OCCLUSION  #: Of M.
    single: Operand = 1.0  #: Fraction of sunlight scattered once.
    #: Fraction of that which they treat as M: its peak of fewer streams turns, and comes round
    #: edges.
    turned: Operand | None = None


UNOCCLUDED = OcclusionOnPath()


@dataclass(frozen=True, eq=False)
class Around:
    """What objects about a pixel do to light that is scattered forward, see :mod:`.adjacency`."""

    blocked: Operand  #: Channels: fraction of scattering that stays within them.
    own: Operand = 1.0  #: Channels: fraction of that which has the light of what is seen.
    #: Channels: what they send besides: their mean radiance, less that fraction of the one that is
    #: seen.
    beside: Operand = 0.0


@dataclass(frozen=True, eq=False)
class SurfaceMaterial:
    """What an object in the water reflects and emits, in colours that may be measured ones."""

    #: Of its colours: :data:`COLOURS`, or the one of a measured reflectance.
    columns: Sequence[Operand]
    #: Per column: radiance per normal irradiance of a white sun, shadows included; empty where
    #: another draws it.
    response: Sequence[Operand]
    base: Sequence[Operand]  #: Per column: its reflectance for light from many sides.
    mirrored: Sequence[Operand] = ()  #: Part of it that mirrors.
    L_mirrored: Operand = 0.0  #: Channels: radiance that it mirrors, the direct sun's apart.
    #: Per red, green and blue: radiance that it emits; empty if it emits nothing.
    emitted: Sequence[Operand] = ()
    pattern: Operand | None = None  #: Of the waves there, of mean 1.
    occlusion: OcclusionFactor = NO_OCCLUSION  #: Of the light from all sides, the direct sun apart.
    #: Fraction of its matte colours that the light from behind it shines through.
    behind: Operand | None = None
    #: Of the light from all sides that falls on the other side.
    occlusion_behind: OcclusionFactor = NO_OCCLUSION
    #: Per emission that is no colour: how much it is excited, over π.
    fluorescing: Sequence[Operand] = ()


@dataclass(frozen=True, eq=False)
class SeenObject:
    """What a pixel shows of an object."""

    leaving: Operand  #: Of :meth:`.ChannelWater.leaving`, multiplied by the coverage.
    coverage: Operand = 1.0  #: Fraction of the pixel that it fills.
    #: What it lets through of each channel beyond 1 - ``coverage``, which is drawn; for what lies
    #: behind it stands unoccluded water.
    tint: Operand | None = None
    #: Of :meth:`.ChannelWater.glow`, if ``leaving`` is without it: what objects around emit is not
    #: known.
    glow: Operand | None = None


@dataclass(frozen=True, eq=False)
class ReflectedRadiance:
    """What a picture shows of the light that the surface mirrors."""

    radiance: Operand  #: Channels: that comes up to the surface, objects included.
    known: Operand  #: 1 where the picture shows it, 0 elsewhere.


@dataclass(frozen=True, eq=False)
class RefractedRadiance:
    """What a picture shows of the objects above the water."""

    radiance: Operand  #: Channels: in air, times what they cover.
    covered: Operand  #: Fraction of the sky behind that they hide.


Direction = Sequence[Operand]
ReflectionPicture = Callable[[Direction], ReflectedRadiance]
"""What light comes up to the surface against a unit direction down, where a ray meets it."""
RefractionPicture = Callable[[Direction], RefractedRadiance]
"""What objects in the air are seen along a unit direction up, where a ray leaves the water."""


@dataclass(frozen=True, eq=False)
class SurfaceAbove:
    """The surface as a ray from below sees it."""

    sky: Sky  #: Of the level 1: that of the channels is in the tables.
    index: Operand | None  #: Of the water against air; None for a surface that lets all through.
    ripples: Ripples | None = None
    picture: ReflectionPicture | None = None  #: Of objects that it mirrors.
    window: RefractionPicture | None = None  #: Of objects in the air.
    foam: FoamAhead | None = None
