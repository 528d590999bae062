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
from .exr_output import write_exr

Passes = dict[str, NDArray[np.float32]]
"""Passes by name, shape (height, width, k)."""


@contextlib.contextmanager
def switched_on(
    layer: bpy.types.ViewLayer, switches: Iterable[str], outputs: Iterable[str] = ()
) -> Iterator[None]:
    """Have a view layer write passes while the block runs.

    Parameters
    ----------
    switches : iterable of str
        Properties such as ``use_pass_z`` or ``cycles.use_pass_volume_direct``.
    outputs : iterable of str
        Names of colours that shaders write.
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
    """Render a scene and return its passes.

    Parameters
    ----------
    scene : Scene
        What to render; its image format settings are changed and stay so.
    beside : Path
        Beside this file one is written for the moment.

    Raises
    ------
    InputError
        If nothing was written.
    """
    raw = beside.with_name(f"{beside.stem}.passes{beside.suffix}")
    try:
        write_exr(scene, raw, passes=True)
        return read_passes(raw)
    finally:
        raw.unlink(missing_ok=True)
