"""What benchmarks that hold EEVEE against Cycles case by case have in common."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.spectra.colour_rendering import srgb_encode
from .path_radiance_table import ROOT

_WHITE = 0.995  # quantile of Cycles' picture that is shown white


@dataclass(frozen=True, eq=False)
class Pair:
    """Scene-linear pictures of a case; ``white`` is shown as such, by default the brightest."""

    title: str
    cycles: NDArray[np.float64]
    eevee: NDArray[np.float64]
    white: float | None = None


def write_sheet(pairs: Sequence[Pair], across: int, size: tuple[float, float], path: Path) -> None:
    """Draw pairs in rows of so many, EEVEE below Cycles."""
    mpl.use("agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2 * -(-len(pairs) // across), across, figsize=size, squeeze=False)
    for axis in axes.flat:
        axis.axis("off")
    for number, pair in enumerate(pairs):
        row, column = divmod(number, across)
        white = pair.white or float(np.quantile(pair.cycles, _WHITE))
        shown = (pair.cycles, f"{pair.title}: Cycles"), (pair.eevee, "EEVEE")
        for (picture, name), axis in zip(shown, axes[2 * row :, column], strict=False):
            axis.imshow(srgb_encode(np.clip(picture / white, 0.0, 1.0)), interpolation="nearest")
            axis.set_title(name, fontsize=6)
    figure.tight_layout(h_pad=0.4, w_pad=0.4)
    quality = {"quality": 80} if path.suffix == ".jpg" else None
    figure.savefig(path, dpi=80, pil_kwargs=quality)
    plt.close(figure)


class _Titled(Protocol):
    @property
    def title(self) -> str: ...


def run[Case: _Titled, Found](
    name: str,
    cases: Sequence[Case],
    measure: Callable[[Case, int], Found],
    numbers: Callable[[Found], Iterable[float]],
    write: Callable[[dict[Case, Found], int, Path], Any],
    arguments: Sequence[str],
    *,
    samples: int,
) -> None:
    """Measure all cases and write the page, or only one with ``--case``."""
    parser = argparse.ArgumentParser(prog=name)
    parser.add_argument("--samples", type=int, default=samples)
    parser.add_argument("--case", type=int, help="only this one, and no page")
    options = parser.parse_args(arguments)
    found: dict[Case, Found] = {}
    for number, case in enumerate(cases):
        if options.case in (None, number):
            found[case] = measure(case, options.samples)
            print(case.title, *(f"{value:.2f}" for value in numbers(found[case])), flush=True)
    if options.case is None:
        write(found, options.samples, ROOT / "docs" / "measured")
