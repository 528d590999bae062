"""What a picture costs, by its options: a measured table, and the straight lines through it."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table
from .terms import SURFACE, TERMS, Options, Term, with_and_without

Method = Literal["realtime", "bands", "cycles"]
"""EEVEE with all bands in one pass, EEVEE with three bands a pass, Cycles."""

COSTED = tuple(term for term in TERMS if term.cost)
"""Terms that cost something where the solved field is looked up; the table holds no others."""

USUAL: Options = frozenset([SURFACE])
"""The water that what a term adds is measured on."""

COLUMNS = ("cycles", "bands", *(term.name for term in COSTED), "shadow_maps", "ratio")
"""Of ``data/costs.csv``."""

_TABLE = DATA_DIRECTORY / "costs.csv"


@dataclass(frozen=True)
class Costs:
    """Costs relative to a sample of the scene without water.

    Those of EEVEE are of the solved field, its usual one; they stand for the closed form too.

    Parameters
    ----------
    base, triple : float
        Cost of the real-time water, and of three of its bands, with the :data:`USUAL` terms.
    adds : mapping
        What each of :data:`COSTED` adds, by name, to three bands or to a pass.
    cycles : float
        Of a Cycles sample of one pass.
    seconds, shadow_seconds : float
        CPU time of a megapixel of one sample without water where the table was
        measured, and what EEVEE's shadow maps, which the ratios leave out, add.
    """

    base: float
    triple: float
    adds: Mapping[str, float]
    cycles: float
    seconds: float
    shadow_seconds: float

    def sample(self, method: Method, bands: int, passes: int, options: Options) -> float:
        """Cost of one sample of every pass of a frame.

        Parameters
        ----------
        method : {"realtime", "bands", "cycles"}
        bands : int
        passes : int
            Of a frame.
        options : Options
            Of EEVEE; that Cycles saves time by leaving something out was not measured.

        Examples
        --------
        >>> costs = read_costs()
        >>> few, many = (costs.sample("realtime", n, 1, USUAL) for n in (3, 15))
        >>> many > few > 1
        True
        """
        if method == "cycles":
            return passes * self.cycles
        triple = max(self.triple + self._change("triple", options), 0.0)
        once = self.base + self._change("pass", options)
        if method == "bands":
            return passes * (once + triple)
        return once + math.ceil(bands / 3) * triple

    def _change(self, cost: str, options: Options) -> float:
        """Cost of terms against that of the usual ones."""
        more, less = options - USUAL, USUAL - options
        return sum(
            self.adds[term.name] * ((term.name in more) - (term.name in less))
            for term in COSTED
            if term.cost == cost
        )

    def sample_seconds(self, method: Method, bands: int, passes: int, options: Options) -> float:
        """CPU time of a megapixel of :meth:`sample`, shadow maps included, s."""
        maps = 0 if method == "cycles" else passes
        cost = self.sample(method, bands, passes, options)
        return self.seconds * cost + self.shadow_seconds * maps


def priced(options: Iterable[str]) -> Options:
    """Leave out what costs nothing.

    Examples
    --------
    >>> sorted(priced(["waves", "surface"]))
    ['waves']
    """
    return frozenset(options) & {term.name for term in COSTED}


@functools.cache
def read_costs() -> Costs:
    """Read ``data/costs.csv``.

    A line goes through the measured costs of few and many bands; what each
    option adds is the difference of two measurements, never less than nothing.
    """
    columns = read_table(_TABLE, COLUMNS).columns
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in values]
    plain, shadowed = (
        next(r["ratio"] for r in rows if not r["bands"] and r["shadow_maps"] == maps)
        for maps in (0, 1)
    )
    cycles = next(r["ratio"] for r in rows if r["cycles"])
    water = {
        (int(r["bands"]), priced(name for name, with_it in r.items() if with_it)): r["ratio"]
        for r in rows
        if r["bands"] and not r["cycles"]
    }
    usual = priced(USUAL)
    basic = {bands: ratio for (bands, options), ratio in water.items() if options == usual}
    triple, base = np.polyfit([math.ceil(n / 3) for n in basic], list(basic.values()), 1)
    bands = next(n for n, options in water if options != usual)

    def adds(term: Term) -> float:
        more, less = (water[bands, priced(options)] for options in with_and_without(term, USUAL))
        return max(more - less, 0.0) / (math.ceil(bands / 3) if term.cost == "triple" else 1)

    return Costs(
        base=float(base),
        triple=float(triple),
        adds={term.name: adds(term) for term in COSTED},
        cycles=cycles,
        seconds=plain,
        shadow_seconds=shadowed - plain,
    )
