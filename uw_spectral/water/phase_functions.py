"""Phase functions of particles, bubbles and molecules, their mixtures in water, and their names."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DataWarning, InputError, unknown_name
from ..mathematics import NUMPY, Mathematics, Operand
from ..spectra.spectrum import shipped_table
from .phase import PER_SPHERE, BandPhase, PhaseFunction, PhaseModel

_LARGEST_PARTICLE_INDEX = 1.5
BACKSCATTER_RANGE = (1e-4, 0.2)
"""bb/b on the line of index and slope of sea particles."""


@dataclass(frozen=True)
class Isotropic(PhaseFunction):
    """The same in every direction."""

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return 1/(4π)."""
        del m
        return 0.0 * s2 + PER_SPHERE


def henyey_greenstein(g: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Return the Henyey-Greenstein function, 1/sr, at s2 = sin²(angle / 2).

    Written as (1 - g)² + 4 g s2, which does not cancel in the forward peak.
    """
    narrow = (1.0 - g) * (1.0 - g) + 4.0 * g * s2
    return PER_SPHERE * (1.0 - g) * (1.0 + g) / (narrow * m.sqrt(narrow))


def draine(g: Operand, alpha: Operand, s2: Operand, m: Mathematics = NUMPY) -> Operand:
    """Return the Draine function, 1/sr, at s2 = sin²(angle / 2): HG(g) times 1 + α cos².

    B. T. Draine, Astrophys. J. 598, 1017 (2003).
    """
    return _with_squared_cosine(henyey_greenstein(g, s2, m), g, alpha, s2)


def _with_squared_cosine(p: Operand, g: Operand, alpha: Operand, s2: Operand) -> Operand:
    """Multiply the Henyey-Greenstein function p of mean cosine g by 1 + α cos², normalised."""
    cosine = 1.0 - 2.0 * s2
    return p / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0) * (1.0 + alpha * cosine * cosine)


@dataclass(frozen=True)
class HenyeyGreenstein(PhaseFunction):
    """Henyey-Greenstein function of mean cosine g.

    Examples
    --------
    >>> round(HenyeyGreenstein(0.8).backscatter_ratio, 3)
    0.051
    """

    asymmetry: float

    def __post_init__(self) -> None:
        _check_asymmetry(self.asymmetry)

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr."""
        return henyey_greenstein(self.asymmetry, s2, m)


@dataclass(frozen=True)
class TwoTermHenyeyGreenstein(PhaseFunction):
    """``fraction`` of HG(g1) and ``1 - fraction`` of HG(g2)."""

    g1: float
    g2: float
    fraction: float

    def __post_init__(self) -> None:
        _check_asymmetry(self.g1)
        _check_asymmetry(self.g2)
        if not 0 <= self.fraction <= 1:
            raise InputError(
                f"two-term Henyey-Greenstein: the fraction of the first term must be 0 to 1, "
                f"got {self.fraction:g}"
            )

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr."""
        first = henyey_greenstein(self.g1, s2, m)
        return self.fraction * first + (1.0 - self.fraction) * henyey_greenstein(self.g2, s2, m)


@dataclass(frozen=True)
class EinsteinSmoluchowski(PhaseFunction):
    """Molecular scattering of water, ∝ 1 + f cos².

    f = (1 - δ)/(1 + δ) for the depolarisation ratio δ: 0.925 for δ = 0.039, with which
    Zhang et al. 2009 compute the scattering coefficient that is used with it
    (:func:`.molecular_scattering`); 0.835 for δ = 0.09 (Morel 1974).
    """

    anisotropy: float = (1 - 0.039) / (1 + 0.039)

    def __post_init__(self) -> None:
        if not 0 <= self.anisotropy <= 1:
            raise InputError(
                f"Einstein-Smoluchowski: the factor of cos² must be 0 to 1, got {self.anisotropy:g}"
            )

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr."""
        del m
        return _with_squared_cosine(PER_SPHERE, 0.0, self.anisotropy, s2)


@dataclass(frozen=True)
class Rayleigh(EinsteinSmoluchowski):
    """Scattering by small particles without depolarisation, ∝ 1 + cos²."""

    anisotropy: float = 1.0


@dataclass(frozen=True)
class FournierForand(PhaseFunction):
    """Fournier-Forand function: spheres of a Junge (power law) size distribution.

    G. Fournier & M. Jonasz, Proc. SPIE 3761 (1999), with the slope from bb/b as
    in C. D. Mobley, L. K. Sundman & E. Boss, Appl. Opt. 41, 1035 (2002). Blender
    Cycles uses the same parameters. The forward peak is infinite but integrable.

    Raises
    ------
    InputError
        If a parameter is out of its range.

    Examples
    --------
    >>> round(FournierForand(1.10, 0.0183).junge_slope, 4)
    3.5833
    """

    #: Real index of the particles relative to water, above 1, at most 1.5.
    refractive_index: float = 1.10
    #: bb/b, between 0 and 0.5. It fixes the Junge slope μ between 3 and 5.
    backscatter: float = 0.0183

    def __post_init__(self) -> None:
        n, ratio = self.refractive_index, self.backscatter
        if not 1 < n <= _LARGEST_PARTICLE_INDEX:
            raise InputError(
                "Fournier-Forand: the index of the particles relative to water must be above 1 "
                f"and at most {_LARGEST_PARTICLE_INDEX:g}, got {n:g}"
            )
        if not 0 < ratio < 0.5:
            raise InputError(f"Fournier-Forand: bb/b must be between 0 and 0.5, got {ratio:g}")

    @classmethod
    def from_junge_slope(cls, refractive_index: float, slope: float) -> FournierForand:
        """Make the function from the index and the Junge slope μ (3 to 5).

        Examples
        --------
        >>> round(FournierForand.from_junge_slope(1.10, 3.5833).backscatter, 4)
        0.0183
        """
        if not (refractive_index > 1 and 3 < slope < 5):
            raise InputError(
                "Fournier-Forand: the index must be above 1 and the Junge slope between 3 and 5, "
                f"got {refractive_index:g} and {slope:g}"
            )
        delta90 = 2.0 / (3.0 * (refractive_index - 1.0) ** 2)
        ratio = (delta90 ** (-(3.0 - slope) / 2.0) - 1.0) / (2.0 * (delta90 - 1.0))
        return cls(refractive_index, ratio)

    @classmethod
    def of_backscatter_Mobley2002(cls, ratio: float) -> FournierForand:
        """Make the function of bb/b, 0.0001 to 0.2, on the line of sea particles.

        n = 1.01 + 0.1542 (μ - 3), of C. D. Mobley, L. K. Sundman & E. Boss, Appl. Opt. 41, 1035
        (2002): particles that scatter less backwards are softer as well as larger.
        """
        low, high = BACKSCATTER_RANGE
        if not low <= ratio <= high:
            raise InputError(
                f"Fournier-Forand: on the line of sea particles bb/b is {low:g} to {high:g}, got "
                f"{ratio:g}"
            )

        def index_of(slope: float) -> float:
            return 1.01 + 0.1542 * (slope - 3.0)

        low, high = 3.01, 4.9
        for _ in range(60):
            slope = (low + high) / 2
            more = cls.from_junge_slope(index_of(slope), slope).backscatter > ratio
            low, high = (low, slope) if more else (slope, high)
        return cls(index_of(low), ratio)

    @property
    def _delta90(self) -> float:
        return 2.0 / (3.0 * (self.refractive_index - 1.0) ** 2)

    @property
    def junge_slope(self) -> float:
        """Slope μ of the particle size distribution."""
        inside = 1 + 2 * self.backscatter * (self._delta90 - 1)
        return 3.0 + 2.0 * math.log(inside) / math.log(self._delta90)

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr."""
        nu = (3.0 - self.junge_slope) / 2.0
        delta = 2.0 * self._delta90 * s2
        # With ρ = (1 - δ^ν)/(1 - δ) the published bracket over (1 - δ)² is τ/s2 - σ,
        # σ = (ρ - ν)/(1 - δ), τ = (δρ - ν)/(1 - δ): both smooth at δ = 1, where they
        # come from the binomial series.
        epsilon = 1.0 - delta
        near = m.less(m.absolute(epsilon), 0.1)
        small = m.clamp(epsilon, -0.1, 0.1)
        coefficients = [nu]
        for order in range(1, 9):
            coefficients.append(-coefficients[-1] * (nu - order) / (order + 1))
        rho_series, sigma_series = 0.0, 0.0
        for coefficient in reversed(coefficients):
            rho_series = rho_series * small + coefficient
        for coefficient in reversed(coefficients[1:]):
            sigma_series = sigma_series * small + coefficient
        away = m.select(near, 0.5, delta)
        rho = (1.0 - m.power(away, nu)) / (1.0 - away)
        sigma = m.select(near, sigma_series, (rho - nu) / (1.0 - away))
        tau = m.select(near, sigma_series - rho_series, (away * rho - nu) / (1.0 - away))
        forward = PER_SPHERE * (tau / s2 - sigma) / m.power(delta, nu)
        delta180 = 2.0 * self._delta90
        back = (1.0 - delta180**nu) / (16.0 * math.pi * (delta180 - 1.0) * delta180**nu)
        cosine = 1.0 - 2.0 * s2
        return forward + back * (3.0 * cosine * cosine - 1.0)


class TabulatedPhase(PhaseFunction):
    """A phase function of one of the project's own tables, :attr:`TABLE`.

    Log-log interpolation in ``s2``; the power law of the first two rows below the first;
    normalised over the sphere.
    """

    TABLE: ClassVar[str]

    @property
    def kinks(self) -> tuple[float, ...]:
        """The angles of the table, in rad."""
        log_s2, _ = _logarithmic(self.TABLE)
        return tuple(2 * np.arcsin(np.exp(log_s2[1:-1] / 2)))

    def per_steradian(self, s2: Operand, m: Mathematics = NUMPY) -> Operand:
        """Return the value in 1/sr."""
        log_s2, log_value = _logarithmic(self.TABLE)
        return m.exp(m.interpolate(m.log(s2), log_s2, log_value))


@dataclass(frozen=True)
class PetzoldAverage(TabulatedPhase):
    """Average of Petzold's measured sea particles (Mobley et al. 1993, Table 2)."""

    TABLE = "petzold_average_particle_phase_function.csv"


@functools.cache
def _logarithmic(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Logarithms of s2 and of the normalised phase function, increasing in s2."""
    table = shipped_table(name)
    half_angle = np.radians(table.columns["angle_deg"]) / 2
    x, y = 2 * np.log(np.sin(half_angle)), np.log(table.columns["phase_function_per_sr"])
    # The power law below the first angle is a straight line in these axes: one far point holds it.
    slope = (y[1] - y[0]) / (x[1] - x[0])
    far = -150.0
    x, y = np.append(far, x), np.append(y[0] + slope * (far - x[0]), y)
    # dΩ = 4π d(s2), and p is a power of s2 in each interval.
    exponent = 1 + np.diff(y) / np.diff(x)
    pieces = (np.exp(y[1:] + x[1:]) - np.exp(y[:-1] + x[:-1])) / exponent
    return x, y - math.log(4 * math.pi * pieces.sum())


def seawater_mixture(
    b: ArrayLike, b_molecular: ArrayLike, particles: PhaseFunction | None = None
) -> BandPhase:
    """b-weighted mixture of molecular and particle scattering.

    ``b_molecular`` is the part of b, 1/m, by water molecules and ions. It counts as at most b:
    fitted water types can lie a little below the molecular value. Particles are Fournier-Forand
    1.10, 0.0183 by default.

    Warns
    -----
    DataWarning
        If the molecular part exceeds b by more than a quarter.
    """
    b, b_molecular = np.broadcast_arrays(np.atleast_1d(b).astype(float), b_molecular)
    if not (np.all(b >= 0) and np.all(b_molecular >= 0)):
        raise InputError("phase mixture: scattering coefficients must be finite and not negative")
    if np.any((b > 0) & (b_molecular > 1.25 * b)):
        warnings.warn(
            "the scattering of this water is well below that of pure seawater in some bands; "
            "all of it is taken as molecular there",
            DataWarning,
            stacklevel=2,
        )
    fraction = np.divide(b_molecular, b, out=np.ones_like(b), where=b > b_molecular)
    return BandPhase(
        (EinsteinSmoluchowski(), particles or FournierForand()), np.stack([fraction, 1 - fraction])
    )


@dataclass(frozen=True)
class SeawaterMixture:
    """Choice of a molecular and particle mixture, resolved when the water is known."""

    particles: PhaseFunction = FournierForand()

    def for_bands(self, b: ArrayLike, b_molecular: ArrayLike | None = None) -> BandPhase:
        """Mix by b; see :func:`seawater_mixture`.

        Raises
        ------
        InputError
            If the molecular scattering is not given.
        """
        if b_molecular is None:
            raise InputError("phase mixture: the molecular scattering per band is needed")
        return seawater_mixture(b, b_molecular, self.particles)


_PARSERS: dict[str, tuple[str, tuple[int, ...], Callable[..., PhaseModel]]] = {
    "hg": ("hg:g", (1,), HenyeyGreenstein),
    "tthg": ("tthg:g1,g2,share", (3,), TwoTermHenyeyGreenstein),
    "fournier-forand": ("fournier-forand:index,bb/b", (2,), FournierForand),
    "petzold": ("petzold", (0,), PetzoldAverage),
    "rayleigh": ("rayleigh", (0,), Rayleigh),
    "einstein-smoluchowski": (
        "einstein-smoluchowski or einstein-smoluchowski:factor of cos²",
        (0, 1),
        EinsteinSmoluchowski,
    ),
    "isotropic": ("isotropic", (0,), Isotropic),
    "mixture": (
        "mixture or mixture:bb/b of the particles",
        (0, 1),
        lambda *ratio: SeawaterMixture(*map(FournierForand.of_backscatter_Mobley2002, ratio)),
    ),
}


def parse_phase(text: str) -> PhaseModel:
    """Read a phase function as the user writes it.

    As ``hg:0.8``, ``tthg:0.9,-0.3,0.97``, ``fournier-forand:1.10,0.0183``, ``petzold``,
    ``rayleigh``, ``einstein-smoluchowski``, ``isotropic``, ``mixture`` or ``mixture:0.0183``.

    Raises
    ------
    InputError
        Unknown name, wrong number of values, or values out of range.
    """
    name, _, listed = text.strip().lower().partition(":")
    if name not in _PARSERS:
        raise unknown_name("phase function", name, _PARSERS)
    usage, counts, make = _PARSERS[name]
    cells = [cell for cell in listed.split(",") if cell.strip()]
    try:
        values = [float(cell) for cell in cells]
    except ValueError as error:
        raise InputError(f"phase function {text!r}: not a number; write {usage}") from error
    if len(values) not in counts:
        raise InputError(f"phase function {text!r}: {len(values)} values; write {usage}")
    return make(*values)


def _check_asymmetry(g: float) -> None:
    if not -1 < g < 1:
        raise InputError(f"Henyey-Greenstein: g must be between -1 and 1, got {g:g}")
