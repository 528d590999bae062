"""Shadows of clouds in the water's daylight: what they leave of it along a path."""

from __future__ import annotations

from collections.abc import Sequence

from ..mathematics import Operand
from .cloud_light import Clouds
from .cloud_numbers import Sum, add_up

STEPS = 6
"""Places of a path that are looked at, one in each equal fraction of the light that it brings."""
_SHORTEST = 1e-3  # optical depth


def daylit_fractions(
    clouds: Clouds,
    origin: Sequence[Operand],
    w: Sequence[Operand],
    P: Operand,
    rate: Operand,
    chance: Operand,
    add: Sum = add_up,
) -> tuple[Operand, Operand]:
    """Fractions of daylight on a path that clouds leave, in channels: of the sun's, of the rest.

    What was scattered before comes along the sun's beam in part, and is dimmed there as that is.

    Sunlight that is scattered once falls off along it at the ``rate``, 1/m
    (:meth:`.ChannelWater.falling_off`); ``chance``, even from 0 to 1, is where in its fraction each
    place lies. ``add`` adds up the places.
    """
    m = clouds.m
    x = rate * P
    x = m.select(m.less(m.absolute(x), _SHORTEST), _SHORTEST, x)
    span = 1.0 - m.exp(-x)

    def terms(index: Operand) -> Sequence[Operand]:
        fraction = (index + chance) * (1.0 / STEPS)
        s = P * (-m.log(1.0 - fraction * span) / x)
        point = [a + b * s for a, b in zip(origin, w, strict=True)]
        return clouds.sunlight_transmittance(point), clouds.skylight_transmittance(
            point, all_round=True
        )

    single, scattered = add(STEPS, terms)
    return single * (1.0 / STEPS), scattered * (1.0 / STEPS)
