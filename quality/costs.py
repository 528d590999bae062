"""What a picture costs, by its options: a measured table, and what each option adds."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table
from .methods import DRAWN, METHODS, Method
from .terms import SURFACE, TERMS, Options, with_and_without

COSTED = tuple(term for term in TERMS if term.costs)
"""Terms that cost something in EEVEE; the table holds no others."""

TYPICAL: Options = frozenset([SURFACE])
"""The water that what a term adds is measured on."""

COLUMNS = ("method", *(term.name for term in COSTED), "shadow_maps", "ratio")
"""Of ``data/costs.csv``; the method is 0 for no water, then one of :data:`METHODS`."""

_TABLE = DATA_DIRECTORY / "costs.csv"


@dataclass(frozen=True)
class Costs:
    """Costs relative to a sample of the scene without water; how many bands there are is free."""

    #: Of a sample of one pass with the :data:`TYPICAL` terms, by the name of the method.
    passes: Mapping[str, float]
    #: What each of :data:`COSTED` adds to a pass, by method and name; nothing in Cycles.
    adds: Mapping[str, Mapping[str, float]]
    #: CPU time of a megapixel of one sample without water where the table was measured, and what
    #: EEVEE's shadow maps, which the ratios leave out, add.
    seconds: float
    shadow_seconds: float

    def sample(self, method: Method, passes: int, options: Options) -> float:
        """Cost of one sample of every pass of a frame.

        ``options`` are those of EEVEE; that Cycles saves time by leaving something out was not
        measured.
        """
        adds = self.adds.get(method.name, {})
        changed = ((name, (name in options) - (name in TYPICAL)) for name in adds)
        return passes * (
            self.passes[method.name] + sum(adds[name] * sign for name, sign in changed)
        )

    def sample_seconds(self, method: Method, passes: int, options: Options) -> float:
        """CPU time of a megapixel of :meth:`sample`, shadow maps included, s."""
        maps = 0 if method.traced else passes
        return self.seconds * self.sample(method, passes, options) + self.shadow_seconds * maps


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

    What each option adds is the difference of two measurements, never less than nothing.
    """
    columns = read_table(_TABLE, COLUMNS).columns
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in values]
    plain, shadowed = (
        next(r["ratio"] for r in rows if not r["method"] and r["shadow_maps"] == maps)
        for maps in (0, 1)
    )
    names = list(METHODS)
    water = {
        (names[int(r["method"]) - 1], priced(name for name, with_it in r.items() if with_it)): (
            r["ratio"]
        )
        for r in rows
        if r["method"]
    }
    adds: dict[str, dict[str, float]] = {method.name: {} for method in DRAWN}
    for name, added in adds.items():
        for term in COSTED:
            more, less = (water[name, priced(o)] for o in with_and_without(term, TYPICAL))
            added[term.name] = max(more - less, 0.0)
    return Costs(
        passes={name: water[name, priced(TYPICAL)] for name in names},
        adds=adds,
        seconds=plain,
        shadow_seconds=shadowed - plain,
    )
