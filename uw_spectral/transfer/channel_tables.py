"""The light of solved water projected into channels: tables that know no number of bands.

What a pixel gets is linear in the spectrum of the light, so the sums over the bands are taken here,
once, and a renderer looks up three channels. Where light is dimmed over a distance after it is
looked up, its three channels stand for its spectrum: at every depth the spectra of light from all
directions are regressed on their channels, and the regression, dimmed, is what is tabulated. So
light with the spectrum of the water passes exactly, and so does everything if channels are bands.

Tables over distance are divided by e^{-κP}, so that they vary slowly; positions are formulas over
a :class:`.Mathematics`, as of :mod:`.radiance_table`.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand
from ..table import EVEN, Axis, Place, Table, discrete_axis
from ..water.phase import PhaseFunction
from .depth_scale import DepthScale
from .radiance_table import AZIMUTH, SUN_ANGLE, TILT, TURN, UP

RATES = ("extinction", "peak", "scattering", "mean_extinction", "sun_decay")
"""Numbers that layered water has of every depth."""
ON_PATCH, ON_PATH, SPECTRA = 0, 2, 4
"""First spectrum of the occlusion on patches, that along paths, and how many there are."""
LENGTHS = 96
"""Distances that tables over distance have."""
FARTHEST = 5e3  # m
GONE = 16.0  # optical depths after which no light counts
FIRST = 0.3  # optical depths of the scale of the first distances
NOTHING = 1e-30
COLOURS = 3
"""Red, green and blue."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LengthScale:
    """Where distances lie among so many: evenly at first, by their logarithm later.

    Examples
    --------
    >>> scale = LengthScale.up_to(100.0, 0.5)
    >>> scale.place(np.array([0.0, 100.0])).round(6), scale.lengths()[1].round(4)
    (array([ 0., 95.]), np.float64(0.0287))
    """

    first: Operand
    per_log: Operand

    @classmethod
    def up_to(cls, farthest: float, first: float) -> LengthScale:
        """Return the scale that ends at a distance, even up to about the ``first`` one, m."""
        return cls(first, (LENGTHS - 1) / math.log1p(farthest / first))

    def place(self, P: Operand, m: Mathematics = NUMPY) -> Operand:
        """Position of a distance among :data:`LENGTHS`; what is farther is the last."""
        return m.minimum(self.per_log * m.log(1.0 + P / self.first), LENGTHS - 1.0)

    def held(self, P: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return a distance, or the last one where it is farther, m."""
        return m.minimum(P, self.first * (m.exp((LENGTHS - 1.0) / self.per_log) - 1.0))

    def step(self, P: Operand) -> Operand:
        """Difference in m between two places at a distance."""
        return (P + self.first) / self.per_log

    def lengths(self) -> Array:
        """All of them, m."""
        return self.first * np.expm1(np.arange(LENGTHS) / self.per_log)


@dataclass(frozen=True)
class TableSizes:
    """How much there is of what :class:`ChannelTables` tell apart."""

    slices: int  #: Depths.
    colours: int  #: Red, green, blue and measured ones.
    parts: int  #: Of the phase function.
    layered: bool  #: The water differs with depth.
    waves: bool
    emissions: int = 0  #: That are no colour.
    skies: int = 1  #: Spectra that the sky is a sum of.

    def axes(
        self, of_depth: Place = EVEN.of, of_length: Place = EVEN.of
    ) -> dict[str, tuple[Axis, ...]]:
        """Return the axes of each table, discrete ones first; channels follow these."""
        depth, length = Axis("depth", self.slices, of_depth), Axis("length", LENGTHS, of_length)
        up, once = UP.axis("up"), ("single", "drawn", "drawn_at")
        azimuth, light = AZIMUTH.axis("azimuth"), discrete_axis("light", 3)
        colour, part = discrete_axis("colour", self.colours), discrete_axis("part", self.parts)
        return {
            "scattered": (depth, up, azimuth),
            "beyond": (depth, up, azimuth),
            "irradiance": (depth, TILT.axis("up"), TURN.axis("azimuth")),
            "dimmed": (light, depth, length),
            "peaked": (light, depth, length),
            "matte": (colour, light, depth, length),
            "sunlit": (colour, depth, length),
            "caustics": (discrete_axis("colour", self.waves * self.colours), depth, length),
            "glowing": (discrete_axis("colour", COLOURS + self.emissions), depth, length),
            "aureole": (depth, SUN_ANGLE.axis("s2")),
            "image": (up, azimuth),
            **({"single": (part, up, length)} if self.layered else {}),
            "rates": (discrete_axis("rate", len(RATES)), depth),
            "occlusion_matrices": (discrete_axis("spectrum", SPECTRA), light, depth),
            "image_transmittance": (discrete_axis("boundary", 2), length),
            "sky": (discrete_axis("part", self.skies), length),
            **dict.fromkeys(("glitter", "floor"), (length,)),
            "mirrored": (light, length),
            **dict.fromkeys(() if self.layered else once, (part, length)),
        }


@dataclass(frozen=True, eq=False)
class ChannelNumbers:
    """What formulas need besides tables; channels are arrays of three, or vectors of a shader."""

    #: Channels: light in the tables of depth and direction is divided by ``scale e^{-decay y}``.
    scale: Operand
    decay: Operand
    #: Channels: κ: tables over distance are divided by e^{-κP}, 1/m. In layered water, where each
    #: depth has its own, it is :attr:`ChannelTables.rates`, as are the next four.
    extinction: Operand
    #: Channels: part of the extinction that scatters forward and counts as unscattered, 1/m.
    peak: Operand
    scattering: Operand  #: Channels: scattering coefficient b, 1/m.
    #: Channels: without that part, and of all that a channel sees at the camera, 1/m.
    mean_extinction: Operand
    sun_decay: Operand  #: Channels: sunlight in its table is divided by e^{-κs y} besides, 1/m.
    #: Channels: sunlight scattered once is divided by e^{-x}, for the optical path x times this.
    single_decay: Operand
    lengths: LengthScale
    #: Cosine of the in-water zenith angle; depth of the floor, m.
    mu_s: Operand
    y_f: Operand


@dataclass(frozen=True, eq=False)
class ChannelTables:
    """Tables of three channels; make them with :func:`project`. The first axis is the channel."""

    numbers: ChannelNumbers
    depth_scale: DepthScale
    components: tuple[PhaseFunction, ...]  #: The k parts of the phase function.
    scattered: Array  #: M(y, w), (3, slices, ELEVATIONS, AZIMUTHS).
    beyond: Array  #: Sunlight that is scattered once ahead, of that shape.
    #: On patches, without the direct sun; with the sun's forward peak unless objects occlude,
    #: (3, slices, TILTS, TURNS).
    irradiance: Array
    aureole: Array  #: Factor on sunlight scattered once, (3, slices, ANGLES).
    #: [j]: what is left over a distance of light at a depth, per unit of its channel j,
    #: (3, 3, slices, LENGTHS).
    dimmed: Array
    #: The same where light that the forward peak scatters counts as unscattered, over that,
    #: of that shape.
    peaked: Array
    #: [k, j]: the same of what colour k reflects of it; after red, green and blue measured ones,
    #: (3 + i, 3, 3, slices, LENGTHS).
    matte: Array
    #: [k]: what is left over a distance of direct sunlight on colour k, normal irradiance,
    #: (3 + i, 3, slices, LENGTHS).
    sunlit: Array
    #: [k]: what is added to that per unit of the waves' pattern above 1,
    #: (3 + i, 3, slices, LENGTHS), or (0, ...).
    caustics: Array
    #: [k]: of the light of a lamp of colour k; after red, green and blue other emissions,
    #: (3 + e, 3, slices, LENGTHS).
    glowing: Array
    #: [i, j]: of light times spectrum i of the occlusion, per unit of its channel j,
    #: (:data:`SPECTRA`, 3, 3, slices).
    occlusion_matrices: Array
    rates: Array  #: Those of :data:`RATES` of :class:`ChannelNumbers`, by depth, (5, 3, slices).
    #: Fraction of each part of the phase function in the scattering about the camera, (k, 3).
    parts: Array
    #: Radiance of the surface from just below, and of the floor, (3, ELEVATIONS, AZIMUTHS).
    image: Array
    #: Fraction of that which is left over a distance: of the surface, of the floor,
    #: (2, 3, LENGTHS).
    image_transmittance: Array
    sky: Array  #: [k]: of the sky per relative radiance of each of its spectra, (k, 3, LENGTHS).
    #: Of the sun's irradiance, of the floor, (3, LENGTHS).
    glitter: Array
    floor: Array
    mirrored: Array  #: [j]: of light that the surface mirrors down, (3, 3, LENGTHS).
    #: Sunlight scattered once: what is left of it after an optical path, or, in layered water,
    #: between the camera and a distance along an elevation, per distance,
    #: (k, 3, LENGTHS), or (k, 3, ELEVATIONS, LENGTHS).
    single: Array
    #: The same with the whole extinction, and its density; of water of one layer, (k, 3, LENGTHS).
    drawn: Array
    drawn_at: Array
    #: Whether the water differs with depth: then all holds for one depth of the camera.
    layered: bool
    fastest: float  #: Largest extinction of the bands, 1/m.

    @property
    def sizes(self) -> TableSizes:
        """How much of each there is."""
        return TableSizes(
            self.depth_scale.slices, len(self.sunlit), len(self.components), self.layered,
            bool(len(self.caustics)), len(self.glowing) - COLOURS, len(self.sky),
        )  # fmt: skip

    def table(self, name: str) -> Table:
        """Return one of the tables, by the name of its attribute."""
        axes = self._axes[name]
        channel = sum(axis.discrete for axis in axes)
        return Table(np.moveaxis(getattr(self, name), channel, -1), axes)

    def at(self, name: str, **coordinates: Operand) -> Operand:
        """Look one of the tables up; see :class:`.Tables`."""
        return self.table(name).at(**coordinates)

    @staticmethod
    def split(channels: Array) -> list[Array]:
        """Return the three channels, shape (..., 1) each."""
        return [channels[..., i : i + 1] for i in range(3)]

    @functools.cached_property
    def _axes(self) -> dict[str, tuple[Axis, ...]]:
        return self.sizes.axes(self.depth_scale.slice, self.numbers.lengths.place)


def path_unit(P: Operand, c: Operand) -> Operand:
    """What sunlight scattered once on paths of layered water is divided by."""
    return P / (1.0 + c * P) + 1e-6
