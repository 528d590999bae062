"""The surface of the water in Cycles, flat or moving."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...node_groups import attributes, realtime_waves, water_surface
from ...settings.render_plan import RenderPlan
from ...uw_spectral.surface.whitecaps import foam_reflectance
from ...uw_spectral.transfer.foam_light import foam_light
from ...uw_spectral.transfer.water_column import WAVES, WaterColumn
from .. import marks
from ..readers import cameras, moving_surface
from . import raised_surface
from .water_body import plane

_INTERFACE = "uw_interface"


def build(
    column: WaterColumn, half_width: float, *, raised: bool, foam: bool, from_air: bool
) -> tuple[bpy.types.Object, dict[str, bpy.types.ID]]:
    """Build the surface, and the data-blocks that :func:`move` asks for."""
    images = None
    if column.surface == WAVES:
        images = realtime_waves.new_images(raised=raised, foam=foam)
    material = water_surface.build(column.refractive_index, images, from_air=from_air)
    item = (raised_surface.surface if raised else plane)("UW Surface", half_width)
    item.data.materials.append(material)
    return item, {_INTERFACE: material, **(images.parts if images else {})}


def move(
    scene: bpy.types.Scene, plan: RenderPlan, camera: bpy.types.Object | None = None
) -> dict[str, NDArray[np.float64]]:
    """Bring the moving surface to the current frame; returns what of its foam differs by band.

    With heights it is finest about a camera.
    """
    # Its sun has a disc already.
    now = moving_surface.patterns(scene, plan, sun_disc=False)
    realtime_waves.write_patterns(marks.images(scene), now, fresh=True)
    material = marks.part(scene, _INTERFACE)
    numbers = realtime_waves.numbers(now, plan.settings.caustics)
    water_surface.write(material, numbers, plan.column.sun_direction.tolist())
    if now.raised is not None:
        middle = (0.0, 0.0) if camera is None else cameras.eye_of(camera)
        raised_surface.follow(scene, now.raised, middle)
    if not moving_surface.sea_of(plan.settings).foam:
        return {}
    return {
        attributes.FOAM_REFLECTANCE: foam_reflectance(plan.bands.centres),
        attributes.FOAM_BELOW: foam_light(plan.column).below,
    }
