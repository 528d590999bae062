"""Lamp light that is scattered more than once.

What turns it by more than some seven degrees is followed through every scattering: it is the source
S of :mod:`.scattered_source` along the ray. The rest goes nearly straight on, and for that one bend
stands, as for light scattered once, of the angular distribution after any number of scatterings,

    K = Σ (2n + 1)/4π Q(b l, χn) Pn(cos Θ) / l,   Q(x, χ) = e^{-x (1 - χ)} - e^{-x} (1 + x χ),

less the K' of what the source has (:mod:`.delta_scaled_phase`):

    L = ∫ (I Φ(θ) (K - K')(Θ, l) / r² + I S e^{-b' t}) e^{-a l} ds,

l the path from the lamp over the place to the camera, t that from there, Θ the deflection, b' the
scattering that the source has. docs/measured/lamp_light.md has the errors.

Shadows of the source are of two kinds. Light that is turned by most of Θ where it meets the ray
came there from about the lamp, by b/r p(Θ); what was turned before it came nearly along the ray,
from all places beyond: by b/h ∫ p dψ over the angles ψ by which the lamp's light is turned there,
up to the last one that the lamp lights. With p falling as ψ^-3 (sea particles from 15° to 80°:
-2.0 to -2.8) the latter is Θ/(2 sin Θ) (1 - Θ²/ψ1²) times the former, and half of it comes from
before 1/ψ² = (1/Θ² + 1/ψ1²)/2: what reaches the two places, each by its fraction, reaches the
camera.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..content import ComparedByContent
from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from ..table import Lookup, Table
from ..water.phase import BandPhase, Mixture
from .angular_spread import Spread, WaterSpread
from .delta_scaled_phase import RESOLVED, wide_moments
from .lamp import Lamp, RayPastLamp
from .lamp_harmonics import Harmonics
from .lamp_path import (
    NODES,
    LitPart,
    PathNode,
    Quadrature,
    half_angle,
    lit_part,
    nodes_for,
    path_node,
)
from .profile import LampProfile
from .scattered_irradiance import arriving_table
from .scattered_source import source_seen, source_table

MORE_NODES = 16
"""Of the integral of the source."""
_REACH = 8.0  # of scattered light, in decay lengths
Transmittance = Callable[[Operand, Sequence[Operand]], Operand]
"""Fraction of light, in channels, that matter in its way leaves: of a place at a distance along the
ray in m, and as the lamp sees it."""


class Field(Protocol):
    """The light of lamps that was scattered already."""

    def source(self, profile: LampProfile) -> Lookup:
        """Return where it is scattered once more."""
        ...

    def arriving(self, profile: LampProfile) -> Lookup:
        """Return what patches get of it."""
        ...


@dataclass(frozen=True, eq=False)
class LampField(ComparedByContent):
    """The light of lamps that was scattered already, in a water of n bands."""

    harmonics: Harmonics

    def source(self, profile: LampProfile) -> Table:
        """Tabulate where that of a lamp of an intensity of 1 is scattered once more."""
        return source_table(self.harmonics, profile)

    def arriving(self, profile: LampProfile) -> Table:
        """Tabulate what patches get of it."""
        return arriving_table(self.harmonics.for_patches(), profile)


@dataclass(frozen=True, eq=False)
class LampWater:
    """Water as the light of lamps meets it, of n bands; make it with :func:`lamp_water`."""

    #: Absorption, scattering and extinction, 1/m.
    a: Operand
    b: Operand
    c: Operand
    phase: Mixture
    spread: Spread  #: Tables of light that goes nearly straight on.
    field: Field  #: Of what is turned more.
    wide: Operand  #: Scattering that the field has, 1/m, (n,).
    #: Distance from the camera, or beyond the lamp, from which no scattered light is counted, m.
    reach: Operand

    def of_bands(self, indices: ArrayLike) -> LampWater:
        """Return the water in some of the bands."""
        assert isinstance(self.field, LampField)
        few = self.field.harmonics.of_bands(indices)
        return lamp_water(few.a, few.b, few.phase)

    def astype(self, dtype: DTypeLike) -> LampWater:
        """Return the numbers in another floating-point precision."""
        cast = np.dtype(dtype).type
        phase = dataclasses.replace(self.phase, weights=np.asarray(self.phase.weights, dtype))
        numbers = {name: cast(getattr(self, name)) for name in ("a", "b", "c", "wide", "reach")}
        return LampWater(**numbers, phase=phase, spread=self.spread, field=self.field)


def lamp_water(a: ArrayLike, b: ArrayLike, phase: BandPhase) -> LampWater:
    """Return the water of n bands, absorption and scattering in 1/m.

    Raises
    ------
    InputError
        If a coefficient is negative or not finite.
    """
    absorption, scattering = np.broadcast_arrays(
        np.atleast_1d(a).astype(np.float64), np.atleast_1d(b).astype(np.float64)
    )
    for name, values in (("absorption", absorption), ("scattering", scattering)):
        if not (np.all(np.isfinite(values)) and np.all(values >= 0)):
            raise InputError(
                f"lamp: the {name} must be finite and not negative, got {values.tolist()} 1/m"
            )
    transport = absorption + scattering * (1.0 - phase.chi1)
    diffuse = np.sqrt(3.0 * absorption * transport)
    return LampWater(
        absorption,
        scattering,
        absorption + scattering,
        phase,
        WaterSpread(scattering, phase),
        LampField(Harmonics(absorption, scattering, phase)),
        scattering * wide_moments(phase, 0, RESOLVED)[0],
        _REACH / max(float((transport + diffuse).min()), 1e-3),
    )


@dataclass(frozen=True, eq=False)
class InelasticLight:
    """What tells light of changed wavelength round a lamp from its own (:mod:`.inelastic_source`).

    Absorption is that of the way to the camera alone. In a node tree lamps of both kinds have it.
    """

    onward: Lookup  #: In place of :attr:`.Spread.narrow`, by the distance from the lamp.
    source: Lookup  #: In place of that of :class:`Field`.
    decay: Operand  #: What neither has of its fading with the distance from the lamp, 1/m, (n,).
    changed: Operand = 1.0  #: 0 where it is the lamp's own light after all.


class LampSpectrum(Protocol):
    """The light of a lamp over wavelengths: its own bands, or a few functionals of them."""

    @property
    def water(self) -> LampWater:
        """Water of the bands that the angles of scattered light are computed for."""
        ...

    @property
    def inelastic(self) -> InelasticLight | None:
        """What it is looked up in if its wavelength has changed."""
        ...

    def arriving(self, bands: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return what absorption over a length leaves of its light, of which bands have so much."""
        ...

    def single(self, s2: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return its light scattered once over a length, by the squared sine of half the angle."""
        ...


@dataclass(frozen=True, eq=False)
class BandLight:
    """The light of a lamp band by band."""

    intensity: Operand
    water: LampWater
    inelastic: InelasticLight | None = None

    def single(self, s2: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the light scattered once, in each band."""
        water = self.water
        if self.inelastic is not None:
            return 0.0 * water.b
        passed = self.intensity * water.b * m.exp(-water.c * length)
        return passed * water.phase.per_steradian(s2, m)

    def arriving(self, bands: Operand, length: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the light that absorption leaves, in each band."""
        return self.intensity * m.exp(-self.water.a * length) * bands


def lamp_light(lamp: Lamp, ray: RayPastLamp, water: LampWater) -> tuple[Operand, Operand]:
    """Radiance of a lamp's light in the water along a ray, band by band, (..., n).

    Scattered once, as :func:`.single_scattering` has it, and more often; in the unit of the
    intensity per m². Arrays of the ray need a last axis of 1 for the bands.
    """
    return light_along(lamp, ray, BandLight(lamp.intensity, water))


def light_along(
    lamp: Lamp,
    ray: RayPastLamp,
    light: LampSpectrum,
    m: Mathematics = NUMPY,
    integrate: Quadrature | None = None,
    transmittance: Transmittance | None = None,
) -> tuple[Operand, Operand]:
    """Radiance of a lamp's light along a ray: scattered once, and more often.

    The lamp's intensity is not read. ``integrate`` adds up the terms of the quadratures, for which
    a shader has a loop; ``transmittance`` is what other matter than the water leaves.
    """
    part = lit_part(lamp, ray, m)
    integrate = integrate or nodes_for(lamp)

    def of_place(place: Operand, fraction: Operand) -> tuple[Operand, Operand]:
        node = path_node(lamp, ray, part, place, fraction, m)
        onward = m.exp(_onward(light, node)) * node.weight
        single = light.single(node.s2, node.length, m) * node.weight
        more = light.arriving(onward, _absorbing(light, node.length, node.wet), m)
        if transmittance is None:
            return single, more
        fraction = transmittance(ray.t0 + node.s, node.where)
        return single * fraction, more * fraction

    single, onward = integrate(NODES, of_place)
    return single, onward + _turned(lamp, ray, part, light, m, integrate, transmittance)


def _absorbing(light: LampSpectrum, length: Operand, leg: Operand) -> Operand:
    """What counts of a length over a place, of which so much is wet before it."""
    return length if light.inelastic is None else length - leg * light.inelastic.changed


def _onward(light: LampSpectrum, node: PathNode) -> Operand:
    """Logarithm of what a place adds that is not in the source."""
    made, water = light.inelastic, light.water
    if made is None:
        return water.spread.narrow.at(length=node.length, half=node.half)
    t = node.length - node.wet
    found = made.onward.at(length=node.length - t * made.changed, half=node.half)
    return found - (water.wide * (t * made.changed) + made.decay * node.wet)


def _turned(
    lamp: Lamp,
    ray: RayPastLamp,
    part: LitPart,
    light: LampSpectrum,
    m: Mathematics,
    integrate: Quadrature,
    transmittance: Transmittance | None,
) -> Operand:
    """Radiance of light that was scattered already when it is scattered into the ray.

    The integral is over u = asinh(s/h), s from the point nearest to the lamp: ds is r du.
    """
    water, made = light.water, light.inelastic
    source = water.field.source(lamp.profile) if made is None else made.source
    end = m.maximum(ray.near, 0.0) + water.reach
    last = m.maximum(m.minimum(ray.far, m.maximum(end, ray.near)), ray.first)
    first, stop = (asinh(s, ray.h, m) for s in (ray.first, last))
    width = m.maximum(stop - first, 0.0)

    def term(place: Operand, fraction: Operand) -> tuple[Operand]:
        grown = m.exp(first + width * place)
        s, r = ray.h * (grown - 1.0 / grown) / 2.0, ray.h * (grown + 1.0 / grown) / 2.0
        turned, t = (ray.across * ray.h + ray.along * s) / r, m.maximum(ray.t0 + s, 0.0)
        where = ray.place(s)
        lit = _source_lit(lamp, ray, part, (s, r, where), m)
        lost = water.wide * t
        if made is not None:
            lost = lost + made.decay * lamp.wet(r, where[2], m)
        left = m.exp(0.0 - lost) * (width * fraction)
        bent, off_axis = 0.0 - s / r, 0.0 - ray.along
        leg = lamp.wet(r, where[2], m)
        # Scattered as on the leg in the water, and as faint as at r.
        lit = lit * leg / r if lamp.shines_in else lit
        seen = source_seen(source, leg, turned, bent, off_axis, m)
        arriving = light.arriving(seen * (lit * left), _absorbing(light, leg + t, leg), m)
        return (arriving if transmittance is None else arriving * transmittance(ray.t0 + s, where),)

    return integrate(MORE_NODES, term)[0]


def _source_lit(
    lamp: Lamp,
    ray: RayPastLamp,
    part: LitPart,
    at: tuple[Operand, Operand, Sequence[Operand]],
    m: Mathematics,
) -> Operand:
    """Fraction of a source's light that objects leave.

    ``at`` are the distance along the ray, that from the lamp, and the place as the lamp sees it.
    """
    s, r, where = at
    here = lamp.scattered_lit(where, m)
    if lamp.soft is None:
        return here
    turned = 2.0 * half_angle(s, ray.h, m)
    first, last = (2.0 * end for end in part.ends)
    begin = m.maximum(turned, first)
    near, far = 1.0 / (begin * begin), 1.0 / m.power(m.maximum(last, begin), 2.0)
    sine = ray.h / r
    fraction = 0.5 * turned * turned * turned * (near - far)
    middle = m.sqrt(2.0 / (near + far))
    beyond = lamp.scattered_lit(ray.place(0.0 - ray.h / m.tan(middle)), m)
    return (sine * here + fraction * beyond) / (sine + fraction)


def asinh(s: Operand, h: Operand, m: Mathematics) -> Operand:
    """Return asinh(s/h), over which places on a ray are even about a lamp.

    Examples
    --------
    >>> bool(np.isclose(asinh(-3.0, 2.0, NUMPY), np.arcsinh(-1.5)))
    True
    """
    size = m.log((m.absolute(s) + m.sqrt(s * s + h * h)) / h)
    return m.select(m.less(s, 0.0), 0.0 - size, size)
