"""Passes of a view layer: switched on while a block runs, rendered, and read as arrays."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.spectra.exr_parts import read_passes
from ..temporary import held
from .exr_output import write_float_exr

Passes = dict[str, NDArray[np.float32]]
"""Passes by name, shape (height, width, k)."""


@contextlib.contextmanager
def switched_on(
    layer: bpy.types.ViewLayer, switches: Iterable[str], outputs: Iterable[str] = ()
) -> Iterator[None]:
    """Have a view layer write passes, and colours that shaders output, while the block runs.

    Switches are properties such as ``use_pass_z`` or ``cycles.use_pass_volume_direct``.
    """
    parts = (switch.rpartition(".") for switch in switches)
    wanted = [
        (getattr(layer, engine) if engine else layer, name, True) for engine, _, name in parts
    ]
    with held(wanted):
        for name in outputs:
            made = layer.aovs.add()
            made.name = name
        try:
            yield
        finally:
            ours = set(outputs)
            for made in [item for item in layer.aovs if item.name in ours]:
                layer.aovs.remove(made)


def render_passes(scene: bpy.types.Scene, beside: Path) -> Passes:
    """Render a scene, whose image format stays changed, and return its passes.

    A file lies beside a path for the moment. InputError if nothing was written.
    """
    raw = beside.with_name(f"{beside.stem}.passes{beside.suffix}")
    try:
        write_float_exr(scene, raw, passes=True)
        return read_passes(raw)
    finally:
        raw.unlink(missing_ok=True)
