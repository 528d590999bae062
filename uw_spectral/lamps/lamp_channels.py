"""The light of lamps in channels: linear functionals of the spectrum, projected beforehand.

Along a path of the length l from a lamp to the camera absorption takes e^{-a l}, which differs
greatly within a channel; so does the lamp's intensity I. All else, what scattering does, differs
little: it is computed for three bands that stand for all (:mod:`.representative_bands`, one set for
light in the water and one for that on objects), with fractions h, and what arrives of their values
x_j is

    L_c = Σ_j x_j S_cj(l),   S_cj(l) = Σ_λ s_cλ h_jλ I_λ e^{-a_λ l},

with s the weights of the channel: a sum over all bands, weights of either sign. A surface of a
colour, which is a sum of three reflectances, has such tables for each. Light scattered once needs
no bands: with the parts p_i of the phase function and their weights w it is

    Σ_i p_i O_ci(l),   O_ci(l) = Σ_λ s_cλ I_λ b_λ w_iλ e^{-(a_λ + b_λ) l}.

Three channels that are three bands are what the bands are, but for the tables' own 0.1 %.

Against 30 bands added up, paths and distances of 0.2 to 12 m, three spectra and three profiles of
lamps, in Jerlov I, IB, II and 3C; worst of these of the median / 95 % / worst error of a channel of
CIE 1931, a camera and Rec.709 (over what its bands add up to without sign): light of objects
0.3 / 1.8 / 12 %, light in the water (12 bands) 0.3 / 3.4 / 7 % in II, 0.4 / 3.7 / 22 % in 3C. Of
what is seen of an object 0.6 % (95 %) at most is on the wrong side of unscattered and scattered
forward.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot, sum_of
from ..table import Axis, Lookup, Table
from ..transfer.facets import Facets
from ..transfer.highlights import Vector, halfway
from ..water.phase import PhaseFunction
from .angular_spread import ANGLE2, path_lengths
from .lamp import Lamp, RayPastLamp, disc_seen, ray_past_lamp
from .lamp_path import Quadrature
from .lamp_surface import (
    ArrivingLight,
    PatchPastLamp,
    arriving_light,
    forward_fraction,
    patch_past_lamp,
)
from .multiple_scattering import InelasticLight, LampWater, light_along
from .representative_bands import COUNT

Array = NDArray[np.float64]

LENGTHS = 256
"""Entries of the tables over the length of a path."""
FLOATING = 96
"""Rows and columns of the table of light on what floats in the water."""
COLOURS = 3
"""Of surfaces: a red, a green and a blue one."""
FARTHEST = 1e9  # m, in place of no end


FLOATING_LENGTHS = path_lengths(FLOATING)
ON_FLOATING = FLOATING_LENGTHS.axis("wet"), FLOATING_LENGTHS.axis("s")
"""Axes of the table of light on what floats; see :meth:`ChannelLight.floating_at`."""


def along_path(stretch: Operand) -> tuple[Axis]:
    """Return the axis of lengths of paths in m: even near, ever wider far away.

    Examples
    --------
    >>> [along_path(5.0)[0].place(length, NUMPY) for length in (0.0, 5.0)]
    [0.0, 127.5]
    """
    place = lambda length, _: length / (length + stretch) * (LENGTHS - 1.0)  # noqa: E731
    return (Axis("length", LENGTHS, place),)


@dataclass(frozen=True, eq=False)
class ChannelLamp:
    """The tables of a lamp."""

    scattered: Array  #: O, of each part of the phase function, 1/m, (k, LENGTHS, 3).
    unscattered: Array  #: What is seen of the lamp itself, (LENGTHS, 3).
    in_water: Array  #: S, of the three bands for light in the water, (3, LENGTHS, 3).
    #: S, of a red, a green and a blue surface and of m measured reflectances, of the three bands
    #: for light on objects, (3 + m, 3, LENGTHS, 3).
    coloured: Array
    #: S, of the three bands for light on objects; its channels are what excites fluorophores,
    #: (3, LENGTHS, 3), or (0, LENGTHS, 3).
    exciting: Array
    #: Of light on what floats in the water, see :meth:`ChannelLight.floating_at`,
    #: (FLOATING, FLOATING, 3), or (0, FLOATING, 3).
    floating: Array
    #: The lamp stands for light of changed wavelength, with three bands of its own; it has no
    #: other, and S are over the way to the camera, but for the scattering there.
    inelastic: InelasticLight | None = None


@dataclass(frozen=True, eq=False)
class ChannelLight:
    """The light of a lamp in channels, of arrays or in a node tree: a :class:`.LampSpectrum`.

    Tables are those of :class:`ChannelLamp`.
    """

    water: LampWater  #: Of the three bands; its absorption and phase function are not read.
    components: Sequence[PhaseFunction]
    scattered: Sequence[Lookup]
    unscattered: Lookup
    in_water: Sequence[Lookup]
    split: Callable[[Operand], Sequence[Operand]]  #: Returns the three bands of a value.
    floating: Lookup | None = None
    inelastic: InelasticLight | None = None

    def single(self, s2: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the light scattered once over a length, by the squared sine of half the angle."""
        parts = zip(self.components, self.scattered, strict=True)
        return sum_of(table.at(length=length) * part.per_steradian(s2, m) for part, table in parts)

    def arriving(self, bands: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return what absorption over a length leaves of light of which bands have so much."""
        del m
        tables = [table.at(length=length) for table in self.in_water]
        return _weighted(self.split(bands), tables)

    def floating_at(self, wet: Operand, s: Operand) -> Operand:
        """Return the light on what floats in the water, as it arrives at the camera.

        On a way of ``wet`` from the lamp, times the square of the distance; and then of ``s`` to
        the camera, m. Light that the water scatters forward on either way is in it.
        """
        assert self.floating is not None, "there are clouds"
        return self.floating.at(wet=wet, s=s)

    def along(
        self,
        lamp: Lamp,
        ray: RayPastLamp,
        m: Mathematics = NUMPY,
        integrate: Quadrature | None = None,
    ) -> Operand:
        """Return the light of a lamp along a ray, that of its own disc included, in channels."""
        single, more = light_along(lamp, ray, self, m, integrate)
        disc = self.unscattered.at(length=m.maximum(ray.t0, 0.0))
        disc = disc * disc_seen(lamp, ray, m)
        return single + more + disc


@dataclass(frozen=True, eq=False)
class SurfaceLight:
    """The light of a lamp on an object and on to the camera, of arrays or in a node tree."""

    water: LampWater  #: Of the three bands; its absorption and phase function are not read.
    #: As of :class:`ChannelLamp`: of each colour, of each of the three bands.
    coloured: Sequence[Sequence[Lookup]]
    split: Callable[[Operand], Sequence[Operand]]  #: Returns the three bands of a value.

    def arriving_at(
        self, lamp: Lamp, patch: PatchPastLamp, visible: Operand = 1.0, m: Mathematics = NUMPY
    ) -> ArrivingLight:
        """Return the light at a patch from which so much of the lamp is seen."""
        return arriving_light(lamp, patch, self.water, m).shadowed(patch, visible)

    def on_patch(
        self, light: ArrivingLight, patch: PatchPastLamp, m: Mathematics = NUMPY
    ) -> Operand:
        """Irradiance in the three bands over the intensity, absorption apart."""
        return light.direct + light.about * m.maximum(patch.cosine, 0.0) + light.rest

    def on_facets(
        self,
        light: ArrivingLight,
        lamp: Lamp,
        patch: PatchPastLamp,
        facets: Facets,
        to_eye: Vector,
        to_lamp: Vector,
        m: Mathematics = NUMPY,
    ) -> tuple[Operand, list[Operand]]:
        """Irradiance, likewise, on a matte surface that is as bright as facets; and its colour.

        Light of the lamp and from about it makes two highlights, as wide as it is spread besides.
        What comes from all other sides lights facets as it does a matte surface.
        """
        half = halfway(to_eye, to_lamp, m)
        disc = 0.5 * lamp.radius * lamp.radius / (patch.r * patch.r)
        x, y, z = self.split(self.water.spread.on_patches.at(length=patch.wet, quantity=ANGLE2))
        spread = disc + (x + y + z) * (1.0 / COUNT)
        sharp, wide = (
            facets.highlight(to_eye, half, to_lamp, angle2, m) for angle2 in (disc, spread)
        )
        facing = m.maximum(dot(facets.normal, to_lamp), 0.0)
        bands = light.straight * (sharp * facing) + light.about * (wide * facing) + light.rest
        return bands, facets.colour(dot(half, to_lamp), m)

    def unscattered(self, P: Operand, m: Mathematics = NUMPY) -> Operand:
        """Fraction of the light of an object that arrives unscattered from a distance, likewise."""
        return m.exp(-self.water.b * P)

    def forward(self, P: Operand) -> Operand:
        """Fraction that arrives scattered forward; see :func:`.forward_transmittance`."""
        return forward_fraction(P, self.water)

    def tables(self, length: Operand) -> list[list[Operand]]:
        """Look up all tables at a length: of each colour, of each band."""
        return [[table.at(length=length) for table in tables] for tables in self.coloured]

    def arriving(self, bands: Operand, tables: Sequence[Operand]) -> Operand:
        """Return the channels of light of which bands have so much, by the tables of a colour."""
        return _weighted(self.split(bands), tables)


def of_colour(tables: Sequence[Sequence[Operand]], colour: Sequence[Operand]) -> list[Operand]:
    """Return the looked-up tables of a colour: those of red, green and blue by its parts."""
    return [_weighted(colour, by_colour) for by_colour in zip(*tables, strict=True)]


def matte_part(
    colour: Sequence[Operand], facets: Sequence[Facets], m: Mathematics = NUMPY
) -> list[Operand]:
    """Return what of a colour is not that of facets that mirror evenly."""
    mirrored = [sum_of(parts) for parts in zip(*(one.even for one in facets), strict=True)]
    mirrored = mirrored or [0.0] * COLOURS
    return [m.maximum(a - b, 0.0) for a, b in zip(colour, mirrored, strict=True)]


@dataclass(frozen=True, eq=False)
class LampChannels:
    """Lamps and their water, projected; make it with :func:`project_lamps`."""

    lamps: tuple[Lamp, ...]  #: The last ones may stand for light of changed wavelength.
    projected: tuple[ChannelLamp, ...]
    #: Of the three bands that stand for all.
    in_water: LampWater
    on_surfaces: LampWater
    components: tuple[PhaseFunction, ...]
    measured: int  #: Measured reflectances of surfaces.
    stretch: float  #: Length at the middle of the tables, m.

    @property
    def parts(self) -> int:
        """Parts of the phase function."""
        return len(self.components)

    @property
    def excites(self) -> bool:
        """Whether there are tables of what excites fluorophores."""
        return any(len(one.exciting) for one in self.projected)

    @property
    def floats(self) -> bool:
        """Whether there are tables of light on what floats in the water."""
        return any(len(one.floating) for one in self.projected)

    def path_light(
        self,
        origin: Sequence[Operand],
        w: Sequence[Operand],
        P: Operand,
        *,
        before_surface: bool = False,
    ) -> Array:
        """Radiance of the lamps along rays, as of :func:`.ray_past_lamp`, shape (..., 3)."""
        total = np.zeros(3)
        for lamp, light in self.lights():
            ray = ray_past_lamp(lamp, origin, w, P, before_surface=before_surface)
            total = total + light.along(lamp, ray)
        return total

    def lights(self) -> Iterator[tuple[Lamp, ChannelLight]]:
        """Return each lamp with its light in the water."""
        for lamp, projected in zip(self.lamps, self.projected, strict=True):
            light = ChannelLight(
                self.in_water,
                self.components,
                self._rows(projected.scattered),
                Table(projected.unscattered, along_path(self.stretch)),
                self._rows(projected.in_water),
                bands_of,
                Table(projected.floating, ON_FLOATING) if self.floats else None,
                projected.inelastic,
            )
            yield lamp, light

    def reflected(
        self,
        point: Sequence[Operand],
        normal: Sequence[Operand],
        colour: Sequence[Operand],
        P: Operand,
        *,
        visible: Operand = 1.0,
        measured: int | None = None,
        facets: Sequence[Facets] = (),
        to_eye: Vector = (),
    ) -> tuple[Array, Array]:
        """Radiance of patches that arrives from a distance, m: unscattered, and forward, (..., 3).

        Places are in world coordinates, m, and ``normal`` and ``to_eye``, which facets need, unit
        vectors, of arrays of shape (..., 1). The colour is linear Rec.709; the index of a measured
        reflectance stands in its place. ``visible`` is the fraction of the lamps that is seen from
        there. What is not that of facets on the patches is matte.
        """
        D, F = np.zeros(3), np.zeros(3)
        matte = matte_part(colour, facets)
        mirroring = [one.with_all_light(to_eye) for one in facets]
        for light, lamp, patch, arriving, _ in self._on_surface(point, normal, visible):
            found = light.tables(arriving.length + P)
            tables = of_colour(found[:COLOURS], matte)
            if measured is not None:
                tables = found[COLOURS + measured]
            parts = [(light.on_patch(arriving, patch), tables)]
            to_lamp = [-part for part in lamp.towards(point)[1]]
            for one in mirroring:
                bands, seen = light.on_facets(arriving, lamp, patch, one, to_eye, to_lamp)
                parts.append((bands, of_colour(found[:COLOURS], seen)))
            unscattered, forward = light.unscattered(P), light.forward(P)
            for bands, tables in parts:
                D = D + light.arriving(bands / math.pi * unscattered, tables)
                F = F + light.arriving(bands / math.pi * forward, tables)
        return D, F

    def irradiance(
        self, point: Sequence[Operand], normal: Sequence[Operand], visible: Operand = 1.0
    ) -> Array:
        """Irradiance on patches, as of :meth:`reflected`, shape (..., 3)."""
        E = np.zeros(3)
        for light, _, patch, arriving, _ in self._on_surface(point, normal, visible):
            white = of_colour(light.tables(arriving.length)[:COLOURS], (1.0, 1.0, 1.0))
            E = E + light.arriving(light.on_patch(arriving, patch), white)
        return E

    def excitation(
        self, point: Sequence[Operand], normal: Sequence[Operand], visible: Operand = 1.0
    ) -> Array:
        """Irradiance on patches as the fluorophores weigh it, shape (..., 3)."""
        X = np.zeros(3)
        for light, _, patch, arriving, projected in self._on_surface(point, normal, visible):
            tables = [row.at(length=arriving.length) for row in self._rows(projected.exciting)]
            X = X + light.arriving(light.on_patch(arriving, patch), tables)
        return X

    def _on_surface(
        self, point: Sequence[Operand], normal: Sequence[Operand], visible: Operand
    ) -> Iterator[tuple[SurfaceLight, Lamp, PatchPastLamp, ArrivingLight, ChannelLamp]]:
        """Return each lamp as patches see it, with its light there and its tables."""
        for lamp, projected in zip(self.lamps, self.projected, strict=True):
            coloured = [self._rows(tables) for tables in projected.coloured]
            light = SurfaceLight(self.on_surfaces, coloured, bands_of)
            patch = patch_past_lamp(lamp, point, normal)
            yield light, lamp, patch, light.arriving_at(lamp, patch, visible), projected

    def _rows(self, tables: Array) -> list[Table]:
        return [Table(table, along_path(self.stretch)) for table in tables]


def bands_of(values: Operand) -> list[Operand]:
    """Return columns of representative bands."""
    return [values[..., band : band + 1] for band in range(COUNT)]


def _weighted(weights: Sequence[Operand], values: Sequence[Operand]) -> Operand:
    return sum_of(value * weight for weight, value in zip(weights, values, strict=True))
