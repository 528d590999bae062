"""Engines behind a port: a pinhole in the water, warped; or rays that begin at the port.

An engine renders as it always does, from a camera that hangs on the user's own; what it draws is
then moved, band by band, to where the port shows it. Cycles traces the port's own rays instead,
where it can and no layers are wanted: warped noise is no longer each pixel's own.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import bpy

from ...datasets.housed_layers import TYPICAL_WAVELENGTH
from ...uw_spectral.errors import InputError
from ...uw_spectral.housing import Housing, intrinsics_in_water
from ...uw_spectral.imaging.layers import parse_layers
from ..readers import moving_surface, port_eye
from .band_engine import BandEngine, Engine, Opening
from .port_look import look_of
from .traced_engine import may_trace, traced
from .warped_port import warped


@contextlib.contextmanager
def opened(
    engine: Engine, scene: bpy.types.Scene, camera: bpy.types.Object, opening: Opening
) -> Iterator[BandEngine]:
    """Open an engine for a camera, behind a port if the settings have one.

    InputError if the port, the lens or the camera cannot be used.
    """
    housing = look_of(scene, camera, opening.plan, opening.depth)
    if housing is None:
        with engine.open(scene, camera, opening) as found:
            yield found
        return
    trough = moving_surface.deepest_trough(opening.plan.settings)
    port_eye.require_under_water(camera, opening.eyes, trough)
    way = traced if _traces(engine, camera, opening) else warped
    with port_eye.port_eye(scene, camera) as eye, way(engine, scene, camera, eye, opening) as found:
        yield replace(found, notes=[*found.notes, _note(housing)])


def _traces(engine: Engine, camera: bpy.types.Object, opening: Opening) -> bool:
    return (
        engine.method.traced
        and opening.device == "cpu"
        and not parse_layers(opening.plan.settings.layers)
        and may_trace(camera)
    )


def _note(housing: Housing) -> str:
    air = housing.camera
    try:
        fitted, error = intrinsics_in_water(housing, TYPICAL_WAVELENGTH, distorted=True)
    except InputError as problem:
        return f"behind the port: {problem}"
    found = fitted.camera
    return (
        f"behind the port: in air focal length {air.fx:.1f} pixels; in water the picture is that "
        f"of a camera of {found.fx:.1f} pixels with distortion "
        f"{', '.join(f'{k:.4f}' for k in found.lens.numbers.values())} (k1, k2, p1, p2, k3) at "
        f"{TYPICAL_WAVELENGTH:g} nm, to {error:.2f} pixels"
    )
