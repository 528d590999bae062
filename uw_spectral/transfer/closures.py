"""What closures of materials throw back of light from many sides, where renderers do not say."""

from __future__ import annotations

import math

from ..mathematics import NUMPY, Mathematics, Operand

# Fitted to what Cycles 5.2 throws back in a white furnace, roughness .1 to 1, within .03.
_SHEEN = (0.056, 0.236, 2.6, -1.793)
_SMOOTHEST = 0.05
_HAIR, _DARKEST = (0.6, 0.2, 16.0), 1e-6
_AMONG_HAIR = 3.0


BOTH_SIDES = 0.5
"""Fraction of the light from behind in that inside a closed translucent body.

There it is what falls on the body in the mean over its sides, and all of its walls throw on the
same. Two opposite sides stand for all of them.
"""


def whole_closure(colour: Operand, m: Mathematics = NUMPY, *, closed: bool = False) -> Operand:
    """Colour of a translucent closure with a thickness that throws on as much as a colour does.

    EEVEE multiplies by what a closure holds twice, once for each of two walls, whatever it was
    mixed with, and lets a body send light of the sun to all sides as if its walls caught 1/pi of
    it and not, as each convex one does in the mean (Cauchy), a quarter.

    ``colour`` is what light is multiplied by, weights and all walls included; a body is ``closed``.

    Examples
    --------
    >>> whole_closure(0.25).item(), (whole_closure(1.0, closed=True) ** 2 / math.pi).round(3).item()
    (0.5, 0.25)
    """
    return m.sqrt(m.maximum(colour * (math.pi / 4.0 if closed else 1.0), 0.0))


def sheen_albedo(roughness: Operand, cosine: Operand, m: Mathematics = NUMPY) -> Operand:
    """Fraction of uniform light that a white sheen throws towards a direction.

    The cosine is between it and the normal, 0 to 1.

    Examples
    --------
    >>> sheen_albedo(0.5, 0.62).round(3).item()  # Cycles: .096
    0.102
    """
    a, b, c, d = _SHEEN
    r = m.maximum(roughness, _SMOOTHEST)
    return m.minimum(m.exp(-(a + b * r + cosine * (c / r + d))), 1.0)


def hair_albedo(colour: Operand, m: Mathematics = NUMPY) -> Operand:
    """Colour of matte threads that throw back what a tuft of hair of a colour does.

    Hair sends light on into the tuft, where more of it is lost; white hair loses none. Fitted to
    Cycles 5.2, tufts of five colours over matte ones, under a sky and suns from four sides:
    reflecting hair .3 to .8, pigment in water .9 (dark) to .4 (bright).

    Examples
    --------
    >>> hair_albedo(1.0).round(3).item(), hair_albedo(0.5).round(3).item()
    (1.0, 0.25)
    """
    dark, bright, steep = _HAIR
    white = m.power(m.maximum(colour, _DARKEST), steep)
    return colour * (dark - bright * colour) + (1.0 - dark + bright) * white


def among_hair(seen: Operand, reflectance: Operand, m: Mathematics = NUMPY) -> Operand:
    """Fraction of even light from all sides that threads in a tuft get.

    A picture's depths show the foremost threads alone; those behind hide more, the less the
    brighter all are: white ones hide nothing. Fitted to Cycles 5.2 and EEVEE's depths, nine tufts
    of three reflectances: fur of 1 to 20 thousand threads, .04 to .2 m long, meadows from above and
    level; single tufts are some 30 % off.

    ``seen`` is the fraction of the sides that is open by a picture's depths, as far as threads are
    long.

    Examples
    --------
    >>> among_hair(0.65, 0.3).round(2).item(), among_hair(0.65, 1.0).item()
    (0.28, 1.0)
    """
    cubed = reflectance * reflectance * reflectance
    return m.power(m.maximum(seen, _DARKEST), _AMONG_HAIR * (1.0 - cubed))
