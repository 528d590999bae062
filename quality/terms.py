"""The optional terms of the water: what each is for, what switches it, how it costs.

A row says all that Auto, the cost table and the panel need to know; the formulas of a term are
elsewhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..uw_spectral.transfer.water_column import WaterColumn
    from .seen_points import SeenPoints

SHAFTS, INELASTIC = "shafts", "inelastic"
DIFFUSE_SHADOWS = "diffuse_shadows"
WAVES, SURFACE, FLOOR = "waves", "surface", "floor"
SINGLE, FLOOR_LIGHT = "single scattering", "floor light"

Options = frozenset[str]
"""Names of the terms that a water has."""

_LIGHTS = "not in view, but it lights the rest"


def _shadows(seen: Sequence[SeenPoints]) -> str:
    fraction = float(np.mean([view.occluded_path for view in seen]))
    return f"{fraction:.0%} of the seen water in shadow" if fraction else "no shadow in the water"


def _skylight(seen: Sequence[SeenPoints]) -> str:
    hidden = np.concatenate([1.0 - view.openness[view.kind > 0] for view in seen]).clip(0.0)
    filled = float(np.mean([v.pixels @ (v.kind == 2) for v in seen if v.buffer] or [0.0]))
    if not (hidden.any() or filled):
        return "nothing is in the way of light"
    return (
        f"{hidden.mean() if len(hidden) else 0.0:.0%} of the light from above is kept from what "
        f"is seen; objects that fill {filled:.0%} of the picture keep back what shines past them"
    )


def _looking_up(seen: Sequence[SeenPoints]) -> str:
    up = [(view.direction[:, 2] > 0) & ~np.isfinite(view.distance) for view in seen]
    fraction = float(np.mean([v.pixels @ u for v, u in zip(seen, up, strict=True)]))
    return f"{fraction:.0%} of the rays go up to it" if fraction else _LIGHTS


def _nearest_floor(seen: Sequence[SeenPoints]) -> str:
    distance = min(float(view.distance[view.on_floor].min(initial=math.inf)) for view in seen)
    return f"nearest {distance:.1f} m" if math.isfinite(distance) else _LIGHTS


@dataclass(frozen=True)
class Term:
    """Something that can be left out of the water."""

    name: str  #: In :data:`Options`; the column of ``data/costs.csv``, and the part of the picture.
    label: str  #: In decisions.
    purpose: Callable[[Sequence[SeenPoints]], str]  #: What it is for in some views, in a few words.
    setting: str
    #: The setting's value without the term, and one with it. A term whose setting is a boolean may
    #: be switched on by Auto, others only left out.
    off: object
    on: object = True
    costs: bool = False  #: Whether a pass of EEVEE costs more with it.
    #: Fields of the water column without the term; none for a part of the picture.
    column: Mapping[str, object] = field(default_factory=dict)
    needs: str = ""  #: The term without which there is none of it.
    engines: tuple[str, ...] = ("eevee", "cycles")  #: Where its setting is used.

    @property
    def is_part(self) -> bool:
        """Whether it is a part of the picture, not a change of the column."""
        return not self.column

    @property
    def is_switch(self) -> bool:
        """Whether its setting is a boolean."""
        return self.off is False


TERMS = (
    Term(SHAFTS, "shafts", _shadows, "shafts", off=False, costs=True, engines=("eevee",)),
    Term(
        INELASTIC, "inelastic", lambda _: "light of changed wavelength",
        "inelastic", off="", on="raman",
    ),
    Term(
        DIFFUSE_SHADOWS, "diffuse shadows", _skylight,
        "diffuse_shadows", off=False, costs=True, engines=("eevee",),
    ),
    Term(
        WAVES, "waves and caustics", _looking_up,
        "surface", off="flat", on="waves", costs=True,
        column={"surface": "flat"}, needs=SURFACE,
    ),
    Term(
        SURFACE, "surface with Snell's window", _looking_up,
        "surface", off="none", on="flat",
        column={"surface": "none"},
    ),
    Term(
        FLOOR, "floor", _nearest_floor,
        "floor_depth", off=0.0, on=10.0,
        column={"floor_depth": math.inf},
    ),
)  # fmt: skip
"""A term stands before the one that it needs."""


@dataclass(frozen=True)
class ComputedLight:
    """A light that is always computed; ``needs`` is the term without which there is none."""

    name: str
    purpose: str
    needs: str = ""


LIGHTS = (
    ComputedLight(SINGLE, "sunlight scattered once on the way"),
    ComputedLight(FLOOR_LIGHT, "light that the floor sends up", FLOOR),
)


def _complete(names: Collection[str]) -> Options:
    """Leave out what lacks the term that it needs."""
    return frozenset(t.name for t in TERMS if t.name in names and t.needs in {"", *names})


def subsets(free: Collection[str], always: Collection[str] = ()) -> list[Options]:
    """Return every water with all of some terms and any of others.

    Examples
    --------
    >>> [sorted(options) for options in subsets({"surface", "waves"}, {"floor"})]
    [['floor', 'surface', 'waves'], ['floor', 'surface'], ['floor']]
    """
    names = [term.name for term in TERMS if term.name in free]
    chosen = itertools.product((True, False), repeat=len(names))
    found = (frozenset([*always, *itertools.compress(names, which)]) for which in chosen)
    return [options for options in found if options == _complete(options)]


def with_and_without(term: Term, options: Options) -> tuple[Options, Options]:
    """Return terms with one of them, but without those that need it; and without it.

    Examples
    --------
    >>> waves = TERMS[3]
    >>> [sorted(found) for found in with_and_without(waves, frozenset())]
    [['surface', 'waves'], ['surface']]
    """
    lost = {term.name, *(t.name for t in TERMS if t.needs == term.name)}
    without = _complete((options | {term.needs}) - lost)
    return without | {term.name}, without


def switched_on(settings: Mapping[str, object]) -> Options:
    """Terms that settings ask for."""
    return _complete({term.name for term in TERMS if settings[term.setting] != term.off})


def settings_of(options: Options) -> dict[str, object]:
    """Settings that ask for terms and for no others."""
    found = {}
    for term in reversed(TERMS):
        if not term.needs or term.needs in options:
            found[term.setting] = term.on if term.name in options else term.off
    return found


def in_column(column: WaterColumn) -> Options:
    """Terms that a water column has."""
    return _complete(
        {t.name for t in TERMS if any(getattr(column, k) != v for k, v in t.column.items())}
    )


def column_of(options: Options) -> dict[str, object]:
    """Fields of a water column that has no other terms than these."""
    changes: dict[str, object] = {}
    for term in TERMS:
        if term.name not in options:
            changes |= term.column
    return changes
