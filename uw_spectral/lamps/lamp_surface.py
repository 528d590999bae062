"""Irradiance that lamps put on objects in the water.

Unscattered light falls off as e^{-c r}. What is scattered on the way comes from directions, and
left the lamp in directions, that are spread as :mod:`.angular_spread` says; nothing is fitted.
Most of it still comes from about the lamp, and has the lamp's shadows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..mathematics import NUMPY, Mathematics, Operand, dot
from .angular_spread import ABOUT, OF_SURFACES
from .lamp import Lamp, LitPart
from .lamp_shadow import PART_SIDE, lit, transmitted_in_shadow
from .multiple_scattering import LampWater
from .scattered_irradiance import arriving_on

TYPICAL_DISTANCE = 2.0
"""Of objects from the lamps that light them, m."""
_FAINTEST = 0.05
_FLATTEST = 0.05  # cosine to the vertical
_FAINTEST_PART = 1e-9  # 1/m²
_SMALLEST = 1e-6  # m²


def lamplight(
    lamps: Sequence[Lamp],
    water: LampWater,
    camera: Sequence[float],
    seen: ArrayLike = (),
) -> NDArray[np.float64]:
    """Irradiance of lamps by which a camera exposes, shape (n,).

    The mean of the brightest quarter of places that it sees, on surfaces that face the lamp,
    dimmed by the water from there to the camera. Where it sees nothing lit: that of a surface
    on each lamp's axis at the usual distance, dimmed likewise, at most to a twentieth.

    ``seen`` (k, 3) are places on objects in the picture.
    """
    places = np.asarray(seen, dtype=np.float64).reshape(-1, 3)
    if len(places):
        E = sum(_facing(lamp, places, water) for lamp in lamps)
        E = E * _dimmed(places, water, camera)
        order = np.argsort(E.mean(axis=-1))[::-1]
        brightest = E[order[: max(len(order) // 4, 1)]].mean(axis=0)
        if brightest.max() > 0:
            return brightest
    total = np.zeros(np.shape(water.c))
    for lamp in lamps:
        dry = float(lamp.dry) / max(-float(lamp.axis[2]), _FLATTEST) if lamp.shines_in else 0.0
        place = (np.array(lamp.position) + (dry + TYPICAL_DISTANCE) * np.array(lamp.axis))[None]
        dimmed = np.maximum(_dimmed(place, water, camera), _FAINTEST)
        total = total + (_facing(lamp, place, water) * dimmed)[0]
    return total


def _facing(lamp: Lamp, places: NDArray[np.float64], water: LampWater) -> NDArray[np.float64]:
    """Irradiance on surfaces that face a lamp, shape (k, n)."""
    columns = tuple(places.T[..., None])
    _, u = lamp.towards(columns)
    patch = patch_past_lamp(lamp, columns, tuple(-x for x in u))
    return np.asarray(sum(surface_irradiance(lamp, patch, water)))


def forward_transmittance(P: Operand, water: LampWater) -> Operand:
    """Fraction of the light of objects that arrives scattered by small angles over the distance P.

    What is lit by lamps has no unoccluded water about it that shines likewise: only what is near
    it in the picture does.
    """
    return forward_fraction(P, water) * np.exp(-water.a * P)


def forward_fraction(P: Operand, water: LampWater) -> Operand:
    """Return :func:`forward_transmittance`, absorption apart."""
    return water.spread.on_patches.at(length=P, quantity=OF_SURFACES)


def _dimmed(
    places: NDArray[np.float64], water: LampWater, camera: Sequence[float]
) -> NDArray[np.float64]:
    away = np.linalg.norm(places - np.array(camera), axis=-1)[:, None]
    return np.exp(-water.c * away) + forward_transmittance(away, water)


@dataclass(frozen=True, eq=False)
class PatchPastLamp:
    """A lamp as a patch sees it: what all bands share."""

    r: Operand  #: Distance, m, at least the radius of the lamp.
    #: Normal irradiance over intensity without water, Φ(θ) / (r² + R²), 1/m².
    per_intensity: Operand
    #: Between the patch's normal and the direction to the lamp; negative behind it.
    cosine: Operand
    off_axis: Operand  #: Cosine between the lamp's axis and the direction to the patch.
    against: Operand  #: Cosine between the lamp's axis and the direction into the patch.
    wet: Operand  #: Of the distance what is in the water, m.
    #: Fraction of what is scattered to it from about the lamp that it gets where it does not see
    #: it.
    transmittance: Operand = 0.0
    #: Of the patch; only what lamps that have parts do is computed from them.
    point: Sequence[Operand] = ()
    normal: Sequence[Operand] = ()

    def about(self, visible: Operand) -> Operand:
        """Fraction of that light where so much of the lamp is seen."""
        return visible + (1.0 - visible) * self.transmittance


def patch_past_lamp(
    lamp: Lamp, point: Sequence[Operand], normal: Sequence[Operand], m: Mathematics = NUMPY
) -> PatchPastLamp:
    """Return how a patch sees a lamp.

    A lamp of finite radius R counts as a disc that faces the patch: on its axis the normal
    irradiance of a disc is π L R²/(r² + R²), exactly, and so it stays finite at the lamp.
    """
    r, u = lamp.towards(point, m)
    off_axis = dot(lamp.axis, u)
    place = [point[i] - lamp.position[i] for i in range(3)]
    z = place[2]
    per_intensity = lamp.profile.value(off_axis, m) * _normal(lamp, r) * lamp.under(z, m)
    transmittance = 0.0 if lamp.soft is None else transmitted_in_shadow(lamp.soft, place, m)
    cosine, against = 0.0 - dot(normal, u), 0.0 - dot(normal, lamp.axis)
    wet = lamp.wet(r, z, m)
    return PatchPastLamp(
        r, per_intensity, cosine, off_axis, against, wet, transmittance, point, normal
    )


def _part_seen(part: LitPart, patch: PatchPastLamp, m: Mathematics) -> tuple[Operand, Operand]:
    """Irradiance of a part over its intensity without water, 1/m², and its distance, m."""
    place, normal = [patch.point[i] - part.position[i] for i in range(3)], patch.normal
    r2 = dot(place, place)
    r = m.sqrt(r2 + _SMALLEST)
    facing = m.maximum(dot(part.axis, place), 0.0) * m.maximum(0.0 - dot(normal, place), 0.0)
    facing = facing / ((r2 + _SMALLEST) * (r2 + part.radius * part.radius + _SMALLEST))
    if part.shadow is not None:
        facing = facing * lit(part.shadow, place, m, PART_SIDE)
    return facing, r


def _normal(lamp: Lamp, r: Operand) -> Operand:
    """Normal irradiance of an even lamp over intensity without water, 1/m²."""
    return 1.0 / (r * r + lamp.radius * lamp.radius)


def surface_irradiance(
    lamp: Lamp, patch: PatchPastLamp, water: LampWater
) -> tuple[Operand, Operand, Operand]:
    """Irradiance on a patch: unscattered, scattered to it from about the lamp, and the rest.

    In the unit of the intensity per m²; the first two are 0 from behind, and are what a renderer
    shadows. Arrays of the patch need a last axis of 1 for the bands.
    """
    found = arriving_light(lamp, patch, water)
    light = lamp.intensity * np.exp(-water.a * found.length)
    about = found.about * np.maximum(patch.cosine, 0.0)
    return light * found.direct, light * about, light * found.rest


@dataclass(frozen=True, eq=False)
class ArrivingLight:
    """Irradiance over the intensity of a lamp, absorption apart."""

    direct: Operand  #: Unscattered.
    #: Unscattered, and scattered from about the lamp, on a patch that faces it.
    straight: Operand
    about: Operand
    rest: Operand  #: Scattered from elsewhere.
    length: Operand  #: Of the way of what is not scattered in the water, m.

    def shadowed(self, patch: PatchPastLamp, visible: Operand) -> ArrivingLight:
        """Return what arrives where so much of the lamp is seen."""
        direct, straight = self.direct * visible, self.straight * visible
        about = self.about * patch.about(visible)
        return ArrivingLight(direct, straight, about, self.rest, self.length)


def arriving_light(
    lamp: Lamp, patch: PatchPastLamp, water: LampWater, m: Mathematics = NUMPY
) -> ArrivingLight:
    """Return the light of :func:`surface_irradiance` over the intensity, absorption apart."""
    straight = m.exp(-water.b * patch.wet) * patch.per_intensity
    onward = water.spread.on_patches.at(length=patch.wet, quantity=ABOUT)
    # Over that of an isotropic lamp.
    profile = water.spread.profile(lamp.profile)
    onward = onward * profile.at(length=patch.wet, cosine=patch.off_axis) * _normal(lamp, patch.r)
    arriving = water.field.arriving(lamp.profile)
    turned = arriving_on(arriving, patch.wet, patch.off_axis, patch.cosine, patch.against, m)
    # Scattered as on the way in the water, and as faint as at r.
    about, rest = (part * (patch.wet / (patch.r * patch.r)) for part in turned)
    direct, length = straight * m.maximum(patch.cosine, 0.0), patch.wet
    if lamp.parts is not None:

        def of_part(part: LitPart) -> tuple[Operand, Operand, Operand]:
            facing, r = _part_seen(part, patch, m)
            return facing, facing * r, m.exp(-water.b * r) * facing * part.fraction

        facing, way, virtual = lamp.parts.total(of_part)
        length = (way + _FAINTEST_PART * patch.wet) / (facing + _FAINTEST_PART)
        direct = direct * (1.0 - lamp.virtual) + virtual
    return ArrivingLight(direct, straight, onward + about, rest, length)
