"""Jobs that benchmarks render."""

from __future__ import annotations

import contextlib
import io
import time
from pathlib import Path

from ..jobs import batch
from ..uw_spectral.errors import InputError


def rendered_seconds(blend: Path, out: Path, *options: str) -> float:
    """Render a job into a folder and return its CPU time, s."""
    start = time.process_time()
    with contextlib.redirect_stdout(io.StringIO()):
        status = batch.main([str(blend), "--out", str(out), *options], inside_blender=False)
    if status:
        raise InputError(f"benchmark: the job in {out} failed")
    return time.process_time() - start


def frame_seconds(blend: Path, out: Path, count: int, *options: str) -> float:
    """Return the CPU time of a frame, the mean of a count after the first, s.

    What is left out is the start, the plan and what is compiled.
    """
    first, all_of_them = (
        rendered_seconds(blend, out / str(last), *options, "--frames", f"1-{last}")
        for last in (1, 1 + count)
    )
    return (all_of_them - first) / count
