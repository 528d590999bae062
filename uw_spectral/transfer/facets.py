"""Closures of facets that mirror: metals, glossy ones, coats and what is clear, in a light.

What facets throw from one to another is as bright as Blender's *Multiscatter GGX* has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..mathematics import NUMPY, Mathematics, Operand, dot
from ..surface.refraction import fresnel_reflectance
from .highlights import Vector, round_highlight

_SMOOTHEST = 1e-3  # width of slopes
_THINNEST = 0.2  # index
_MEAN_EDGE = 1.0 / 21.0  # of (1 - u)^5 over all sides
_MOST_LOST = 0.9
# Of light that a white one loses, by powers of the roughness from 2 on and of the cosine from 0
# on: fitted to GGX with Smith's shadowing, within .03 at cosines from .3 on (.08 below).
_LOST = ((2.301, -5.643, 2.409), (-4.93, 16.826, -8.41), (2.807, -10.223, 5.549))


@dataclass(frozen=True, eq=False)
class Facets:
    """A closure of facets.

    At an angle with the cosine u they reflect ``even`` + ``grazing`` (1 - u)⁵ + ``clear`` F(u), F
    by Fresnel's equations.
    """

    normal: Vector  #: Unit vector.
    roughness: Operand  #: As of Blender's closures.
    #: Linear Rec.709.
    even: Sequence[Operand] = (0.0, 0.0, 0.0)
    grazing: Sequence[Operand] = (0.0, 0.0, 0.0)
    clear: Sequence[Operand] = (0.0, 0.0, 0.0)
    index: Operand = 1.0  #: Refractive index against what is around it.

    def colour(self, cosine: Operand, m: Mathematics = NUMPY) -> list[Operand]:
        """What they reflect at an angle."""
        away = m.clamp(1.0 - cosine, 0.0, 1.0)
        edge = away * away * away * away * away
        clear = fresnel_reflectance(cosine, m.maximum(self.index, _THINNEST), m)
        parts = zip(self.even, self.grazing, self.clear, strict=True)
        return [one + other * edge + third * clear for one, other, third in parts]

    def highlight(
        self,
        to_eye: Vector,
        half: Vector,
        to_light: Vector,
        angle2: Operand,
        m: Mathematics = NUMPY,
    ) -> Operand:
        """Return that of a white one, as of :func:`.round_highlight`.

        Directions are unit vectors. ``angle2`` is the mean square angle of the light from its
        middle, rad²; it makes the highlight wider: a mirror is as bright in the middle as an even
        disc is.
        """
        width = m.maximum(self.roughness * self.roughness, _SMOOTHEST)
        width2 = m.minimum(width * width + 0.5 * angle2, 1.0)
        return round_highlight(self.normal, to_eye, half, to_light, width2, m)

    def with_all_light(self, to_eye: Vector, m: Mathematics = NUMPY) -> Facets:
        """Return them with what facets throw from one to another, seen from a direction."""
        cosine = m.clamp(dot(self.normal, to_eye), 0.0, 1.0)
        here, mean = (_lost(self.roughness, by) for by in (_powers(cosine), _MEANS))
        lost, mean = (m.clamp(x, 0.0, _MOST_LOST) for x in (here, mean))
        gained = lost / (1.0 - lost)

        def brighter(even: Operand, grazing: Operand) -> Operand:
            F = even + _MEAN_EDGE * grazing
            return 1.0 + gained * (F * (1.0 - mean) / (1.0 - F * mean))

        factors = [brighter(*parts) for parts in zip(self.even, self.grazing, strict=True)]
        return replace(
            self,
            even=[part * factor for part, factor in zip(self.even, factors, strict=True)],
            grazing=[part * factor for part, factor in zip(self.grazing, factors, strict=True)],
        )


def specular_index(index: Operand, level: Operand, m: Mathematics = NUMPY) -> Operand:
    """Refractive index of what reflects 2 × level times as much from straight ahead.

    ``level`` is the *Specular IOR Level* of Blender's Principled BSDF.
    """
    amplitude = m.absolute((index - 1.0) / (index + 1.0)) * m.sqrt(m.maximum(2.0 * level, 0.0))
    amplitude = m.minimum(amplitude, 0.99)
    dense = (1.0 + amplitude) / (1.0 - amplitude)
    return m.select(m.less(index, 1.0), 1.0 / dense, dense)


def _powers(cosine: Operand) -> tuple[Operand, ...]:
    return 1.0, cosine, cosine * cosine


_MEANS = tuple(2.0 / (power + 2.0) for power in range(3))  # of those, over all sides


def _lost(roughness: Operand, powers: Sequence[Operand]) -> Operand:
    """Fraction of its light that a white one loses between facets."""
    found: Operand = 0.0
    for row in reversed(_LOST):
        by_cosine = sum(factor * power for factor, power in zip(row, powers, strict=True))
        found = found * roughness + by_cosine
    return found * roughness * roughness
