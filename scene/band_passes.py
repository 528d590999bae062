"""Renders the passes of a frame, each whole on disk before the next begins."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..uw_spectral.errors import InputError
from ..uw_spectral.spectra.spectral_image import read_exr
from .engines import RenderPass


@dataclass(frozen=True)
class RenderedPass:
    """A pass on disk; ``seconds`` is None where it was there before."""

    path: Path
    bands: tuple[int, ...]
    seconds: float | None


def render_passes(
    render: RenderPass,
    passes: Sequence[tuple[int, ...]],
    folder: Path,
    size: tuple[int, int],
    *,
    resume: bool,
) -> Iterator[RenderedPass]:
    """Render every pass of the current frame, one at each step of the iteration.

    Parameters
    ----------
    render : callable
        Renders one pass, see :data:`.engines.RenderPass`.
    passes : sequence of tuples
        The bands of each pass.
    folder : Path
        Where the passes go, ``pass_00.exr`` and so on.
    size : tuple of int
        Width and height of the render in pixels.
    resume : bool
        Keep passes that are there and whole; render damaged ones again.

    Yields
    ------
    RenderedPass
        The pass that was just written or found.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot write to {folder}: {error.strerror}; choose another --out"
        ) from error
    for number, bands in enumerate(passes):
        path = folder / f"pass_{number:02d}.exr"
        seconds = None
        if not (resume and is_whole(path, size)):
            start = time.perf_counter()
            render(bands, path)
            seconds = time.perf_counter() - start
        yield RenderedPass(path, bands, seconds)


def is_whole(path: Path, size: tuple[int, int]) -> bool:
    """Whether a pass can be read to its end and has the size of the render."""
    try:
        pixels, _ = read_exr(path)
    except InputError:
        return False
    return pixels.shape[1::-1] == size


def gather(rendered: Sequence[RenderedPass]) -> NDArray[np.float32]:
    """Read passes of up to three bands and stack them into bands, shape (h, w, n)."""
    images = [read_exr(item.path)[0][..., : len(item.bands)] for item in rendered]
    return np.concatenate(images, axis=-1)
