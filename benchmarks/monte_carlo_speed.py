"""Speed of the Monte Carlo: photons per second, standard error against time, memory."""

from __future__ import annotations

import math
import os
import time
import tracemalloc

from ..uw_spectral.spectra.bands import Bands
from ..uw_spectral.transfer.water_column import WaterColumn
from ..uw_spectral.water.phase import parse_phase
from ..validation.monte_carlo import numba_available, simulate

PHOTONS = {"numpy": 400_000, "numba": 1_600_000}


def _measure(engine: str, photons: int, threads: int = 1) -> tuple[float, float, float, float]:
    """Return seconds, processor seconds, and relative standard errors of Ed and Eu at 10 m."""
    column = WaterColumn(
        Bands.uniform(3), (0.05, 0.1, 0.3), 0.2, 1.0, 0.9, (math.sqrt(0.19), 0.0, -0.9), 0.1,
        20.0, 0.2, "flat", 1.34,
    )  # fmt: skip
    phase = parse_phase("fournier-forand:1.10,0.0183").for_bands(column.scattering)
    start, processor = time.perf_counter(), time.process_time()
    found = simulate(
        column, phase, (0.0, 5.0, 10.0, 20.0), photons=photons, engine=engine, threads=threads
    )
    seconds, processor = time.perf_counter() - start, time.process_time() - processor
    light = found.total
    return seconds, processor, light.Ed.relative_error[2, 0], light.Eu.relative_error[2, 0]


def markdown() -> str:
    """Measure and return the table."""
    engines = ["numpy", *(["numba"] if numba_available() else [])]
    lines = [
        "Three bands in water of 20 m; one thread unless said, compiled, on a busy machine of "
        f"{os.cpu_count()} cores.",
        "",
        "| engine | photons | photons/s | per processor s | error of Ed | of Eu | peak MiB |",
        "|---|---|---|---|---|---|---|",
    ]
    runs = [(engine, PHOTONS[engine], threads) for threads in (1, 2) for engine in engines]
    for engine in engines:
        _measure(engine, 100)
    for engine, photons, threads in runs:
        seconds, processor, Ed, Eu = _measure(engine, photons, threads)
        tracemalloc.start()
        _measure(engine, min(photons, 400_000), threads)
        peak = tracemalloc.get_traced_memory()[1] / 2**20
        tracemalloc.stop()
        name = engine if threads == 1 else f"{engine}, {threads} threads"
        lines.append(
            f"| {name} | {photons} | {photons / seconds:.3g} | {photons / processor:.3g} "
            f"| {100 * Ed:.3f} % | {100 * Eu:.3f} % | {peak:.1f} |"
        )
    return "\n".join(lines)


def main(_arguments: list[str]) -> None:
    """Print the table."""
    print(markdown())
