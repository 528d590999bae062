"""What a picture costs, by its options: a measured table, and the straight lines through it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .spectrum import DATA_DIRECTORY, read_table
from .water_column import SURFACES

Method = Literal["realtime", "bands", "cycles"]
"""EEVEE with all bands in one pass, EEVEE with three bands a pass, Cycles."""

COLUMNS = ("cycles", "bands", "aureole", "surface", "inelastic", "shafts", "nodes", "ratio")
"""Of ``data/costs.csv``."""

_TABLE = DATA_DIRECTORY / "costs.csv"


@dataclass(frozen=True)
class Options:
    """What can be left out of the water to save time."""

    aureole: bool = True
    surface: str = "none"
    inelastic: bool = False
    shafts: bool = False


@dataclass(frozen=True, eq=False)
class Costs:
    """Costs relative to a sample of the scene without water.

    Parameters
    ----------
    nodes : array, shape (7,)
        Shader nodes that each of the terms of :func:`_terms` adds.
    base, per_node : float
        Cost of the real-time water without nodes, and of a node.
    shafts : float
        Of the volume of the shafts.
    cycles : float
        Of a Cycles sample of one pass.
    seconds : float
        CPU time of a megapixel of one sample without water, where the table was measured.
    """

    nodes: NDArray[np.float64]
    base: float
    per_node: float
    shafts: float
    cycles: float
    seconds: float

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
        passes = math.ceil(bands / bands_per_pass)
        if method == "cycles":
            return passes * self.cycles
        triples = 1 if method == "bands" else math.ceil(bands / 3)
        nodes = float(_terms(triples, options) @ self.nodes)
        one = self.base + self.per_node * nodes + self.shafts * options.shafts
        return one * (passes if method == "bands" else 1)


@functools.cache
def read_costs() -> Costs:
    """Read ``data/costs.csv``.

    The nodes of every option are counted; what a node costs follows from the
    real-time water with few and with more bands, whose times were measured.
    """
    columns = read_table(_TABLE, COLUMNS).columns
    values = zip(*(column.tolist() for column in columns.values()), strict=True)
    rows = [dict(zip(columns, row, strict=True)) for row in values]
    plain = next(r["ratio"] for r in rows if not r["bands"])
    cycles = next(r["ratio"] for r in rows if r["cycles"])
    water = [r for r in rows if r["bands"] and not r["cycles"]]
    terms = [
        _terms(
            math.ceil(r["bands"] / 3),
            Options(bool(r["aureole"]), SURFACES[int(r["surface"])], bool(r["inelastic"])),
        )
        for r in water
        if not r["shafts"]
    ]
    counted = [r["nodes"] for r in water if not r["shafts"]]
    nodes = np.linalg.lstsq(np.array(terms), np.array(counted), rcond=None)[0]
    few, more = sorted(
        (r for r in water if r["ratio"] and not r["shafts"]), key=lambda r: r["bands"]
    )
    per_node = (more["ratio"] - few["ratio"]) / (more["nodes"] - few["nodes"])
    shafts = next(r["ratio"] for r in water if r["ratio"] and r["shafts"]) - few["ratio"]
    base = few["ratio"] - per_node * few["nodes"]
    return Costs(nodes, base, per_node, shafts, cycles, plain)


def _terms(triples: int, options: Options) -> NDArray[np.float64]:
    """What the number of nodes is linear in."""
    flat, waves = options.surface != "none", options.surface == "waves"
    parts = (1, options.aureole, flat, waves, options.inelastic)
    return np.array([1.0, *(triples * part for part in parts), waves])
