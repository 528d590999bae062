"""Particles that are seen one by one: how many there are, how large, and how they move.

Sizes follow a power law, n(D) = K D^-s, as those of marine particles do from a micrometre to a
centimetre. Where only the scattering of a water is known, the same law says how many of its
particles are large. That the law holds over the whole range is assumed; the slope is the largest
unknown, and a setting.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..mathematics import NUMPY, Mathematics, Operand
from .pure_water import molecular_scattering

SNOW, PLANKTON, BUBBLES, SILT = "snow", "plankton", "bubbles", "silt"
COUNTED_FROM = 1e-4
"""Diameter in m from which on particles are counted: 0.1 mm, about the smallest that eyes see."""
TYPICAL_SLOPE = 3.6
"""Measured: 3.6 ± 0.33 from 0.8 to 120 µm in 168 Arctic samples (Runyan, Reynolds & Stramski 2020,
doi:10.1029/2020JC016218); 3.5 from 3 µm on in 5500 coastal ones (Reynolds et al. 2010, J. Geophys.
Res. 115(8)); 3 in images of 1 µm to 1 cm of a diatom bloom, 3.5 to 3.6 there by aperture
impedance (Jackson et al. 1997, Deep-Sea Res. I 44:1739). With 4, equal steps of log size hold
equal volumes (Sheldon, Prakash & Sutcliffe 1972, Limnol. Oceanogr. 17:327)."""
SLOPES = (3.0, 5.0)
"""Limits of the slope."""
REFERENCE_WAVELENGTH = 550.0
"""Wavelength in nm at which scattering is counted."""
# Smaller ones scatter little, for their efficiency falls below their number's rise (Stramski &
# Kiefer 1991, Prog. Oceanogr. 28:343); larger ones are rare.
_SCATTERERS = (1e-6, 1e-2)
# Of particles far larger than the wavelength: diffraction counts as much as what they meet.
_EFFICIENCY = 2.0
_GRAVITY, _VISCOSITY = 9.81, 1.05e-6  # m/s², m²/s of sea water at 20 °C
_METRE_PER_DAY = 1.0 / 86400.0
_LITRE = 1e-3


@dataclass(frozen=True)
class ParticleKind:
    """Particles of one kind."""

    name: str
    #: Diameter, m.
    smallest: float
    largest: float
    reflectance: tuple[float, float, float]  #: Linear Rec.709; of bubbles none is needed.
    #: Speed upwards of a particle of 1 mm, m/s, for those that follow a power law.
    speed: float = 0.0
    exponent: float = 0.0  #: Of that power law.
    #: Density over that of sea water, less 1, of those that fall or rise as spheres do; 0 for the
    #: power law.
    excess: float = 0.0
    wander: float = 0.0  #: How far it strays from its path, m.
    period: float = 1.0  #: In about that time, s.
    stretch: float = 1.0  #: Longest side over the mean of the others.
    slope: float | None = None  #: Of the sizes; None takes the setting.

    def rise(self, diameter: ArrayLike) -> Operand:
        """Return the speed upwards, m/s, of diameters in m, same shape.

        Examples
        --------
        >>> round(86400 * float(KINDS["snow"].rise(1e-3)), 6)
        -50.0
        """
        D = np.asarray(diameter, dtype=np.float64)
        if self.excess:
            speed = np.sign(-self.excess) * settling_FergusonChurch2004(D, abs(self.excess))
        else:
            speed = self.speed * (D / 1e-3) ** self.exponent
        return speed[()]


KINDS = {
    kind.name: kind
    for kind in (
        # Sinks 50 D^0.26 m a day, D in mm (Alldredge & Gotschalk 1988, Limnol. Oceanogr. 33:339).
        ParticleKind(
            SNOW, 1e-4, 1e-2, (0.52, 0.50, 0.44), speed=-50.0 * _METRE_PER_DAY, exponent=0.26,
            wander=0.01, period=6.0, stretch=1.7,
        ),
        # Swims a body's length or so about its place; mostly copepods.
        ParticleKind(
            PLANKTON, 3e-4, 5e-3, (0.42, 0.30, 0.22), wander=0.02, period=2.0, stretch=2.2,
        ),
        # Sizes of large bubbles in plumes of waves (Deane & Stokes 2002, Nature 418:839).
        ParticleKind(
            BUBBLES, 2e-4, 5e-3, (1.0, 1.0, 1.0), excess=-1.0, wander=0.008, period=0.4,
            slope=10.0 / 3.0,
        ),
        # Quartz and clay, stirred up.
        ParticleKind(SILT, 5e-5, 8e-4, (0.36, 0.29, 0.21), excess=1.58, wander=0.01, period=4.0),
    )
}  # fmt: skip
"""Sizes, reflectances and wander are plausible values, not measured ones, but for what is cited."""


def settling_FergusonChurch2004(diameter: ArrayLike, excess: float) -> Operand:
    """Terminal speed, m/s, of spheres of diameters in m in still sea water.

    ``excess`` is the difference of their density from that of the water, over that of the water.

    Ferguson & Church 2004, J. Sediment. Res. 74:933, with C1 = 18 and C2 = 0.4 of smooth spheres.
    It joins Stokes' law and a constant drag. Bubbles in sea water are dirty, and rise as rigid
    spheres do.
    """
    D = np.asarray(diameter, dtype=np.float64)
    pull = excess * _GRAVITY * D
    return (pull * D / (18.0 * _VISCOSITY + np.sqrt(0.75 * 0.4 * pull) * D))[()]


def _moment(low: float, high: float, slope: float, power: float) -> float:
    """Integrate D^(power - slope) from low to high, in m."""
    exponent = power - slope + 1.0
    ratio = math.log(high / low)
    if exponent == 0.0:
        return ratio
    return low**exponent * math.expm1(exponent * ratio) / exponent


def scattering_fraction(slope: float = TYPICAL_SLOPE) -> float:
    """Fraction of the particles' scattering that those larger than 0.1 mm carry.

    ``slope`` is that of the size distribution.

    From cross sections alone: n(D) D² from 1 µm to 1 cm. For 3.6 it is 6 %, for 3, as in blooms,
    a half; Davies, Basedow & McKee (2021, doi:10.1038/s41598-021-83610-5) argue that millimetre
    sizes can matter, which bulk measurements miss.
    """
    first, last = _SCATTERERS
    return _moment(COUNTED_FROM, last, slope, 2.0) / _moment(first, last, slope, 2.0)


def number_of_scattering(b_p: float, slope: float = TYPICAL_SLOPE) -> float:
    """Particles larger than 0.1 mm in a litre of a water whose particles scatter b_p, 1/m.

    Raises
    ------
    InputError
        If the slope is outside its limits.
    """
    _require_slope(slope)
    first, last = _SCATTERERS
    area = _EFFICIENCY * math.pi / 4.0 * _moment(first, last, slope, 2.0)
    return _LITRE * max(b_p, 0.0) * _moment(COUNTED_FROM, last, slope, 0.0) / area


def particle_scattering(wavelengths: ArrayLike, scattering: ArrayLike) -> float:
    """Scattering of the particles of a water at 550 nm, 1/m, by that of the whole water."""
    centres = np.asarray(wavelengths, dtype=np.float64)
    of_particles = np.asarray(scattering) - molecular_scattering(centres)
    return float(max(np.interp(REFERENCE_WAVELENGTH, centres, of_particles), 0.0))


def diameter(
    fraction: Operand, smallest: Operand, largest: Operand, slope: Operand, m: Mathematics = NUMPY
) -> Operand:
    """Diameter, m, below which a fraction of the particles of a power law between two lie.

    ``slope`` is that of n(D), above 1.
    """
    exponent = 1.0 - slope
    rare = m.power(largest / smallest, exponent)
    return smallest * m.power(1.0 - fraction * (1.0 - rare), 1.0 / exponent)


def wrapped(place: Operand, middle: Operand, side: Operand, m: Mathematics = NUMPY) -> Operand:
    """Bring a coordinate into a box around a middle, as if boxes of its kind filled all space."""
    return place - side * m.floor((place - middle) / side + 0.5)


@dataclass(frozen=True)
class SizeClass:
    """Particles between two diameters, in a box around the camera."""

    #: Diameter, m.
    smallest: float
    largest: float
    side: float  #: Of the box, m.
    count: int  #: Particles in it.
    rise: tuple[float, float]  #: Speed upwards of the smallest and of the largest, m/s.


@dataclass(frozen=True)
class ParticleCloud:
    """Particles of one kind around the camera."""

    kind: ParticleKind
    per_litre: float  #: Larger than 0.1 mm, per litre.
    slope: float  #: Of their sizes.
    angle: float  #: Smallest that is drawn: diameter over distance, radians.
    #: From small to large, each up to twice the diameter of the last.
    classes: tuple[SizeClass, ...]

    @property
    def count(self) -> int:
        """Particles in all boxes."""
        return sum(part.count for part in self.classes)


def particle_cloud(
    kind: ParticleKind,
    per_litre: float,
    *,
    slope: float = TYPICAL_SLOPE,
    angle: float = 3e-4,
    reach: float = math.inf,
    most: int = 200_000,
) -> ParticleCloud:
    """Return the particles that are large or near enough to be seen.

    Small ones are drawn near the camera only, large ones far away too: each size class fills a
    box that ends where its smallest would look smaller than an angle.

    ``per_litre`` counts particles larger than 0.1 mm; smaller ones of the kind follow the same law,
    whose ``slope`` a kind may have of its own. From ``reach``, m, on nothing is seen. With more
    particles than ``most`` the angle grows.

    Raises
    ------
    InputError
        If the slope is outside its limits, or number or angle are not positive numbers.
    """
    slope = kind.slope or slope
    _require_slope(slope)
    if not 0.0 <= per_litre < math.inf or not angle > 0.0:
        raise InputError(
            f"{per_litre:g} particles per litre down to {angle:g} radians cannot be drawn; give a "
            "number that is not negative and an angle above 0"
        )
    K = per_litre / _LITRE / _moment(COUNTED_FROM, _SCATTERERS[1], slope, 0.0)
    octaves = math.ceil(math.log2(kind.largest / kind.smallest) - 1e-9)
    ends = [min(kind.smallest * 2.0**i, kind.largest) for i in range(octaves + 1)]

    def classes(angle: float) -> list[SizeClass]:
        found = []
        for low, high in itertools.pairwise(ends):
            side = 2.0 * min(low / angle, reach)
            expected = K * _moment(low, high, slope, 0.0) * side**3
            speeds = float(kind.rise(low)), float(kind.rise(high))
            found.append(SizeClass(low, high, side, round(expected), speeds))
        return found

    found = classes(angle)
    while (count := sum(part.count for part in found)) > most:
        angle *= max((count / most) ** (1.0 / 3.0), 1.01)
        found = classes(angle)
    return ParticleCloud(kind, per_litre, slope, angle, tuple(found))


def drifted(
    start: Sequence[Operand],
    time: Operand,
    rise: Operand,
    drift: Sequence[Operand],
    wander: Operand,
    pace: Operand,
    phases: Sequence[Operand],
    m: Mathematics = NUMPY,
) -> tuple[Operand, ...]:
    """Where a particle is after some time, as three coordinates in m.

    ``wander`` is its largest stray from its path along each axis, m, ``pace`` the angle per second
    at which it strays; the three ``phases`` of the strays, radians, also make the axes' paces
    differ.
    """
    found = []
    for axis in range(3):
        way = drift[axis] + (rise if axis == 2 else 0.0)
        # Paces apart by up to a third, or all would go round in ellipses.
        turn = time * pace * (1.0 + phases[(axis + 1) % 3] * (1.0 / (6.0 * math.pi)))
        found.append(start[axis] + way * time + wander * m.sine(turn + phases[axis]))
    return tuple(found)


def _require_slope(slope: float) -> None:
    if not SLOPES[0] <= slope <= SLOPES[1]:
        raise InputError(
            f"slope of the particles' sizes: {slope:g} is outside {SLOPES[0]:g} to {SLOPES[1]:g}"
        )
