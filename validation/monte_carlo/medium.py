"""What the water is made of, for the Monte Carlo: constituents and inelastic processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...uw_spectral.errors import InputError
from ...uw_spectral.transfer.water_column import WaterColumn
from ...uw_spectral.water.phase import BandPhase, PhaseFunction
from ...uw_spectral.water.phase_functions import Isotropic

_AGREEMENT = 1e-6
_ISOTROPIC = Isotropic()


@dataclass(frozen=True, eq=False)
class Constituent:
    """One absorbing and scattering part of the water; its name is that of its events in the tally.

    Coefficients are per band, 1/m, shape (n,) or a number; InputError if negative or not finite.
    """

    name: str
    absorption: ArrayLike = 0.0
    scattering: ArrayLike = 0.0
    phase: PhaseFunction = _ISOTROPIC

    def __post_init__(self) -> None:
        for quantity in ("absorption", "scattering"):
            values = _coefficients(f"{quantity} of {self.name}", getattr(self, quantity))
            object.__setattr__(self, quantity, values)


@dataclass(frozen=True, eq=False)
class InelasticInteraction:
    """Scattering, or absorption and re-emission, that changes the wavelength."""

    name: str  #: ``"Raman"``; names the event and the part of the light it makes.
    coefficient: ArrayLike  #: Shape (n,): b_I of each excitation band, 1/m.
    #: Shape (n, n): Probability that a photon of band i (row) comes out in band j (column). A row
    #: may add up to less than 1: the rest is absorbed (quantum yield) or leaves the bands.
    redistribution: ArrayLike
    phase: PhaseFunction = _ISOTROPIC  #: Of the emission; isotropic for fluorescence.
    #: Constituent whose absorption contains ``coefficient`` already (fluorescence). Without it the
    #: process adds to the extinction (Raman).
    absorber: str | None = None

    def __post_init__(self) -> None:
        b = np.atleast_1d(_coefficients(f"coefficient of {self.name}", self.coefficient))
        f = _coefficients(f"redistribution of {self.name}", self.redistribution)
        if b.ndim != 1 or f.shape != (len(b), len(b)):
            raise InputError(
                f"{self.name}: {b.shape} coefficients and a {f.shape} redistribution matrix; "
                "give n and n × n"
            )
        if np.any(f.sum(axis=1) > 1 + _AGREEMENT):
            raise InputError(
                f"{self.name}: row {int(np.argmax(f.sum(axis=1)))} of the redistribution adds up "
                f"to {f.sum(axis=1).max():g}; probabilities of a photon add up to at most 1"
            )
        object.__setattr__(self, "coefficient", b)
        object.__setattr__(self, "redistribution", f)


@dataclass(frozen=True, eq=False)
class Interactions:
    """The roulette: the event types of a medium and their coefficients.

    Absorption and scattering are by constituent, 1/m, shape (n,); those that are zero everywhere
    are left out. ``phases`` are of the scattering constituents.
    """

    absorption: dict[str, NDArray[np.float64]]
    scattering: dict[str, NDArray[np.float64]]
    phases: dict[str, PhaseFunction]
    inelastic: tuple[InelasticInteraction, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Event types in the order of the roulette."""
        return (
            *(f"absorption by {name}" for name in self.absorption),
            *(f"scattering by {name}" for name in self.scattering),
            *(process.name for process in self.inelastic),
        )

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """Of every event type and band, 1/m, shape (k, n)."""
        return np.array(
            [
                *self.absorption.values(),
                *self.scattering.values(),
                *(process.coefficient for process in self.inelastic),
            ]
        )


def interactions(
    column: WaterColumn,
    water: BandPhase | Sequence[Constituent],
    inelastic: Sequence[InelasticInteraction] = (),
) -> Interactions:
    """List every event that can happen to a photon.

    Absorption and scattering of the column are what the constituents add up to; in their place
    there may be the phase function of its scattering alone. Raises InputError if the column has
    layers, the parts do not add up to it, bands do not fit, a name appears twice, or a process
    takes more than its absorber absorbs.
    """
    column.require_one_layer("Monte Carlo knows")
    n = len(column.bands)
    parts = _from_phase(column, water) if isinstance(water, BandPhase) else list(water)
    for part in parts:
        _check_bands(part.name, np.atleast_1d(part.absorption), n)
        _check_bands(part.name, np.atleast_1d(part.scattering), n)
    names = [part.name for part in parts] + [process.name for process in inelastic]
    doubles = {name for name in names if names.count(name) > 1}
    if doubles:
        raise InputError(f"Monte Carlo: two parts are named {doubles.pop()!r}; rename one")
    absorption = {p.name: np.broadcast_to(p.absorption, n).astype(float) for p in parts}
    scattering = {p.name: np.broadcast_to(p.scattering, n).astype(float) for p in parts}
    for quantity, found, wanted in (
        ("absorption", absorption, column.absorption),
        ("scattering", scattering, column.scattering),
    ):
        total = sum(found.values(), np.zeros(n))
        if not np.allclose(total, wanted, rtol=_AGREEMENT, atol=1e-12):
            at = int(np.argmax(np.abs(total - wanted)))
            raise InputError(
                f"Monte Carlo: the {quantity} of the constituents adds up to {total[at]:g} 1/m at "
                f"{column.bands.centres[at]:g} nm, that of the column is {wanted[at]:g} 1/m"
            )
    for process in inelastic:
        _check_bands(process.name, np.atleast_1d(process.coefficient), n, broadcast=False)
        if process.absorber is not None:
            if process.absorber not in absorption:
                raise InputError(
                    f"{process.name}: no constituent is named {process.absorber!r}; "
                    f"known: {', '.join(absorption)}"
                )
            left = absorption[process.absorber] - process.coefficient
            if np.any(left < -_AGREEMENT * np.maximum(process.coefficient, 1e-9)):
                at = int(np.argmin(left))
                raise InputError(
                    f"{process.name}: takes more than {process.absorber} absorbs at "
                    f"{column.bands.centres[at]:g} nm; lower its coefficient"
                )
            absorption[process.absorber] = np.maximum(left, 0.0)
    scattering = {name: b for name, b in scattering.items() if b.any()}
    return Interactions(
        {name: a for name, a in absorption.items() if a.any()},
        scattering,
        {part.name: part.phase for part in parts if part.name in scattering},
        tuple(inelastic),
    )


def _from_phase(column: WaterColumn, phase: BandPhase) -> list[Constituent]:
    if len(phase) != len(column.bands):
        raise InputError(
            f"Monte Carlo: a phase function of {len(phase)} bands for {len(column.bands)} bands"
        )
    if len(phase.components) == 1:
        return [Constituent("water", column.absorption, column.scattering, phase.components[0])]
    kinds = [type(component).__name__ for component in phase.components]
    names = [
        f"{kind} {kinds[:i].count(kind) + 1}" if kinds.count(kind) > 1 else kind
        for i, kind in enumerate(kinds)
    ]
    return [
        Constituent("water", column.absorption),
        *(
            Constituent(name, 0.0, column.scattering * weight, component)
            for name, weight, component in zip(names, phase.weights, phase.components, strict=True)
        ),
    ]


def _coefficients(name: str, values: ArrayLike) -> NDArray[np.float64]:
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: not numbers") from error
    bad = ~(np.isfinite(array) & (array >= 0))
    if bad.any():
        raise InputError(
            f"{name} must be finite and not negative, got {float(array[bad].flat[0]):g}"
        )
    return array


def _check_bands(name: str, values: NDArray, n: int, *, broadcast: bool = True) -> None:
    if values.shape != (n,) and not (broadcast and values.size == 1):
        raise InputError(f"{name}: {values.shape} coefficients for {n} bands; give one per band")
