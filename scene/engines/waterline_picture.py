"""Pictures of EEVEE by a camera that may be at the surface, half in the air."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ...uw_spectral.spectra.spectral_image import read_exr, write_rgb_exr
from ..readers import waterline
from ..temporary import held
from ..terms.view_from_air import AirTerm
from ..terms.waves import WaveTerm
from ..water import realtime
from ..water.frame_water import RealtimeWater
from .exr_output import write_float_exr


def drawn(
    scene: bpy.types.Scene, camera: bpy.types.Object, water: RealtimeWater, path: Path
) -> NDArray[np.float32]:
    """Render a picture into a file, from either side of the waterline if the camera is there."""

    def render(now: RealtimeWater) -> NDArray[np.float32]:
        realtime.set_values(scene, now)
        write_float_exr(scene, path)
        return read_exr(path)[0]

    waves, above = water.term(WaveTerm), water.term(AirTerm)
    raised = None if waves is None else waves.patterns.raised
    if above is None or not waterline.splits(scene, camera, raised):
        return render(water)
    with held([(scene.render, "use_border", False)]):  # glass and water bend it across
        air, wet = (render(water.with_terms(above.seen(in_air=in_air))) for in_air in (True, False))
    index = water.column.refractive_index
    both = waterline.joined(scene, camera, air, wet, index, raised)
    write_rgb_exr(path, both)
    return both
