"""Water of EEVEE for the frames of a job: computed, and brought into its scene."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...settings.render_plan import RenderPlan
from ..readers import cameras
from ..terms.eevee_water import eevee_water
from ..terms.fluorescence import FluorescenceTerm
from ..terms.lamps import LampTerm
from ..terms.planar_views import ReflectionTerm, WindowTerm
from ..terms.waves import with_waves
from ..water import metering
from ..water.frame_water import RealtimeWater
from ..water.occlusion import Cache
from ..water.term import Eye
from . import planar_picture


class EeveeFrames:
    """The water of a camera's job; ``eyes`` is where the camera is at its frames.

    The nodes are built for the first frame's, which is not computed again to be drawn.
    """

    def __init__(
        self,
        scene: bpy.types.Scene,
        camera: bpy.types.Object,
        eyes: Sequence[tuple[float, ...]],
        cache: Cache,
    ) -> None:
        self.scene, self.camera, self.eyes, self.cache = scene, camera, eyes, cache
        self.pictures = planar_picture.PlanarPictures(scene, camera, cache)
        self._shows: tuple[bool, bool] | None = None  # in the first frame, as the nodes are
        self._water = functools.lru_cache(maxsize=1)(self._water_at)

    def water(self, plan: RenderPlan, depth: float) -> RealtimeWater:
        """Return the water of the current frame, for a plan and a depth of the camera, m."""
        return self._water(self.scene.frame_current_final, plan, depth)

    def _water_at(self, _: float, plan: RenderPlan, depth: float) -> RealtimeWater:
        scene, camera, eyes = self.scene, self.camera, self.eyes
        every = np.ones((3, len(plan.bands)))
        water = eevee_water(plan, scene, Eye(camera, depth, eyes), every, self.cache)
        water = with_waves(scene, plan, water)
        if self._shows is None:
            mirrors = planar_picture.may_show(camera, plan, eyes, self.pictures)
            air = planar_picture.may_show_air(scene, camera, plan, eyes, self.pictures)
            self._shows = mirrors, air
        mirrors, air = self._shows
        if mirrors:
            water = water.with_terms(ReflectionTerm())
        return water.with_terms(WindowTerm(cameras.eye_of(camera)[:3])) if air else water

    def weights(self, now: RenderPlan, depth: float) -> NDArray[np.float64]:
        """Linear RGB per unit radiance of each band in the light that the camera sees, (3, n)."""
        return now.reduction(depth, metering.lamplight(self.scene, self.camera, now)).weights

    def white_light(self, now: RenderPlan, depth: float) -> NDArray[np.float64]:
        """Irradiance that makes white what is as bright as white that fluoresces, (n,)."""
        lit = metering.lamplight(self.scene, self.camera, now)
        light = now.viewpoint(depth, lamplight=lit).light
        water = self.water(now, depth)
        if (lamps := water.term(LampTerm)) is not None:
            light = light + lamps.changed_light(now.bands)
        glowing = water.term(FluorescenceTerm)
        return light if glowing is None else glowing.objects.brightened(light, now.bands)
