"""Volumes of the layers of a water in Cycles."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import water_volume
from ...uw_spectral.transfer.water_column import WaterColumn
from . import raised_surface
from .cycles_phase import CyclesPhase
from .water_body import WaterExtent, box

# The volume box stays clear of the interface, or Cycles would nest the two media; the
# gap is water that is not there, so it is kept to this optical depth.
_SURFACE_GAP = 1e-3
_LARGEST_GAP = 0.01
# Layers overlap: faces in one place would count as one. It is a tenth of that gap, and lies
# below the depth where they meet, so that a camera there is in the upper one alone.
_OVERLAP = 0.1


def build(
    column: WaterColumn, phases: Sequence[CyclesPhase], extent: WaterExtent, *, raised: bool
) -> list[bpy.types.Object]:
    """Build a box for each layer; the first follows waves with heights if it is ``raised``."""
    gap = _gap(column.attenuation)
    tops, bottoms = [gap if column.reflects else 0.0], []
    above = column.attenuation
    for layer in column.below:
        here = layer.absorption + layer.scattering
        overlap = _OVERLAP * _gap(np.maximum(above, here))
        above = here
        if layer.top + overlap >= extent.bottom:
            break
        tops.append(layer.top + overlap)
        bottoms.append(min(layer.top + 2.0 * overlap, extent.bottom))
    bottoms.append(extent.bottom)
    boxes = []
    # Layers below the water's bottom have no box.
    for index, (top, bottom, phase) in enumerate(zip(tops, bottoms, phases, strict=False)):
        part = WaterExtent(extent.half_width, bottom)
        follows = raised and index == 0
        boxes.append((raised_surface.body if follows else box)("UW Water", part, top))
        boxes[-1].data.materials.append(water_volume.build(phase.lobes, index))
    return boxes


def _gap(attenuation: NDArray[np.float64]) -> float:
    return min(_LARGEST_GAP, _SURFACE_GAP / max(float(attenuation.max()), _SURFACE_GAP))
