"""Light that changes its wavelength: Raman scattering and fluorescence.

A process is a coefficient per excitation band and a redistribution matrix in
photons. The closed form below drives it with the elastic light field: the
source in each emission band is a sum of exponentials of depth, and so are the
irradiances and the path radiance that follow. Like :mod:`.path_radiance` the
per-pixel formulas are plain arithmetic over a :class:`.Mathematics`.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bands import Bands
from .bio_optics import Constituents, pure_water_absorption
from .errors import InputError, unknown_name
from .light_field import DEEPEST_FLOOR, LightField, solve_light_field
from .math_backend import NUMPY, Mathematics
from .path_radiance import attenuated_path, distance_in_water
from .phase import BandPhase, EinsteinSmoluchowski, Isotropic, PhaseFunction
from .spectrum import DATA_DIRECTORY, Table, read_table
from .sun import diffuse_transmittance, fresnel_reflectance
from .water_column import WaterColumn

PROCESSES = ("raman", "chlorophyll", "cdom")
RAMAN_PHASE = EinsteinSmoluchowski(0.53)
"""(1 + 0.53 cos²)/(4π 1.177), as the Ocean Optics Web Book has it."""

# HydroLight, energy units, 1/m at 488 nm; exponent of J. S. Bartlett et al., Appl. Opt. 37, 3324
# (1998), in energy units too.
_RAMAN_488, _RAMAN_EXPONENT = 2.6e-4, 5.5
# G. E. Walrafen, J. Chem. Phys. 47, 114 (1967): amplitude, shift and full width in 1/cm.
_WALRAFEN = np.array(
    [(0.41, 3250.0, 210.0), (0.39, 3425.0, 175.0), (0.10, 3530.0, 140.0), (0.10, 3625.0, 140.0)]
)
# C. D. Mobley, Light and Water (1994), §5.15.
_CHLOROPHYLL_LINE, _CHLOROPHYLL_SIGMA = 685.0, 10.6
_CHLOROPHYLL_EXCITATION = (370.0, 690.0)
EXCITATION = Bands.uniform(20, 300.0, 700.0)
"""Bands of the light that excites: no process of ours starts elsewhere."""
QUANTUM_YIELD = 0.02
"""Of chlorophyll fluorescence; 0.01 to 0.1 in nature."""
# S. K. Hawes (1992), fulvic acid FA7; B1, B2 in 1/nm.
_A1, _A2, _B1, _B2 = 0.470, 0.407, 8.077e-4, -4.57e-4
_FULL_WIDTH = 2 * math.sqrt(2 * math.log(2))
_RESONANCE = 1e-3
_SHORT = 3e-4  # optical length below which a path counts as one of this length
# Of the fit to few exponentials: depths, candidate rates, the share of the largest value below
# which light counts less and less.
_FIT_DEPTHS, _FIT_RATES, _FAINT, _FIT_CONDITION = 48, 12, 1e-4, 1e-6
_NODES, _NODE_WEIGHTS = np.polynomial.legendre.leggauss(8)
_error_function = np.vectorize(math.erf, otypes=[float])


@dataclass(frozen=True, eq=False)
class InelasticProcess:
    """One way in which photons change wavelength, on bands.

    Parameters
    ----------
    name : str
        ``"raman"``, ``"chlorophyll"`` or ``"cdom"``.
    coefficient : array, shape (n,)
        b_I: events per metre of a photon in each excitation band, 1/m. Those
        of fluorescence are part of the absorption of the water; those of
        Raman scattering, 3e-4 1/m, come on top of it.
    photons : array, shape (n, k)
        f: photons that come out in each emission band per event. A row adds up
        to the quantum yield, 1 for Raman, as far as the bands reach.
    phase : PhaseFunction
        Where they go.
    """

    name: str
    coefficient: NDArray[np.float64]
    photons: NDArray[np.float64]
    phase: PhaseFunction

    def energy_matrix(self, excitation: Bands, emission: Bands) -> NDArray[np.float64]:
        """Emitted power per spectral scalar irradiance, 1/m, shape (n, k).

        The power that leaves a cubic metre in emission band j, per nm, is
        ``Σ_i E0_i matrix_ij``, E0 per nm: photons times energy per photon,
        λ_i/λ_j, times the widths Δλ_i/Δλ_j.
        """
        ratio = excitation.centres[:, None] / emission.centres
        widths = excitation.widths[:, None] / emission.widths
        return self.coefficient[:, None] * self.photons * ratio * widths


def raman_coefficient(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Raman scattering coefficient of water in energy units, 1/m, by excitation wavelength.

    ``2.6e-4 (488/λ')^5.5``: the power that comes out per metre and scalar irradiance.

    Examples
    --------
    >>> raman_coefficient([400, 488]).round(5)
    array([0.00078, 0.00026])
    """
    nm = _checked(wavelengths)
    return _RAMAN_488 * (488.0 / nm) ** _RAMAN_EXPONENT


def raman_coefficient_Gutierrez2008(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Raman coefficient as the paper has it, the absorption of water: far too strong.

    For comparison only; 300 to 800 nm.
    """
    return pure_water_absorption(wavelengths)


def raman_emission(excitation: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectrum of Raman scattered photons, 1/nm; integrates to 1.

    Walrafen's four Gaussians of the wavenumber shift 1e7/λ' - 1e7/λ, times the
    Jacobian 1e7/λ² of the emission wavelength.

    Examples
    --------
    >>> grid = np.arange(500.0, 700.0)
    >>> float(grid[raman_emission(488.0, grid).argmax()])
    586.0
    """
    nm = _checked(wavelengths)
    shift = 1e7 / excitation - 1e7 / nm
    amplitude, centre, width = _WALRAFEN.T
    sigma = width / _FULL_WIDTH
    peaks = np.exp(-0.5 * ((shift[:, None] - centre) / sigma) ** 2) / (
        sigma * math.sqrt(2 * math.pi)
    )
    return 1e7 / nm**2 * (peaks @ amplitude) / amplitude.sum()


def chlorophyll_emission(wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectrum of the photons that chlorophyll emits, 1/nm; a Gaussian at 685 nm, σ 10.6 nm."""
    x = (_checked(wavelengths) - _CHLOROPHYLL_LINE) / _CHLOROPHYLL_SIGMA
    return np.exp(-0.5 * x**2) / (_CHLOROPHYLL_SIGMA * math.sqrt(2 * math.pi))


def cdom_emission(excitation: float, wavelengths: ArrayLike) -> NDArray[np.float64]:
    """Spectral quantum efficiency η(λ', λ) of CDOM, 1/nm (Hawes 1992, sample FA7).

    Zero for excitation outside 310 to 550 nm, and at wavelengths shorter than it.

    Examples
    --------
    >>> round(float(cdom_emission(450.0, [540.0])[0]), 6)
    0.000135
    """
    nm = _checked(wavelengths)
    table = _fulvic_acid()
    efficiency = table.spectrum("A0", "fluorescence of CDOM").at_or_zero([excitation])[0]
    width = 0.6 * (_A2 / excitation + _B2)
    x = (1 / nm - _A1 / excitation - _B1) / width
    return np.where(nm > excitation, efficiency * np.exp(-(x**2)), 0.0)


@functools.cache
def _fulvic_acid() -> Table:
    return read_table(DATA_DIRECTORY / "cdom_fluorescence_hawes_fa7.csv")


def raman_process(excitation: Bands, emission: Bands) -> InelasticProcess:
    """Raman scattering by water between two sets of bands; one photon out per event.

    The coefficient of events is that in energy units times the mean λ/λ',
    so that both photons and :func:`raman_coefficient` are kept.
    """
    edges = _edges(emission)
    amplitude, centre, width = _WALRAFEN.T
    scale = width / _FULL_WIDTH * math.sqrt(2)

    def below(nm: NDArray[np.float64], from_nm: NDArray[np.float64]) -> NDArray[np.float64]:
        shift = 1e7 / from_nm[:, None, None] - 1e7 / nm
        parts = 0.5 * (1 + _error_function((shift[..., None] - centre) / scale))
        return parts @ amplitude / amplitude.sum()

    photons = np.zeros((len(excitation), len(emission)))
    for node, weight in zip(_NODES, _NODE_WEIGHTS / 2, strict=True):
        shares = below(edges, excitation.centres + node * excitation.widths / 2)
        photons += weight * (shares[..., 1] - shares[..., 0])
    # λ/λ' of the mean shift: 1/(1 - λ' shift).
    mean_shift = float(amplitude @ centre / amplitude.sum())
    stretch = 1 / (1 - excitation.centres * mean_shift * 1e-7)
    return InelasticProcess(
        "raman", raman_coefficient(excitation.centres) * stretch, photons, RAMAN_PHASE
    )


def chlorophyll_process(
    absorption: ArrayLike, excitation: Bands, emission: Bands, quantum_yield: float = QUANTUM_YIELD
) -> InelasticProcess:
    """Fluorescence of chlorophyll between two sets of bands.

    Parameters
    ----------
    absorption : array_like, shape (n,)
        Of the phytoplankton in the excitation bands, 1/m.
    excitation, emission : Bands
    quantum_yield : float
        Photons out per photon absorbed between 370 and 690 nm, 0 to 1.
    """
    if not 0 <= quantum_yield <= 1:
        raise InputError(f"quantum yield must be 0 to 1, got {quantum_yield:g}")
    low, high = _CHLOROPHYLL_EXCITATION
    excites = (excitation.centres >= low) & (excitation.centres <= high)
    scale = _CHLOROPHYLL_SIGMA * math.sqrt(2)
    line = np.diff(_error_function((_edges(emission) - _CHLOROPHYLL_LINE) / scale))[..., 0] / 2
    return InelasticProcess(
        "chlorophyll",
        _coefficient(absorption, excitation, "phytoplankton") * excites,
        np.tile(quantum_yield * line, (len(excitation), 1)),
        Isotropic(),
    )


def cdom_process(absorption: ArrayLike, excitation: Bands, emission: Bands) -> InelasticProcess:
    """Fluorescence of CDOM between two sets of bands.

    Parameters
    ----------
    absorption : array_like, shape (n,)
        Of the CDOM in the excitation bands, 1/m.
    excitation, emission : Bands
    """
    half = emission.widths[:, None] / 2
    grid = emission.centres[:, None] + half * _NODES
    photons = np.stack(
        [
            (cdom_emission(nm, grid.ravel()).reshape(grid.shape) * half) @ _NODE_WEIGHTS
            for nm in excitation.centres
        ]
    )
    return InelasticProcess(
        "cdom", _coefficient(absorption, excitation, "CDOM"), photons, Isotropic()
    )


def parse_processes(text: str) -> tuple[str, ...]:
    """Read which processes an option switches on.

    Parameters
    ----------
    text : str
        Names of :data:`PROCESSES`, comma separated; ``"all"``; empty for none.

    Raises
    ------
    InputError
        If a name is unknown.

    Examples
    --------
    >>> parse_processes("cdom, raman")
    ('raman', 'cdom')
    """
    names = [part.strip().lower() for part in text.split(",") if part.strip()]
    if names == ["all"]:
        return PROCESSES
    for name in names:
        if name not in PROCESSES:
            raise unknown_name("inelastic process", name, (*PROCESSES, "all"))
    return tuple(name for name in PROCESSES if name in names)


def inelastic_processes(
    constituents: Constituents,
    excitation: Bands,
    emission: Bands,
    switched_on: Sequence[str] = PROCESSES,
    quantum_yield: float = QUANTUM_YIELD,
) -> tuple[InelasticProcess, ...]:
    """Return the processes of a bio-optical water.

    Parameters
    ----------
    constituents : Constituents
    excitation, emission : Bands
        The excitation should reach down to 300 nm, and be at most 20 nm wide.
    switched_on : sequence of str
        Any of :data:`PROCESSES`.
    quantum_yield : float
        Of chlorophyll.

    Raises
    ------
    InputError
        If a process is unknown or a band lies outside the tables.

    Examples
    --------
    >>> bands = Bands.uniform(50, 300, 800)
    >>> raman, *_ = inelastic_processes(Constituents(chlorophyll=1), bands, bands)
    >>> raman.photons[20].sum().round(6)
    np.float64(1.0)
    """
    for name in switched_on:
        if name not in PROCESSES:
            raise unknown_name("inelastic process", name, PROCESSES)
    parts = constituents.absorptions(excitation.centres)
    makers = {
        "raman": lambda: raman_process(excitation, emission),
        "chlorophyll": lambda: chlorophyll_process(
            parts["phytoplankton"], excitation, emission, quantum_yield
        ),
        "cdom": lambda: cdom_process(parts["cdom"], excitation, emission),
    }
    return tuple(makers[name]() for name in PROCESSES if name in switched_on)


@dataclass(frozen=True, eq=False)
class DepthTerm:
    """One exponential of depth in every emission band: its rate and what it carries.

    ``emission`` is emitted power per volume, ``E0`` and ``F`` the diffuse light
    that follows from it. It falls from the surface, or rises to the floor.
    """

    rate: Any
    rising: bool
    emission: Any
    E0: Any
    F: Any

    def exponent(self, y: Any, y_f: Any) -> Any:  # noqa: ANN401
        """Exponent at depth y over a floor at y_f."""
        return -self.rate * (y_f - y) if self.rising else -self.rate * y


@dataclass(frozen=True, eq=False)
class InelasticLight:
    """Light of changed wavelength in the emission bands; make it with :func:`solve_inelastic`.

    It adds to the elastic light of the same bands. The methods take what those
    of :class:`.LightField` and :class:`.PathRadiance` take.
    """

    field: LightField
    terms: tuple[DepthTerm, ...]

    def source(self, y: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Power emitted per volume at depth y, per nm, in all directions together."""
        return self._sum("emission", y, m)

    def E0(self, y: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Scalar irradiance at depth y."""
        return self._sum("E0", y, m)

    def F(self, y: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Net downward flux at depth y."""
        return self._sum("F", y, m)

    def Ed(self, y: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Downwelling irradiance at depth y."""
        return self.E0(y, m) / 4.0 + self.F(y, m) / 2.0

    def Eu(self, y: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Upwelling irradiance at depth y."""
        return self.E0(y, m) / 4.0 - self.F(y, m) / 2.0

    def surface_irradiance(self, y: Any, up: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Irradiance on a patch whose normal has the upward component ``up``."""
        return m.maximum(self.E0(y, m) / 4.0 + up * self.F(y, m) / 2.0, 0.0)

    def floor_radiance(self, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Radiance that the Lambertian floor adds."""
        return m.maximum(self.field.r / math.pi * self.Ed(self.field.y_f, m), 0.0)

    def mean_source(self, upper: Any, lower: Any) -> NDArray[np.float64]:  # noqa: ANN401
        """Mean of :meth:`source` between two depths, in closed form."""
        f, P = self.field, np.asarray(lower) - upper
        total = 0.0
        for t in self.terms:
            ends = t.exponent(upper, f.y_f), t.exponent(lower, f.y_f)
            total = total + t.emission * attenuated_path(*ends, t.rate * P, 1.0)
        return np.asarray(total)

    def path(
        self,
        y_o: Any,  # noqa: ANN401
        w: Sequence[Any],
        P: Any,  # noqa: ANN401
        m: Mathematics = NUMPY,
    ) -> Any:  # noqa: ANN401
        """Radiance that the water adds between depth y_o and distance P along w.

        Emitted on the path, and emitted elsewhere and scattered into it; see
        :meth:`.PathRadiance.path` for the arguments.
        """
        f = self.field
        w_y = -w[2]
        P = m.minimum(P, distance_in_water(y_o, w_y, f.y_f, m))
        y_e = m.clamp(y_o + w_y * P, 0.0, f.y_f)
        tilt = 3.0 * f.gp * w_y
        total = 0.0
        for t in self.terms:
            falls = -t.rate if t.rising else t.rate
            strength = (t.emission + f.bp * (t.E0 - tilt * t.F)) / (4.0 * math.pi)
            total = total + strength * _attenuated_path(
                t.exponent(y_o, f.y_f),
                t.exponent(y_e, f.y_f) - f.cp * P,
                (f.cp + falls * w_y) * P,
                P,
                m,
            )
        return m.maximum(total, 0.0)

    def background(
        self,
        y_o: Any,  # noqa: ANN401
        w: Sequence[Any],
        L_surface: Any = 0.0,  # noqa: ANN401
        m: Mathematics = NUMPY,
    ) -> Any:  # noqa: ANN401
        """Radiance that the undisturbed water with its floor or surface behind adds along w.

        ``L_surface`` comes down from the surface: :meth:`under_surface`, or 0.
        """
        f = self.field
        w_y = -w[2]
        P = distance_in_water(y_o, w_y, f.y_f, m)
        end = m.select(m.less(w_y, 0.0), L_surface, self.floor_radiance(m))
        return self.path(y_o, w, P, m) + m.exp(-f.cp * P) * end

    def under_surface(self, w: Sequence[Any], relative_index: Any, m: Mathematics = NUMPY) -> Any:  # noqa: ANN401
        """Radiance that a flat surface mirrors down; see :meth:`.PathRadiance.under_surface`."""
        cosine = m.maximum(w[2], 0.0)
        reflectance = fresnel_reflectance(cosine, 1.0 / relative_index, m)
        return reflectance * self.background(0.0 * w[2], (w[0], w[1], -cosine), m=m)

    def _sum(self, name: str, y: Any, m: Mathematics) -> Any:  # noqa: ANN401
        total = 0.0
        for t in self.terms:
            total = total + getattr(t, name) * m.exp(t.exponent(y, self.field.y_f))
        return total


def excitation_fields(column: WaterColumn, phase: BandPhase) -> tuple[LightField, ...]:
    """Return light fields that add up to the elastic light of a column.

    Below a reflecting surface skylight keeps within Snell's cone. Two-stream
    theory takes it for light from all sides, which dies away too fast where
    absorption outweighs scattering, as in the ultraviolet that excites CDOM;
    here it is a second beam, of its mean cosine.

    Examples
    --------
    >>> from .phase import parse_phase
    >>> column = WaterColumn(Bands.uniform(1), 0.9, 0.1, 0.0, 1.0, (0, 0, -1), 1.0,
    ...                      math.inf, 0.0, "flat", 1.34)
    >>> fields = excitation_fields(column, parse_phase("hg:0.8").for_bands([0.1]))
    >>> sum(field.Ed(2.0) for field in fields).round(2)
    array([0.33])
    """
    if not (column.reflects and column.sky_radiance.any()):
        return (column.light_field(phase),)
    sunlight = dataclasses.replace(column, sky_radiance=np.zeros(len(column.bands)))
    field = sunlight.light_field(phase)
    n = column.refractive_index
    skylight = solve_light_field(
        column.absorption,
        column.scattering,
        phase.chi1,
        phase.chi2,
        math.pi * column.sky_radiance * diffuse_transmittance(n),
        _skylight_cosine(n),
        R=field.R,
        r=column.floor_reflectance,
        y_f=column.floor_depth,
    )
    return (field, skylight)


def _skylight_cosine(n: float) -> float:
    """Mean cosine Ed/E0 of a uniform sky just below a flat surface."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    in_air = (nodes + 1) / 2
    entering = weights * in_air * (1 - fresnel_reflectance(in_air, n))
    in_water = np.sqrt(1 - (1 - in_air**2) / n**2)
    return float(entering.sum() / (entering / in_water).sum())


def solve_inelastic(
    processes: Sequence[InelasticProcess],
    excitation_field: LightField | Sequence[LightField],
    excitation: Bands,
    emission_field: LightField,
    emission: Bands,
) -> InelasticLight:
    """Solve the light of changed wavelength, once per water.

    Parameters
    ----------
    processes : sequence of InelasticProcess
        On these bands; an empty one gives no light.
    excitation_field : LightField, or a sequence of them
        Elastic light of the excitation bands, irradiances per nm; several add
        up, see :func:`excitation_fields`.
    excitation : Bands
    emission_field : LightField
        Elastic light of the emission bands, in the same water column.
    emission : Bands

    Returns
    -------
    InelasticLight

    Raises
    ------
    InputError
        If shapes or columns do not agree.

    Notes
    -----
    An emission s e^{-qy} adds to the diffusion equations of
    :mod:`.light_field`, dF/dy = s e^{-qy} - a E0 and F = -(dE0/dy)/ct, the
    particular solution E0 = ct s/(k² - q²) e^{-qy}, F = q/ct E0. Two
    homogeneous solutions meet the boundaries, at which no light enters.
    Neglected: the small anisotropy of Raman scattering, light that changes its
    wavelength twice, and what the events take from the excitation.
    """
    shape = (len(excitation), len(emission))
    for process in processes:
        if process.photons.shape != shape:
            raise InputError(
                f"inelastic {process.name}: the matrix has shape {process.photons.shape} for "
                f"{shape[0]} excitation and {shape[1]} emission bands"
            )
    f = emission_field
    exciting = [excitation_field] if isinstance(excitation_field, LightField) else excitation_field
    if np.shape(f.k) != shape[1:] or any(
        x.y_f != f.y_f or np.shape(x.k) != shape[:1] for x in exciting
    ):
        raise InputError("inelastic light: the two light fields are not of one water column")
    matrix = np.zeros(shape)
    for process in processes:
        matrix += process.energy_matrix(excitation, emission)

    ct = f.k / f.h
    terms: list[DepthTerm] = []

    def drive(rates: Any, strengths: Any, rising: bool) -> None:  # noqa: ANN401
        for rate, strength, row in zip(rates, strengths, matrix, strict=True):
            if not (strength and row.any()):
                continue
            detuning = f.k**2 - rate**2
            away = np.maximum(np.abs(detuning), _RESONANCE * rate**2)
            E0 = ct * strength * row / np.where(detuning > 0, away, -away)
            F = (-rate if rising else rate) / ct * E0
            terms.append(DepthTerm(float(rate), rising, strength * row, E0, F))

    drive(exciting[0].k, sum(x.C1 for x in exciting), rising=False)
    drive(exciting[0].k, sum(x.C2 for x in exciting), rising=True)
    for x in exciting:
        drive(x.ks, x.A + x.E / x.mu_s, rising=False)

    def boundary(y: float) -> tuple[Any, Any]:
        decays = [(t, math.exp(t.exponent(y, f.y_f))) for t in terms]
        return (
            sum((t.E0 * decay for t, decay in decays), np.zeros(shape[1])),
            sum((t.F * decay for t, decay in decays), np.zeros(shape[1])),
        )

    # (1-R)E0/4 + (1+R)F/2 = 0 at the surface, (1-r)E0/4 - (1+r)F/2 = 0 at the floor.
    def balance(E0: Any, F: Any, share: Any, sign: float) -> Any:  # noqa: ANN401
        return (1 - share) * E0 / 4 + sign * (1 + share) * F / 2

    top, low = -balance(*boundary(0.0), f.R, 1.0), -balance(*boundary(f.y_f), f.r, -1.0)
    across = np.exp(-f.k * f.y_f)
    top_along, top_against = balance(1.0, f.h, f.R, 1.0), balance(1.0, -f.h, f.R, 1.0)
    low_along, low_against = balance(1.0, -f.h, f.r, -1.0), balance(1.0, f.h, f.r, -1.0)
    if f.y_f >= DEEPEST_FLOOR:
        low = np.zeros(shape[1])
    determinant = top_along * low_along - top_against * low_against * across**2
    C1 = (top * low_along - low * top_against * across) / determinant
    C2 = (low * top_along - top * low_against * across) / determinant
    nothing = np.zeros(shape[1])
    terms.append(DepthTerm(f.k, False, nothing, C1, f.h * C1))
    terms.append(DepthTerm(f.k, True, nothing, C2, -f.h * C2))
    return InelasticLight(f, tuple(terms))


def reduced(light: InelasticLight, count: int = 3, deepest: float = 100.0) -> InelasticLight:
    """Approximate inelastic light by a few exponentials of depth in each band, for shaders.

    The rates are the best of a grid, the coefficients a least-squares fit of
    emission, E0 and F, each depth weighing by the inverse of the light there.

    Parameters
    ----------
    light : InelasticLight
        Of :func:`solve_inelastic`; it has a few per excitation band.
    count : int
        Number of falling exponentials, 1 to 4; over a floor one that rises joins them.
    deepest : float
        Depth in m to which the fit reaches, at most to the floor.

    Returns
    -------
    InelasticLight
        With ``count`` terms, or one more; the rates differ by band.
    """
    if not 1 <= count <= 4:
        raise InputError(f"inelastic light: reduce to 1 to 4 exponentials, got {count}")
    f = light.field
    over_floor = f.y_f < DEEPEST_FLOOR
    reach = min(f.y_f, deepest)
    # Dense near the surface, where light of strongly absorbed bands is made.
    y = reach * np.linspace(0.0, 1.0, _FIT_DEPTHS)[:, None] ** 3
    source, E0, F = light.source(y), light.E0(y), light.F(y)
    weigh_source, weigh_light = (
        1.0 / np.maximum(x, _FAINT * x.max(axis=0) + np.finfo(float).tiny) for x in (source, E0)
    )
    rates = [np.broadcast_to(t.rate, f.k.shape) for t in light.terms if not t.rising]
    low, high = np.min(rates, axis=0), np.max(rates, axis=0)
    grid = low * (high / low) ** np.linspace(0.0, 1.0, _FIT_RATES)[:, None]
    # Axes: bands, depths, candidates or quantities.
    columns = np.exp(-y * grid[:, None, :])
    if over_floor:
        columns = np.concatenate([columns, np.exp(-f.k * (f.y_f - y))[None]])
    columns = np.moveaxis(columns, 0, -1).transpose(1, 0, 2)
    weights = [np.moveaxis(w, 0, 1)[..., None] for w in (weigh_source, weigh_light)]
    wanted = [np.moveaxis(q, 0, -1)[..., None] for q in (source, E0, F)]
    wanted = [wanted[0], np.concatenate(wanted[1:], axis=-1)]
    best = np.full(f.k.shape, math.inf)
    kept = np.zeros((*f.k.shape, count), dtype=int)
    fits = np.zeros((*f.k.shape, count + over_floor, 3))
    for chosen in itertools.combinations(range(_FIT_RATES), count):
        basis = columns[..., [*chosen, *([_FIT_RATES] if over_floor else [])]]
        found, error = [], 0.0
        for weight, quantity in zip(weights, wanted, strict=True):
            weighted, aim = weight * basis, weight * quantity
            found.append(np.linalg.pinv(weighted, rcond=_FIT_CONDITION) @ aim)
            error = error + ((weighted @ found[-1] - aim) ** 2).sum(axis=(1, 2))
        better = error < best
        best[better], kept[better] = error[better], chosen
        fits[better] = np.concatenate(found, axis=-1)[better]
    terms = [
        DepthTerm(np.take_along_axis(grid, kept[None, :, i], axis=0)[0], False, *fits[:, i].T)
        for i in range(count)
    ]
    if over_floor:
        terms.append(DepthTerm(f.k, True, *fits[:, count].T))
    return InelasticLight(f, tuple(terms))


def _attenuated_path(near: Any, far: Any, qP: Any, P: Any, m: Mathematics) -> Any:  # noqa: ANN401
    """Return :func:`.attenuated_path` to 3e-4 in single precision, in a third of the nodes."""
    x = m.maximum(m.absolute(qP), _SHORT)
    return P * m.exp(m.maximum(near, far)) * ((1.0 - m.exp(-x)) / x)


def _checked(wavelengths: ArrayLike) -> NDArray[np.float64]:
    nm = np.atleast_1d(np.asarray(wavelengths, dtype=np.float64))
    if not np.all(np.isfinite(nm) & (nm > 0)):
        raise InputError("inelastic scattering: wavelengths must be finite and positive, in nm")
    return nm


def _edges(bands: Bands) -> NDArray[np.float64]:
    """Lower and upper edge of each band, shape (k, 2)."""
    half = bands.widths / 2
    return np.stack([bands.centres - half, bands.centres + half], axis=-1)


def _coefficient(values: ArrayLike, bands: Bands, name: str) -> NDArray[np.float64]:
    a = np.broadcast_to(np.asarray(values, dtype=np.float64), (len(bands),))
    if not np.all(np.isfinite(a) & (a >= 0)):
        raise InputError(f"absorption of {name} must be finite and not negative")
    return a
