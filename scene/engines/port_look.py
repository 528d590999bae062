"""What a camera sees through its port at a frame."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ...datasets.housed_layers import TYPICAL_WAVELENGTH
from ...settings.descriptions import housing_of
from ...settings.render_plan import RenderPlan
from ...uw_spectral.housing import Housing, PinholeView, defocus_factor, field_needed
from ..readers import port_eye

_NEAREST = 0.05  # m before the port: to there the rendered field is wide enough


@dataclass(frozen=True)
class PortLook:
    """What a camera sees through its port at a frame."""

    housing: Housing
    view: PinholeView

    @classmethod
    def of(cls, housing: Housing, plan: RenderPlan) -> PortLook:
        """Return what it sees of all bands; InputError if no picture is wide enough."""
        return cls(housing, field_needed(housing, _NEAREST, plan.bands.centres, finest=False))

    def aperture(self, camera: bpy.types.Object, distance: float) -> float:
        """Diameter of the lens as it counts in the water, mm, focused at a distance in m."""
        chosen = camera.data.lens / camera.data.dof.aperture_fstop
        # Discs of defocus are the same in the water.
        blur = self.housing.camera.fx / self.view.camera.fx
        return chosen * blur * defocus_factor(self.housing, distance, TYPICAL_WAVELENGTH)


def look_of(
    scene: bpy.types.Scene, camera: bpy.types.Object, plan: RenderPlan, depth: float
) -> Housing | None:
    """Return the housing of a camera at this frame; None if the settings have none.

    InputError if the camera, the port or the lens cannot be used.
    """
    described = housing_of(plan.settings)
    if not described.is_any:
        return None
    in_air = port_eye.lens_camera(scene, camera)
    return described.measured().before(in_air, described.water(depth))
