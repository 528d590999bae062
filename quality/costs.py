"""What a picture costs, by its options: a measured table, and the straight lines through it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..uw_spectral.spectra.spectrum import DATA_DIRECTORY, read_table
from ..uw_spectral.transfer.water_column import SURFACES

Method = Literal["realtime", "bands", "cycles"]
"""EEVEE with all bands in one pass, EEVEE with three bands a pass, Cycles."""

COLUMNS = (
    "cycles",
    "bands",
    "aureole",
    "surface",
    "inelastic",
    "shafts",
    "diffuse_shadows",
    "shadow_maps",
    "ratio",
)
"""Of ``data/costs.csv``."""

_TABLE = DATA_DIRECTORY / "costs.csv"


@dataclass(frozen=True)
class Options:
    """What can be left out of the water to save time."""

    aureole: bool = True
    surface: str = "none"
    inelastic: bool = False
    shafts: bool = False
    diffuse_shadows: bool = False


@dataclass(frozen=True)
class Costs:
    """Costs relative to a sample of the scene without water.

    Parameters
    ----------
    base, triple : float
        Cost of the real-time water, and of three of its bands, with aureole and flat surface.
    aureole, surface, waves, inelastic : float
        What each adds to three bands; waves to a flat surface.
    shafts, diffuse_shadows : float
        What each adds, however many bands there are.
    cycles : float
        Of a Cycles sample of one pass.
    seconds, shadow_seconds : float
        CPU time of a megapixel of one sample without water where the table was
        measured, and what EEVEE's shadow maps, which the ratios leave out, add.
    """

    base: float
    triple: float
    aureole: float
    surface: float
    waves: float
    inelastic: float
    shafts: float
    diffuse_shadows: float
    cycles: float
    seconds: float
    shadow_seconds: float

    def sample(self, method: Method, bands: int, bands_per_pass: int, options: Options) -> float:
        """Cost of one sample of every pass of a frame.

        Parameters
        ----------
        method : {"realtime", "bands", "cycles"}
        bands : int
        bands_per_pass : int
            Of band passes; real time has one pass.
        options : Options
            Of EEVEE; what Cycles leaves out was not measured to save time.

        Examples
        --------
        >>> costs = read_costs()
        >>> few, many = (costs.sample("realtime", n, 3, Options()) for n in (3, 15))
        >>> many > few > 1
        True
        """
        passes = _passes(method, bands, bands_per_pass)
        if method == "cycles":
            return passes * self.cycles
        triple = (
            self.triple
            - self.aureole * (not options.aureole)
            - self.surface * (options.surface == "none")
            + self.waves * (options.surface == "waves")
            + self.inelastic * options.inelastic
        )
        once = (
            self.base
            + self.shafts * options.shafts
            + self.diffuse_shadows * options.diffuse_shadows
        )
        if method == "bands":
            return passes * (once + max(triple, 0.0))
        return once + math.ceil(bands / 3) * max(triple, 0.0)

    def sample_seconds(
        self, method: Method, bands: int, bands_per_pass: int, options: Options
    ) -> float:
        """CPU time of a megapixel of :meth:`sample`, shadow maps included, s."""
        maps = 0 if method == "cycles" else _passes(method, bands, bands_per_pass)
        cost = self.sample(method, bands, bands_per_pass, options)
        return self.seconds * cost + self.shadow_seconds * maps


def _passes(method: Method, bands: int, bands_per_pass: int) -> int:
    return 1 if method == "realtime" else math.ceil(bands / bands_per_pass)


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
        (int(r["bands"]), _options(r)): r["ratio"] for r in rows if r["bands"] and not r["cycles"]
    }
    usual = Options(surface="flat")
    basic = {bands: ratio for (bands, options), ratio in water.items() if options == usual}
    triple, base = np.polyfit([math.ceil(n / 3) for n in basic], list(basic.values()), 1)
    bands = next(n for n, options in water if options != usual)
    triples = math.ceil(bands / 3)

    def adds(more: Options, less: Options) -> float:
        return max(water[bands, more] - water[bands, less], 0.0)

    return Costs(
        base=float(base),
        triple=float(triple),
        aureole=adds(usual, Options(aureole=False, surface="flat")) / triples,
        surface=adds(usual, Options()) / triples,
        waves=adds(Options(surface="waves"), usual) / triples,
        inelastic=adds(Options(surface="flat", inelastic=True), usual) / triples,
        shafts=adds(Options(surface="flat", shafts=True), usual),
        diffuse_shadows=adds(Options(surface="flat", diffuse_shadows=True), usual),
        cycles=cycles,
        seconds=plain,
        shadow_seconds=shadowed - plain,
    )


def _options(row: dict[str, float]) -> Options:
    return Options(
        bool(row["aureole"]),
        SURFACES[int(row["surface"])],
        bool(row["inelastic"]),
        bool(row["shafts"]),
        bool(row["diffuse_shadows"]),
    )
